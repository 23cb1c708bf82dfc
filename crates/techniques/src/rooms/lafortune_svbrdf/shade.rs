//! The lobes as text for a GPU; what looks them up and sums them is shared
//! ([`crate::shared::surface::cosine_lobes`]), and `shade.wgsl` has the same functions.

use crate::local::LocalText;
use crate::shared::surface::cosine_lobes::CosineLobes;
use steradian_brdf::wgsl::scoped;

pub(super) fn text(t: &CosineLobes) -> LocalText {
    let lobes = t.text("local_lobes");
    LocalText {
        // Names are prefixed: a technique for environments in the same shader may contain the same lobes.
        module: (scoped("local", &lobes.module) + include_str!("shade.wgsl")).into(),
        tables: vec![lobes.table],
        uniforms: lobes.uniforms,
        buffers: Vec::new(),
    }
}
