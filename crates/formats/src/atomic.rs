//! Files and folders that appear whole or not at all: they are built beside their destination and renamed.
//!
//! What is not a regular file (a device, a pipe: `/dev/stdout`, `/dev/full`) is written in place, since a
//! rename would replace the device. A symbolic link keeps its place; the file that it names is replaced. A
//! file without write permission is refused although a rename could replace it.

use crate::FormatError;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Cursor, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes gathered before a system call.
const BUFFER: usize = 1 << 18;

/// A sink that can go back: some formats write their tables last.
pub trait WriteSeek: Write + Seek {}

impl<T: Write + Seek> WriteSeek for T {}

/// Writes the file `path` through `body`. On any failure the temporary file is removed and the old file is
/// whole; the error is [`FormatError::Unwritable`].
pub fn write_atomic(
    path: &Path,
    body: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), FormatError> {
    write_with(path, |sink| match sink {
        Sink::File(w) => body(w),
        Sink::Device(w) => {
            let mut w = BufWriter::with_capacity(BUFFER, w);
            body(&mut w)?;
            w.flush()
        }
    })
}

/// [`write_atomic`] for a body that seeks; to a device the bytes go once they are complete.
pub fn write_atomic_seek(
    path: &Path,
    body: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>,
) -> Result<(), FormatError> {
    write_with(path, |sink| match sink {
        Sink::File(w) => body(w),
        Sink::Device(w) => {
            let mut bytes = Cursor::new(Vec::new());
            body(&mut bytes)?;
            w.write_all(bytes.get_ref())?;
            w.flush()
        }
    })
}

/// Builds the folder `path` through `body`, which fills an empty folder beside it. A failure leaves `path` as
/// it was. Where `path` already holds files, the new ones replace those of the same name and the others stay:
/// a folder that the user names by mistake loses nothing else.
pub fn write_dir_atomic(
    path: &Path,
    body: impl FnOnce(&Path) -> Result<(), FormatError>,
) -> Result<(), FormatError> {
    let unwritable = |e: io::Error| unwritable(path, &e);
    if path.exists() && !path.is_dir() {
        return Err(FormatError::Unwritable { path: path.into(), why: "exists and is not a folder".into() });
    }
    let temporary = Temporary(beside(path));
    fs::create_dir(&temporary.0).map_err(unwritable)?;
    body(&temporary.0).map_err(|e| relocated(e, &temporary.0, path))?;
    if path.is_dir() {
        move_into(&temporary.0, path).map_err(unwritable)
    } else {
        fs::rename(&temporary.0, path).map_err(unwritable)
    }
}

/// Refuses a place where [`write_atomic`] and [`write_dir_atomic`] could make nothing, by trying to.
pub fn check_writable(path: &Path) -> Result<(), FormatError> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.into());
    let temporary = Temporary(beside(&target));
    let made = OpenOptions::new().write(true).create_new(true).open(&temporary.0);
    made.map(|_| ()).map_err(|e| {
        let folder = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let why = format!("the folder {} takes no files ({})", folder.display(), plain(&e));
        FormatError::Unwritable { path: path.into(), why }
    })
}

/// The error with the name that the user knows instead of the temporary one.
fn relocated(mut error: FormatError, from: &Path, to: &Path) -> FormatError {
    let (FormatError::Unreadable { path, .. }
    | FormatError::Invalid { path, .. }
    | FormatError::Unwritable { path, .. }) = &mut error;
    if let Ok(rest) = path.strip_prefix(from) {
        *path = if rest.as_os_str().is_empty() { to.into() } else { to.join(rest) };
    }
    error
}

