//! The light's factor of techniques that take distant light only.

use crate::tensors::{PartError, TensorFile, get_f32, get_f64, put_f32, put_f64};
use crate::{BakeError, Part};
use glam::DVec3;
use std::sync::{Arc, OnceLock};
use steradian_base::{Cancelled, Task};
use steradian_light::{Environment, Lights};
use steradian_prefilter::source::{MAX_HEIGHT, reduced};
use steradian_prefilter::{EdgeCube, SmallLight, Source, Tree};
use steradian_sphere::{Layout, SphereImage};

/// Highest band of the spectrum that light is analysed to; sharper kernels are filtered in angular space.
pub const ORDER: usize = 255;

/// Distant light, prepared for filtering and for exact evaluation.
pub struct DistantLight {
    /// The light split into a base image and small lights; made when it is first needed, since shading does
    /// not need it.
    source: OnceLock<Source>,
    /// Highest band of its spectrum.
    order: usize,
    /// Hierarchy of the unfiltered light, against which errors are measured: all texels of the image as
    /// given, constant over their cells, and the small lights.
    pub tree: Tree,
    /// The image as it came.
    image: Option<Arc<Environment>>,
    /// Disks and directional lights in addition to the image.
    small: Vec<SmallLight>,
}

impl DistantLight {
    /// Prepares everything in `lights`; refuses point lights.
    pub fn bake(slug: &'static str, lights: &Lights, order: usize, task: &Task) -> Result<Self, BakeError> {
        refuse_points(slug, lights)?;
        if let Some(e) = &lights.environment {
            let texels = (e.image.width * e.image.height) as u64;
            // The hierarchy with its copy of the image, and the reduced image with its split.
            let need = texels * (12 + 16) + (2048 * 1024).min(texels) * (12 + 12);
            if need > task.max_memory() {
                return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
            }
        }
        Ok(Self::of(lights, order, task)?)
    }

    /// Radiance from direction `d`: the texel that contains it, and the disks that do.
    pub fn radiance(&self, d: DVec3) -> [f64; 3] {
        let mut l = self.image.as_ref().map_or([0.0; 3], |e| e.image.nearest(d).map(f64::from));
        // Directions nearer than the radius have a shorter chord.
        let within = |b: &&SmallLight| {
            b.radius > 0.0 && b.direction.distance_squared(d) < 4.0 * (0.5 * b.radius).sin().powi(2)
        };
        for b in self.small.iter().filter(within) {
            let omega = 4.0 * std::f64::consts::PI * (0.5 * b.radius).sin().powi(2);
            (0..3).for_each(|c| l[c] += b.flux[c] / omega);
        }
        l
    }

    /// The light split into a base image and small lights.
    pub fn source(&self) -> &Source {
        self.source.get_or_init(|| {
            let image = self.image.as_ref().map(|e| reduced(&e.image, MAX_HEIGHT));
            Source::of(image, self.small.clone(), self.order, &Task::quiet())
                .expect("nobody cancels a quiet task")
        })
    }

    /// Replaces [`DistantLight::source`] by one of more or fewer bands.
    pub fn set_source(&mut self, source: Source) {
        self.order = source.order();
        self.source = OnceLock::from(source);
    }

    /// The light itself as texel means of a cube of `size` intervals an edge, small lights spread over
    /// texels.
    pub fn mirror(&self, size: usize) -> EdgeCube {
        let dark = || EdgeCube::from_fn(size, |_| [0.0; 3]);
        let mut cube = self.source().base.as_ref().map_or_else(dark, |i| EdgeCube::from_image(i, size));
        self.source().small_lights.iter().for_each(|b| cube.add(b));
        cube
    }

    fn of(lights: &Lights, order: usize, task: &Task) -> Result<Self, Cancelled> {
        let source = Source::new(lights, order, task)?;
        let (image, small) = (lights.environment.clone(), small(lights));
        let tree = Tree::new(image.as_ref().map(|e| &e.image), &small, task)?;
        Ok(Self { source: OnceLock::from(source), order, tree, image, small })
    }
}

/// The disks and directional lights.
pub fn small(lights: &Lights) -> Vec<SmallLight> {
    let disks = lights.disks.iter().map(SmallLight::from);
    disks.chain(lights.directionals.iter().map(SmallLight::from)).collect()
}

