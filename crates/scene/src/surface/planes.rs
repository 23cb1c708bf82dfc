//! Named parameter textures.

use super::Texture;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Textures by name, each a parameter of a reflectance that varies over the surface; techniques that read
/// them define the meaning of the names.
#[derive(Debug, Clone, Default)]
pub struct Planes(BTreeMap<String, Arc<Texture>>);

impl Planes {
    /// The planes with one more, which replaces one of the same name.
    #[must_use]
    pub fn with(mut self, name: &str, texture: Arc<Texture>) -> Self {
        self.0.insert(name.to_owned(), texture);
        self
    }

    /// The plane of a name.
    pub fn get(&self, name: &str) -> Option<&Arc<Texture>> {
        self.0.get(name)
    }

    /// Is there a plane of this name, or are there planes called NAME.0, NAME.1 and so on?
    pub fn has(&self, name: &str) -> bool {
        let part =
            |n: &String| n.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
        self.0.keys().any(part)
    }

    /// Names and planes in the order of the names.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Arc<Texture>)> {
        self.0.iter().map(|(name, t)| (name.as_str(), t))
    }

    /// Are there none?
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
