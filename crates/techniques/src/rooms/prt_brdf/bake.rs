//! Transfer matrices, each with the rotation into the frame of its site.

use super::PrtBrdf;
use crate::certify::Report;
use crate::shared::geometry::transport::{self, PerSite};
use crate::shared::light::spectrum::Spectrum;
use crate::shared::material::view_table::{SiteFrames, Views};
use crate::tensors::{PartError, TensorFile};
use crate::{BakeError, Geometry, Part, Technique};
use glam::DVec3;
use steradian_base::{ParamInfo, Task, params};
use steradian_parallel::prelude::*;
use steradian_sphere::Frame;
use steradian_sphere::sh::{Rotation, ShRgb, Window};
use steradian_transfer::{Products, Settings};

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Bands of light, transfer and reflectance.
        pub bands: usize = ParamInfo::whole("bands", [3.0, 6.0], 5.0, "bands of spherical harmonics, of light, transfer and reflectance alike"),
        /// Texels along an edge of the table.
        pub size: usize = ParamInfo::whole("size", [16.0, 1024.0], 128.0, "edge of the table of views").unit("texels"),
        /// Absolute error of the coefficients of visibility.
        pub precision: f64 = ParamInfo::real("precision", [1e-4, 0.1], 5e-3, "absolute error of the coefficients of diffuse transfer, a fifth of that of visibility"),
        /// Where the window ends; 0 for none.
        pub window: f64 = ParamInfo::real("window", [0.0, 32.0], 0.0, "band at which a window of Hann ends that takes ringing off the light; 0: none"),
        /// 16-bit data.
        pub halves: bool = ParamInfo::switch("halves", false, "matrices and table of 16-bit floats, and the light of sites of whole numbers of 16 bits"),
    }
}

impl Params {
    fn window(&self) -> Window {
        if self.window > 0.0 { Window::Hanning { width: self.window } } else { Window::Box }
    }
}

/// The first bands of the light, under its window.
pub(super) fn first(light: &Spectrum, p: &Params) -> ShRgb {
    let n = p.bands * p.bands;
    let first = |c: &Vec<f64>| {
        let mut c = c.clone();
        c.resize(n, 0.0);
        c
    };
    let mut sh = ShRgb { order: p.bands - 1, c: light.sh.c.each_ref().map(first) };
    sh.window(p.window());
    sh
}

/// Estimates the error of cutting off the bands, where nothing is blocked.
pub(super) fn report(light: &Spectrum, m: &Views, p: &Params) -> Report {
    let squares = light.sh.mean_squares();
    let (error, elevations) =
        m.energies.error([&squares, &squares], [0.0; 3], &p.window().factors(p.bands - 1));
    Report::estimated(error, elevations).detail("bands", p.bands as f64)
}

/// R M of every site, row by row, and the frames.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Matrices {
    /// Where the sites are.
    pub frames: SiteFrames,
    /// bands⁴ numbers a site.
    pub all: PerSite,
}

impl Matrices {
    pub(super) fn bake(g: &Geometry, p: &Params, task: &Task) -> Result<Self, BakeError> {
        let slug = PrtBrdf::CARD.slug;
        let frames = SiteFrames::new(slug, g)?;
        let n = p.bands * p.bands;
        let need = (frames.len() * n * n * 4) as u64;
        if need > task.max_memory() {
            return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
        }
        let settings =
            Settings { bands: p.bands, tolerance: p.precision, matrices: true, ..Settings::default() };
        let t = transport::bake(slug, g, [0.0; 3], settings, task)?;
        let products = Products::new(p.bands);
        let wide = t.v.len() / frames.len().max(1);
        let mut data = vec![0.0f32; frames.len() * n * n];
        let sites = data.par_chunks_exact_mut(n * n).zip(t.v.par_chunks_exact(wide.max(1))).enumerate();
        sites.try_for_each(|(k, (to, v))| {
            task.check()?;
            let [normal, along] = frames.at(k).map(|v| v.as_dvec3());
            // Vertices of no triangle have no frame; their light is zero.
            if normal == DVec3::ZERO {
                return Ok(());
            }
            let m = products.transfer(normal, v);
            let frame = Frame::from_normal_tangent(normal, along);
            let into = Rotation::new(p.bands - 1, frame.matrix().transpose());
            let (mut column, mut turned) = (vec![0.0; n], vec![0.0; n]);
            for j in 0..n {
                (0..n).for_each(|i| column[i] = m[i * n + j]);
                into.apply(&column, &mut turned);
                (0..n).for_each(|i| to[i * n + j] = turned[i] as f32);
            }
            Ok::<_, BakeError>(())
        })?;
        let all = PerSite { stride: n * n, data };
        Ok(Self { frames, all: if p.halves { all.rounded() } else { all } })
    }
}

impl Part for Matrices {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.frames.save(to, prefix);
        self.all.save(to, prefix);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let (frames, all) = (SiteFrames::load(from, prefix)?, PerSite::load(from, prefix)?);
        if all.data.len() != frames.len() * all.stride {
            return Err(PartError::Unexpected(format!("{prefix}.sites")));
        }
        Ok(Self { frames, all })
    }

    fn bytes(&self) -> usize {
        self.frames.bytes() + self.all.bytes()
    }
}
