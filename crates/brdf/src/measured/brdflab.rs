//! Published parameters as BRDFLab keeps them in XML: Ngan, Durand & Matusik's fits to MERL materials (2005,
//! "Experimental Analysis of BRDF Models"), car paints of the MPI, Cornell's paints and skin. **f = Σ scale ·
//! lobe**, each lobe one of the models here:
//!
//! | in the file | here |
//! |---|---|
//! | Lambertian | 1/π, or its `value` |
//! | Ward, WardDuer | `ward`, variants 1992 and duer |
//! | BlinnPhong | (n + 2)/2π (n·h)^n |
//! | LafortuneIso, Lafortune | in a sum with factors (n + 2)/2π (C·…/max\|C\|)^n, without them (C·…)^n |
//! | CookTorrance | `cook-torrance` |
//! | AshikhminShirley | `ashikhmin-shirley`, without its diffuse part |
//!
//! The files do not say how lobes are normalised. These forms bring the fits of one material nearest to each
//! other and to the measurements: at normal incidence the fits of aluminium and of blue metallic paint but
//! for Ashikhmin and Shirley's, whose `F0` for aluminium is a hundredth of the measured reflectance in the
//! file itself.

use super::tabulated::load;
use crate::draw::Draw;
use crate::math::{largest, spherical};
use crate::registry::Entry;
use crate::spec::Args;
use crate::wgsl::scoped;
use crate::{Brdf, BrdfShader, Info, Lobe, Peak, Sample, SharedBrdf, SpecError, albedo};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;
use steradian_base::{ParamInfo, brief, nearest};
use steradian_formats::{BrdfLabFit, BrdfLabLobe, Limits, decode_brdflab};

/// The page.
pub static INFO: Info = Info {
    name: "brdflab",
    source: "BRDFLab's XML (Forés et al. 2009): fits of Ngan, Durand & Matusik 2005, MPI car paints, Cornell's Lafortune lobes",
    formula: "f = Σ scale · lobe, lobes Lambertian, Ward, WardDuer, BlinnPhong, Lafortune, CookTorrance, AshikhminShirley",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::file("file", "path of an .xml file").positional(),
        ParamInfo::name("fit", "which fit of the file, such as Ngan-CookTorrance; its first").positional(),
    ],
    reciprocity: "reciprocal, as its lobes are",
    energy: "as fitted to measurements",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// A file of this kind has some hundreds of nodes.
const MAX_BYTES: u64 = 16 << 20;

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let read = |path: &Path| {
        let fault = |what: String| SpecError::File { file: path.display().to_string(), what };
        let bytes = a.bytes(path, MAX_BYTES, "a file of BRDFLab's")?;
        let all = decode_brdflab(path, &bytes, &Limits::default())?;
        let fit = chosen(&all.fits, a.name("fit").as_deref()).map_err(fault)?;
        let terms: Vec<Term> = fit.lobes.iter().map(Term::of).collect::<Result<_, _>>().map_err(fault)?;
        let error = fit.error.unwrap_or(-1.0);
        Sum::new(a.spec(), terms, error).map_err(fault)
    };
    let keep = |numbers: &[f64]| {
        let (error, terms) = numbers.split_first()?;
        let (terms, []) = terms.as_chunks::<TERM>() else { return None };
        Sum::new(a.spec(), terms.iter().map(|t| Term(*t)).collect(), *error).ok()
    };
    Ok(Arc::new(load(a, "brdflab:MERL-aluminium.xml,Ngan-Ward", read, keep)?))
}

