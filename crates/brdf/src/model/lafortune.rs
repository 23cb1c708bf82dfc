//! Generalised cosine lobes.
//!
//! Lafortune, Foo, Torrance, Greenberg 1997, Non-Linear Approximation of Reflectance Functions, eq. 8;
//! Kautz 2004 (STAR), eqs 36–38. In the local frame (t, b, n), with wo = (x, y, z) and wi = (x', y', z'):
//!
//! **f = kd/π + Σ ks (c_x x x' + c_y y y' + c_z z z')₊^n**, per channel.
//!
//! c_x = c_y = −1, c_z = 1 is Phong's lobe about the mirror direction; c_x, c_y > 0 reflects back to where
//! the light comes from; |c_z| < |c_x| moves the peak towards the horizon.

use super::published;
use crate::draw::{self, Draw};
use crate::math::{INV_PI, above, largest, power_cosine};
use crate::registry::Entry;
use crate::shader::{BrdfShader, rgb, with};
use crate::spec::{self, Args};
use crate::{Brdf, Form, Info, Lobe, Peak, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "lafortune",
    source: "Lafortune et al. 1997, eq. 8; Kautz 2004 (STAR), eqs 36–38; sets: Cornell Program of Computer \
             Graphics (Lafortune et al. 1997, Marschner et al. 1999)",
    formula: "f = kd/π + Σ ks (c_x x x' + c_y y y' + c_z z z')₊^n, wo = (x, y, z) and wi = (x', y', z') along t, b, n",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::name(
            "@set",
            "a published set instead of keys: skin, skin-steve, skin-mahesh, blue-paint, krylon-blue, clay, felt, primer, bluish, brushed-metal",
        )
        .positional(),
        ParamInfo::real("cx", [f64::NEG_INFINITY, f64::INFINITY], 0.0, "coefficient along the tangent, −1 … forward, +1 … back to the light").required(),
        ParamInfo::real("cy", [f64::NEG_INFINITY, f64::INFINITY], 0.0, "coefficient along the bitangent").required(),
        ParamInfo::real("cz", [f64::NEG_INFINITY, f64::INFINITY], 0.0, "coefficient along the normal").required(),
        ParamInfo::real("n", [0.0, 1e8], 0.0, "exponent").required(),
        ParamInfo::rgb("ks", [0.0, f64::INFINITY], 1.0, "factor of the lobe"),
        ParamInfo::rgb("kd", [0.0, 1.0], 0.0, "diffuse albedo"),
        ParamInfo::file(
            "lobes",
            "file of lobes instead of the other keys: CSV lines lobe,CHANNEL,cx,cy,cz,n[,ks] and diffuse,CHANNEL,kd with CHANNEL 0, 1, 2 or *",
        ),
    ],
    reciprocity: "reciprocal",
    energy: "not conserved in general: the lobes are not normalised",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

const OWN: [&str; 6] = ["cx", "cy", "cz", "n", "ks", "kd"];

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    if let Some(name) = a.name("@set") {
        refuse_others(a, "a set", &["lobes"])?;
        return Ok(Arc::new(published::find(&name)?));
    }
    if let Some(file) = a.file("lobes") {
        refuse_others(a, "lobes=", &[])?;
        let spec = a.spec();
        let name = file.display();
        return Ok(Arc::new(match a.held() {
            Some(numbers) => Lafortune::from_numbers(spec, numbers)
                .ok_or_else(|| a.syntax(format!("what is kept of {name} is damaged")))?,
            None => super::lafortune_file::read(&file, spec, a)?,
        }));
    }
    let n = a.number("n")?;
    let c = DVec3::new(a.number("cx")?, a.number("cy")?, a.number("cz")?);
    let (ks, kd) = (a.rgb("ks")?, a.rgb("kd")?);
    let lobe = [("cx", c.x.into()), ("cy", c.y.into()), ("cz", c.z.into()), ("n", n.into())];
    let spec = spec::print(&INFO, lobe.into_iter().chain([("ks", ks.into()), ("kd", kd.into())]));
    let lobe = std::array::from_fn(|i| Cosine { c, n, ks: ks[i] });
    Ok(Arc::new(Lafortune { spec, kd, lobes: vec![lobe] }))
}

fn refuse_others(a: &Args, what: &str, more: &[&str]) -> Result<(), SpecError> {
    match OWN.iter().chain(more).find(|k| a.has(k)) {
        Some(key) => Err(a.syntax(format!("{what} takes no '{key}='; give either one or the other"))),
        None => Ok(()),
    }
}

/// One generalised cosine of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cosine {
    /// (c_x, c_y, c_z).
    pub c: DVec3,
    /// Exponent.
    pub n: f64,
    /// Factor.
    pub ks: f64,
}

impl Cosine {
    fn value(&self, wi: DVec3, wo: DVec3) -> f64 {
        let o = self.c * wo;
        let c = o.dot(wi);
        if c <= 0.0 || self.ks == 0.0 {
            return 0.0;
        }
        if self.n < 1e3 {
            return self.ks * c.powf(self.n);
        }
        let length = o.length();
        self.ks * (self.n * length.ln()).exp() * power_cosine(o / length, wi, self.n)
    }

    fn draw(&self, wo: DVec3) -> Draw {
        Draw::Power { axis: (self.c * wo).normalize_or(DVec3::Z), n: self.n }
    }

