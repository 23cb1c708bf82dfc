//! Generalised cosine lobes whose parameters differ from texel to texel, stored in a form that can be
//! averaged.
//!
//! C and n do not average under a footprint. Levels hold means of C, |C|² and 1/n, the lobe's variance across
//! its axis, weighed with the largest value ρ max|C|ⁿ of each texel's lobe, about axes of max|C| = 1, so that
//! texels without a lobe have no say: the length of C is the root of the mean of |C|², its direction that of
//! the mean, and what the directions scatter, 1 − |E\[C\]|²/E\[|C|²\], half of it each way, adds to 1/n, with
//! ρ scaled so that the lobe keeps its integral. `cosine_lobes.wgsl` has the same function.

use super::texels::Texels;
use crate::local::{Content, Plane};
use glam::DVec3;
use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;
use steradian_brdf::model::lafortune::{Cosine, Lafortune};
use steradian_brdf::{Brdf, Form};
use steradian_scene::surface::{Planes, Texture, Wrap};

/// Most lobes.
pub const MOST: usize = 4;
/// Textures of a lobe: its largest value, and times that C in x, in y, in z, 1/n and |C|², each for red,
/// green and blue.
pub const LAYERS: usize = 6;
/// Least exponent, since 1/n is stored.
pub const LEAST: f64 = 1e-3;
/// Largest factor of a texel.
const MOST_FACTOR: f32 = 1e30;
/// Scatter of the axes below which they count as one.
const ONE: f32 = 1e-5;
/// The lobe of averaged values, in WGSL: `fn cosine_lobe(rho, x, y, z, s, q: vec3<f32>) -> CosineLobe`.
pub const WGSL: &str = include_str!("cosine_lobes.wgsl");

/// The images of the lobes' parameters: factors as colours, C as red, green and blue, exponents as numbers.
pub const PLANES: [Plane; 7] = [
    Plane::new("rho_d", Content::Colours).within(0.0, MOST_FACTOR, 3),
    Plane::new("rho_1", Content::Colours).within(0.0, MOST_FACTOR, 3),
    Plane::new("c_1", Content::Numbers),
    Plane::new("n_1", Content::Numbers).within(LEAST as f32, 1e8, 3),
    Plane::new("rho_2", Content::Colours).within(0.0, MOST_FACTOR, 3),
    Plane::new("c_2", Content::Numbers),
    Plane::new("n_2", Content::Numbers).within(LEAST as f32, 1e8, 3),
];

/// Lobes by texel.
#[derive(Debug, Clone)]
pub struct CosineLobes {
    /// Lobes.
    pub count: usize,
    /// ρ_d, then [`LAYERS`] a lobe.
    pub texels: Texels,
}

/// A lobe of a point, for red, green and blue.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lobe {
    /// Factor.
    pub rho: [f32; 3],
    /// The components of C in x, y and z.
    pub c: [[f32; 3]; 3],
    /// Exponent.
    pub n: [f32; 3],
}

/// The reflectance of a point.
#[derive(Debug, Clone, Copy, Default)]
pub struct Texel {
    /// ρ_d/π.
    pub rho_d: [f32; 3],
    /// The point's lobes, then unused ones of factor 0.
    pub lobes: [Lobe; MOST],
}

/// The lobes of a reflectance whose parameters images may replace: its own, or none for a Lambertian one;
/// `None` for any other reflectance.
pub fn lobes_of(brdf: &dyn Brdf) -> Option<Lafortune> {
    match brdf.form() {
        Form::Lafortune(own) => Some(own),
        Form::Lambert { albedo } => Some(Lafortune { spec: brdf.spec(), kd: albedo, lobes: Vec::new() }),
        _ => None,
    }
}

fn constant(v: [f64; 3]) -> Arc<Texture> {
    Arc::new(Texture::constant(v.map(|x| x as f32)))
}

/// The layers of a lobe from its ρ, the three components of C, and its n.
fn weighed(parts: Vec<Arc<Texture>>) -> Vec<Arc<Texture>> {
    let wrap = parts.iter().find(|t| t.size() != (1, 1)).map_or([Wrap::Repeat; 2], |t| t.wrap());
    let parts = Texels::new(parts);
    let (width, height) = parts.size();
    let texel = |k: usize| -> [[f32; 3]; LAYERS] {
        let uv = [(k % width) as f32 + 0.5, (k / width) as f32 + 0.5];
        let uv = [uv[0] / width as f32, uv[1] / height as f32];
        let [rho, x, y, z, n] = std::array::from_fn(|j| parts.sample(j, uv, 0.0).map(f64::from));
        let mut out = [[0.0; 3]; LAYERS];
        for c in 0..3 {
            let (v, n) = (DVec3::new(x[c], y[c], z[c]), n[c].max(LEAST));
            let most = v.abs().max_element();
            if most > 0.0 {
                let (axis, peak) = (v / most, (rho[c] * most.powf(n)).clamp(0.0, 1e30));
                let all = [1.0, axis.x, axis.y, axis.z, 1.0 / n, axis.length_squared()];
                all.iter().zip(&mut out).for_each(|(from, to)| to[c] = (peak * from) as f32);
            }
        }
        out
    };
    let all: Vec<_> = (0..width * height).map(texel).collect();
    let layer = |j: usize| {
        let planes = [0, 1, 2].map(|c| all.iter().map(|t| t[j][c]).collect());
        Texture::new(width, height, &planes).map(|t| Arc::new(t.with_wrap(wrap)))
    };
    (0..LAYERS).filter_map(layer).collect()
}