fn chosen<'a>(fits: &'a [BrdfLabFit], wanted: Option<&str>) -> Result<&'a BrdfLabFit, String> {
    let Some(wanted) = wanted else { return fits.first().ok_or_else(|| "holds no fit".into()) };
    let plain = |s: &str| s.trim_start_matches('@').to_ascii_lowercase().replace(['_', ' '], "-");
    fits.iter().find(|f| plain(&f.name) == plain(wanted)).ok_or_else(|| {
        let names: Vec<&str> = fits.iter().map(|f| f.name.as_str()).collect();
        let near = nearest(wanted, &names).map(|n| format!(" (did you mean '{}'?)", brief(n)));
        let near = near.unwrap_or_default();
        format!(
            "has no fit '{}'{near}; it has {}",
            brief(wanted),
            names.iter().map(|n| brief(n)).collect::<Vec<_>>().join(", ")
        )
    })
}

/// Numbers of a term: its kind, three factors, four parameters.
const TERM: usize = 8;

/// One lobe as numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Term([f64; TERM]);

impl Term {
    fn of(lobe: &BrdfLabLobe) -> Result<Self, String> {
        let get = |names: &[&str]| {
            let named = |p: &&(String, f64)| names.iter().any(|n| p.0.eq_ignore_ascii_case(n));
            lobe.parameters.iter().find(named).map(|p| p.1)
        };
        let need = |names: &[&str]| {
            get(names)
                .ok_or_else(|| format!("a lobe '{}' has no parameter '{}'", brief(&lobe.model), names[0]))
        };
        let mut scale = lobe.scale.unwrap_or([1.0; 3]);
        if let Some(channel) = lobe.channel {
            (0..3).filter(|c| *c != channel).for_each(|c| scale[c] = 0.0);
        }
        let mut factor = 1.0;
        let (kind, p) = match lobe.model.as_str() {
            "Lambertian" => {
                factor = get(&["value"]).map_or(1.0, |v| v * PI);
                (0.0, [0.0; 4])
            }
            "Ward" | "WardDuer" => {
                let ax = need(&["ax"])?;
                let kind = if lobe.model == "Ward" { 1.0 } else { 2.0 };
                (kind, [ax, get(&["ay"]).unwrap_or(ax), 0.0, 0.0])
            }
            "BlinnPhong" => {
                let n = need(&["Exponent"])?;
                factor = 4.0 * (n + 2.0) / (n + 8.0);
                (3.0, [n, 0.0, 0.0, 0.0])
            }
            "LafortuneIso" | "Lafortune" => {
                let both = get(&["Cxy"]);
                let cx = both.or(get(&["Cx"])).map_or_else(|| need(&["Cxy"]), Ok)?;
                let (cy, cz, n) = (both.or(get(&["Cy"])).unwrap_or(cx), need(&["Cz"])?, need(&["Exponent"])?);
                let top = cx.abs().max(cy.abs()).max(cz.abs());
                if lobe.scale.is_none() {
                    (4.0, [cx, cy, cz, n])
                } else if top > 0.0 {
                    factor = (n + 2.0) / (2.0 * PI);
                    (4.0, [cx / top, cy / top, cz / top, n])
                } else {
                    return Err("a Lafortune lobe has only zeros".into());
                }
            }
            "CookTorrance" => (5.0, [need(&["m"])?, need(&["F0"])?, 0.0, 0.0]),
            "AshikhminShirley" => {
                let n = get(&["Exponent"]);
                let nu = n.or(get(&["nu"])).map_or_else(|| need(&["Exponent"]), Ok)?;
                (6.0, [nu, n.or(get(&["nv"])).unwrap_or(nu), need(&["F0"])?, 0.0])
            }
            other => {
                return Err(format!(
                    "a lobe is of the model '{}'; read are Lambertian, Ward, WardDuer, BlinnPhong, LafortuneIso, \
                     CookTorrance, AshikhminShirley",
                    brief(other)
                ));
            }
        };
        let [r, g, b] = scale.map(|s| s * factor);
        Ok(Self([kind, r, g, b, p[0], p[1], p[2], p[3]]))
    }

