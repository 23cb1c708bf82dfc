//! Opening files to read.

use std::fs::{File, Metadata};
use std::io;
use std::path::Path;

/// Opens the regular file `path` to read, and says how many bytes it has. Whatever else has a name is refused
/// before it is opened: a device may have no end, and opening a pipe waits for whoever writes to it.
pub fn open_file(path: &Path) -> io::Result<(File, u64)> {
    regular(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    // The name may have come to mean something else in between.
    let found = file.metadata()?;
    regular(&found)?;
    Ok((file, found.len()))
}

fn regular(found: &Metadata) -> io::Result<()> {
    if found.is_file() {
        return Ok(());
    }
    if found.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    Err(io::Error::other("is a device, a pipe or a socket, not a file"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_are_opened() {
        let own = Path::new(env!("CARGO_MANIFEST_DIR"));
        assert!(open_file(&own.join("Cargo.toml")).expect("a file").1 > 0);
        assert_eq!(open_file(own).unwrap_err().kind(), io::ErrorKind::IsADirectory);
        assert_eq!(open_file(&own.join("none")).unwrap_err().kind(), io::ErrorKind::NotFound);
        #[cfg(unix)]
        assert!(open_file(Path::new("/dev/zero")).unwrap_err().to_string().contains("device"));
    }
}
