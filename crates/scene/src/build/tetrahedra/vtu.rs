//! Reads VTK's XML files of unstructured grids (.vtu): text, base64 and appended data, as they are or compressed by zlib.
//!
//! In: bytes. Out: tetrahedra and their regions. Never here: fields of points, several pieces, parallel files.

use super::cells::{CellData, Grid};
use super::{NUMBERS_MAX, counted, whole};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use metachron_geometry::Tetrahedra;
use roxmltree::{Document, Node};
use std::io::Read;

pub(super) fn is_vtu(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    start.starts_with(b"<") && start.windows(8).take(2000).any(|window| window == b"<VTKFile")
}

/// Most bytes of an array.
const BYTES_MAX: usize = 8 * NUMBERS_MAX;

/// The coding of all data of the file.
#[derive(Debug, Clone, Copy)]
struct Coding {
    is_big_endian: bool,
    /// Headers count with eight bytes, not with four.
    has_long_headers: bool,
    is_compressed: bool,
}

/// The data that follow the XML, and whether they are in base64.
struct Appended<'a> {
    bytes: &'a [u8],
    is_base64: bool,
}

/// The properties that all arrays of a file share.
struct File<'a> {
    coding: Coding,
    appended: Option<Appended<'a>>,
}

pub(super) fn read(bytes: &[u8]) -> Result<Tetrahedra, String> {
    // appended data is no XML
    let end = bytes.windows(13).position(|window| window == b"<AppendedData").unwrap_or(bytes.len());
    let mut head = str::from_utf8(&bytes[..end]).map_err(|_| "its XML is no text".to_owned())?.to_owned();
    let appended = appended(&bytes[end..]);
    if appended.is_some() {
        // they stand within the outermost element
        head.push_str("</VTKFile>");
    }
    let document = Document::parse(&head).map_err(|why| format!("it is no XML: {why}"))?;
    let file = File { coding: Coding::of(document.root_element())?, appended };
    let mut pieces = document.descendants().filter(|node| node.has_tag_name("Piece"));
    let piece = match (pieces.next(), pieces.count()) {
        (Some(piece), 0) => piece,
        (first, more) => return Err(format!("it has {} pieces: expected one", usize::from(first.is_some()) + more)),
    };
    let grid = file.grid(piece)?;
    let number = |key: &str| {
        let found = piece.attribute(key).unwrap_or_default().parse();
        found.map_err(|_| format!("expected a number as `{key}`"))
    };
    let said = counted("points", number("NumberOfPoints")?)?;
    let of = counted("cells", number("NumberOfCells")?)?;
    let (points, cells) = (grid.coordinates.len(), grid.kinds.len());
    if points != 3 * said || cells != of {
        return Err(format!(
            "it has {points} coordinates for {said} points, and says of {cells} cells of {of} what they are"
        ));
    }
    grid.tetrahedra()
}

/// The appended data, which begin after an underscore.
fn appended(rest: &[u8]) -> Option<Appended<'_>> {
    let head = rest.iter().position(|byte| *byte == b'>')?;
    let is_base64 = rest[..head].windows(6).any(|window| window == b"base64");
    let start = head + 1 + rest[head + 1..].iter().position(|byte| *byte == b'_')? + 1;
    Some(Appended { bytes: &rest[start..], is_base64 })
}

impl File<'_> {
    fn grid(&self, piece: Node<'_, '_>) -> Result<Grid, String> {
        let mut grid = Grid { offsets: vec![0], ..Grid::default() };
        for array in piece.descendants().filter(|node| node.has_tag_name("DataArray")) {
            let section = array.parent_element().map_or("", |parent| parent.tag_name().name());
            if !matches!(section, "Points" | "Cells" | "CellData") {
                continue;
            }
            let name = array.attribute("Name").unwrap_or_default();
            let values = self.values(array).map_err(|why| format!("the array `{name}` of {section}: {why}"))?;
            match (section, name) {
                ("Points", _) => grid.coordinates = values,
                ("Cells", "connectivity") => grid.connectivity = whole("connectivity", &values)?,
                ("Cells", "offsets") => grid.offsets.extend(whole("offsets", &values)?),
                ("Cells", "types") => grid.kinds = whole("types", &values)?,
                ("CellData", _) => {
                    let width = array.attribute("NumberOfComponents").and_then(|width| width.parse().ok());
                    grid.data.push(CellData { name: name.to_owned(), width: width.unwrap_or(1), values });
                }
                _ => {}
            }
        }
        Ok(grid)
    }

    fn values(&self, array: Node<'_, '_>) -> Result<Vec<f64>, String> {
        // information about an array stands in elements within it
        let text: String = array.children().filter(Node::is_text).filter_map(|node| node.text()).collect();
        let bytes = match array.attribute("format").unwrap_or_default() {
            "ascii" => {
                let number = |word: &str| word.parse().map_err(|_| format!("expected a number, found `{word}`"));
                return text.split_ascii_whitespace().map(number).collect();
            }
            "binary" => self.coding.decoded(text.trim().as_bytes())?,
            "appended" => {
                let Some(Appended { bytes, is_base64 }) = &self.appended else {
                    return Err("there are no appended data".to_owned());
                };
                let offset: Option<usize> = array.attribute("offset").and_then(|offset| offset.parse().ok());
                let offset = offset.ok_or("it says no offset where it begins")?;
                let from = bytes.get(offset..).ok_or("it begins beyond the end of the file")?;
                if *is_base64 { self.coding.decoded(from)? } else { self.coding.unpacked(from)? }
            }
            other => return Err(format!("its format is `{other}`: expected ascii, binary or appended")),
        };
        self.coding.numbers(array.attribute("type").unwrap_or_default(), &bytes)
    }
}

