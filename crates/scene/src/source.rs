//! Sources of scenes: built in, or a file; and the files next to it.
//!
//! In: a name or a path, and limits. Out: text and bytes. Never here: their meaning. No other module of this crate reads files.

use super::build::triangles;
use super::builtin;
use super::demand::{FileHead, PROGRAM_BYTES};
use super::diagnostic::{SceneError, did_you_mean};
use metachron_geometry::Triangles;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

/// Longest scene file, bytes: more than 100000 path points need.
pub const SCENE_BYTES_MAX: u64 = 16 << 20;
/// Longest file next to a scene, bytes.
const SIBLING_BYTES_MAX: u64 = 64 << 20;

/// How much of a file's beginning says its contents, bytes.
const HEAD_BYTES: u64 = 64 << 10;
/// Most memory of a scene where the system does not say how much there is: half of 8 GiB.
const MEMORY_DEFAULT_BYTES: u64 = 4 << 30;

/// How far a scene may go on the machine that reads it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Most memory that the scene may ask for, bytes, by the estimate that is made before anything of it is. Default: half of the machine's, or of
    /// what the control groups of this process allow.
    pub memory_bytes: u64,
    /// Whether files that the scene names may lie outside of its folder, by their path or behind links. Default: no.
    pub allow_outside: bool,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            memory_bytes: machine_bytes(&|path| std::fs::read_to_string(path).ok())
                .map_or(MEMORY_DEFAULT_BYTES, |all| all / 2),
            allow_outside: false,
        }
    }
}

impl Limits {
    /// The least memory that an object can be held in, bytes.
    pub const MEMORY_LEAST_BYTES: u64 = PROGRAM_BYTES + (1 << 20);
}

/// The memory of this machine that this process may have, bytes, where the system says it.
fn machine_bytes(read: &dyn Fn(&Path) -> Option<String>) -> Option<u64> {
    let text = read(Path::new("/proc/meminfo"))?;
    let total = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    let total = total.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? << 10;
    Some(group_limits(read).into_iter().fold(total, u64::min))
}

/// The limits of the control groups that this process is in, bytes (Linux, cgroup_namespaces(7)): a container's, a service's, a job's.
fn group_limits(read: &dyn Fn(&Path) -> Option<String>) -> Vec<u64> {
    let groups = read(Path::new("/proc/self/cgroup")).unwrap_or_default();
    let mut limits = Vec::new();
    for group in groups.lines() {
        let mut parts = group.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else { continue };
        let (root, file) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max"),
            _ if controllers.split(',').any(|one| one == "memory") => {
                ("/sys/fs/cgroup/memory", "memory.limit_in_bytes")
            }
            _ => continue,
        };
        // the group of a limit may be any around this one; a group without a limit says `max`
        let around = Path::new(path.trim_start_matches('/')).ancestors();
        limits.extend(
            around.filter_map(|group| read(&Path::new(root).join(group).join(file))?.trim().parse::<u64>().ok()),
        );
    }
    limits
}

/// A scene's text and where it comes from.
#[derive(Debug, Clone)]
pub struct Source {
    name: String,
    text: String,
    limits: Limits,
    siblings: SiblingFiles,
    /// Files beside it that are not on the disk, by their names.
    made: Arc<BTreeMap<String, Vec<u8>>>,
    /// The files on the disk that it has been read from, by all copies of this source.
    files: Files,
}

type Files = Arc<Mutex<BTreeMap<PathBuf, Option<FileVersion>>>>;

/// The modification time and size of a file, by which a change of it is noticed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileVersion {
    modified: SystemTime,
    bytes: u64,
}

impl FileVersion {
    /// That of the file at a path at present; `None` where there is none.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let file = path.metadata().ok()?;
        Some(Self { modified: file.modified().ok()?, bytes: file.len() })
    }
}

/// A file that a scene is made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceFile {
    /// Where it is.
    pub path: PathBuf,
    /// Its version before the scene first read it: a file that changes while it is read has another one afterwards.
    /// `None` where there was none.
    pub version: Option<FileVersion>,
}

