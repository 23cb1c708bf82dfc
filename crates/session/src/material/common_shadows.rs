//! Shadows that several pictures have in common.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use steradian_render::LobeShadow;

/// Shadows of one scene in one light, by reflectance, that several pictures of it have in common.
#[derive(Default)]
pub(crate) struct CommonShadows(Mutex<BTreeMap<String, Arc<LobeShadow>>>);

impl CommonShadows {
    pub(super) fn of(&self, spec: String, make: impl FnOnce() -> LobeShadow) -> Arc<LobeShadow> {
        let mut made = self.0.lock().expect("nobody panics in between");
        made.entry(spec).or_insert_with(|| Arc::new(make())).clone()
    }
}
