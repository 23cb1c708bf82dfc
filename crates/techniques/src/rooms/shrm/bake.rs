//! The maps B_pq.

use super::Shrm;
use crate::certify::Report;
use crate::shared::light::sun::{self, load_suns, save_suns};
use crate::shared::light::sunlit_spectrum::SunlitSpectrum;
use crate::shared::material::kernels::Kernels;
use crate::shared::maths::harmonics::Harmonics;
use crate::shared::shrm::{Expansion, HighestP, Orders, ScaleTable, choose, diffuse_map, local_maps};
use crate::shared::tables::bundle::Bundle;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Part, Technique};
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_brdf::central::{Argument, Centre};
use steradian_prefilter::Sun;

const HIGHEST: HighestP = HighestP { usual: 5, asked: 8, zonal: 30 };

/// Data that shading reads.
#[derive(Debug, Clone, PartialEq)]
pub struct ReflectionMaps {
    /// The central direction.
    pub centre: Centre,
    /// The direction that y_pq are functions of.
    pub of: Argument,
    /// y_pq with its orders P and Q.
    pub harmonics: Harmonics,
    /// B_pq over C.
    pub maps: Bundle,
    /// Factor of the sum, by elevation.
    pub scale: ScaleTable,
    /// Radiance of the diffuse part over n.
    pub diffuse: Option<Bundle>,
    /// Suns that no map holds.
    pub suns: Vec<Sun>,
    halves: bool,
}

/// Joins light and slices; the error is computed from both.
pub fn link(
    light: &SunlitSpectrum,
    kernels: &Kernels,
    p: &Orders,
    task: &Task,
) -> Result<(ReflectionMaps, Report), BakeError> {
    let slug = Shrm::CARD.slug;
    let (expansion, report) = choose(slug, light, kernels, p, |size| PI / size as f64, HIGHEST, task)?;
    let Expansion { lpq, q, size, .. } = &expansion;
    let harmonics = Harmonics::new(lpq.p, *q);
    let need = (harmonics.len() * (size + 1) * 2 * size * 12) as u64;
    if 2 * need > task.max_memory() {
        return Err(BakeError::Memory { slug, need: 2 * need, allowed: task.max_memory() });
    }
    let mut maps = local_maps(slug, &expansion, *size, task)?;
    let mut diffuse = diffuse_map(slug, &expansion, task)?;
    if p.halves {
        maps.halve();
        diffuse.iter_mut().for_each(Bundle::halve);
    }
    let (centre, of, scale, suns) = (lpq.centre, lpq.of, expansion.scale, expansion.apart.suns);
    let made = ReflectionMaps { centre, of, harmonics, maps, scale, diffuse, suns, halves: p.halves };
    let bytes = made.bytes() as f64;
    Ok((made, report.detail("bytes", bytes)))
}

impl Part for ReflectionMaps {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let centre = self.centre.number();
        let head = [
            centre,
            self.harmonics.p() as f64,
            self.harmonics.q() as f64,
            f64::from(u8::from(self.diffuse.is_some())),
            self.of.number(),
        ];
        put_f64(to, format!("{prefix}.head"), vec![5], head.to_vec());
        self.maps.save(to, format!("{prefix}.maps"), self.halves);
        if let Some(d) = &self.diffuse {
            d.save(to, format!("{prefix}.diffuse"), self.halves);
        }
        self.scale.save(to, prefix);
        save_suns(&self.suns, to, format!("{prefix}.suns"));
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.head");
        let bad = || PartError::Unexpected(name.clone());
        let (_, head) = get_f64(from, &name, 1)?;
        let [centre, p, q, split, of] = head[..] else { return Err(bad()) };
        let centre = Centre::from_number(centre).ok_or_else(bad)?;
        let harmonics = Harmonics::new(p as usize, q as usize);
        let name = format!("{prefix}.maps");
        let maps = Bundle::load(from, &name)?;
        if maps.terms() != harmonics.len() || !maps.is_globe() {
            return Err(PartError::Unexpected(name));
        }
        let halves = Bundle::is_half(from, &name);
        let name = format!("{prefix}.diffuse");
        let diffuse = if split > 0.0 { Some(Bundle::load(from, &name)?) } else { None };
        if diffuse.as_ref().is_some_and(|d| d.terms() != 1 || !d.is_globe()) {
            return Err(PartError::Unexpected(name));
        }
        let (of, scale) = (Argument::from_number(of), ScaleTable::load(from, prefix)?);
        let suns = load_suns(from, &format!("{prefix}.suns"))?;
        Ok(Self { centre, of, harmonics, maps, scale, diffuse, suns, halves })
    }

    fn bytes(&self) -> usize {
        let maps = self.maps.bytes() + self.diffuse.as_ref().map_or(0, Bundle::bytes);
        maps + self.scale.bytes() + sun::BYTES * self.suns.len()
    }
}
