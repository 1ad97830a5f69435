//! Reads VTK's XML files of unstructured grids (.vtu): text, base64 and appended data, as they are or compressed by zlib.
//!
//! In: bytes. Out: tetrahedra and their regions. Never here: fields of points, several pieces, parallel files.

use super::cells::{CellData, Grid};
use super::{NUMBERS_MAX, counted, whole};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use metachron_geometry::Tetrahedra;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::io::Read;

pub(super) fn is_vtu(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    start.starts_with(b"<") && start.windows(8).take(2000).any(|window| window == b"<VTKFile")
}

/// Most bytes of an array.
const BYTES_MAX: usize = 8 * NUMBERS_MAX;

/// The coding of all data of the file.
#[derive(Debug, Clone, Copy, Default)]
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

/// An array that has begun.
struct Array {
    /// The element around it: `Points`, `Cells`, `CellData` or another.
    section: String,
    name: String,
    kind: String,
    format: String,
    offset: Option<usize>,
    /// How many numbers a point or a cell has.
    width: usize,
}

/// The contents read so far.
struct File<'a> {
    coding: Coding,
    appended: Option<Appended<'a>>,
    /// The elements that have begun, outermost first.
    open: Vec<String>,
    array: Option<Array>,
    text: String,
    pieces: usize,
    /// How many points and cells the piece says that it has.
    points: usize,
    cells: usize,
    grid: Grid,
}

pub(super) fn read(bytes: &[u8]) -> Result<Tetrahedra, String> {
    // appended data is no XML
    let end = bytes.windows(13).position(|window| window == b"<AppendedData").unwrap_or(bytes.len());
    let head = str::from_utf8(&bytes[..end]).map_err(|_| "its XML is no text".to_owned())?;
    let mut file = File {
        coding: Coding::default(),
        appended: appended(&bytes[end..]),
        open: vec![],
        array: None,
        text: String::new(),
        pieces: 0,
        points: 0,
        cells: 0,
        grid: Grid { offsets: vec![0], ..Grid::default() },
    };
    let mut reader = Reader::from_str(head);
    reader.config_mut().check_end_names = false;
    loop {
        let event = reader.read_event().map_err(|why| format!("byte {}: {why}", reader.error_position()))?;
        match event {
            Event::Start(tag) => file.begin(&tag)?,
            Event::Empty(tag) => {
                file.begin(&tag)?;
                file.end()?;
            }
            // information about an array stands in elements within it
            Event::Text(text) if file.open.last().is_some_and(|name| name == "DataArray") => {
                file.text.push_str(&String::from_utf8_lossy(&text));
            }
            Event::End(_) => file.end()?,
            Event::Eof => break,
            _ => {}
        }
    }
    // appended data stand within the outermost element
    if file.open.len() > usize::from(file.appended.is_some()) {
        return Err(format!("it ends within `{}`", file.open.join("/")));
    }
    if file.pieces != 1 {
        return Err(format!("it has {} pieces: expected one", file.pieces));
    }
    let (points, cells) = (file.grid.coordinates.len(), file.grid.kinds.len());
    if points != 3 * file.points || cells != file.cells {
        let (said, of) = (file.points, file.cells);
        return Err(format!(
            "it has {points} coordinates for {said} points, and says of {cells} cells of {of} what they are"
        ));
    }
    file.grid.tetrahedra()
}

/// The appended data, which begin after an underscore.
fn appended(rest: &[u8]) -> Option<Appended<'_>> {
    let head = rest.iter().position(|byte| *byte == b'>')?;
    let is_base64 = rest[..head].windows(6).any(|window| window == b"base64");
    let start = head + 1 + rest[head + 1..].iter().position(|byte| *byte == b'_')? + 1;
    Some(Appended { bytes: &rest[start..], is_base64 })
}

fn attribute(tag: &BytesStart<'_>, name: &str) -> Option<String> {
    let found = tag.try_get_attribute(name).ok()??;
    Some(String::from_utf8_lossy(&found.value).into_owned())
}