impl Coding {
    fn of(root: Node<'_, '_>) -> Result<Self, String> {
        let kind = root.attribute("type").unwrap_or_default();
        if !root.has_tag_name("VTKFile") || kind != "UnstructuredGrid" {
            return Err(format!("its type is `{kind}`: expected UnstructuredGrid"));
        }
        let compressor = root.attribute("compressor");
        if let Some(name) = compressor.filter(|name| *name != "vtkZLibDataCompressor") {
            return Err(format!("it is compressed by {name}: expected vtkZLibDataCompressor or none"));
        }
        Ok(Self {
            is_big_endian: root.attribute("byte_order") == Some("BigEndian"),
            has_long_headers: root.attribute("header_type") == Some("UInt64"),
            is_compressed: compressor.is_some(),
        })
    }

    const fn word(self) -> usize {
        if self.has_long_headers { 8 } else { 4 }
    }

    /// The counts at the start of some bytes.
    fn count(self, bytes: &[u8], at: usize) -> Result<usize, String> {
        let width = self.word();
        let mut word = [0; 8];
        let found = bytes.get(at * width..(at + 1) * width).ok_or("it ends within its header")?;
        word[..width].copy_from_slice(found);
        if self.is_big_endian {
            word[..width].reverse();
        }
        match usize::try_from(u64::from_le_bytes(word)) {
            Ok(count) if count <= BYTES_MAX => Ok(count),
            _ => Err(format!(
                "it says that it has {} bytes, more than {} MiB",
                u64::from_le_bytes(word),
                BYTES_MAX >> 20
            )),
        }
    }

    /// How many words the header of compressed data has.
    fn header(self, bytes: &[u8]) -> Result<usize, String> {
        if self.is_compressed { Ok(3 + self.count(bytes, 0)?) } else { Ok(1) }
    }

    /// The data of bytes in base64: the header of compressed data is encoded for itself.
    fn decoded(self, text: &[u8]) -> Result<Vec<u8>, String> {
        let end = text.iter().position(|byte| *byte == b'<' || byte.is_ascii_whitespace()).unwrap_or(text.len());
        let text = &text[..end];
        let plain = |text: &[u8]| STANDARD.decode(text).map_err(|why| format!("it is no base64: {why}"));
        let in_base64 = |bytes: usize| 4 * bytes.div_ceil(3);
        let part = |from: usize, bytes: usize| {
            let found = text.get(from..from.saturating_add(in_base64(bytes)));
            found.ok_or("it ends early").map_err(str::to_owned).and_then(plain)
        };
        if !self.is_compressed {
            let size = self.count(&part(0, self.word())?, 0)?;
            return self.unpacked(&part(0, self.word() + size)?);
        }
        let words = self.header(&part(0, self.word())?)?;
        let mut bytes = part(0, words * self.word())?;
        bytes.truncate(words * self.word());
        let mut size = 0;
        for block in 3..words {
            size += self.count(&bytes, block)?;
        }
        bytes.extend(part(in_base64(words * self.word()), size)?);
        self.unpacked(&bytes)
    }

    /// The data after their header.
    fn unpacked(self, bytes: &[u8]) -> Result<Vec<u8>, String> {
        let words = self.header(bytes)?;
        let mut from = words * self.word();
        let mut part = |size: usize| {
            let found = bytes.get(from..from.saturating_add(size));
            from = from.saturating_add(size);
            found.ok_or_else(|| "it ends within its data".to_owned())
        };
        if !self.is_compressed {
            return part(self.count(bytes, 0)?).map(<[u8]>::to_vec);
        }
        let (size, last) = (self.count(bytes, 1)?, self.count(bytes, 2)?);
        let mut data = vec![];
        for block in 3..words {
            let most = if block + 1 == words && last > 0 { last } else { size };
            if data.len() + most > BYTES_MAX {
                return Err(format!("it has more than {} MiB", BYTES_MAX >> 20));
            }
            let packed = part(self.count(bytes, block)?)?;
            let unpacked = ZlibDecoder::new(packed).take(most as u64).read_to_end(&mut data);
            unpacked.map_err(|why| format!("block {} cannot be unpacked: {why}", block - 2))?;
        }
        Ok(data)
    }

    fn numbers(self, kind: &str, bytes: &[u8]) -> Result<Vec<f64>, String> {
        macro_rules! read {
            ($type:ty) => {{
                if bytes.len() / size_of::<$type>() > NUMBERS_MAX {
                    return Err(format!("it has more than {NUMBERS_MAX} numbers"));
                }
                let (values, _) = bytes.as_chunks::<{ size_of::<$type>() }>();
                let of = if self.is_big_endian { <$type>::from_be_bytes } else { <$type>::from_le_bytes };
                Ok(values.iter().map(|bytes| of(*bytes) as f64).collect())
            }};
        }
        match kind {
            "Float64" => read!(f64),
            "Float32" => read!(f32),
            "Int64" => read!(i64),
            "UInt64" => read!(u64),
            "Int32" => read!(i32),
            "UInt32" => read!(u32),
            "Int16" => read!(i16),
            "UInt16" => read!(u16),
            "Int8" => read!(i8),
            "UInt8" => read!(u8),
            other => Err(format!("its type is `{other}`: expected Float32, Float64 or a type of whole numbers")),
        }
    }
}
