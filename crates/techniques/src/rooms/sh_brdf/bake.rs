//! The table of the reflectance, and the light without its suns.

use super::ShBrdf;
use crate::certify::Report;
use crate::local::FileName;
use crate::shared::light::sun::{self, load_suns, save_suns};
use crate::shared::light::sunlit_spectrum::SunlitSpectrum;
use crate::shared::material::view_table::{BANDS, MOST_BANDS, MOST_NODES, PLANE, Places, SiteFrames, Views};
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Geometry, Material, Part, Technique};
use steradian_base::{ParamInfo, Task, params};
use steradian_prefilter::Apart;
use steradian_prefilter::Sun;
use steradian_sphere::sh::{ShRgb, Window};

/// Words of `fix`.
const FIX: [&str; 3] = ["nothing", "light", "view"];

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Bands of light and reflectance.
        pub bands: usize = ParamInfo::whole("bands", [3.0, 15.0], 5.0, "bands of spherical harmonics, of the light and of the reflectance alike"),
        /// Texels along an edge of the table.
        pub size: usize = ParamInfo::whole("size", [16.0, 1024.0], 128.0, "edge of the table of views").unit("texels"),
        /// Suns apart at most.
        pub lights: usize = ParamInfo::whole("lights", [0.0, 64.0], 4.0, "suns at most that are taken out of the light and shaded with the exact reflectance"),
        /// Where the window ends; 0 for none.
        pub window: f64 = ParamInfo::real("window", [0.0, 32.0], 0.0, "band at which a window of Hann ends that takes ringing off the light; 0: none"),
        /// Quantity that is static, an index of the choices.
        pub fix: usize = ParamInfo::choice("fix", &FIX, "what stands still: light, which vertices of a mesh then keep in their frames, or view, for which they keep their reflectance; 3 to 6 bands"),
        /// Widths by texel.
        pub widths: Option<FileName> = ParamInfo::file("widths", "image whose red and green are the width or exponent of the lobe along tangent and bitangent (.exr or .pfm for exponents), red alone where the model has one; auto: those of the reflectance").auto(f64::NAN),
        /// Tables along a line of widths.
        pub nodes: Option<usize> = ParamInfo::whole("nodes", [2.0, MOST_NODES as f64], 0.0, "tables along each of the numbers that vary; auto: as many as bring the error between them to 1 %, 17 at most, 9 where both vary").auto(f64::NAN),
        /// 16-bit table.
        pub halves: bool = ParamInfo::switch("halves", false, "a table of 16-bit floats, and a fixed light at sites of whole numbers of 16 bits"),
    }
}

/// Quantity that is static, so that sites can keep data that depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fix {
    Nothing,
    Light,
    View,
}

impl Params {
    pub(super) fn fix(&self) -> Fix {
        [Fix::Nothing, Fix::Light, Fix::View][self.fix.min(2)]
    }
}

/// The tables of a material.
pub(super) fn views(m: &Material, p: &Params, task: &Task) -> Result<Views, BakeError> {
    let (slug, size) = (ShBrdf::CARD.slug, [p.bands, p.size]);
    let Some(plane) = m.textures.get(PLANE) else {
        if p.widths.is_some() {
            let why = format!("the file of {PLANE} was not read");
            return Err(BakeError::Material { slug, why });
        }
        return Views::bake(slug, m, size, p.halves, task);
    };
    if p.fix() != Fix::Nothing {
        let why = format!("fix={} keeps one reflectance: leave out fix or {PLANE}", FIX[p.fix]);
        return Err(BakeError::Material { slug, why });
    }
    let places = Places::new(slug, &*m.brdf, plane, p.nodes, task)?;
    Views::vary(slug, m, size, p.halves, places, task)
}

/// The frames of the sites; none unless light or view is fixed.
pub(super) fn frames(g: Option<&Geometry>, p: &Params) -> Result<SiteFrames, BakeError> {
    let slug = ShBrdf::CARD.slug;
    let Some(g) = g.filter(|_| p.fix() != Fix::Nothing) else { return Ok(SiteFrames::default()) };
    if p.bands > MOST_BANDS {
        let why = format!("fix={} keeps {MOST_BANDS} bands at most, not {}", FIX[p.fix], p.bands);
        return Err(BakeError::Geometry { slug, why });
    }
    SiteFrames::new(slug, g)
}

/// The light as it is shaded.
#[derive(Debug, Clone, PartialEq)]
pub struct Linked {
    /// The first bands, without the suns.
    pub sh: ShRgb,
    /// Shaded exactly.
    pub suns: Vec<Sun>,
}

pub(super) fn link(
    light: &SunlitSpectrum,
    m: &Views,
    p: &Params,
    task: &Task,
) -> Result<(Linked, Report), BakeError> {
    // Suns are shaded separately only where one reflectance holds for all points.
    let apart = Apart::round_suns(light, if m.places.is_some() { 0 } else { p.lights });
    let n = p.bands * p.bands;
    let first = |c: &Vec<f64>| {
        let mut c = c.clone();
        c.resize(n, 0.0);
        c
    };
    let mut sh = ShRgb { order: p.bands - 1, c: apart.rest.c.each_ref().map(first) };
    let mut kept = vec![1.0; p.bands];
    if p.window > 0.0 {
        let window = Window::Hanning { width: p.window };
        kept = window.factors(p.bands - 1);
        sh.window(window);
    }
    // Relative to all light, suns too.
    let (rest, all) = (apart.rest.mean_squares(), light.spectrum.mean_squares());
    let (error, elevations) = m.energies.error([&rest, &all], apart.beyond, &kept);
    let mut report = Report::estimated(error, elevations)
        .detail("bands", p.bands as f64)
        .detail("suns apart", apart.suns.len() as f64)
        .detail("quadrature error", m.energies.quadrature());
    for (degrees, error) in m.energies.lookup() {
        report = report.detail(format!("lookup error at {degrees}°"), error);
    }
    if let Some(places) = &m.places {
        let [x, y] = places.nodes();
        report = report
            .detail("tables", (x * y) as f64)
            .detail("error between tables", places.between(&*m.brdf, task)?);
    }
    Ok((Linked { sh, suns: apart.suns }, report))
}

impl Part for Linked {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f64(to, format!("{prefix}.light"), vec![3, self.sh.c[0].len()], self.sh.c.concat());
        save_suns(&self.suns, to, format!("{prefix}.suns"));
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.light");
        let (shape, v) = get_f64(from, &name, 2)?;
        let bands = shape[1].isqrt();
        if shape != [3, bands * bands] || !(BANDS[0]..=BANDS[1]).contains(&bands) {
            return Err(PartError::Unexpected(name));
        }
        let mut rows = v.chunks(shape[1]).map(<[f64]>::to_vec);
        let sh = ShRgb { order: bands - 1, c: std::array::from_fn(|_| rows.next().unwrap_or_default()) };
        Ok(Self { sh, suns: load_suns(from, &format!("{prefix}.suns"))? })
    }

    fn bytes(&self) -> usize {
        12 * self.sh.c[0].len() + sun::BYTES * self.suns.len()
    }
}
