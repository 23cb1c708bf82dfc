//! The reflectance's factor of techniques that shade the light that reaches a site
//! ([`crate::shared::geometry::matrices`]): Phong's lobe, which is a convolution at the mirror direction and
//! needs no table, or any reflectance by its coefficients over the view (Sloan, Kautz & Snyder 2002, section
//! 4.2; STAR04 eqs 53 and 54).

use crate::certify;
use crate::gpu::Buffer;
use crate::shared::geometry::matrices::{Below, padded};
use crate::shared::geometry::site_sum::{self, Vectors};
use crate::shared::light::sh_light::{self, ShLight};
use crate::shared::material::phong_lobe::PhongLobe;
use crate::shared::material::view_table::{self, BANDS, Views};
use crate::shared::maths::harmonics::{self, Harmonics};
use crate::tensors::{PartError, TensorFile};
use crate::{BakeError, Material, Part, Points, Radiance};
use std::borrow::Cow;
use steradian_base::{Elevation, Task};
use steradian_brdf::Brdf;

/// The form in which a reflectance is stored.
pub enum Glossy {
    /// Phong's lobe.
    Lobe(PhongLobe),
    /// A table over the view.
    Table(Box<Views>),
}

/// Accepts reflectances that can be tabulated, and `phong` ([`crate::Card::materials`]).
pub fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    PhongLobe::materials(brdf).or_else(|_| certify::measurable(brdf))
}

impl Glossy {
    /// The reflectance of `m` in `bands` bands; its table, if it needs one, has `size`² texels.
    pub fn bake(
        slug: &'static str,
        m: &Material,
        bands: usize,
        size: usize,
        task: &Task,
    ) -> Result<Self, BakeError> {
        if PhongLobe::materials(&*m.brdf).is_ok() {
            return Ok(Self::Lobe(PhongLobe::of(&*m.brdf)));
        }
        if bands < BANDS[0] {
            let why = format!(
                "takes {} bands at least with {}, not {bands}; fewer with phong alone",
                BANDS[0],
                m.brdf.info().name
            );
            return Err(BakeError::Material { slug, why });
        }
        Ok(Self::Table(Box::new(Views::bake(slug, m, [bands, size], false, task)?)))
    }

    /// Visibility that matrices assume below the horizon: Phong's kernel has values there, so it must be
    /// blocked; coefficients of f_cos are zero there already.
    pub fn below(&self) -> Below {
        match self {
            Self::Lobe(_) => Below::Blocked,
            Self::Table(_) => Below::Open,
        }
    }

    /// Factor of the light, per channel.
    pub fn factor(&self) -> [f64; 3] {
        match self {
            Self::Lobe(lobe) => lobe.factor,
            Self::Table(views) => views.table.tint().map(f64::from),
        }
    }

    /// For each coefficient of transferred light in `bands` bands its factor and its index.
    pub fn order(&self, bands: usize) -> (Vec<f32>, Vec<usize>) {
        match self {
            Self::Lobe(lobe) => (lobe.scale(bands), harmonics::places(bands - 1)),
            Self::Table(_) => (vec![1.0; bands * bands], (0..bands * bands).collect()),
        }
    }

    /// Relative error of cutting off after `bands` bands where nothing is blocked, and that by elevation of
    /// the view where it is available.
    pub fn left_out(&self, light: &ShLight, bands: usize) -> (f64, Vec<Elevation>) {
        match self {
            Self::Lobe(lobe) => (light.left_out(&lobe.kernel(sh_light::ORDER), bands), Vec::new()),
            Self::Table(views) => {
                let squares = light.mean_squares();
                views.energies.error([&squares, &squares], [0.0; 3], &vec![1.0; bands])
            }
        }
    }

    /// Radiance of points, whose sites have vectors of transferred light in the order of [`Glossy::order`].
    pub fn shade(&self, bands: usize, vectors: &impl Vectors, q: &Points<'_>, out: &mut Radiance<'_>) {
        match self {
            Self::Lobe(_) => {
                site_sum::at_mirror(&Harmonics::new(bands - 1, bands - 1), vectors, q, out);
            }
            Self::Table(views) => view_table::shade_sites(&views.table, vectors, q, out),
        }
    }

    /// `fn shade_site(n, t, wo, p, site)` in WGSL, and the buffers that it reads. It calls `transferred(site,
    /// c)`, the sum of the coefficients c of a reflectance times those of the light that reaches a site.
    /// Coefficients of the lobe include k_l where `scaled`.
    pub fn wgsl(&self, bands: usize, scaled: bool) -> (Vec<Cow<'static, str>>, Vec<Buffer>) {
        match self {
            Self::Lobe(lobe) => {
                let lobe = if scaled { lobe.wgsl(bands) } else { PhongLobe::plain_wgsl(bands) };
                (vec![lobe.into(), include_str!("glossy.wgsl").into()], Vec::new())
            }
            Self::Table(views) => {
                let modules = view_table::site_modules(&views.table);
                (modules, vec![view_table::views_buffer(&views.table, false)])
            }
        }
    }
}

/// Numbers of transferred light of a site, all channels.
pub fn each(bands: usize) -> usize {
    3 * padded(bands * bands)
}

impl Part for Glossy {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        match self {
            Self::Lobe(lobe) => lobe.save(to, prefix),
            Self::Table(views) => views.save(to, prefix),
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        if PhongLobe::is_kept(from, prefix) {
            PhongLobe::load(from, prefix).map(Self::Lobe)
        } else {
            Views::load(from, prefix).map(|v| Self::Table(Box::new(v)))
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Lobe(lobe) => lobe.bytes(),
            Self::Table(views) => views.bytes(),
        }
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        match self {
            Self::Lobe(lobe) => lobe.kept_reflectance(),
            Self::Table(views) => views.kept_reflectance(),
        }
    }
}
