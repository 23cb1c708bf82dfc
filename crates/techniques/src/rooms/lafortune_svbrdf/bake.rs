//! The numbers of the lobes by texel, as what averages.

use super::shade;
use crate::local::{FileName, Place, error_at, texel};
use crate::shared::surface::texels::Texels;
use crate::{BakeError, Material};
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::{ParamInfo, params};
use steradian_brdf::Form;
use steradian_scene::surface::{Texture, Wrap};

/// Lobes at most.
pub const MOST: usize = 4;
/// Textures of a lobe: its largest value, and times that C in x, in y, in z, 1/n and |C|², each for red, green and blue.
pub const LAYERS: usize = 6;
/// Smallest exponent: of 0 there is no inverse.
pub const LEAST: f64 = 1e-3;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Albedo of the diffuse part.
        pub rho_d: Option<FileName> = ParamInfo::file("rho_d", "image of the diffuse albedo; auto: that of the reflectance").auto(f64::NAN),
        /// Factor of the first lobe.
        pub rho_1: Option<FileName> = ParamInfo::file("rho_1", "image of the first lobe's factor; auto: that of the reflectance, or 0").auto(f64::NAN),
        /// C of the first lobe.
        pub c_1: Option<FileName> = ParamInfo::file("c_1", "image of the first lobe's C, as red, green and blue (.exr or .pfm); auto: that of the reflectance, or -1, -1, 1").auto(f64::NAN),
        /// Exponent of the first lobe.
        pub n_1: Option<FileName> = ParamInfo::file("n_1", "image of the first lobe's exponent, 0.001 at least (.exr or .pfm); auto: that of the reflectance, or 1").auto(f64::NAN),
        /// Factor of the second lobe.
        pub rho_2: Option<FileName> = ParamInfo::file("rho_2", "the same of the second lobe").auto(f64::NAN),
        /// C of the second lobe.
        pub c_2: Option<FileName> = ParamInfo::file("c_2", "the same of the second lobe").auto(f64::NAN),
        /// Exponent of the second lobe.
        pub n_2: Option<FileName> = ParamInfo::file("n_2", "the same of the second lobe").auto(f64::NAN),
    }
}

/// Lobes by texel.
pub struct Lobes {
    /// Lobes.
    pub count: usize,
    /// ρ_d, then [`LAYERS`] a lobe.
    pub texels: Texels,
}

fn constant(v: [f64; 3]) -> Arc<Texture> {
    Arc::new(Texture::constant(v.map(|x| x as f32)))
}

/// The layers of a lobe from its ρ, the three components of C, and its n. Everything is weighed with the largest value of the
/// lobe, ρ max|C|ⁿ, about an axis of max|C| = 1: texels without a lobe have no say in its shape.
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

pub(super) fn bake(m: &Material) -> Result<Lobes, BakeError> {
    let slug = "lafortune_svbrdf";
    let (kd, own) = match m.brdf.form() {
        Form::Lafortune(l) => (l.kd, l.lobes),
        Form::Lambert { albedo } => (albedo, Vec::new()),
        _ => return Err(BakeError::Material { slug, why: "takes lafortune and lambert only".into() }),
    };
    let plane = |name: &str, k: usize| m.textures.get(&format!("{name}_{k}"));
    let named = (1..=2).filter(|k| ["rho", "c", "n"].iter().any(|n| plane(n, *k).is_some())).max();
    let count = own.len().max(named.unwrap_or(0));
    let mut layers = vec![m.textures.get("rho_d").cloned().unwrap_or_else(|| constant(kd))];
    for k in 0..count {
        let lobe = |f: &dyn Fn(&steradian_brdf::model::lafortune::Cosine) -> f64, usual: f64| {
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
    Ok(Lobes { count, texels: Texels::new(layers) })
}

/// Against the equation at the texels themselves.
pub(super) fn error(t: &Lobes, m: &Material) -> f64 {
    let size = t.texels.size();
    let exact = |at: Place, wi: DVec3, wo: DVec3| {
        let layer = |k: usize| t.texels.sample(k, at.uv, 0.0).map(f64::from);
        let mut f = layer(0).map(|x| x / PI);
        for k in 0..t.count {
            let [rho, x, y, z, s, _] = std::array::from_fn(|j| layer(1 + LAYERS * k + j));
            for c in (0..3).filter(|c| rho[*c] > 0.0) {
                let cosine = (x[c] * wo.x * wi.x + y[c] * wo.y * wi.y + z[c] * wo.z * wi.z) / rho[c];
                f[c] += if cosine > 0.0 { rho[c] * cosine.powf(rho[c] / s[c]) } else { 0.0 };
            }
        }
        f.map(|f| f * wi.z)
    };
    error_at(
        &*m.brdf,
        |k| texel(k, size).0,
        exact,
        |at, wi, wo| shade::f_cos(t, &shade::texel(t, at), wi, wo),
    )
}
