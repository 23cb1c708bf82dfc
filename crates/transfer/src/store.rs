//! Finished parts of a computation in a file next to its output, so that an interrupted computation resumes.
//!
//! The file begins with a key, the digest of everything that the parts depend on; a file with another key is
//! overwritten. Parts follow in the order in which they were finished, each with its length, a checksum and
//! its number; an incomplete part at the end is cut off. [`crate::transfer`] keeps blocks of sites.

use crate::TransferError;
use crate::direct::Block;
use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use steradian_base::Input;

/// Bytes of the key at the beginning of the file.
const KEY: usize = 64;

/// The file of finished parts.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    found: HashMap<u64, Vec<u8>>,
    file: Mutex<File>,
}

impl Store {
    /// Opens the file next to `output`, and reads its parts of the computation `key`, 64 characters.
    pub fn open(output: &Path, key: &str) -> Result<Self, TransferError> {
        let mut name = output.file_name().unwrap_or_default().to_os_string();
        name.push(".part");
        let path = output.with_file_name(name);
        let fault = |e: std::io::Error| fault(&path, &e);
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(fault)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(fault)?;
        let mut key = key.as_bytes().to_vec();
        key.resize(KEY, b' ');
        let (mut found, mut end) = (HashMap::new(), KEY);
        if bytes.len() >= KEY && bytes[..KEY] == key {
            while let Some((number, part, next)) = record(&bytes, end) {
                found.insert(number, part.to_vec());
                end = next;
            }
        } else {
            file.set_len(0).map_err(fault)?;
            file.seek(SeekFrom::Start(0)).map_err(fault)?;
            file.write_all(&key).map_err(fault)?;
        }
        file.set_len(end as u64).map_err(fault)?;
        file.seek(SeekFrom::Start(end as u64)).map_err(fault)?;
        Ok(Self { path, found, file: Mutex::new(file) })
    }

    /// Parts that were there already.
    pub fn found(&self) -> usize {
        self.found.len()
    }

    /// Removes the file, once the result is written.
    pub fn finish(self) -> Result<(), TransferError> {
        std::fs::remove_file(&self.path).map_err(|e| fault(&self.path, &e))
    }

    /// A part that was there already.
    pub fn read(&self, number: u64) -> Option<&[u8]> {
        self.found.get(&number).map(Vec::as_slice)
    }

    /// Keeps a finished part.
    pub fn write(&self, number: u64, part: &[u8]) -> Result<(), TransferError> {
        let body = [&number.to_le_bytes()[..], part].concat();
        let mut bytes = (body.len() as u32).to_le_bytes().to_vec();
        bytes.extend(checksum(&body));
        bytes.extend(body);
        let mut file = self.file.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        file.write_all(&bytes).map_err(|e| fault(&self.path, &e))
    }
}

fn fault(path: &Path, e: &std::io::Error) -> TransferError {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    TransferError::Store { path: name, why: e.to_string() }
}

fn checksum(body: &[u8]) -> [u8; 8] {
    let text = Input::of(Path::new(""), body).sha256;
    let mut out = [0; 8];
    out.iter_mut().zip(text.bytes()).for_each(|(o, b)| *o = b);
    out
}

/// The part at `at`, and where the next begins; `None` where it is not whole.
fn record(bytes: &[u8], at: usize) -> Option<(u64, &[u8], usize)> {
    let length = u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?) as usize;
    let body = bytes.get(at + 12..)?.get(..length)?;
    if bytes[at + 4..at + 12] != checksum(body) {
        return None;
    }
    let (number, part) = body.split_first_chunk()?;
    Some((u64::from_le_bytes(*number), part, at + 12 + length))
}

impl Block {
    /// The block as a part.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut out = self.rays.to_le_bytes().to_vec();
        out.extend((self.enclosed.len() as u32).to_le_bytes());
        self.enclosed.iter().for_each(|i| out.extend(i.to_le_bytes()));
        self.values.iter().for_each(|x| out.extend(x.to_le_bytes()));
        out
    }

    /// Reads what [`Block::to_bytes`] returns; `None` where it is not whole.
    pub(crate) fn from_bytes(part: &[u8]) -> Option<Self> {
        let rays = u64::from_le_bytes(*part.first_chunk()?);
        let enclosed = u32::from_le_bytes(*part.get(8..)?.first_chunk()?) as usize;
        let (words, rest) = part.get(12..)?.as_chunks::<4>();
        if !rest.is_empty() {
            return None;
        }
        Some(Self {
            enclosed: words.get(..enclosed)?.iter().map(|w| u32::from_le_bytes(*w)).collect(),
            values: words[enclosed..].iter().map(|w| f32::from_le_bytes(*w)).collect(),
            rays,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_parts_are_found_again_and_torn_ones_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("out.safetensors");
        let block = |k: u32| Block { values: vec![k as f32; 5], enclosed: vec![k; k as usize], rays: 7 };
        let store = Store::open(&output, "key").unwrap();
        for k in 0..4 {
            store.write(k.into(), &block(k).to_bytes()).unwrap();
        }
        drop(store);
        let part = folder.path().join("out.safetensors.part");
        let bytes = std::fs::read(&part).unwrap();
        std::fs::write(&part, &bytes[..bytes.len() - 3]).unwrap();
        let store = Store::open(&output, "key").unwrap();
        let of = |store: &Store, k: u64| store.read(k).and_then(Block::from_bytes);
        assert_eq!((store.found(), of(&store, 2), of(&store, 3)), (3, Some(block(2)), None));
        store.write(3, &block(3).to_bytes()).unwrap();
        drop(store);
        assert_eq!(of(&Store::open(&output, "key").unwrap(), 3), Some(block(3)));
        assert_eq!(Store::open(&output, "other").unwrap().found(), 0);
        let store = Store::open(&output, "key").unwrap();
        assert_eq!(store.found(), 0, "another computation has begun the file anew");
        store.finish().unwrap();
        assert!(!part.exists());
    }
}
