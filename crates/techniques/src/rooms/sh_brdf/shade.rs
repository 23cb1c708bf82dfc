//! The light of a frame, and the sum over coefficients ([`view_table`]); suns on top. Where light or view is
//! static (KSS02 section 4), sites keep the data that depend on it.

use super::ShBrdf;
use super::bake::Fix;
use crate::gpu::{Buffer, Entry, Uniform};
use crate::shared::geometry::transport;
use crate::shared::light::exact::{self, TurnedSuns};
use crate::shared::material::view_table::{self, LightLanes, LocalLight, Places, WorldViews};
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};
use glam::Vec3;
use std::sync::Arc;
use steradian_sphere::sh::Rotation;

/// The light of a frame.
#[derive(Default)]
pub struct Frame {
    view: Option<View>,
    light: Option<LightLanes>,
    shown: TurnedSuns,
    pub(super) kept: Kept,
}

/// Data that sites keep.
#[derive(Default)]
pub(super) enum Kept {
    /// Nothing: light and view change.
    #[default]
    Nothing,
    /// Light in their frames.
    Light(Arc<LocalLight>),
    /// Reflectance towards a viewer, and the radiance of the sites.
    View { eye: Vec3, views: Arc<WorldViews>, radiance: Vec<[f32; 3]> },
}

impl Frame {
    /// Recomputes the data that depend on a light or a viewer that has changed.
    pub(super) fn renew(&mut self, b: &Bake<ShBrdf>, v: &View) {
        let turned = self.view.is_none_or(|old| old.light_rotation != v.light_rotation);
        if turned {
            let l = &b.linked;
            let sh = Rotation::new(l.sh.order, v.light_rotation.as_dmat3()).apply_rgb(&l.sh);
            self.light = Some(LightLanes::new(&b.material.table, &sh));
            self.shown = TurnedSuns::new(&l.suns, v);
        }
        self.view = Some(*v);
        let (Some(light), frames) = (&self.light, &*b.transfer) else { return };
        match b.params.fix() {
            Fix::Nothing => {}
            Fix::Light if turned => {
                let local = LocalLight::turned(frames, light);
                self.kept = Kept::Light(Arc::new(if b.params.halves {
                    local.shortened(&b.material.table)
                } else {
                    local
                }));
            }
            Fix::Light => {}
            Fix::View => {
                let (views, mut radiance) = match std::mem::take(&mut self.kept) {
                    Kept::View { eye, views, radiance } if eye == v.eye => {
                        if !turned {
                            self.kept = Kept::View { eye, views, radiance };
                            return;
                        }
                        (views, radiance)
                    }
                    _ => (Arc::new(WorldViews::new(&b.material.table, frames, v.eye)), Vec::new()),
                };
                views.radiance(light, &mut radiance);
                self.kept = Kept::View { eye: v.eye, views, radiance };
            }
        }
    }
}

pub(super) fn shade(b: &Bake<ShBrdf>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    let m = &b.material;
    let Some(light) = &f.light else { return out.rgb.iter_mut().for_each(|p| p.fill(0.0)) };
    // Points that lie on no mesh are shaded as if nothing were fixed.
    let sited = q.site.index.iter().all(|s| !s.is_empty());
    match &f.kept {
        Kept::Light(local) if sited => view_table::shade_local(&m.table, &b.transfer, local, q, out),
        Kept::View { radiance, .. } if sited => {
            for i in 0..q.len() {
                let at = |s: u32| radiance.get(s as usize).copied().unwrap_or_default();
                let l = transport::gather(q, i, at);
                (0..3).for_each(|c| out.rgb[c][i] = l[c]);
            }
        }
        _ => match &m.places {
            Some(places) => view_table::shade_places(&m.table, places, light, q, out),
            None => view_table::shade(&m.table, light, q, out),
        },
    }
    f.shown.add(Some(&m.brdf), q, out);
}

/// Uniforms of light and turn; those of suns come with [`exact::gpu`].
fn uniforms(f: &Frame) -> Vec<Uniform> {
    let mut all = vec![f.shown.turn.uniform()];
    all.extend(f.light.iter().flat_map(view_table::light_uniforms));
    all
}

pub(super) fn gpu(b: &Bake<ShBrdf>, f: &Frame) -> GpuTechnique {
    let table = &b.material.table;
    let n = table.bands() * table.bands();
    let views = || view_table::views_buffer(table, b.params.halves);
    let places = b.material.places.as_ref();
    let (mut modules, entry, buffers) = match &f.kept {
        Kept::Nothing if let Some(places) = places => {
            (view_table::place_modules(table, places), Entry::SITE, vec![views()])
        }
        Kept::Nothing => (view_table::modules(table), Entry::PLAIN, vec![views()]),
        Kept::Light(local) => {
            let frames = Buffer::new("frames", 6, b.transfer.numbers());
            let light = Buffer::new("light", 3 * n, local.numbers());
            (view_table::local_modules(table), Entry::SITE, vec![views(), frames, light])
        }
        Kept::View { views, .. } => {
            let each = if table.is_mono() { n } else { 3 * n };
            let kept = Buffer::new("reflectance", each, views.numbers());
            (view_table::fixed_modules(table), Entry::SITE, vec![kept])
        }
    };
    modules.push(match &f.kept {
        Kept::Nothing if places.is_some() => include_str!("places.wgsl").into(),
        Kept::Nothing => include_str!("shade.wgsl").into(),
        Kept::Light(_) => include_str!("fixed_light.wgsl").into(),
        Kept::View { .. } => include_str!("fixed_view.wgsl").into(),
    });
    let technique = GpuTechnique {
        slug: ShBrdf::CARD.slug,
        modules,
        entry,
        tables: places.map(Places::table).into_iter().collect(),
        uniforms: uniforms(f),
        buffers,
    };
    exact::gpu(technique, &b.linked.suns, Some(&b.material.brdf))
}

/// The uniforms of a frame, where no buffer changes with it.
pub(super) fn gpu_frame(b: &Bake<ShBrdf>, f: &Frame) -> Option<Vec<Uniform>> {
    matches!(f.kept, Kept::Nothing).then(|| {
        let none = GpuTechnique {
            slug: ShBrdf::CARD.slug,
            modules: Vec::new(),
            entry: Entry::PLAIN,
            tables: Vec::new(),
            uniforms: uniforms(f),
            buffers: Vec::new(),
        };
        exact::gpu(none, &b.linked.suns, Some(&b.material.brdf)).uniforms
    })
}