/// The texture of one channel of another in all three.
fn channel(t: &Texture, axis: usize) -> Arc<Texture> {
    t.levels()
        .next()
        .and_then(|(width, height, texels)| {
            let plane: Vec<f32> = texels.iter().map(|x| x[axis]).collect();
            Texture::new(width, height, &[plane.clone(), plane.clone(), plane])
        })
        .map_or_else(|| constant([0.0; 3]), |made| Arc::new(made.with_wrap(t.wrap())))
}

impl CosineLobes {
    /// Lobes from the images among `textures` ([`PLANES`]); where there is no image, from the diffuse albedo
    /// `kd` and the lobes `own`; a lobe that has neither is Phong's, C = (−1, −1, 1), with n = 1.
    pub fn new(kd: [f64; 3], own: &[[Cosine; 3]], textures: &Planes) -> Self {
        let plane = |name: &str, k: usize| textures.get(&format!("{name}_{k}"));
        let named = (1..=2).filter(|k| ["rho", "c", "n"].iter().any(|n| plane(n, *k).is_some())).max();
        let count = own.len().max(named.unwrap_or(0));
        let mut layers = vec![textures.get("rho_d").cloned().unwrap_or_else(|| constant(kd))];
        for k in 0..count {
            let lobe = |f: &dyn Fn(&Cosine) -> f64, usual: f64| {
                constant(own.get(k).map_or([usual; 3], |l| [0, 1, 2].map(|c| f(&l[c]))))
            };
            let mut parts = vec![plane("rho", k + 1).cloned().unwrap_or_else(|| lobe(&|l| l.ks, 0.0))];
            for (axis, usual) in [-1.0, -1.0, 1.0].into_iter().enumerate() {
                let own = || lobe(&|l| l.c.to_array()[axis], usual);
                parts.push(plane("c", k + 1).map_or_else(own, |t| channel(t, axis)));
            }
            parts.push(plane("n", k + 1).cloned().unwrap_or_else(|| lobe(&|l| l.n, 1.0)));
            layers.extend(weighed(parts));
        }
        Self { count, texels: Texels::new(layers) }
    }

    /// The lobes at `uv`, averaged over a square of side `footprint`.
    #[inline(always)]
    pub fn at(&self, uv: [f32; 2], footprint: f32) -> Texel {
        let layer = |k: usize| self.texels.sample(k, uv, footprint);
        let mut out = Texel { rho_d: layer(0).map(|x| x * FRAC_1_PI), ..Texel::default() };
        for (k, lobe) in out.lobes.iter_mut().enumerate().take(self.count) {
            let [rho, x, y, z, s, q] = std::array::from_fn(|j| layer(1 + LAYERS * k + j));
            lobe.rho = rho;
            for c in 0..3 {
                let weight = rho[c].max(1e-30).recip();
                let [x, y, z, s, q] = [x, y, z, s, q].map(|v| v[c] * weight);
                let square = x * x + y * y + z * z;
                let scatter = 1.0 - square / q.max(1e-30);
                let (mut wide, mut longer) = (s.max(1e-30), 1.0);
                if scatter > ONE {
                    wide += 0.5 * scatter;
                    longer = (q / square.max(1e-30)).sqrt();
                    // 1/(n + 1) of both.
                    lobe.rho[c] *= s * (1.0 + wide) / (wide * (1.0 + s));
                }
                lobe.c.iter_mut().zip([x, y, z]).for_each(|(to, v)| to[c] = longer * v);
                lobe.n[c] = wide.recip();
            }
        }
        out
    }

    /// The reflectance at `uv`, of no footprint: between texels the numbers that stand there, in double
    /// precision.
    pub fn reflectance(&self, uv: [f32; 2]) -> Lafortune {
        let layer = |k: usize| self.texels.sample(k, uv, 0.0).map(f64::from);
        let lobe = |k: usize| {
            let [rho, x, y, z, s, _] = std::array::from_fn(|j| layer(1 + LAYERS * k + j));
            std::array::from_fn(|c| {
                let weight = rho[c].max(1e-30);
                let axis = DVec3::new(x[c], y[c], z[c]) / weight;
                let n = if s[c] > 0.0 { rho[c] / s[c] } else { 1.0 };
                Cosine { c: axis, n, ks: rho[c].max(0.0) }
            })
        };
        let spec = String::from("lafortune");
        Lafortune { spec, kd: layer(0), lobes: (0..self.count).map(lobe).collect() }
    }
}
