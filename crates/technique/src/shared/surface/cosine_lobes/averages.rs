//! The numbers of lobes as images give them, in a form that can be averaged: single precision, with levels.

use super::super::texels::TextureLayers;
use super::{LAYERS, LEAST, Lobe};
use glam::DVec3;
use std::sync::Arc;
use steradian_brdf::model::lafortune::{Cosine, Lafortune};
use steradian_scene::surface::{Planes, Texture, Wrap};

/// Scatter of the axes below which they count as one.
const ONE: f32 = 1e-5;

/// Lobes by texel, in single precision: what [`super::CosineLobes`] are made of and measured against.
#[derive(Debug, Clone)]
pub struct Averages {
    /// Lobes.
    pub count: usize,
    /// ρ_d, then [`LAYERS`] a lobe.
    pub(super) texels: TextureLayers,
}

pub(super) fn constant(v: [f64; 3]) -> Arc<Texture> {
    Arc::new(Texture::constant(v.map(|x| x as f32)))
}

/// The layers of a lobe from its ρ, the three components of C, and its n.
fn weighed(parts: Vec<Arc<Texture>>) -> Vec<Arc<Texture>> {
    let wrap = parts.iter().find(|t| t.size() != (1, 1)).map_or([Wrap::Repeat; 2], |t| t.wrap());
    let parts = TextureLayers::new(parts);
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

/// The lobe of sums over a footprint: of the largest value, and of that value times C, 1/n and |C|².
/// Factor, C and exponent.
#[inline(always)]
pub(super) fn mean([rho, x, y, z, s, q]: [f32; LAYERS]) -> (f32, [f32; 3], f32) {
    let weight = rho.max(1e-30).recip();
    let [x, y, z, s, q] = [x, y, z, s, q].map(|v| v * weight);
    let square = x * x + y * y + z * z;
    let scatter = 1.0 - square / q.max(1e-30);
    let s = s.max(1e-30);
    if scatter > ONE {
        let wide = s + 0.5 * scatter;
        let longer = (q / square.max(1e-30)).sqrt();
        // 1/(n + 1) of both.
        let scale = s * (1.0 + wide) / (wide * (1.0 + s));
        return (rho * scale, [x, y, z].map(|v| longer * v), wide.recip());
    }
    (rho, [x, y, z], s.recip())
}

impl Averages {
    /// Lobes from the images among `textures` ([`super::PLANES`]); where there is no image, from the diffuse
    /// albedo `kd` and the lobes `own`; a lobe that has neither is Phong's, C = (−1, −1, 1), with n = 1.
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
        Self { count, texels: TextureLayers::new(layers) }
    }

    /// Texels a row and rows.
    pub fn size(&self) -> (usize, usize) {
        self.texels.size()
    }

    /// For each texel of all levels ρ_d, and to `lobe` each lobe: sums of its layers by channel.
    pub(super) fn each(&self, mut texel: impl FnMut(usize, [f32; 3], &[[[f32; 3]; LAYERS]])) {
        let layers: Vec<Vec<[f32; 3]>> = self.texels.layers().collect();
        let mut lobes = vec![[[0.0; 3]; LAYERS]; self.count];
        for i in 0..layers[0].len() {
            for (k, lobe) in lobes.iter_mut().enumerate() {
                *lobe = std::array::from_fn(|j| layers[1 + LAYERS * k + j][i]);
            }
            texel(i, layers[0][i], &lobes);
        }
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

/// The lobe of red, green and blue whose sums are `layers`.
#[inline(always)]
pub(super) fn lobe_of(layers: &[[f32; 3]; LAYERS]) -> Lobe {
    let mut out = Lobe::default();
    for c in 0..3 {
        let (rho, axis, n) = mean(layers.map(|l| l[c]));
        out.rho[c] = rho;
        out.n[c] = n;
        out.c.iter_mut().zip(axis).for_each(|(to, v)| to[c] = v);
    }
    out
}
