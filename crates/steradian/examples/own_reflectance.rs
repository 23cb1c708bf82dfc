//! A reflectance of one's own, shaded by the techniques that take any isotropic one.

#![allow(clippy::print_stdout, reason = "an example says what it found")]

use std::f64::consts::PI;
use std::sync::Arc;
use steradian::base::ParamInfo;
use steradian::brdf::{Brdf, Info, Lobe, Sample, SharedBrdf};
use steradian::session::eval::{Points, Request};
use steradian::session::{Adjust, Error, Method, Session};
use steradian::sphere::glam::{DVec2, DVec3};

/// Minnaert (1941): f = albedo/π (cos θi cos θo)^k, darker towards the rim than Lambert's.
#[derive(Debug)]
struct Minnaert {
    albedo: f64,
    k: f64,
}

static INFO: Info = Info {
    name: "minnaert",
    source: "Minnaert 1941, The reciprocity principle in lunar photometry",
    formula: "f = albedo/π (cos θi cos θo)^k",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::real("albedo", [0.0, 1.0], 1.0, "factor"),
        ParamInfo::real("k", [0.0, 10.0], 0.0, "darkening, 0 is Lambert's"),
    ],
    reciprocity: "reciprocal",
    energy: "at most albedo",
};

impl Brdf for Minnaert {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        format!("minnaert:albedo={},k={}", self.albedo, self.k)
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return [0.0; 3];
        }
        [self.albedo / PI * (wi.z * wo.z).powf(self.k); 3]
    }

    fn lobes(&self, _: DVec3) -> Vec<Lobe> {
        Vec::new()
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        // By the cosine: points of the unit disk, projected up.
        let (r, (s, c)) = (u.x.sqrt(), (2.0 * PI * u.y).sin_cos());
        let wi = DVec3::new(r * c, r * s, (1.0 - u.x).max(0.0).sqrt());
        let pdf = self.pdf(wi, wo);
        (pdf > 0.0).then_some(Sample { wi, pdf })
    }

    fn pdf(&self, wi: DVec3, _: DVec3) -> f64 {
        wi.z.max(0.0) / PI
    }
}

/// Radiance of a floor by the reference and by a technique, and what that certifies.
pub fn run() -> Result<[f64; 3], Error> {
    let mut session = Session::new();
    let brdf: SharedBrdf = Arc::new(Minnaert { albedo: 0.8, k: 0.5 });
    let sky = session.light("sky:elevation=50", &Adjust::default())?;
    let request = Request::new(sky, brdf, Method::Reference);
    let floor = Points::new(vec![DVec3::Y], vec![DVec3::new(0.6, 0.8, 0.0)]);
    let exact = session.eval(&request, &floor)?.met()?;
    let fast = Request { method: Method::find("shrm")?, ..request };
    let fast = session.eval(&fast, &floor)?.met()?;
    println!("reference {:?}, shrm {:?}", exact.rows[0], fast.rows[0]);
    Ok([exact.rows[0].0[1], fast.rows[0].0[1], fast.error])
}

#[allow(dead_code, reason = "the test calls run()")]
fn main() -> Result<(), Error> {
    run().map(|_| ())
}
