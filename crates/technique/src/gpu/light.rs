//! Data that are filtered light and nothing else: a device that has another light can make them anew.

use super::{GpuTechnique, Shape};
use steradian_prefilter::{GgxMirror, Lobe, Zonal};

/// The kernel that light is filtered with: ∫ L w / ∫ w over the lobe about each direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kernel {
    /// The light itself.
    Mirror,
    /// The split sum's: D(n·h)/4 ⟨n·wi⟩ with n = wo = r (Karis 2013), alpha = perceptual_roughness².
    Ggx {
        /// α, 0 < α ≤ 1.
        alpha: f64,
    },
    /// Phong's cos^n over the hemisphere (STAR04 eq. 25).
    Phong {
        /// The exponent, ≥ 1.
        n: f64,
    },
    /// The spherical Gaussian exp((cos θ − 1)/σ²) over the whole sphere (Green, Kautz & Durand 2007).
    Gaussian {
        /// σ, radians.
        sigma: f64,
    },
    /// ⟨cos⟩: irradiance over π; a gain of π gives E.
    Lambert,
}

impl Kernel {
    /// The kernel as the CPU's filter has it; `None` for a mirror.
    pub fn zonal(self) -> Option<Box<dyn Zonal>> {
        match self {
            Self::Mirror => None,
            Self::Ggx { alpha } => Some(Box::new(GgxMirror::new(alpha))),
            Self::Phong { n } => Some(Box::new(Lobe::phong(n))),
            Self::Gaussian { sigma } => Some(Box::new(Lobe::spherical_gaussian(sigma))),
            Self::Lambert => Some(Box::new(Lobe::lambert())),
        }
    }
}

/// Cubes of filtered light in a table of shape [`super::Shape::EdgeCube`] or [`super::Shape::EdgeCubeChain`].
#[derive(Debug, Clone, PartialEq)]
pub struct LightCube {
    /// The table's name.
    pub table: &'static str,
    /// The kernel of each level, and the factor on its values; `None` where the material never looks the
    /// level up.
    pub levels: Vec<Option<(Kernel, f32)>>,
}

/// Everything of a technique's data that depends on distant light.
#[derive(Debug, Clone, PartialEq)]
pub struct LightTables {
    /// The cubes of filtered light.
    pub cubes: Vec<LightCube>,
    /// Where the `mat4x4` uniforms [`LightTables::QUADRICS`] hold nᵀMn = gain · E(n) of bands 0 to 2
    /// (Ramamoorthi & Hanrahan 2001), the gain of each channel.
    pub irradiance: Option<[f32; 3]>,
}

impl LightTables {
    /// The uniforms of irradiance, by channel.
    pub const QUADRICS: [&str; 3] = ["red", "green", "blue"];

    /// Blackens the levels of `technique` that its material never looks up: black packs to nothing.
    pub fn blacken_unused(&self, technique: &mut GpuTechnique) {
        for cube in &self.cubes {
            let Some(t) = technique.tables.iter_mut().find(|t| t.name == cube.table) else { continue };
            let Shape::EdgeCubeChain(places) = &t.shape else { continue };
            let (width, height, texel) = (t.level.width, t.level.height, t.format.bytes());
            let unused = places.iter().zip(&cube.levels).filter(|(_, used)| used.is_none());
            for [x, y, size] in unused.map(|(place, _)| place.map(|n| n as usize)) {
                for row in (0..t.level.layers).flat_map(|face| (y..=y + size).map(move |r| face * height + r))
                {
                    let at = (row * width + x) * texel;
                    t.level.bytes[at..at + (size + 1) * texel].fill(0);
                }
            }
        }
    }

    /// One cube of one level.
    pub fn cube(table: &'static str, kernel: Kernel, gain: f32) -> LightCube {
        LightCube { table, levels: vec![Some((kernel, gain))] }
    }
}