    /// The model, and the factors.
    fn brdf(&self) -> Result<(SharedBrdf, [f64; 3]), String> {
        let [kind, r, g, b, p, q, s, t] = self.0;
        if [r, g, b].iter().any(|v| !(0.0..=1e30).contains(v)) {
            return Err("a lobe has a factor that is negative or beyond 1e30".into());
        }
        let spec = match kind {
            0.0 => "lambert:albedo=1".into(),
            1.0 => format!("ward:ax={p},ay={q},variant=1992"),
            2.0 => format!("ward:ax={p},ay={q},variant=duer"),
            3.0 => format!("blinn-phong:n={p}"),
            4.0 => format!("lafortune:cx={p},cy={q},cz={s},n={t}"),
            5.0 => format!("cook-torrance:m={p},f0={q}"),
            6.0 => format!("ashikhmin-shirley:nu={p},nv={q},rs={s}"),
            _ => return Err("a lobe is of no known kind".into()),
        };
        Ok((crate::parse(&spec).map_err(|e| e.to_string())?, [r, g, b]))
    }
}

/// A sum of models.
#[derive(Debug)]
struct Sum {
    spec: String,
    terms: Vec<Term>,
    /// The file's own error; negative where it gives none.
    error: f64,
    parts: Vec<(SharedBrdf, [f64; 3])>,
    /// Share of the samples that each part draws; they sum to 1.
    weights: Vec<f64>,
}

impl Sum {
    fn new(spec: String, terms: Vec<Term>, error: f64) -> Result<Self, String> {
        let parts: Vec<_> = terms.iter().map(Term::brdf).collect::<Result<_, _>>()?;
        let view = spherical(0.5, 0.3);
        let weight = |(brdf, scale): &(SharedBrdf, [f64; 3])| {
            largest(*scale) * largest(albedo::directional(&**brdf, view, 1e-2))
        };
        let mut weights: Vec<f64> = parts.iter().map(weight).collect();
        let all: f64 = weights.iter().sum();
        if !(all > 0.0 && all.is_finite()) {
            return Err("its lobes send nothing back".into());
        }
        // A part that is dim at one view may not be at another.
        weights.iter_mut().for_each(|w| *w = (*w / all).max(0.05));
        let all: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= all);
        Ok(Self { spec, terms, error, parts, weights })
    }

    fn sum(&self, f: impl Fn(&dyn Brdf) -> [f64; 3]) -> [f64; 3] {
        let mut out = [0.0; 3];
        for (brdf, scale) in &self.parts {
            let f = f(&**brdf);
            (0..3).for_each(|c| out[c] += scale[c] * f[c]);
        }
        out
    }
}

impl Brdf for Sum {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn held(&self) -> Option<Vec<f64>> {
        Some(std::iter::once(self.error).chain(self.terms.iter().flat_map(|t| t.0)).collect())
    }

