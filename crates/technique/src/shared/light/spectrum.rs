//! The light's factor of techniques that work with spherical harmonics alone: its coefficients.

use crate::shared::light::distant::refuse_points;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Part};
use steradian_base::Task;
use steradian_light::Lights;
use steradian_prefilter::Source;
use steradian_sphere::sh::{self, ShRgb};

/// Coefficients of distant light: the image's, and those of suns and directional lights in closed form.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Up to the order of the bake, or that of the image's resolution if that is lower.
    pub sh: ShRgb,
}

impl Spectrum {
    /// Analyses everything in `lights` up to `order`; refuses point lights.
    pub fn bake(slug: &'static str, lights: &Lights, order: usize, task: &Task) -> Result<Self, BakeError> {
        Ok(Self { sh: Self::source(slug, lights, order, task)?.coefficients(order) })
    }

    /// The light, prepared; refuses point lights.
    pub fn source(
        slug: &'static str,
        lights: &Lights,
        order: usize,
        task: &Task,
    ) -> Result<Source, BakeError> {
        check(slug, lights, task)?;
        Ok(Source::new(lights, order, task)?)
    }
}

/// Refuses point lights, and images that need more memory than is allowed.
pub(super) fn check(slug: &'static str, lights: &Lights, task: &Task) -> Result<(), BakeError> {
    refuse_points(slug, lights)?;
    if let Some(e) = &lights.environment {
        let texels = (e.image.width * e.image.height) as u64;
        let need = texels * 24;
        if need > task.max_memory() {
            return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
        }
    }
    Ok(())
}

/// Writes coefficients.
pub(super) fn save(sh: &ShRgb, to: &mut TensorFile, prefix: &str) {
    put_f64(to, format!("{prefix}.spectrum"), vec![3, sh::count(sh.order)], sh.c.concat());
}

/// Bytes of coefficients.
pub(super) fn bytes(sh: &ShRgb) -> usize {
    8 * sh.c.iter().map(Vec::len).sum::<usize>()
}

impl Part for Spectrum {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        save(&self.sh, to, prefix);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.spectrum");
        let (shape, v) = get_f64(from, &name, 2)?;
        let order = shape[1].isqrt().saturating_sub(1);
        if shape[0] != 3 || shape[1] != sh::count(order) || order > 2047 {
            return Err(PartError::Unexpected(name));
        }
        let mut channels = v.chunks_exact(shape[1]).map(<[f64]>::to_vec);
        Ok(Self { sh: ShRgb { order, c: std::array::from_fn(|_| channels.next().unwrap_or_default()) } })
    }

    fn bytes(&self) -> usize {
        bytes(&self.sh)
    }
}
