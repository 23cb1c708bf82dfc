//! Textures in saved bakes. A bake saves the textures that it was made from, so that loading can make its
//! data from them again.

use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use std::sync::Arc;
use steradian_scene::surface::{Planes, Texture, Wrap};

/// Prefix of metadata keys that give a texture's wrap modes.
const WRAP: &str = "steradian.wrap.";

fn word(w: Wrap) -> &'static str {
    match w {
        Wrap::Repeat => "repeat",
        Wrap::Mirror => "mirror",
        Wrap::Clamp => "clamp",
    }
}

fn wrap(word: &str) -> Option<Wrap> {
    [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].into_iter().find(|w| self::word(*w) == word)
}

/// Writes the finest levels of textures under their names with `prefix` before them.
pub fn put(to: &mut TensorFile, prefix: &str, planes: &Planes) {
    for (name, t) in planes.iter() {
        let Some((width, height, texels)) = t.levels().next() else { continue };
        let data = texels.iter().flatten().copied().collect();
        put_f32(to, format!("{prefix}{name}"), vec![height, width, 3], data);
        let [u, v] = t.wrap().map(word);
        to.metadata.insert(format!("{WRAP}{name}"), format!("{u} {v}"));
    }
}

/// The textures that [`put`] wrote.
pub fn planes(from: &TensorFile, prefix: &str) -> Result<Planes, PartError> {
    let mut out = Planes::default();
    for key in from.tensors.keys().filter(|k| k.starts_with(prefix)) {
        let unexpected = || PartError::Unexpected(key.clone());
        let name = &key[prefix.len()..];
        let (shape, data) = get_f32(from, key, 3)?;
        let [height, width, 3] = shape[..] else { return Err(unexpected()) };
        let words = from.metadata.get(&format!("{WRAP}{name}")).ok_or_else(unexpected)?;
        let (u, v) = words.split_once(' ').ok_or_else(unexpected)?;
        let (u, v) = wrap(u).zip(wrap(v)).ok_or_else(unexpected)?;
        let channels = [0, 1, 2].map(|c| data.iter().skip(c).step_by(3).copied().collect());
        let texture = Texture::new(width, height, &channels).ok_or_else(unexpected)?;
        out = out.with(name, Arc::new(texture.with_wrap([u, v])));
    }
    Ok(out)
}
