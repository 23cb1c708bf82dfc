//! GPU data of a stage and its baked surfaces.

use crate::Prepared;
use glam::{Affine3A, Mat3};
use std::sync::Arc;
use steradian_gpu::scene::{self, Level, Object, Scene, Triangles};
use steradian_reference::path::PathScene;
use steradian_render::{Background, Stage};
use steradian_scene::shadow::{Flat, Volumes};
use steradian_sphere::SphereImage;
use steradian_techniques::GpuTechnique;
use steradian_techniques::direct::Direct;
use steradian_techniques::gpu::shadow;
use steradian_techniques::local::beside;

/// The lights that surfaces are shaded with in addition to their techniques: surfaces that fold suns into
/// their data have only the point lights.
fn lights(baked: &[Prepared]) -> Direct {
    let all = || baked.iter().map(|b| &b.direct.1);
    all().find(|d| has_suns(d)).or_else(|| all().find(|d| !d.is_empty())).cloned().unwrap_or_default()
}

pub fn has_suns(d: &Direct) -> bool {
    !(d.disks.is_empty() && d.directionals.is_empty())
}

/// Why the GPU cannot shade these additional lights, if it cannot.
pub fn unlit(baked: &[Prepared]) -> Option<String> {
    let local = |b: &Prepared| b.material.local.clone();
    if baked.iter().any(|b| local(b) != baked.first().and_then(local)) {
        return Some("materials that differ in their technique for local light are for the CPU".into());
    }
    if let Some(b) = baked.iter().find(|b| b.local.as_ref().is_some_and(|l| l.gpu().is_none())) {
        return Some(format!("{} has no GPU text for local light", b.direct.0.spec()));
    }
    if baked.iter().any(|b| b.lobe) {
        return Some("rays over the lobe that shadow all light are for the CPU".into());
    }
    if baked.iter().any(|b| b.blocker.as_ref().is_some_and(|s| !s.is_portable())) {
        return Some(
            "more than 16 million triangles or texels that shadow, and shadow volumes of more than 64 lights, are for the \
             CPU"
                .into(),
        );
    }
    let deaf = |b: &&Prepared| {
        b.shadowed && b.local.as_ref().and_then(|l| l.gpu()).is_some_and(|l| !shadow::knows_shadows(&l))
    };
    if let Some(b) = baked.iter().find(deaf) {
        let local = local(b).map(|l| l.label()).unwrap_or_default();
        return Some(format!("{local} has no GPU text for shadows of local light"));
    }
    let without = baked.iter().find(|b| !b.direct.1.is_empty() && b.direct.0.shader().is_none());
    without.map(|b| format!("{} has no GPU text for disks and points", b.direct.0.spec()))
}

/// The GPU technique of a baked material.
pub fn technique(b: &Prepared) -> Option<GpuTechnique> {
    let bake = &b.bake.as_ref()?.0;
    let varied = if b.surface.maps.is_empty() { None } else { bake.gpu_varied() };
    Some(varied.unwrap_or_else(|| bake.gpu()))
}

/// The shadow volumes of all surfaces, in place of those of each: they are drawn once, and surfaces that fold
/// suns into their data are lit by fewer lights than others.
fn volumes(flats: &mut [Option<Flat>]) -> Option<Arc<Volumes>> {
    fn of(flat: &mut Option<Flat>) -> Option<&mut Arc<Volumes>> {
        match flat {
            Some(Flat::Volumes(v)) => Some(v),
            _ => None,
        }
    }
    let each: Vec<_> = flats.iter_mut().filter_map(of).map(|v| v.clone()).collect();
    let all = each.into_iter().reduce(|all, v| all.joined(&v))?;
    flats.iter_mut().filter_map(of).for_each(|v| *v = all.clone());
    Some(all)
}

/// One object per material slot that has triangles.
#[cfg(feature = "gpu")]
pub fn scene(stage: &Stage<'_>, baked: &[Prepared]) -> Scene {
    scene_by(stage, baked, technique)
}

/// One object per material slot that has triangles, shaded by `technique` of its material.
pub fn scene_by(
    stage: &Stage<'_>,
    baked: &[Prepared],
    technique: impl Fn(&Prepared) -> Option<GpuTechnique>,
) -> Scene {
    let (last, direct) = (baked.len().saturating_sub(1), lights(baked));
    let flat = |b: &Prepared| b.blocker.as_ref().and_then(|blocker| blocker.flat());
    let mut flats: Vec<Option<Flat>> = baked.iter().map(flat).collect();
    let volumes = volumes(&mut flats);
    let object = |(k, b): (usize, &Prepared)| {
        let triangles = Triangles::of(stage.mesh, |slot| (slot as usize).min(last) == k);
        let technique = technique(b)?;
        let maps = &b.surface.maps;
        let technique = match b.local.as_ref().and_then(|l| l.gpu()) {
            Some(local) => beside(technique, local),
            None => technique,
        };
        let technique = match &flats[k] {
            Some(by) => shadow::behind(technique, by, PathScene::OFFSET as f32),
            None => technique,
        };
        let triangles = Arc::new(triangles);
        (!triangles.indices.is_empty()).then_some(Object {
            triangles,
            technique,
            brdf: if b.direct.1.is_empty() { None } else { b.direct.0.shader() },
            folds_suns: !has_suns(&b.direct.1),
            base_colour: b.surface.base_colour.clone(),
            maps: maps.clone(),
            transform: Affine3A::IDENTITY,
        })
    };
    Scene {
        objects: baked.iter().enumerate().filter_map(object).collect(),
        direct,
        volumes,
        backdrop: backdrop(stage.background),
        camera: stage.camera,
        light_rotation: Mat3::IDENTITY,
    }
}

pub fn backdrop(background: &Background) -> scene::Backdrop {
    match background {
        Background::Colour(colour) => scene::Backdrop { colour: *colour, ..Default::default() },
        Background::Sky(sky) => {
            let disk = |&(direction, cosine, radiance): &(glam::Vec3, f32, [f32; 3])| scene::Disk {
                direction,
                angular_radius: cosine.clamp(-1.0, 1.0).acos(),
                radiance,
            };
            scene::Backdrop {
                colour: [0.0; 3],
                image: sky.image().map(level),
                disks: sky.disks().iter().map(disk).collect(),
            }
        }
    }
}

fn level(i: &SphereImage) -> Level {
    let texels = (0..i.width * i.height).map(|k| [i.planes[0][k], i.planes[1][k], i.planes[2][k]]);
    Level { width: i.width, height: i.height, texels: texels.collect() }
}
