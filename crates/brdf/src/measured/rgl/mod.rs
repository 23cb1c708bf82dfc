//! Materials measured by EPFL's Realistic Graphics Laboratory, isotropic and anisotropic, RGB and spectral.
//!
//! Dupuy & Jakob 2018, An Adaptive Parameterization for Efficient Material Acquisition and Rendering. With
//! the view at (θ, φ), the half vector h and u_h = (√(2 θ_h/π), (φ_h + π)/2π) (isotropic: φ_h − φ), s the
//! uniform numbers that the density of visible normals maps to u_h:
//!
//! **f n·wi = M(s; φ, θ) D(u_h)/(4 σ(u_wo))**
//!
//! M the file's colours, D and σ its distribution of normals and their projected area. The files' incident
//! direction is the view here, as it is in the authors' renderer: a sample draws light. Between the measured
//! elevations and azimuths of the view, M and the densities are bilinear. Files with a symmetry (their
//! azimuths span half or a quarter of the circle) are turned or mirrored into it. Spectra become linear Rec.
//! 709 such that a flat one is grey; negative channels are set to 0.
//!
//! Sampling is the file's own: s by its luminance, h by its visible normals; one sample in ten by the cosine.

mod file;
mod warp;

use self::file::Arrays;
use self::warp::{Blend, Density, Grids};
use super::shape::Shape;
use super::tabulated::load;
use crate::draw::Draw;
use crate::math::{INV_PI, above, half, polar_angle};
use crate::registry::Entry;
use crate::shader::four;
use crate::spec::Args;
use crate::{Brdf, BrdfShader, Info, Lobe, MAX_CELLS, Peak, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;
use std::sync::Arc;
use steradian_base::ParamInfo;
use steradian_formats::{Limits, decode_bsdf};

/// The page.
pub static INFO: Info = Info {
    name: "rgl",
    source: "Dupuy & Jakob 2018",
    formula: "f n·wi = M(s; wo) D(h)/(4 σ(wo)), s the uniform numbers that the visible normals of wo map to h",
    units: "sr⁻¹; spectra as linear Rec. 709, a flat one grey",
    parameters: &[ParamInfo::file("file", "path of a .bsdf file, RGB or spectral").positional()],
    reciprocity: "not reciprocal exactly: measured and interpolated by the view",
    energy: "as measured",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// A spectral anisotropic file has some 300 MiB.
const MAX_BYTES: u64 = 1 << 30;
/// Share of samples by the cosine.
const COSINE: f64 = 0.1;

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let read = |path: &Path| {
        let fault = |what: String| SpecError::File { file: path.display().to_string(), what };
        let bytes = a.bytes(path, MAX_BYTES, "a measured material")?;
        let fields = decode_bsdf(path, &bytes, &Limits::default())?;
        let (arrays, negative) = Arrays::of_file(&fields).map_err(fault)?;
        Rgl::new(a.spec(), arrays, negative)
            .ok_or_else(|| fault("a slice of 'vndf' or 'luminance' is zero everywhere".into()))
    };
    let keep = |numbers: &[f64]| Arrays::of_numbers(numbers).and_then(|arrays| Rgl::new(a.spec(), arrays, 0));
    Ok(Arc::new(load(a, "rgl:paper_white_rgb.bsdf", read, keep)?))
}

/// One material.
#[derive(Debug, Clone)]
pub struct Rgl {
    spec: String,
    arrays: Arrays,
    negative: usize,
    sigma: Grids<1>,
    ndf: Grids<1>,
    vndf: Density,
    luminance: Density,
    /// Red, green, blue.
    colours: Grids<3>,
    isotropic: bool,
    /// 1, 2 or 4: the circle over the span of the azimuths.
    symmetry: u32,
    shape: Shape,
}

/// Azimuth of a direction. At the pole components are zeros, whose signs must not decide it.
fn azimuth(w: DVec3) -> f64 {
    (w.y + 0.0).atan2(w.x + 0.0)
}

/// Bounds of the maps between angles and the unit square.
fn theta_to_u(theta: f64) -> f64 {
    (theta / FRAC_PI_2).sqrt()
}

impl Rgl {
    fn new(spec: String, arrays: Arrays, negative: usize) -> Option<Self> {
        let [phi, _, sigma, ndf, vndf, luminance, colours, _] = &arrays.0;
        let size = |a: &file::Array| [a.shape[a.shape.len() - 1], a.shape[a.shape.len() - 2]];
        let grid = |a: &file::Array| Grids::new(size(a), a.values.iter().map(|v| [*v]).collect());
        let density = |a: &file::Array| Density::new(size(a), a.values.clone());
        let plane = size(colours)[0] * size(colours)[1];
        let slices = colours.values.chunks_exact(3 * plane);
        let nodes = slices.flat_map(|s| (0..plane).map(|i| [s[i], s[plane + i], s[2 * plane + i]]));
        let span = f64::from(phi.values[phi.values.len() - 1] - phi.values[0]);
        let isotropic = phi.values.len() <= 2;
        let symmetry = if isotropic || span <= 0.0 { 1 } else { (TAU / span).round().clamp(1.0, 4.0) as u32 };
        let mut rgl = Self {
            spec,
            negative,
            sigma: grid(sigma),
            ndf: grid(ndf),
            vndf: density(vndf)?,
            luminance: density(luminance)?,
            colours: Grids::new(size(colours), nodes.collect()),
            isotropic,
            symmetry,
            shape: Shape::measure(&|_, _| [0.0; 3], true),
            arrays,
        };
        rgl.shape = Shape::measure(&|wi, wo| rgl.eval(wi, wo), isotropic);
        Some(rgl)
    }

    /// Signs of x and y that bring the view into the measured part of the circle.
    fn fold(&self, wo: DVec3) -> [f64; 2] {
        let away = |x: f64| if x > 0.0 { -1.0 } else { 1.0 };
        match self.symmetry {
            2 => [away(wo.y); 2],
            4 => [away(wo.x), away(wo.y)],
            _ => [1.0; 2],
        }
    }

    fn blend(&self, wo: DVec3) -> Blend {
        let [phi, theta, ..] = &self.arrays.0;
        warp::blend(&phi.values, &theta.values, azimuth(wo), polar_angle(wo))
    }

    /// Azimuth of a folded view, from which those of half vectors count.
    fn from(&self, wo: DVec3) -> f64 {
        if self.isotropic { azimuth(wo) } else { 0.0 }
    }

    /// u of the half vector for a view that is folded, whose azimuth is `from`.
    fn place(&self, wi: DVec3, wo: DVec3, from: f64) -> DVec2 {
        let h = half(wi, wo);
        let turn = (azimuth(h) - from + PI) / TAU;
        DVec2::new(theta_to_u(polar_angle(h)), turn - turn.floor())
    }

    /// Light and view, folded.
    fn folded(&self, wi: DVec3, wo: DVec3) -> (DVec3, DVec3) {
        let [x, y] = self.fold(wo);
        let turned = |w: DVec3| DVec3::new(w.x * x, w.y * y, w.z);
        (turned(wi), turned(wo))
    }

    /// Density of wi by the file's own sampling, per steradian.
    fn warped_pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        let (wi, wo) = self.folded(wi, wo);
        let blend = self.blend(wo);
        let u = self.place(wi, wo, self.from(wo));
        let s = self.vndf.invert(&blend, u);
        let h = half(wi, wo);
        self.vndf.pdf(&blend, u) * self.luminance.pdf(&blend, s) / jacobian(u.x, h, wo)
    }
}

