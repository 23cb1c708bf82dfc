//! Lights, views and reflectances of the tests.

use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_brdf::{Brdf, Domain, Info, Lobe, Sample};
use steradian_light::{Environment, Lights};
use steradian_reference::{Lookup, Reference};
use steradian_sphere::{Frame, Layout, SphereImage};

/// A closure as a reflectance: `f_cos` in the local frame.
pub struct Made<F> {
    pub f_cos: F,
    pub domain: Domain,
    pub lobes: Vec<Lobe>,
}

impl<F> std::fmt::Debug for Made<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Made")
    }
}

static INFO: Info =
    Info { name: "made", source: "", formula: "", units: "", parameters: &[], reciprocity: "", energy: "" };

impl<F: Fn(DVec3, DVec3) -> [f64; 3] + Send + Sync> Brdf for Made<F> {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        "made".into()
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.f_cos(wi, wo).map(|f| f / wi.z)
    }

    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if self.domain == Domain::Hemisphere && wi.z <= 0.0 { [0.0; 3] } else { (self.f_cos)(wi, wo) }
    }

    fn domain(&self) -> Domain {
        self.domain
    }

    fn lobes(&self, _: DVec3) -> Vec<Lobe> {
        self.lobes.clone()
    }

    fn sample(&self, _: DVec3, _: DVec2) -> Option<Sample> {
        None
    }

    fn pdf(&self, _: DVec3, _: DVec3) -> f64 {
        0.0
    }
}

/// A reflectance of one channel's formula.
pub fn made(domain: Domain, f_cos: impl Fn(DVec3, DVec3) -> f64 + Send + Sync) -> impl Brdf {
    Made { f_cos: move |wi, wo| [f_cos(wi, wo); 3], domain, lobes: Vec::new() }
}

/// Numbers in [0, 1) that look random.
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = (self.0 >> 33) ^ (self.0 >> 45);
        (x & 0x3fff_ffff) as f64 / f64::from(1u32 << 30)
    }
}

pub fn image(w: usize, h: usize, mut f: impl FnMut(usize, usize) -> [f32; 3]) -> SphereImage {
    let mut out = SphereImage::new(Layout::LatLong, w, h);
    for j in 0..h {
        for i in 0..w {
            let (k, v) = (out.index(0, i, j), f(i, j));
            for c in 0..3 {
                out.planes[c][k] = v[c];
            }
        }
    }
    out
}

/// Noise with a bright texel now and then.
pub fn stormy(w: usize, h: usize, seed: u64) -> SphereImage {
    let mut s = Noise(seed);
    for _ in 0..5 {
        s.next();
    }
    image(w, h, |_, _| {
        let spark = if s.next() < 4.0 / (w * h) as f64 { 3e3 } else { 1.0 };
        [s.next(), s.next(), s.next()].map(|v| (v * v * spark) as f32)
    })
}

pub fn reference(image: SphereImage, lookup: Lookup) -> Reference {
    Reference::new(&Lights::from(Environment { image }), lookup, &Task::quiet()).expect("sound light")
}

/// A frame and a view at `degrees` from its normal.
pub fn view(n: DVec3, degrees: f64, azimuth: f64) -> (Frame, DVec3) {
    let frame = Frame::from_normal(n.normalize());
    let (s, c) = degrees.to_radians().sin_cos();
    (frame, frame.to_world(DVec3::new(s * azimuth.cos(), s * azimuth.sin(), c)))
}

/// Centre of texel (i, j).
pub fn centre(w: usize, h: usize, i: usize, j: usize) -> DVec3 {
    let phi = ((i as f64 + 0.5) / w as f64 - 0.5) * 2.0 * PI;
    let theta = (j as f64 + 0.5) / h as f64 * PI;
    DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
}

/// |a − b| over the larger magnitude of b, worst channel.
pub fn difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    let top = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let worst = (0..3).fold(0.0_f64, |m, c| m.max((a[c] - b[c]).abs()));
    if worst == 0.0 { 0.0 } else { worst / top }
}

/// Every kind of reflectance there is: smooth, narrow, jumping at the horizon, creased, brushed.
pub const SPECS: [&str; 37] = [
    "lambert",
    "oren-nayar:sigma=0.5",
    "minnaert:k=0.5",
    "phong:n=20",
    "phong:n=1000",
    "phong-map:n=1",
    "phong-map:n=50",
    "phong-normalized:s=50",
    "microfacet:sigma=0.3",
    "microfacet:sigma=0.05",
    "blinn-phong:n=300",
    "blinn-phong-gl:kd=0.3,ks=0.5,n=50",
    "cook-torrance:m=0.4",
    "cook-torrance:m=0.1,f0=0.9/0.5/0.1",
    "cook-torrance:m=0.1,g=smith",
    "ggx:alpha=1",
    "ggx:alpha=0.3",
    "ggx:alpha=0.1",
    "ggx:alpha=0.04",
    "ggx:alpha=0.005",
    "ggx:ax=0.01,ay=0.5",
    "phong:n=100000",
    "ggx:ax=0.05,ay=0.4",
    "ashikhmin-shirley:nu=1000,nv=10,rs=0.5,rd=0.5",
    "ashikhmin-shirley:nu=50,nv=50",
    "ward:ax=0.05,ay=0.3",
    "ward:ax=0.1,ay=0.1,variant=1992",
    "ward:ax=0.2,ay=0.2,variant=duer",
    "banks:n=50",
    "banks-map:n=3",
    "banks-map:n=200",
    "kajiya-kay:s=5",
    "kajiya-kay:s=100",
    "lafortune:@skin",
    "lafortune:cx=-1,cy=-1,cz=0.9,n=30",
    "poulin-fournier:n=20",
    "sgd:gold-metallic-paint",
];