/// Location of the files next to a scene.
#[derive(Debug, Clone)]
enum SiblingFiles {
    BuiltIn,
    Folder(PathBuf),
    Unavailable,
}

/// One file next to a scene.
enum SiblingFile<'a> {
    InMemory(&'a [u8]),
    OnDisk(PathBuf),
}

impl Source {
    /// The built-in scene called `name_or_path`, or else the file at this path.
    ///
    /// # Errors
    /// [`SceneError`] when neither exists, or the file cannot be read, is too long or not UTF-8.
    pub fn open(name_or_path: &str) -> Result<Self, SceneError> {
        if let Some(scene) = builtin::find(name_or_path) {
            let (name, text) = (scene.name.to_owned(), scene.text.to_owned());
            let (siblings, limits) = (SiblingFiles::BuiltIn, Limits::default());
            return Ok(Self { name, text, limits, siblings, made: Arc::default(), files: Arc::default() });
        }
        let path = Path::new(name_or_path);
        let version = FileVersion::of(path);
        let bytes = read_bounded(path, SCENE_BYTES_MAX).map_err(|why| missing(name_or_path, path, &why))?;
        let folder = path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
        let source = Self::from_bytes(name_or_path, bytes, SiblingFiles::Folder(folder))?;
        source.note_file(path, version);
        Ok(source)
    }

    /// A scene from bytes in memory, without files next to it.
    ///
    /// # Errors
    /// [`SceneError`] when they are too many or not UTF-8.
    pub fn memory(name: &str, bytes: &[u8]) -> Result<Self, SceneError> {
        if bytes.len() as u64 > SCENE_BYTES_MAX {
            let message = format!("it has {} bytes, more than {SCENE_BYTES_MAX}", bytes.len());
            return Err(SceneError::unreadable(name, message, None));
        }
        Self::from_bytes(name, bytes.to_vec(), SiblingFiles::Unavailable)
    }

    /// The scene `name` with the text that it had when it was recorded; files next to it are read from the `folder`
    /// that it was in, or are the built-in ones.
    ///
    /// # Errors
    /// [`SceneError`] when the text is too long.
    pub fn recorded(name: &str, text: &str, folder: Option<&Path>) -> Result<Self, SceneError> {
        let siblings = folder.map_or(SiblingFiles::BuiltIn, |folder| SiblingFiles::Folder(folder.to_owned()));
        let source = Self { siblings, ..Self::memory(name, text.as_bytes())? };
        if let Some(path) = folder.zip(Path::new(name).file_name()).map(|(folder, name)| folder.join(name)) {
            source.note_file(&path, FileVersion::of(&path));
        }
        Ok(source)
    }

    /// The same with files beside it that are not written yet, by their names in the scene.
    #[must_use]
    pub fn with_files(self, files: BTreeMap<String, Vec<u8>>) -> Self {
        Self { made: Arc::new(files), ..self }
    }

    /// The same within other limits than the default ones.
    #[must_use]
    pub fn within(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// How far it may go.
    #[must_use]
    pub const fn limits(&self) -> Limits {
        self.limits
    }

    fn from_bytes(name: &str, bytes: Vec<u8>, siblings: SiblingFiles) -> Result<Self, SceneError> {
        match String::from_utf8(bytes) {
            Ok(text) => {
                let (name, limits) = (name.to_owned(), Limits::default());
                Ok(Self { name, text, limits, siblings, made: Arc::default(), files: Arc::default() })
            }
            Err(error) => {
                let valid = error.utf8_error().valid_up_to();
                let before = &error.as_bytes()[..valid];
                let line = before.iter().filter(|b| **b == b'\n').count() + 1;
                let column = valid - before.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1) + 1;
                let message = format!("line {line}, byte {column} is not UTF-8 text");
                Err(SceneError::unreadable(name, message, Some("expected a TOML file".to_owned())))
            }
        }
    }