impl File<'_> {
    fn begin(&mut self, tag: &BytesStart<'_>) -> Result<(), String> {
        let name = String::from_utf8_lossy(tag.name().as_ref()).into_owned();
        let of = |key: &str| attribute(tag, key).unwrap_or_default();
        match name.as_str() {
            "VTKFile" => {
                let kind = attribute(tag, "type").unwrap_or_default();
                if kind != "UnstructuredGrid" {
                    return Err(format!("its type is `{kind}`: expected UnstructuredGrid"));
                }
                let compressor = attribute(tag, "compressor");
                if compressor.as_ref().is_some_and(|name| name != "vtkZLibDataCompressor") {
                    let name = compressor.unwrap_or_default();
                    return Err(format!("it is compressed by {name}: expected vtkZLibDataCompressor or none"));
                }
                self.coding = Coding {
                    is_big_endian: attribute(tag, "byte_order").is_some_and(|order| order == "BigEndian"),
                    has_long_headers: attribute(tag, "header_type").is_some_and(|kind| kind == "UInt64"),
                    is_compressed: compressor.is_some(),
                };
            }
            "Piece" => {
                self.pieces += 1;
                let number = |key: &str| of(key).parse().map_err(|_| format!("expected a number as `{key}`"));
                self.points = counted("points", number("NumberOfPoints")?)?;
                self.cells = counted("cells", number("NumberOfCells")?)?;
            }
            "DataArray" => {
                self.array = Some(Array {
                    section: self.open.last().cloned().unwrap_or_default(),
                    name: of("Name"),
                    kind: of("type"),
                    format: of("format"),
                    offset: of("offset").parse().ok(),
                    width: of("NumberOfComponents").parse().unwrap_or(1),
                });
                self.text.clear();
            }
            _ => {}
        }
        self.open.push(name);
        Ok(())
    }

    fn end(&mut self) -> Result<(), String> {
        if self.open.pop().is_none_or(|name| name != "DataArray") {
            return Ok(());
        }
        let Some(array) = self.array.take() else { return Ok(()) };
        let is_wanted = matches!(array.section.as_str(), "Points" | "Cells" | "CellData");
        if !is_wanted {
            return Ok(());
        }
        let wrong = |why: String| format!("the array `{}` of {}: {why}", array.name, array.section);
        let values = self.values(&array).map_err(wrong)?;
        let grid = &mut self.grid;
        match (array.section.as_str(), array.name.as_str()) {
            ("Points", _) => grid.coordinates = values,
            ("Cells", "connectivity") => grid.connectivity = whole("connectivity", &values)?,
            ("Cells", "offsets") => grid.offsets.extend(whole("offsets", &values)?),
            ("Cells", "types") => grid.kinds = whole("types", &values)?,
            ("CellData", _) => grid.data.push(CellData { name: array.name, width: array.width, values }),
            _ => {}
        }
        Ok(())
    }

    fn values(&self, array: &Array) -> Result<Vec<f64>, String> {
        let bytes = match array.format.as_str() {
            "ascii" => {
                let number = |word: &str| word.parse().map_err(|_| format!("expected a number, found `{word}`"));
                return self.text.split_ascii_whitespace().map(number).collect();
            }
            "binary" => self.coding.decoded(self.text.trim().as_bytes())?,
            "appended" => {
                let Some(Appended { bytes, is_base64 }) = &self.appended else {
                    return Err("there are no appended data".to_owned());
                };
                let offset = array.offset.ok_or("it says no offset where it begins")?;
                let from = bytes.get(offset..).ok_or("it begins beyond the end of the file")?;
                if *is_base64 { self.coding.decoded(from)? } else { self.coding.unpacked(from)? }
            }
            other => return Err(format!("its format is `{other}`: expected ascii, binary or appended")),
        };
        self.coding.numbers(&array.kind, &bytes)
    }
}

impl Coding {
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
