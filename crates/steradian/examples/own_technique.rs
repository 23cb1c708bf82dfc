//! A technique of one's own beside the reference: diffuse light as a constant and a gradient, four
//! coefficients.

#![allow(clippy::print_stdout, reason = "an example says what it found")]

use steradian::base::Task;
use steradian::brdf::{Brdf, Form};
use steradian::light::Lights;
use steradian::session::compare::Plan;
use steradian::session::{Error, Method, Renderer, Scene, Session, coefficients};
use steradian::technique::gpu::Entry;
use steradian::technique::tensors::{PartError, get_f64, put_f64};
use steradian::technique::{
    Bake, BakeError, Capabilities, Card, Erased, Geometry, GpuTechnique, Material, Needs, Part, Parts,
    Points, Radiance, Report, Technique, TensorFile, View,
};

/// Irradiance from two bands of the light: E(n) = a + b·n.
struct TwoBands;

/// Per channel a, bx, by, bz; of a reflectance its albedo in a.
struct Four(Vec<f64>);

impl Part for Four {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f64(to, prefix.into(), vec![self.0.len()], self.0.clone());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        get_f64(from, prefix, 1).map(|(_, v)| Self(v))
    }

    fn bytes(&self) -> usize {
        8 * self.0.len()
    }
}

fn diffuse(brdf: &dyn Brdf) -> Result<(), String> {
    if matches!(brdf.form(), Form::Lambert { .. }) { Ok(()) } else { Err("takes lambert only".into()) }
}

impl Technique for TwoBands {
    const CARD: Card = Card {
        slug: "two_bands",
        title: "Two bands of light",
        citation: "an example; Ramamoorthi & Hanrahan 2001 take three bands",
        equation: "L_o = albedo/π (a + b·n)",
        light: "bands 0 and 1",
        visibility: "none: V = 1",
        reflectance: "exact",
        materials: diffuse,
        specimens: &["lambert:albedo=0.5"],
        exact_when: &[],
        capabilities: Capabilities { global: true, diffuse: true, ..Capabilities::NONE },
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: false },
        waived: &[],
    };
    type Params = ();
    type Light = Four;
    type Material = Four;
    type Transfer = ();
    type Linked = Four;
    type Frame = ();

    fn light(l: &Lights, _: &(), _: &Task) -> Result<Four, BakeError> {
        // Y00 = 0.282095, Y1m = 0.488603 (y, z, x); the cosine's factors are π and 2π/3.
        let (sh, pi) = (coefficients(l, 1), std::f64::consts::PI);
        let four = |c: &[f64]| {
            let b = |i: usize| 2.0 * pi / 3.0 * 0.488603 * c[i];
            [pi * 0.282095 * c[0], b(3), b(1), b(2)]
        };
        Ok(Four(sh.c.iter().flat_map(|c| four(c)).collect()))
    }

    fn material(m: &Material, _: &(), _: &Task) -> Result<Four, BakeError> {
        let up = steradian::sphere::glam::DVec3::Z;
        Ok(Four(m.brdf.eval(up, up).map(|f| f * std::f64::consts::PI).into()))
    }

    fn transfer(_: Option<&Geometry>, _: &Four, _: &(), _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, _: &(), _: &Task) -> Result<(Four, Report), BakeError> {
        let scaled =
            |c: usize, k: usize| parts.light.0[4 * c + k] * parts.material.0[c] / std::f64::consts::PI;
        let linked = Four((0..12).map(|i| scaled(i / 4, i % 4)).collect());
        // The certificate is measured after the bake, against the light and the reflectance as they came.
        Ok((linked, Report::default()))
    }

    fn frame(_: &Bake<Self>, _: &View, _: &mut ()) {}

    fn shade(b: &Bake<Self>, _: &(), q: &Points<'_>, out: &mut Radiance<'_>) {
        for i in 0..q.len() {
            let n = q.n.map(|a| f64::from(a[i]));
            let facing = (0..3).map(|k| n[k] * f64::from(q.wo[k][i])).sum::<f64>() > 0.0;
            for c in 0..3 {
                let l = &b.linked.0[4 * c..4 * c + 4];
                let v = l[0] + l[1] * n[0] + l[2] * n[1] + l[3] * n[2];
                out.rgb[c][i] = if facing { v.max(0.0) as f32 } else { 0.0 };
            }
        }
    }

    fn gpu(_: &Bake<Self>, _: &()) -> GpuTechnique {
        // This one shades on the CPU.
        GpuTechnique {
            slug: Self::CARD.slug,
            modules: vec![],
            entry: Entry::PLAIN,
            tables: vec![],
            uniforms: vec![],
            buffers: vec![],
        }
    }
}

static TWO_BANDS: Erased<TwoBands> = Erased::new();

/// Relative RMS errors in a picture: two bands, three bands.
pub fn run() -> Result<[f64; 2], Error> {
    let mut session = Session::new();
    let mut scene = Scene::of("sphere", Some("lambert:albedo=0.6"), "sky:elevation=30", &mut session)?;
    (scene.settings.width, scene.settings.height) = (48, 48);
    let methods = [Method::Technique(&TWO_BANDS), Method::find("sh_irradiance")?];
    let plan = Plan { reference_tolerance: 1e-2, paths: false, ev: 0.0, certificates: true };
    let answers = session.compare(&scene, &methods, &[Renderer::Cpu], &plan)?.met()?;
    let error = |i: usize| {
        let rendering = answers[i].rendering().and_then(|r| r.errors.as_ref());
        rendering.map_or(f64::NAN, |e| e.0.relative_rms)
    };
    println!("two bands {:.1} %, three bands {:.1} %", 100.0 * error(1), 100.0 * error(2));
    Ok([error(1), error(2)])
}

#[allow(dead_code, reason = "the test calls run()")]
fn main() -> Result<(), Error> {
    run().map(|_| ())
}