    /// The scene's name: that of the built-in one, or the path as it was given.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The folder that files next to the scene are read from, whatever the working directory; `None` of a scene that is no file.
    #[must_use]
    pub fn folder(&self) -> Option<PathBuf> {
        let SiblingFiles::Folder(folder) = &self.siblings else { return None };
        std::env::current_dir().map_or_else(|_| Some(folder.clone()), |here| Some(here.join(folder)))
    }

    /// The files that it has been read from, also files that could not be read: its own, and the files beside it that a
    /// [`crate::load`] of it, or of a copy, has asked for. None of a scene that is built in or from memory.
    #[must_use]
    pub fn files(&self) -> Vec<SourceFile> {
        let files = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        files.iter().map(|(path, version)| SourceFile { path: path.clone(), version: *version }).collect()
    }

    /// The bytes of the files beside it on the disk that a [`crate::load`] of it has read, by their names in the scene: with these
    /// ([`Source::with_files`]) its text is the same scene elsewhere.
    ///
    /// # Errors
    /// The file that cannot be read, and why.
    pub fn files_beside(&self) -> Result<BTreeMap<String, Vec<u8>>, String> {
        let SiblingFiles::Folder(folder) = &self.siblings else { return Ok(BTreeMap::new()) };
        let beside = self.files().into_iter().filter(|file| file.path != Path::new(&self.name));
        let read = |SourceFile { path, .. }: SourceFile| {
            let bytes = read_plain(&path, SIBLING_BYTES_MAX).map_err(|why| format!("{}: {why}", path.display()))?;
            Ok((plain_name(path.strip_prefix(folder).unwrap_or(&path)), bytes))
        };
        beside.map(read).collect()
    }

    /// Of these files the ones outside of its folder: only a source whose limits allow it is read from them.
    #[must_use]
    pub fn files_outside(&self) -> Vec<PathBuf> {
        let SiblingFiles::Folder(folder) = &self.siblings else { return Vec::new() };
        let is_outside = |path: &PathBuf| path.strip_prefix(folder).is_ok_and(|name| is_outside(folder, name));
        self.files().into_iter().map(|file| file.path).filter(is_outside).collect()
    }

    fn note_file(&self, path: &Path, version: Option<FileVersion>) {
        let mut files = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        files.entry(path.to_path_buf()).or_insert(version);
    }

    /// The text.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The mesh in a file, which a program gives to a body that it builds; its coordinates are multiplied by `scale` to be metres.
    ///
    /// # Errors
    /// [`SceneError`] where the file cannot be read, or is no sound mesh: STL, OBJ or binary glTF.
    pub fn mesh(path: &Path, scale: f64) -> Result<Triangles, SceneError> {
        let mesh = read_plain(path, SIBLING_BYTES_MAX).and_then(|bytes| triangles(&bytes, scale));
        mesh.map_err(|why| {
            let why = format!("the mesh cannot be used: {why}");
            SceneError::unreadable(&path.to_string_lossy(), why, Some("expected STL, OBJ or .glb".to_owned()))
        })
    }

    /// The bytes of a file next to the scene, or why there are none.
    pub(super) fn sibling(&self, name: &str) -> Result<Vec<u8>, String> {
        match self.find(name)? {
            SiblingFile::InMemory(bytes) => Ok(bytes.to_vec()),
            SiblingFile::OnDisk(path) => read_plain(&path, SIBLING_BYTES_MAX),
        }
    }

    /// How such a file begins, or why there is none.
    pub(super) fn head(&self, name: &str) -> Result<FileHead, String> {
        match self.find(name)? {
            SiblingFile::InMemory(bytes) => {
                let start = bytes[..bytes.len().min(HEAD_BYTES as usize)].to_vec();
                Ok(FileHead { start, bytes: bytes.len() as u64 })
            }
            SiblingFile::OnDisk(path) => {
                let PlainFile { file, bytes } = open_plain(&path, SIBLING_BYTES_MAX)?;
                let mut start = Vec::new();
                file.take(HEAD_BYTES).read_to_end(&mut start).map_err(|e| e.to_string())?;
                Ok(FileHead { start, bytes })
            }
        }
    }