enum Sink<'a> {
    File(&'a mut BufWriter<File>),
    Device(&'a mut File),
}

fn write_with(path: &Path, body: impl FnOnce(Sink<'_>) -> io::Result<()>) -> Result<(), FormatError> {
    let old = fs::metadata(path).ok();
    let result = match &old {
        Some(m) if m.is_dir() => Err(io::Error::other("is a folder")),
        Some(m) if !m.is_file() => write_in_place(path, body),
        Some(m) if m.permissions().readonly() => Err(io::Error::other("the file is read-only")),
        _ => replace(path, old.map(|m| m.permissions()), body),
    };
    result.map_err(|e| unwritable(path, &e))
}

fn write_in_place(path: &Path, body: impl FnOnce(Sink<'_>) -> io::Result<()>) -> io::Result<()> {
    let mut device = OpenOptions::new().write(true).open(path)?;
    body(Sink::Device(&mut device))
}

fn replace(
    path: &Path,
    permissions: Option<fs::Permissions>,
    body: impl FnOnce(Sink<'_>) -> io::Result<()>,
) -> io::Result<()> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.into());
    let temporary = Temporary(beside(&target));
    let file = OpenOptions::new().write(true).create_new(true).open(&temporary.0)?;
    let mut writer = BufWriter::with_capacity(BUFFER, file);
    body(Sink::File(&mut writer))?;
    let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
    if let Some(p) = permissions {
        file.set_permissions(p)?;
    }
    drop(file);
    fs::rename(&temporary.0, &target)
}

/// A file or folder that goes when its scope ends, unless it was renamed away.
struct Temporary(PathBuf);

impl Drop for Temporary {
    fn drop(&mut self) {
        // Nothing to be done about a failure here; the error that led here is already on its way up.
        let _ = if self.0.is_dir() { fs::remove_dir_all(&self.0) } else { fs::remove_file(&self.0) };
    }
}

/// A name beside `path` that nobody else has: process and counter are in it.
fn beside(path: &Path) -> PathBuf {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let n = COUNTER.fetch_add(1, Ordering::Relaxed);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // A name near the file system's limit of 255 bytes leaves no room for more.
    let short: String = name.chars().take(40).collect();
    path.with_file_name(format!(".{short}.{}.{n}.tmp", std::process::id()))
}

/// Moves everything in `from` into `to`, folders by content.
fn move_into(from: &Path, to: &Path) -> io::Result<()> {
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() && target.is_dir() {
            move_into(&entry.path(), &target)?;
        } else {
            fs::rename(entry.path(), &target)?;
        }
    }
    Ok(())
}

fn unwritable(path: &Path, error: &io::Error) -> FormatError {
    FormatError::Unwritable { path: path.into(), why: plain(error) }
}

/// An operating system's message in plain words, without its number.
pub(crate) fn plain(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "no such file or folder".into(),
        io::ErrorKind::PermissionDenied => "permission denied".into(),
        io::ErrorKind::IsADirectory => "is a folder, not a file".into(),
        io::ErrorKind::NotADirectory => "a part of its path is not a folder".into(),
        io::ErrorKind::StorageFull => {
            "no space left on the disk: free some, or name a place elsewhere".into()
        }
        _ if error.raw_os_error().is_some() => {
            let text = error.to_string();
            text.split(" (os error").next().unwrap_or(&text).to_lowercase()
        }
        _ => error.to_string().replace(['\n', '\r'], " "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().expect("a temporary folder")
    }

    fn names(dir: &Path) -> Vec<String> {
        let mut v: Vec<_> = fs::read_dir(dir)
            .expect("readable")
            .map(|e| e.expect("entry").file_name().to_string_lossy().into_owned())
            .collect();
        v.sort();
        v
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_whole() {
        let d = folder();
        let p = d.path().join("a.txt");
        write_atomic(&p, |w| w.write_all(b"old")).unwrap();
        let e = write_atomic(&p, |w| {
            w.write_all(b"new")?;
            Err(io::Error::other("broken"))
        })
        .unwrap_err();
        assert_eq!(e.exit_code(), 1);
        assert_eq!(fs::read(&p).unwrap(), b"old");
        assert_eq!(names(d.path()), ["a.txt"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_place_is_tried_and_left_as_it_was() {
        let d = folder();
        assert!(check_writable(&d.path().join("a.txt")).is_ok());
        assert!(names(d.path()).is_empty());
        let e = check_writable(Path::new("/proc/a.txt")).unwrap_err();
        assert_eq!(e.exit_code(), 1);
        assert!(e.to_string().contains("the folder /proc takes no files"), "{e}");
    }

    #[test]
    fn a_write_replaces_through_links() {
        let d = folder();
        let (p, link) = (d.path().join("a.txt"), d.path().join("l"));
        fs::write(&p, "old").unwrap();
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&p, &link).unwrap();
            write_atomic(&link, |w| w.write_all(b"new")).unwrap();
            assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
            assert_eq!(fs::read(&p).unwrap(), b"new");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error_and_the_device_survives() {
        let full = Path::new("/dev/full");
        if !full.exists() {
            return;
        }
        for e in [
            write_atomic(full, |w| w.write_all(&[0; 1000])).unwrap_err(),
            write_atomic_seek(full, |w| w.write_all(&[0; 1000])).unwrap_err(),
        ] {
            assert_eq!(e.exit_code(), 1);
            assert!(
                e.to_string().contains("/dev/full: cannot write: no space left on the disk: free some"),
                "{e}"
            );
        }
        assert!(!fs::metadata(full).unwrap().is_file());
    }

    #[test]
    fn a_folder_and_a_missing_folder_are_refused() {
        let d = folder();
        let e = write_atomic(d.path(), |_| Ok(())).unwrap_err();
        assert!(e.to_string().ends_with("cannot write: is a folder"), "{e}");
        let e = write_atomic(&d.path().join("x/y"), |_| Ok(())).unwrap_err();
        assert!(e.to_string().ends_with("no such file or folder"), "{e}");
    }

    #[test]
    fn folders_appear_whole_and_keep_strangers() {
        let d = folder();
        let p = d.path().join("out");
        let put = |text: &'static str| {
            move |t: &Path| {
                fs::create_dir(t.join("s")).unwrap();
                write_atomic(&t.join("s/a"), |w| w.write_all(text.as_bytes()))
            }
        };
        write_dir_atomic(&p, put("1")).unwrap();
        fs::write(p.join("s/mine"), "kept").unwrap();
        write_dir_atomic(&p, put("2")).unwrap();
        assert_eq!(fs::read_to_string(p.join("s/a")).unwrap(), "2");
        assert_eq!(fs::read_to_string(p.join("s/mine")).unwrap(), "kept");
        let failed = write_dir_atomic(&p, |t| {
            fs::write(t.join("b"), "x").unwrap();
            Err(FormatError::Unwritable { path: t.join("b"), why: "broken".into() })
        });
        let expected = format!("{}: cannot write: broken", p.join("b").display());
        assert_eq!(failed.unwrap_err().to_string(), expected);
        assert_eq!(names(&p), ["s"]);
        assert_eq!(names(d.path()), ["out"]);
    }
}