/// d(wi)/d(u): 2π² u_x sin θ_h of the map to angles, times 4 wo·h of the reflection.
fn jacobian(u: f64, h: DVec3, wo: DVec3) -> f64 {
    (2.0 * PI * PI * u * h.x.hypot(h.y)).max(1e-6) * 4.0 * wo.dot(h).max(1e-12)
}

impl Brdf for Rgl {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn held(&self) -> Option<Vec<f64>> {
        Some(self.arrays.numbers())
    }

    fn is_interpolated(&self) -> bool {
        true
    }

    fn notes(&self) -> Vec<String> {
        let [phi, theta, ..] = &self.arrays.0;
        let mut notes = vec![format!(
            "{} elevations and {} azimuths of the view, colours on {} x {} points",
            theta.values.len(),
            phi.values.len(),
            self.arrays.0[6].shape[3],
            self.arrays.0[6].shape[4],
        )];
        if self.negative > 0 {
            notes.push(format!("{} negative numbers are set to 0", self.negative));
        }
        notes
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.f_cos(wi, wo).map(|f| f / wi.z.max(1e-150))
    }

    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let mut f = [[0.0; 3]];
        self.f_cos_batch(&[wi], wo, &mut f);
        f[0]
    }

    fn f_cos_batch(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        out.fill([0.0; 3]);
        if wo.z <= 0.0 {
            return;
        }
        let (_, view) = self.folded(wo, wo);
        let (blend, from) = (self.blend(view), self.from(view));
        let scaled = self.arrays.0[7].values[0] != 0.0;
        let turn = (azimuth(view) + PI) / TAU;
        let [sigma] = self.sigma.value(&Blend::FIRST, DVec2::new(theta_to_u(polar_angle(view)), turn));
        if scaled && sigma <= 0.0 {
            return;
        }
        for (wi, f) in wi.iter().zip(out).filter(|(wi, _)| above(**wi, wo)) {
            let u = self.place(self.folded(*wi, wo).0, view, from);
            let s = self.vndf.invert(&blend, u);
            let factor = if scaled { self.ndf.value(&Blend::FIRST, u)[0] / (4.0 * sigma) } else { 1.0 };
            *f = self.colours.value(&blend, s).map(|c| c * factor);
        }
    }

    fn is_isotropic(&self) -> bool {
        self.isotropic
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        self.shape.lobes(self, wo)
    }

    fn peak(&self) -> Peak {
        self.shape.peak()
    }

    /// Cells of the shader: azimuths, elevations, σ, D, visible D (two cells a node), colours.
    fn shader(&self) -> Option<BrdfShader> {
        let [phi, theta, sigma, ndf, vndf, _, colours, jacobian] = &self.arrays.0;
        let single = [
            &phi.values[..],
            &theta.values,
            self.sigma.values().as_flattened(),
            self.ndf.values().as_flattened(),
        ];
        let mut cells: Vec<[f32; 3]> = single.concat().into_iter().map(|v| [v; 3]).collect();
        cells.extend(self.vndf.cells());
        cells.extend_from_slice(self.colours.values());
        if cells.len() > MAX_CELLS {
            return None;
        }
        let size = |a: &file::Array| [a.shape[a.shape.len() - 1] as f64, a.shape[a.shape.len() - 2] as f64];
        let both = |a: &file::Array, b: &file::Array| four([size(a)[0], size(a)[1], size(b)[0], size(b)[1]]);
        let turned = if self.isotropic { 1.0 } else { 0.0 };
        let scaled = if jacobian.values[0] == 0.0 { 0.0 } else { 1.0 };
        let parameters = [
            four([phi.values.len() as f64, theta.values.len() as f64, turned, f64::from(self.symmetry)]),
            both(sigma, ndf),
            both(vndf, colours),
            four([scaled, 0.0, 0.0, 0.0]),
        ];
        let shader =
            BrdfShader::new(include_str!("rgl.wgsl"), self.peak(), self.domain(), parameters).with_f_cos();
        Some(shader.with_cells(Arc::new(cells)))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = if u.x < COSINE {
            Draw::Cosine.direction(wo, DVec2::new(u.x / COSINE, u.y))
        } else {
            let u = DVec2::new((u.x - COSINE) / (1.0 - COSINE), u.y);
            let [sx, sy] = self.fold(wo);
            let view = DVec3::new(wo.x * sx, wo.y * sy, wo.z);
            let blend = self.blend(view);
            let at = self.vndf.sample(&blend, self.luminance.sample(&blend, u));
            let from = if self.isotropic { azimuth(view) } else { 0.0 };
            let (theta, phi) = (at.x * at.x * FRAC_PI_2, at.y * TAU - PI + from);
            let h = crate::math::spherical(theta, phi);
            let wi = (2.0 * view.dot(h) * h - view).normalize_or(DVec3::Z);
            DVec3::new(wi.x * sx, wi.y * sy, wi.z)
        };
        let pdf = self.pdf(wi, wo);
        (pdf > 0.0 && pdf.is_finite()).then_some(Sample { wi, pdf })
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        if wo.z <= 0.0 || (wi + wo).z <= 0.0 {
            return 0.0;
        }
        COSINE * wi.z.max(0.0) * INV_PI + (1.0 - COSINE) * self.warped_pdf(wi, wo)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::check_measured;
    use crate::{Files, albedo, parse_with};

    const FILES: [&str; 6] = [
        "cc_ibiza_sunset",
        "cc_iris_purple_gem",
        "cg_sunflower",
        "colodur_napoli_4f",
        "paper_white",
        "vch_golden_yellow",
    ];

    fn open(name: &str) -> Option<SharedBrdf> {
        let path = steradian_testkit::data(&format!("brdfs/rgl/{name}_rgb.bsdf"))?;
        Some(parse_with(&format!("rgl:{}", path.display()), Files::Any).expect("valid"))
    }

    #[test]
    fn the_measured_files() {
        for name in FILES {
            let Some(brdf) = open(name) else { return };
            check_measured(&*brdf);
            let a = albedo::directional(&*brdf, DVec3::Z, 1e-4);
            assert!(a.iter().all(|a| (0.0..1.1).contains(a)), "{name}: {a:?}");
        }
    }

    /// Values of π f of a published file, computed from its bytes by another program.
    #[test]
    fn white_paper_is_nearly_diffuse() {
        let Some(brdf) = open("paper_white") else { return };
        for (theta, want) in [(0.2, 0.867), (0.6, 0.840), (1.0, 0.802), (1.3, 0.746)] {
            let got = PI * brdf.eval(crate::math::spherical(theta, 0.0), DVec3::Z)[0];
            assert!((got - want).abs() < 0.01, "{theta}: {got} instead of {want}");
        }
    }

    /// The file rewritten as spectral, as anisotropic with a symmetry, and as kept in a bake.
    #[test]
    fn other_layouts_and_what_is_kept() {
        let Some(brdf) = open("vch_golden_yellow") else { return };
        let held = brdf.held().expect("numbers");
        let again = parse_with(&brdf.spec(), Files::Held(&held)).expect("kept");
        let pairs = || super::super::nbrdf::pairs(50);
        for (wi, wo) in pairs() {
            assert_eq!(brdf.eval(wi, wo), again.eval(wi, wo));
        }
        assert!(parse_with(&brdf.spec(), Files::Held(&held[..held.len() - 1])).is_err());
        let arrays = Arrays::of_numbers(&held).expect("valid");
        for (phis, symmetry) in [(vec![-PI, -FRAC_PI_2, 0.0], 2), (vec![-PI, -2.0, -FRAC_PI_2], 4)] {
            // The isotropic slices at three azimuths, the half vector's azimuth absolute: turned by the
            // view's.
            let mut all = arrays.clone();
            all.0[0] = file::Array { shape: vec![3], values: phis.iter().map(|p| *p as f32).collect() };
            for k in 4..7 {
                let a = &mut all.0[k];
                a.shape[0] = 3;
                a.values = [&a.values[..]; 3].concat();
            }
            let many = Rgl::new("rgl:a".into(), all, 0).expect("mass");
            assert_eq!((many.symmetry, many.is_isotropic()), (symmetry, false));
            for (wi, wo) in pairs() {
                let turned = |w: DVec3| {
                    if symmetry == 2 { DVec3::new(-w.x, -w.y, w.z) } else { DVec3::new(-w.x, w.y, w.z) }
                };
                let (a, b) = (many.eval(wi, wo), many.eval(turned(wi), turned(wo)));
                assert!((0..3).all(|c| (a[c] - b[c]).abs() <= 1e-6 * a[c].abs()), "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn bad_files_are_refused_in_one_line() {
        let Some(path) = steradian_testkit::data("brdfs/rgl/paper_white_rgb.bsdf") else { return };
        let bytes = std::fs::read(&path).expect("readable");
        let fields = decode_bsdf(&path, &bytes, &Limits::default()).expect("valid");
        let refused =
            |change: &dyn Fn(&mut std::collections::BTreeMap<String, steradian_formats::Tensor>)| {
                let mut fields = fields.clone();
                change(&mut fields);
                Arrays::of_file(&fields).map(|_| ()).expect_err("damaged")
            };
        assert!(refused(&|f| _ = f.remove("vndf")).starts_with("has no field 'vndf'; it has description"));
        assert!(refused(&|f| _ = f.remove("rgb")).contains("'spectra'"));
        let nan = |f: &mut std::collections::BTreeMap<String, steradian_formats::Tensor>| {
            let t = f.get_mut("ndf").expect("there");
            let mut v = t.data.to_f32().into_owned();
            v[5] = f32::NAN;
            t.data = steradian_formats::TensorData::F32(v);
        };
        assert_eq!(refused(&nan), "field 'ndf' holds NaN");
        let shape = |f: &mut std::collections::BTreeMap<String, steradian_formats::Tensor>| {
            f.get_mut("luminance").expect("there").shape = vec![1, 4, 64, 32];
        };
        assert!(refused(&shape).contains("'luminance' has the shape [1, 4, 64, 32]"));
    }
}