    fn notes(&self) -> Vec<String> {
        let term = |(brdf, scale): &(SharedBrdf, [f64; 3])| {
            format!("{:.4}/{:.4}/{:.4} of {}", scale[0], scale[1], scale[2], brdf.spec())
        };
        let mut notes: Vec<String> = self.parts.iter().map(term).collect();
        if self.error >= 0.0 {
            notes.push(format!("the file states an error of {} (Ngan's metric)", self.error));
        }
        notes
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.sum(|f| f.eval(wi, wo))
    }

    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.sum(|f| f.f_cos(wi, wo))
    }

    fn is_isotropic(&self) -> bool {
        self.parts.iter().all(|p| p.0.is_isotropic())
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        self.parts.iter().filter(|p| largest(p.1) > 0.0).flat_map(|p| p.0.lobes(wo)).collect()
    }

    /// The narrowest of the parts'.
    fn peak(&self) -> Peak {
        let peaks = self.parts.iter().filter(|p| largest(p.1) > 0.0).map(|p| p.0.peak());
        let sharp: Vec<Peak> = peaks.filter(|p| *p != Peak::Smooth).collect();
        let width = |p: &Peak| match *p {
            Peak::Mirror { narrow, .. } => narrow,
            Peak::Cone { width, .. } | Peak::Anywhere { width } => width,
            Peak::Smooth => f64::INFINITY,
        };
        let Some(narrowest) = sharp.iter().min_by(|a, b| width(a).total_cmp(&width(b))) else {
            return Peak::Smooth;
        };
        if sharp.iter().all(|p| matches!(p, Peak::Mirror { .. })) {
            *narrowest
        } else {
            Peak::Anywhere { width: width(narrowest) }
        }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let mut text = "struct Brdf {\n    scale: vec4<f32>,\n    peak: vec4<f32>,\n}\n".to_owned();
        let mut terms = Vec::new();
        for (k, (brdf, scale)) in self.parts.iter().enumerate() {
            let prefix = format!("term{k}");
            text += &scoped(&prefix, &brdf.shader()?.scaled(*scale).closed());
            terms.push(format!("{prefix}_brdf_value(wi, wo)"));
        }
        let sum = terms.join(" + ");
        text += &format!(
            "\nfn brdf_f_cos(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {{\n    return {sum};\n}}\n"
        );
        Some(BrdfShader::new(text, self.peak(), self.domain(), []).with_f_cos())
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        let mut x = u.x;
        for ((brdf, _), weight) in self.parts.iter().zip(&self.weights) {
            if x < *weight {
                let wi = brdf.sample(wo, DVec2::new((x / weight).min(1.0 - f64::EPSILON / 2.0), u.y))?.wi;
                let pdf = self.pdf(wi, wo);
                return (pdf > 0.0 && pdf.is_finite()).then_some(Sample { wi, pdf });
            }
            x -= weight;
        }
        // The weights sum to 1 but for rounding.
        let wi = Draw::Cosine.direction(wo, u);
        let pdf = self.pdf(wi, wo);
        (pdf > 0.0 && pdf.is_finite()).then_some(Sample { wi, pdf })
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        self.parts.iter().zip(&self.weights).map(|(p, w)| w * p.0.pdf(wi, wo)).sum()
    }
}

#[cfg(test)]
mod tests {
    use crate::conformance::check_measured;
    use crate::{Files, parse, parse_with};

    const FOLDER: &str = "brdfs/analytic_fits/brdflab_xml";

    #[test]
    fn every_published_file_and_fit() {
        let Some(folder) = steradian_testkit::data(FOLDER) else { return };
        let mut files: Vec<_> =
            std::fs::read_dir(folder).expect("readable").flatten().map(|e| e.path()).collect();
        files.sort();
        assert_eq!(files.len(), 22);
        for file in files {
            let spec = format!("brdflab:{}", file.display());
            let e = parse_with(&format!("{spec},?"), Files::Any).expect_err("no such fit").to_string();
            let names = e.split_once("; it has ").expect("a list").1.to_owned();
            for name in names.split(", ") {
                let brdf = parse_with(&format!("{spec},{name}"), Files::Any).expect(name);
                let held = brdf.held().expect("numbers");
                assert!(parse_with(&brdf.spec(), Files::Held(&held)).is_ok());
            }
            if spec.ends_with("bluish.xml") || spec.ends_with("MERL-orange-paint.xml") {
                check_measured(&*parse_with(&spec, Files::Any).expect("valid"));
            }
        }
    }

    /// The file's lobes equal those typed in elsewhere.
    #[test]
    fn skin_is_the_published_set() {
        let Some(folder) = steradian_testkit::data(FOLDER) else { return };
        let spec = format!("brdflab:{}/Cornell-Skin-mahesh-Indian.xml", folder.display());
        let (read, set) =
            (parse_with(&spec, Files::Any).expect("valid"), parse("lafortune:@skin-mahesh").expect("set"));
        for (i, o) in crate::measured::nbrdf::pairs(50) {
            let (a, b) = (read.eval(i, o), set.eval(i, o));
            assert!((0..3).all(|c| (a[c] / b[c] - 1.0).abs() < 1e-9), "{a:?} {b:?}");
        }
    }
}