    fn find(&self, name: &str) -> Result<SiblingFile<'_>, String> {
        let path = Path::new(name);
        if name.is_empty() || path.components().any(|c| matches!(c, Component::Prefix(_) | Component::RootDir)) {
            return Err("expected a path relative to the scene".to_owned());
        }
        if let Some(bytes) = self.made.get(name).or_else(|| self.made.get(&plain_name(path))) {
            return Ok(SiblingFile::InMemory(bytes));
        }
        match &self.siblings {
            SiblingFiles::BuiltIn => {
                builtin::sibling(name).map(SiblingFile::InMemory).ok_or_else(|| "no such built-in file".to_owned())
            }
            SiblingFiles::Folder(folder) if !self.limits.allow_outside && is_outside(folder, path) => {
                Err("it is outside of the scene's folder; expected a file within, or --allow-outside".to_owned())
            }
            SiblingFiles::Folder(folder) => {
                let path = folder.join(path);
                self.note_file(&path, FileVersion::of(&path));
                Ok(SiblingFile::OnDisk(path))
            }
            SiblingFiles::Unavailable => Err("a scene from memory has no files beside it".to_owned()),
        }
    }
}

/// A relative path without `.`, its parts divided by `/`.
fn plain_name(path: &Path) -> String {
    let parts = path.components().filter(|part| *part != Component::CurDir);
    parts.map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}

/// Whether the file called `name` in a folder lies outside of it: by its path, which is not looked up, or behind links.
fn is_outside(folder: &Path, name: &Path) -> bool {
    let mut depth = 0;
    for part in name.components() {
        match part {
            Component::ParentDir if depth == 0 => return true,
            Component::ParentDir => depth -= 1,
            Component::Normal(_) => depth += 1,
            _ => {}
        }
    }
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    match (folder.canonicalize(), folder.join(name).canonicalize()) {
        (Ok(folder), Ok(file)) => !file.starts_with(folder),
        // nothing is read where there is no such file
        _ => false,
    }
}

/// An open file and its length.
struct PlainFile {
    file: File,
    bytes: u64,
}

/// Opens a file of at most `most` bytes that a scene names, which must not be a stream: only the caller of the program may make it wait for one.
fn open_plain(path: &Path, most: u64) -> Result<PlainFile, String> {
    // checked before opening: opening a pipe waits for a writer
    let about = std::fs::metadata(path).map_err(|e| e.to_string())?;
    if about.is_dir() {
        return Err("it is a folder".to_owned());
    }
    if !about.is_file() {
        return Err("it is a pipe, a device or a socket; expected a plain file".to_owned());
    }
    if about.len() > most {
        return Err(format!("it has more than {most} bytes"));
    }
    Ok(PlainFile { file: File::open(path).map_err(|e| e.to_string())?, bytes: about.len() })
}

fn read_plain(path: &Path, most: u64) -> Result<Vec<u8>, String> {
    read_opened(open_plain(path, most)?.file, most)
}

fn read_bounded(path: &Path, most: u64) -> Result<Vec<u8>, String> {
    if path.is_dir() {
        return Err("it is a folder".to_owned());
    }
    let file = File::open(path).map_err(|e| e.to_string())?;
    read_opened(file, most)
}

fn read_opened(file: File, most: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    if bytes.len() as u64 > most {
        return Err(format!("it has more than {most} bytes"));
    }
    Ok(bytes)
}

