//! Files that are written: whole or not at all, by links of both kinds, or growing; and which names are of one file.

use metachron_world::{OutputFile, is_same_file};
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process;

/// A folder of this process and test, gone when it is dropped.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("metachron-{test}-{}", process::id()));
        fs::create_dir(&folder).unwrap();
        Self(folder)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<_> = entries.map(|one| one.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.0).unwrap();
    }
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

#[test]
fn a_file_takes_its_place_when_it_is_complete_and_not_before() {
    let folder = Folder::new("whole");
    let path = folder.file("a");
    fs::write(&path, "old").unwrap();
    let mut file = OutputFile::whole(&path).unwrap();
    let mut second = OutputFile::whole(folder.file("b")).unwrap();
    file.write_all(b"new").unwrap();
    second.write_all(b"other").unwrap();
    assert_eq!((text(&path).as_str(), folder.names().len()), ("old", 3));
    drop(second);
    file.complete().unwrap();
    assert_eq!((text(&path).as_str(), folder.names()), ("new", vec!["a".to_owned()]));
}

#[test]
fn a_file_that_grows_is_in_its_place_at_once() {
    let folder = Folder::new("growing");
    let path = folder.file("a");
    fs::write(&path, "old").unwrap();
    let mut file = OutputFile::growing(&path).unwrap();
    file.write_all(b"new").unwrap();
    assert_eq!((text(&path).as_str(), folder.names()), ("new", vec!["a".to_owned()]));
    drop(file);
    assert_eq!(text(&path), "new");
}

#[cfg(unix)]
#[test]
fn other_names_keep_the_old_bytes_and_links_lead_to_the_new_ones() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = Folder::new("links");
    let [path, hard, soft] = ["a", "hard", "soft"].map(|name| folder.file(name));
    fs::create_dir(folder.file("inner")).unwrap();
    let ways: [fn(&Path) -> std::io::Result<()>; 2] =
        [|path| OutputFile::write(path, "new"), |path| OutputFile::growing(path)?.write_all(b"new")];
    for write in ways {
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        fs::hard_link(&path, &hard).unwrap();
        symlink("a", &soft).unwrap();
        write(&soft).unwrap();
        assert_eq!([&path, &hard, &soft].map(|path| text(path)), ["new", "old", "new"]);
        assert!(fs::symlink_metadata(&soft).unwrap().is_symlink());
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        // a link to what is not there yet
        fs::remove_file(&path).unwrap();
        fs::remove_file(&soft).unwrap();
        symlink("inner/b", &soft).unwrap();
        write(&soft).unwrap();
        assert_eq!(text(&folder.file("inner/b")), "new");
        [&hard, &soft].into_iter().for_each(|path| fs::remove_file(path).unwrap());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_place_that_takes_no_file_says_why_and_a_device_takes_the_bytes() {
    let folder = Folder::new("refused");
    let kind = |path: &Path| OutputFile::whole(path).map(drop).unwrap_err().kind();
    assert_eq!(kind(&folder.0), ErrorKind::IsADirectory);
    assert_eq!(kind(&folder.file("none/a")), ErrorKind::NotFound);
    // no user can make a file there
    assert!(OutputFile::whole("/proc/a").is_err());
    OutputFile::write("/dev/null", "new").unwrap();
    assert!(OutputFile::write("/dev/full", "new").is_err());
    assert!(folder.names().is_empty());
}

#[cfg(unix)]
#[test]
fn one_file_is_the_same_by_all_of_its_names() {
    let folder = Folder::new("same");
    let [path, hard, soft, other] = ["a", "hard", "soft", "other"].map(|name| folder.file(name));
    [&path, &other].into_iter().for_each(|path| fs::write(path, "old").unwrap());
    fs::hard_link(&path, &hard).unwrap();
    std::os::unix::fs::symlink("hard", &soft).unwrap();
    let spelled = folder.0.join("../").join(folder.0.file_name().unwrap()).join("a");
    for name in [&path, &hard, &soft, &spelled] {
        assert!(is_same_file(&path, name) && !is_same_file(&other, name), "{name:?}");
    }
    let (new, spelled) = (folder.file("new"), spelled.with_file_name("new"));
    assert!(is_same_file(&new, &spelled) && !is_same_file(&new, &path));
    assert!(!is_same_file(&folder.0, &folder.0) && !is_same_file(Path::new("/dev/null"), Path::new("/dev/null")));
}

#[cfg(target_os = "linux")]
#[test]
fn a_file_or_pipe_that_the_process_has_open_takes_bytes_at_its_end() {
    use std::io::Read;
    use std::os::fd::AsRawFd;
    let folder = Folder::new("open");
    let path = folder.file("log");
    fs::write(&path, "before ").unwrap();
    let open = fs::File::open(&path).unwrap();
    OutputFile::write(format!("/proc/self/fd/{}", open.as_raw_fd()), "more").unwrap();
    assert_eq!(text(&path), "before more");
    let (mut reader, writer) = std::io::pipe().unwrap();
    OutputFile::write(format!("/dev/fd/{}", writer.as_raw_fd()), "through").unwrap();
    drop(writer);
    let mut read = String::new();
    reader.read_to_string(&mut read).unwrap();
    assert_eq!(read, "through");
}
