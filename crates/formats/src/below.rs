//! Names that data give: of files in the folder of the file that names them, or below it.

use std::path::{Component, Path, PathBuf};

/// Does `name` stay below its folder, as far as its letters say: neither absolute, nor a URL, nor with `..`?
pub fn stays_below(name: &str) -> bool {
    !name.is_empty()
        && !name.contains("://")
        && Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir))
}

/// The file that `name` means in `folder` or below it; neither its letters nor links may lead out. The error
/// says so.
pub fn file_below(folder: &Path, name: &str) -> Result<PathBuf, String> {
    let path = folder.join(name);
    let root = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let linked_out = match (path.canonicalize(), root.canonicalize()) {
        (Ok(path), Ok(root)) => !path.starts_with(&root),
        // What does not exist is missed where it is opened.
        _ => false,
    };
    if !stays_below(name) {
        Err(format!("'{name}' must be a file below the folder of the file that names it"))
    } else if linked_out {
        Err(format!("'{name}' is a link that leads out of the folder of the file that names it"))
    } else {
        Ok(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neither_letters_nor_links_lead_out() {
        let dir = tempfile::tempdir().unwrap();
        let inner = dir.path().join("scene");
        std::fs::create_dir_all(inner.join("a")).unwrap();
        std::fs::write(dir.path().join("secret"), "s").unwrap();
        std::fs::write(inner.join("a/b,c.csv"), "x").unwrap();
        for good in ["a/b,c.csv", "./a/b,c.csv", "missing"] {
            assert!(file_below(&inner, good).is_ok(), "{good}");
        }
        for bad in ["", "../secret", "a/../../secret", "/etc/passwd", "file:///etc/passwd"] {
            assert!(file_below(&inner, bad).is_err(), "{bad}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../secret", inner.join("link")).unwrap();
            assert!(file_below(&inner, "link").unwrap_err().contains("link that leads out"));
        }
    }
}
