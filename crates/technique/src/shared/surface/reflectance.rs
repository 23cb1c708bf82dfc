//! A reflectance whose numbers differ from texel to texel, as direct evaluation needs it.

use super::cosine_lobes::{self, Averages};
use crate::Material;
use crate::shared::material::view_table;
use std::sync::Arc;
use steradian_brdf::{SharedBrdf, with_widths};
use steradian_scene::surface::Texture;

/// The reflectance of each point of a surface, from the images that techniques read ([`Material::textures`]).
#[derive(Debug, Clone)]
pub struct TexelReflectance(Numbers);

#[derive(Debug, Clone)]
enum Numbers {
    Lobes(Averages),
    Widths(SharedBrdf, Arc<Texture>),
}

impl TexelReflectance {
    /// The varying reflectance of a material; `None` where it is the same everywhere.
    pub fn of(m: &Material) -> Option<Self> {
        let lobes = cosine_lobes::PLANES.iter().any(|p| m.textures.has(p.name));
        if let (true, Some(own)) = (lobes, cosine_lobes::lobes_of(&*m.brdf)) {
            return Some(Self(Numbers::Lobes(Averages::new(own.kd, &own.lobes, &m.textures))));
        }
        let widths = m.textures.get(view_table::PLANE)?;
        Some(Self(Numbers::Widths(m.brdf.clone(), widths.clone())))
    }

    /// Does it read the images of this parameter?
    pub fn reads(parameter: &str) -> bool {
        parameter == view_table::PLANE || cosine_lobes::PLANES.iter().any(|p| p.name == parameter)
    }

    /// The reflectance at texture coordinates, of no footprint: between texels with the numbers that stand
    /// there.
    pub fn at(&self, uv: [f32; 2]) -> SharedBrdf {
        match &self.0 {
            Numbers::Lobes(lobes) => Arc::new(lobes.reflectance(uv)),
            Numbers::Widths(brdf, texture) => {
                let [x, y, _] = texture.sample(uv[0], uv[1], 0.0).map(f64::from);
                with_widths(&**brdf, [x, y]).unwrap_or_else(|_| brdf.clone())
            }
        }
    }
}
