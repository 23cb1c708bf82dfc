//! Where an output comes from; written into every file that a command makes.

use sha2::{Digest, Sha256};
use std::path::Path;

/// One input of an output: its name without directories, and its SHA-256.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// File name without directories.
    pub name: String,
    /// SHA-256 of the bytes, in hexadecimal.
    pub sha256: String,
}

impl Input {
    /// The input `name` (directories are dropped) with these bytes.
    pub fn of(path: &Path, bytes: &[u8]) -> Self {
        Self { name: file_name(path), sha256: hex(&Sha256::digest(bytes)) }
    }

    /// The input at `path`, hashed in pieces.
    pub fn of_file(path: &Path) -> std::io::Result<Self> {
        let (mut file, _) = crate::open_file(path)?;
        let mut hash = Hash::default();
        std::io::copy(&mut file, &mut hash)?;
        Ok(Self { name: file_name(path), sha256: hash.hex() })
    }
}

/// SHA-256 of all that is written to it.
#[derive(Clone, Default)]
pub struct Hash(Sha256);

impl Hash {
    /// The digest of what was written so far, in hexadecimal.
    pub fn hex(self) -> String {
        hex(&self.0.finalize())
    }
}

impl std::io::Write for Hash {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Version, arguments, inputs and reached error of one output.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Provenance {
    /// Version of Steradian.
    pub version: String,
    /// The command's arguments; paths appear without directories.
    pub arguments: Vec<String>,
    /// The inputs.
    pub inputs: Vec<Input>,
    /// The certificate in words, where there is one.
    pub error: Option<String>,
}

impl Provenance {
    /// This version of Steradian, called with `arguments`.
    pub fn new(arguments: impl IntoIterator<Item = String>) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            arguments: arguments.into_iter().map(|a| without_folders(&a)).collect(),
            inputs: Vec::new(),
            error: None,
        }
    }

    /// Key and value pairs for a file's metadata.
    pub fn pairs(&self) -> Vec<(String, String)> {
        let mut out = vec![
            ("steradian.version".into(), self.version.clone()),
            ("steradian.arguments".into(), self.arguments.join(" ")),
        ];
        for i in &self.inputs {
            out.push((format!("steradian.input.{}", i.name), format!("sha256:{}", i.sha256)));
        }
        if let Some(e) = &self.error {
            out.push(("steradian.error".into(), e.clone()));
        }
        out
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| "?".into(), |n| n.to_string_lossy().into_owned())
}

/// An argument or a spec without the folders of the files that it names.
///
/// `a/b/c.hdr` → `c.hdr`; `merl:x/y.binary` → `merl:y.binary`; `lafortune:lobes=x/l.csv` →
/// `lafortune:lobes=l.csv`; triples such as `f0=1/0.8/0.3` and other arguments stay whole.
pub fn without_folders(argument: &str) -> String {
    if argument.contains('=') {
        argument.split(',').map(strip_value).collect::<Vec<_>>().join(",")
    } else {
        strip_value(argument)
    }
}

/// The value behind the last `=` or `:`, without directories where it is a path.
fn strip_value(part: &str) -> String {
    let start = part.rfind(['=', ':']).map_or(0, |i| i + 1);
    let (head, value) = part.split_at(start);
    let mut pieces = value.split(['/', '\\']);
    let triple = pieces.clone().all(|p| p.parse::<f64>().is_ok());
    match pieces.next_back() {
        Some(name) if !triple => format!("{head}{name}"),
        _ => part.into(),
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directories_do_not_leave_the_machine() {
        for (argument, kept) in [
            ("/home/me/a.hdr", "a.hdr"),
            ("merl:/data/gold.binary", "merl:gold.binary"),
            ("lafortune:lobes=../x/l.csv", "lafortune:lobes=l.csv"),
            (r"C:\Users\me, you\a.exr", "C:a.exr"),
            ("ggx:alpha=0.2,f0=1/0.8/0.3", "ggx:alpha=0.2,f0=1/0.8/0.3"),
            ("sky:elevation=35,azimuth=120", "sky:elevation=35,azimuth=120"),
            ("front.hdr,back.hdr", "front.hdr,back.hdr"),
        ] {
            assert_eq!(without_folders(argument), kept);
        }
    }

    #[test]
    fn sha256_of_the_empty_input() {
        let i = Input::of(Path::new("d/e.bin"), b"");
        assert_eq!(i.name, "e.bin");
        assert!(i.sha256.starts_with("e3b0c44298fc1c149afbf4c8996fb924"));
    }
}