fn missing(name: &str, path: &Path, why: &str) -> SceneError {
    let list = builtin::all().iter().map(|s| s.name).collect::<Vec<_>>().join(", ");
    let looks_like_a_path = path.components().count() > 1 || path.extension().is_some();
    let hint = did_you_mean(name, builtin::all().iter().map(|s| s.name)).filter(|_| !looks_like_a_path);
    let help = match hint {
        Some(hint) => format!("{hint} Built-in scenes: {list}; or give the path of a scene file"),
        None => format!("built-in scenes: {list}; or give the path of a scene file"),
    };
    let message = if looks_like_a_path || path.exists() {
        format!("the file cannot be read: {why}")
    } else {
        format!("there is no built-in scene `{name}`, and no file of that name ({why})")
    };
    SceneError::unreadable(name, message, Some(help))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_is_not_a_plain_file_is_refused_without_waiting() {
        // an endless device, and a socket in place of a pipe: both are refused before they are opened
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("socket.obj");
        let _listens = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        for path in [Path::new("/dev/zero"), &socket] {
            let message = read_plain(path, SIBLING_BYTES_MAX).unwrap_err();
            assert!(message.contains("expected a plain file"), "{path:?}: {message}");
        }
        assert_eq!(read_plain(folder.path(), 9).unwrap_err(), "it is a folder");
        // a scene may come from a pipe, but its length is bounded
        assert!(read_bounded(Path::new("/dev/zero"), 9).unwrap_err().contains("more than 9 bytes"));
    }

    #[test]
    fn the_memory_of_a_machine_is_no_more_than_its_groups_allow() {
        let bytes = |files: &[(&str, &str)]| {
            let read =
                |path: &Path| files.iter().find(|(at, _)| Path::new(at) == path).map(|(_, text)| (*text).to_owned());
            machine_bytes(&read)
        };
        let machine = ("/proc/meminfo", "MemFree: 1 kB\nMemTotal:        8388608 kB\n");
        assert_eq!(bytes(&[machine]), Some(8 << 30));
        // a service within a slice that has the lesser limit
        let service = ("/proc/self/cgroup", "0::/user.slice/a.service\n");
        let own = ("/sys/fs/cgroup/user.slice/a.service/memory.max", "max\n");
        let slice = ("/sys/fs/cgroup/user.slice/memory.max", "1073741824\n");
        assert_eq!(bytes(&[machine, service, own]), Some(8 << 30));
        assert_eq!(bytes(&[machine, service, own, slice]), Some(1 << 30));
        // a container, which sees itself as the root; the first version, whose limit may exceed the machine
        assert_eq!(
            bytes(&[machine, ("/proc/self/cgroup", "0::/\n"), ("/sys/fs/cgroup/memory.max", "4096\n")]),
            Some(4096)
        );
        let first = ("/proc/self/cgroup", "5:cpu,cpuacct:/a\n3:memory:/a\n");
        let limit = |text| ("/sys/fs/cgroup/memory/a/memory.limit_in_bytes", text);
        assert_eq!(bytes(&[machine, first, limit("2147483648\n")]), Some(2 << 30));
        assert_eq!(bytes(&[machine, first, limit("9223372036854771712\n")]), Some(8 << 30));
        assert_eq!(bytes(&[service, slice]), None);
    }

    #[test]
    fn a_file_that_has_changed_since_it_was_read_is_another_one_than_the_source_has() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("scene.toml"), "format = 1\n").unwrap();
        let source = Source::open(at("scene.toml").to_str().unwrap()).unwrap();
        let changed = || {
            let all = source.files().into_iter();
            let changed = all.filter(|file| FileVersion::of(&file.path) != file.version).map(|file| file.path);
            changed.collect::<Vec<_>>()
        };
        assert!(source.clone().sibling("mesh.obj").is_err());
        assert!(changed().is_empty() && source.files().len() == 2);
        std::fs::write(at("mesh.obj"), "v 0 0 0\n").unwrap();
        assert_eq!(changed(), [at("mesh.obj")]);
        let elsewhere =
            Source::memory("scene.toml", b"format = 1\n").unwrap().with_files(source.files_beside().unwrap());
        assert_eq!(elsewhere.sibling("./mesh.obj").unwrap(), b"v 0 0 0\n");
        std::fs::write(at("scene.toml"), "format = 1\nname = 'other'\n").unwrap();
        assert_eq!(changed(), [at("mesh.obj"), at("scene.toml")]);
    }
}
