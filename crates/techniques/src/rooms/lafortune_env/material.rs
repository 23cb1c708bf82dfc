//! The reflectance's factor: its lobes themselves, so that no file has to be there when a bake is loaded.

use super::LafortuneEnv;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Material, Part, Technique};
use glam::DVec3;
use steradian_brdf::model::lafortune::{Cosine, Lafortune};
use steradian_brdf::{Brdf, Form, spec_without_folders};

/// Most terms (lobes times different channels) that shading sums.
const MOST: usize = 64;

/// Generalised cosine lobes and a diffuse part.
pub struct Cosines(pub Lafortune);

/// Channels of a lobe that share C and n: one lookup.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// (C_x, C_y, C_z).
    pub c: DVec3,
    /// Exponent.
    pub n: f64,
    /// ρ per channel, 0 where the channel has another term.
    pub k: [f64; 3],
}

impl Cosines {
    /// The material's lobes.
    pub fn of(m: &Material) -> Result<Self, BakeError> {
        let slug = LafortuneEnv::CARD.slug;
        let refuse = |why: String| BakeError::Material { slug, why };
        let Form::Lafortune(own) = m.brdf.form() else { return Err(refuse("takes lafortune only".into())) };
        let own = Self(own);
        let count = own.terms().len();
        if count > MOST {
            return Err(refuse(format!(
                "takes up to {MOST} lookups, not {count}: use fewer lobes, or reference"
            )));
        }
        Ok(own)
    }

    /// What shading sums.
    pub fn terms(&self) -> Vec<Term> {
        let mut all: Vec<Term> = Vec::new();
        for lobe in &self.0.lobes {
            let first = all.len();
            for (channel, cosine) in lobe.iter().enumerate().filter(|(_, l)| l.ks > 0.0) {
                let same = |t: &&mut Term| t.c == cosine.c && t.n == cosine.n;
                if let Some(t) = all[first..].iter_mut().find(same) {
                    t.k[channel] = cosine.ks;
                } else {
                    let mut k = [0.0; 3];
                    k[channel] = cosine.ks;
                    all.push(Term { c: cosine.c, n: cosine.n, k });
                }
            }
        }
        all
    }
}

impl Part for Cosines {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        to.metadata.insert(format!("steradian.{prefix}.brdf"), spec_without_folders(&self.0.spec));
        let cosine = |l: &Cosine| [l.c.x, l.c.y, l.c.z, l.n, l.ks];
        let lobes = self.0.lobes.iter().flatten().flat_map(cosine).collect();
        put_f64(to, format!("{prefix}.lobes"), vec![self.0.lobes.len(), 3, 5], lobes);
        put_f64(to, format!("{prefix}.kd"), vec![3], self.0.kd.to_vec());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let key = format!("steradian.{prefix}.brdf");
        let spec = from.metadata.get(&key).ok_or(PartError::Missing(key))?.clone();
        let name = format!("{prefix}.lobes");
        let (shape, v) = get_f64(from, &name, 3)?;
        if shape[1..] != [3, 5] || v.iter().any(|x| !x.is_finite()) {
            return Err(PartError::Unexpected(name));
        }
        let cosine =
            |v: &[f64]| Cosine { c: DVec3::new(v[0], v[1], v[2]), n: v[3].max(0.0), ks: v[4].max(0.0) };
        let lobes = v.chunks_exact(15).map(|l| std::array::from_fn(|c| cosine(&l[5 * c..]))).collect();
        let name = format!("{prefix}.kd");
        let (_, kd) = get_f64(from, &name, 1)?;
        let kd = kd.try_into().map_err(|_| PartError::Unexpected(name))?;
        Ok(Self(Lafortune { spec, kd, lobes }))
    }

    fn bytes(&self) -> usize {
        0
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        Some(&self.0)
    }
}
