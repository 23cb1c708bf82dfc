//! Shadows that several pictures have in common.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};
use steradian_render::LobeShadow;
use steradian_scene::{Bvh, Mesh};

/// Shadows of one scene in one light, by reflectance, that several pictures of it have in common.
#[derive(Default)]
pub(crate) struct CommonShadows {
    shares: Mutex<BTreeMap<String, Arc<LobeShadow>>>,
    bvh: OnceLock<Arc<Bvh>>,
}

impl CommonShadows {
    pub(super) fn of(&self, spec: String, make: impl FnOnce() -> LobeShadow) -> Arc<LobeShadow> {
        let mut made = self.shares.lock().expect("nobody panics in between");
        made.entry(spec).or_insert_with(|| Arc::new(make())).clone()
    }

    /// The hierarchy of the scene's mesh.
    pub(super) fn bvh(&self, mesh: &Mesh) -> Arc<Bvh> {
        self.bvh.get_or_init(|| Arc::new(Bvh::build(mesh))).clone()
    }
}
