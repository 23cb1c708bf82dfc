//! The reflectance's factor: its radially symmetric lobes.

use super::LobeMaps;
use super::params::Params;
use crate::shared::material::reflectance;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Material, Part, Technique};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;
use steradian_base::{Task, brief};
use steradian_brdf::fit::radial::{Plan, RadialFit, RadialLobe, Rings, Shape, Views};
use steradian_brdf::{Brdf, Domain, Info, Lobe, Sample, SharedBrdf};

/// A reflectance and its lobes.
pub struct Fitted {
    spec: String,
    /// `None` in a loaded bake without the contents of the files that its reflectance needs.
    brdf: Option<SharedBrdf>,
    /// The lobes.
    pub fit: RadialFit,
}

impl Fitted {
    /// The fit that the parameters describe.
    pub fn new(m: &Material, p: &Params, task: &Task) -> Result<Self, BakeError> {
        let shape = if p.dimensions == 2 { Shape::Scaled } else { Shape::Stack };
        let plan = Plan { shape, stack: p.elevations, lobes: p.lobes, mirror: p.axis == 0 };
        let fit = if p.cosine {
            RadialFit::new(&*m.brdf, plan, task)?
        } else {
            let slug = LobeMaps::CARD.slug;
            RadialFit::new(
                &CosineOutside::new(&m.brdf).map_err(|why| BakeError::Material { slug, why })?,
                plan,
                task,
            )?
        };
        Ok(Self { spec: m.brdf.spec(), brdf: Some(m.brdf.clone()), fit })
    }
}

/// f n·r in place of f n·wi, as STAR04's eqs 29 and 31 have it under the integral, "assuming that the BRDF is
/// fairly specular".
#[derive(Debug)]
struct CosineOutside(SharedBrdf);

impl CosineOutside {
    /// Refuses reflectances whose f has no bound at the horizon, such as those that are defined with the
    /// cosine in.
    fn new(brdf: &SharedBrdf) -> Result<Self, String> {
        let f = |z: f64, phi: f64, wo: f64| {
            let s = (1.0 - z * z).sqrt();
            let wo = DVec3::new((1.0 - wo * wo).sqrt(), 0.0, wo);
            brdf.eval(DVec3::new(s * phi.cos(), s * phi.sin(), z), wo).into_iter().fold(0.0, f64::max)
        };
        // Between n·wi = 1e-2 and 1e-5 a function like 1/n·wi grows a thousandfold, and its root (Ward 1992)
        // by 32.
        let grows = |(phi, wo)| f(1e-5, phi, wo) > 100.0 * f(1e-2, phi, wo).max(1e-6);
        let around = (0..16).flat_map(|k| [0.05, 0.3, 0.8].map(|wo| (TAU * f64::from(k) / 16.0, wo)));
        if brdf.domain() == Domain::Sphere || around.into_iter().any(grows) {
            return Err(format!(
                "f of {} has no bound at the horizon without its cosine: leave the parameter cosine at 1",
                brief(&brdf.spec())
            ));
        }
        Ok(Self(brdf.clone()))
    }
}

impl Brdf for CosineOutside {
    fn info(&self) -> &'static Info {
        self.0.info()
    }
    fn spec(&self) -> String {
        self.0.spec()
    }
    fn held(&self) -> Option<Vec<f64>> {
        self.0.held()
    }
    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.f_cos(wi, wo).map(|f| f / wi.z)
    }
    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        // n·r = n·wo.
        if wi.z > 0.0 { self.0.eval(wi, wo).map(|f| f * wo.z) } else { [0.0; 3] }
    }
    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        self.0.lobes(wo)
    }
    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        self.0.sample(wo, u)
    }
    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        self.0.pdf(wi, wo)
    }
}

impl Part for Fitted {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let key = format!("steradian.{prefix}.brdf");
        match &self.brdf {
            Some(brdf) => reflectance::put(to, &key, &**brdf),
            None => _ = to.metadata.insert(key, self.spec.clone()),
        }
        let f = &self.fit;
        let (lobes, views, rings) = (f.lobes.len(), f.views.len(), f.rings.angles().len());
        let shapes = f.lobes.first().map_or(0, |l| l.shapes.len());
        let put = |to: &mut TensorFile, name: &str, shape: Vec<usize>, data: Vec<f64>| {
            put_f64(to, format!("{prefix}.{name}"), shape, data);
        };
        put(to, "fit", vec![3], vec![f.rings.width(), f.stride as f64, f.residual]);
        let gamma = f.lobes.iter().flat_map(|l| l.gamma.iter().copied()).collect();
        put(to, "gamma", vec![lobes, views], gamma);
        let amplitude = f.lobes.iter().flat_map(|l| l.amplitude.iter().flatten().copied()).collect();
        put(to, "amplitude", vec![lobes, views, 3], amplitude);
        let values = f.lobes.iter().flat_map(|l| l.shapes.iter().flatten().flatten().copied()).collect();
        put(to, "shapes", vec![lobes, shapes, 3, rings], values);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let key = format!("steradian.{prefix}.brdf");
        let spec = from.metadata.get(&key).ok_or_else(|| PartError::Missing(key.clone()))?.clone();
        let brdf = reflectance::kept(from, &key).ok();
        let name = |n: &str| format!("{prefix}.{n}");
        let bad = |n: &str| PartError::Unexpected(name(n));
        let (_, head) = get_f64(from, &name("fit"), 1)?;
        let [width, stride, residual] = head[..] else { return Err(bad("fit")) };
        let (shape, gamma) = get_f64(from, &name("gamma"), 2)?;
        let [lobes, views] = shape[..] else { return Err(bad("gamma")) };
        if !(1.0..=64.0).contains(&stride) || views < 2 || lobes == 0 {
            return Err(bad("fit"));
        }
        let (shape, amplitude) = get_f64(from, &name("amplitude"), 3)?;
        if shape != [lobes, views, 3] {
            return Err(bad("amplitude"));
        }
        let rings = Rings::graded(width);
        let count = rings.angles().len();
        let (shape, values) = get_f64(from, &name("shapes"), 4)?;
        let stack = shape[1];
        if shape != [lobes, stack, 3, count] || stack == 0 {
            return Err(bad("shapes"));
        }
        let lobe = |i: usize| RadialLobe {
            gamma: gamma[i * views..(i + 1) * views].to_vec(),
            amplitude: amplitude[3 * i * views..3 * (i + 1) * views]
                .chunks_exact(3)
                .map(|a| [a[0], a[1], a[2]])
                .collect(),
            shapes: (i * stack..(i + 1) * stack)
                .map(|k| std::array::from_fn(|c| values[(3 * k + c) * count..][..count].to_vec()))
                .collect(),
        };
        let lobes = (0..lobes).map(lobe).collect();
        let fit = RadialFit { rings, views: Views::new(views), stride: stride as usize, lobes, residual };
        Ok(Self { brdf, spec, fit })
    }

    fn bytes(&self) -> usize {
        0
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        self.brdf.as_deref()
    }
}