    /// Approximate integral of the lobe times the cosine; 0 for a lobe that points well below the horizon.
    fn strength(&self, wo: DVec3) -> f64 {
        let axis = self.c * wo;
        let cosine = (axis.normalize_or(DVec3::Z).z + self.width()).clamp(0.0, 1.0);
        cosine * self.ks * axis.length().powf(self.n) * 2.0 * PI / (self.n + 1.0)
    }

    fn width(&self) -> f64 {
        (1.0 / (self.n + 1.0)).sqrt()
    }
}

/// Most lobes in a GPU's uniforms.
const MOST_ON_GPU: usize = 64;

/// Lobes per channel and a diffuse part.
#[derive(Debug, Clone, PartialEq)]
pub struct Lafortune {
    /// The spec string.
    pub spec: String,
    /// Diffuse albedo.
    pub kd: [f64; 3],
    /// Lobes, each for red, green and blue.
    pub lobes: Vec<[Cosine; 3]>,
}

/// Numbers of one lobe: c, n and ks of each channel.
const PER_LOBE: usize = 15;

impl Lafortune {
    /// See [`Brdf::held`]: kd, then the lobes.
    fn numbers(&self) -> Vec<f64> {
        let one = |l: &Cosine| [l.c.x, l.c.y, l.c.z, l.n, l.ks];
        self.kd.into_iter().chain(self.lobes.iter().flatten().flat_map(one)).collect()
    }

    fn from_numbers(spec: String, numbers: &[f64]) -> Option<Self> {
        let (kd, rest) = numbers.split_first_chunk::<3>()?;
        let one = |v: &[f64]| Cosine { c: DVec3::new(v[0], v[1], v[2]), n: v[3], ks: v[4] };
        let lobe = |v: &[f64]| std::array::from_fn(|i| one(&v[5 * i..]));
        let own = Self { spec, kd: *kd, lobes: rest.chunks_exact(PER_LOBE).map(lobe).collect() };
        let good = |l: &Cosine| (0.0..=1e8).contains(&l.n) && l.ks >= 0.0;
        let whole = rest.len().is_multiple_of(PER_LOBE) && numbers.iter().all(|v| v.is_finite());
        let fits = kd.iter().all(|k| (0.0..=1.0).contains(k)) && own.lobes.iter().flatten().all(good);
        (whole && fits).then_some(own)
    }

    /// The channels of all lobes, without repetition.
    fn distinct(&self) -> Vec<Cosine> {
        let mut all: Vec<Cosine> = Vec::new();
        for cosine in self.lobes.iter().flatten() {
            if cosine.ks > 0.0 && !all.iter().any(|o| o.c == cosine.c && o.n == cosine.n) {
                all.push(*cosine);
            }
        }
        all
    }

    fn draw(&self, wo: DVec3) -> Vec<(f64, Draw)> {
        let mut parts = vec![(largest(self.kd).max(0.05), Draw::Cosine)];
        parts.extend(self.distinct().iter().map(|c| (c.strength(wo), c.draw(wo))));
        let sum: f64 = parts.iter().map(|p| p.0).sum();
        parts.iter_mut().for_each(|p| p.0 /= sum);
        parts
    }
}

impl Brdf for Lafortune {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn held(&self) -> Option<Vec<f64>> {
        self.spec.contains("lobes=").then(|| self.numbers())
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        std::array::from_fn(|i| {
            self.kd[i] * INV_PI + self.lobes.iter().map(|l| l[i].value(wi, wo)).sum::<f64>()
        })
    }

    fn is_isotropic(&self) -> bool {
        self.lobes.iter().flatten().all(|l| l.c.x == l.c.y)
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        let hint = |c: &Cosine| {
            let axis = (c.c * wo).try_normalize()?;
            let width = c.width();
            (axis.z > -2.0 * width && c.n > 0.0).then_some(Lobe::Axis { axis, width })
        };
        self.distinct().iter().filter_map(hint).collect()
    }

    fn peak(&self) -> Peak {
        let widths = self.distinct().into_iter().map(|c| c.width());
        widths.min_by(f64::total_cmp).map_or(Peak::Smooth, |width| Peak::Anywhere { width })
    }

    fn form(&self) -> Form {
        Form::Lafortune(self.clone())
    }

    fn shader(&self) -> Option<BrdfShader> {
        if self.lobes.len() > MOST_ON_GPU {
            return None;
        }
        let none = [Cosine { c: DVec3::Z, n: 0.0, ks: 0.0 }; 3];
        let lobes = if self.lobes.is_empty() { std::slice::from_ref(&none) } else { &self.lobes };
        let mut parameters = vec![rgb(self.kd)];
        parameters.extend(lobes.iter().map(|l| rgb(l.each_ref().map(|c| c.ks))));
        parameters.extend(lobes.iter().flatten().map(|c| with(c.c.to_array(), c.n)));
        let shader = BrdfShader::new(include_str!("lafortune.wgsl"), self.peak(), self.domain(), parameters);
        Some(shader.with_arrays([("BRDF_LOBES", lobes.len()), ("BRDF_LOBE_CHANNELS", 3 * lobes.len())]))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.draw(wo), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.draw(wo), wi, wo)
    }
}