/// The hierarchy of distant light as it is.
pub fn tree(lights: &Lights, task: &Task) -> Result<Tree, Cancelled> {
    Tree::new(lights.environment.as_ref().map(|e| &e.image), &small(lights), task)
}

/// Environment maps have no place for point lights.
pub fn refuse_points(slug: &'static str, lights: &Lights) -> Result<(), BakeError> {
    if lights.points.is_empty() {
        return Ok(());
    }
    let why = "takes distant light only (environment, disks, directional lights), not point lights".into();
    Err(BakeError::Light { slug, why })
}

impl Part for DistantLight {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        // Saves the image at the size to which filters reduce it: loading then finds the same small lights in
        // it.
        let image = self.image.as_ref().map(|e| reduced(&e.image, MAX_HEIGHT));
        save_plain(image.as_ref(), &self.small, to, prefix);
        put_f64(to, format!("{prefix}.order"), vec![1], vec![self.order as f64]);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let (base, small) = load_plain(from, prefix)?;
        let name = format!("{prefix}.order");
        let (_, order) = get_f64(from, &name, 1)?;
        let order = order.first().copied().filter(|o| (0.0..=2047.0).contains(o));
        let order = order.ok_or_else(|| PartError::Unexpected(name.clone()))?;
        let task = Task::quiet();
        let cancelled = |_| PartError::Unexpected(name.clone());
        let tree = Tree::new(base.as_ref(), &small, &task).map_err(cancelled)?;
        let image = base.map(|image| Arc::new(Environment { image }));
        Ok(Self { source: OnceLock::new(), order: order as usize, tree, image, small })
    }

    fn bytes(&self) -> usize {
        // A light that was read is as small as its base image.
        let sides = match self.source.get() {
            Some(s) => s.base.as_ref().map(|b| (b.width, b.height)),
            None => self.image.as_ref().map(|e| (e.image.width, e.image.height)),
        };
        sides.map_or(0, |(width, height)| 12 * width * height) + 56 * self.small.len()
    }

    fn kept_light(&self) -> Option<&Tree> {
        Some(&self.tree)
    }
}

/// Writes an image and the small lights in addition to it.
pub fn save_plain(image: Option<&SphereImage>, small: &[SmallLight], to: &mut TensorFile, prefix: &str) {
    if let Some(image) = image {
        put_f32(to, format!("{prefix}.base"), vec![3, image.height, image.width], image.planes.concat());
    }
    let small_light = |b: &SmallLight| {
        [b.direction.x, b.direction.y, b.direction.z, b.radius, b.flux[0], b.flux[1], b.flux[2]]
    };
    let small_lights = small.iter().flat_map(small_light).collect();
    put_f64(to, format!("{prefix}.small_lights"), vec![small.len(), 7], small_lights);
}

/// Reads an image and small lights that [`save_plain`] wrote.
pub fn load_plain(
    from: &TensorFile,
    prefix: &str,
) -> Result<(Option<SphereImage>, Vec<SmallLight>), PartError> {
    let name = format!("{prefix}.base");
    let base = if from.tensors.contains_key(&name) { Some(load_base(from, &name)?) } else { None };
    Ok((base, load_small_lights(from, &format!("{prefix}.small_lights"))?))
}

fn load_base(from: &TensorFile, name: &str) -> Result<SphereImage, PartError> {
    let (shape, v) = get_f32(from, name, 3)?;
    if shape[0] != 3 || shape[1] == 0 || shape[2] == 0 {
        return Err(PartError::Unexpected(name.into()));
    }
    let (height, width) = (shape[1], shape[2]);
    let mut planes = v.chunks(width * height).map(<[f32]>::to_vec);
    let planes = std::array::from_fn(|_| planes.next().unwrap_or_default());
    Ok(SphereImage { layout: Layout::LatLong, width, height, planes })
}

fn load_small_lights(from: &TensorFile, name: &str) -> Result<Vec<SmallLight>, PartError> {
    let (shape, v) = get_f64(from, name, 2)?;
    if shape[1] != 7 {
        return Err(PartError::Unexpected(name.into()));
    }
    let small_light = |b: &[f64]| SmallLight {
        direction: DVec3::new(b[0], b[1], b[2]).normalize_or(DVec3::Y),
        radius: b[3],
        flux: [b[4], b[5], b[6]],
        cell: None,
    };
    Ok(v.chunks_exact(7).map(small_light).collect())
}
