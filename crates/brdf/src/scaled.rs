//! A reflectance times a constant (`scale=` of any spec string).

use crate::spec::SCALE;
use crate::{Brdf, BrdfShader, Domain, Form, Info, Lobe, Peak, Sample, SharedBrdf};
use glam::{DVec2, DVec3};
use steradian_base::Value;

/// `scale · f`, per channel.
#[derive(Debug)]
pub struct Scaled {
    /// The reflectance before scaling.
    pub brdf: SharedBrdf,
    /// Per channel.
    pub scale: [f64; 3],
}

impl Scaled {
    fn times(&self, f: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|c| f[c] * self.scale[c])
    }
}

impl Brdf for Scaled {
    fn info(&self) -> &'static Info {
        self.brdf.info()
    }

    fn spec(&self) -> String {
        let spec = self.brdf.spec();
        let joint = if spec.contains(':') { ',' } else { ':' };
        format!("{spec}{joint}{}={}", SCALE.name, Value::Rgb(self.scale))
    }

    fn held(&self) -> Option<Vec<f64>> {
        self.brdf.held()
    }

    fn is_interpolated(&self) -> bool {
        self.brdf.is_interpolated()
    }

    fn notes(&self) -> Vec<String> {
        self.brdf.notes()
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.times(self.brdf.eval(wi, wo))
    }

    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.times(self.brdf.f_cos(wi, wo))
    }

    fn f_cos_batch(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        self.brdf.f_cos_batch(wi, wo, out);
        out.iter_mut().for_each(|f| *f = self.times(*f));
    }

    fn domain(&self) -> Domain {
        self.brdf.domain()
    }

    fn is_isotropic(&self) -> bool {
        self.brdf.is_isotropic()
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        self.brdf.lobes(wo)
    }

    fn peak(&self) -> Peak {
        self.brdf.peak()
    }

    fn form(&self) -> Form {
        self.brdf.form().scaled(self.scale, || self.spec())
    }

    fn shader(&self) -> Option<BrdfShader> {
        Some(self.brdf.shader()?.scaled(self.scale))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        self.brdf.sample(wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        self.brdf.pdf(wi, wo)
    }
}
