//! The cubes B̂_pq.

use super::ShrmGlobal;
use crate::certify::Report;
use crate::shared::light::sun::{self, load_suns, save_suns};
use crate::shared::light::sunlit_spectrum::SunlitSpectrum;
use crate::shared::material::kernels::Kernels;
use crate::shared::maths::harmonics::Harmonics;
use crate::shared::shrm::{HighestP, Orders, ScaleTable, choose, diffuse_map, global_maps};
use crate::shared::tables::bundle::Bundle;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Part, Technique};
use steradian_base::{ParamError, ParamInfo, ParamValues, Task};
use steradian_brdf::central::{Argument, Centre};
use steradian_prefilter::Sun;
use steradian_prefilter::edge_cube::spacing;

/// Highest P: 36 cubes (P = 5) have 216 of the 256 layers that every GPU supports; strands, which need one
/// cube for each p, 41 with 246.
const HIGHEST: HighestP = HighestP { usual: 5, asked: 5, zonal: 40 };
/// Most texels per edge, where the tolerance decides.
const MOST: usize = 256;

const DISTANT: ParamInfo = ParamInfo::switch(
    "distant",
    false,
    "the viewer is far away: one reflection map per frame (eq. 5.35), one lookup per point",
);

/// The parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Params {
    /// Orders and resolutions.
    pub orders: Orders,
    /// Is the viewer far away, so that one map is made per frame?
    pub distant: bool,
}

impl steradian_base::Params for Params {
    const INFO: &'static [ParamInfo] = &{
        let mut all = [DISTANT; Orders::INFO.len() + 1];
        let mut i = 0;
        while i < Orders::INFO.len() {
            all[i] = Orders::INFO[i];
            i += 1;
        }
        all
    };

    fn from_values(values: &ParamValues) -> Result<Self, ParamError> {
        values.check(Self::INFO)?;
        Ok(Self { orders: Orders::read(values)?, distant: values.is_on(&DISTANT)? })
    }

    fn to_values(&self) -> ParamValues {
        let mut values = self.orders.to_values();
        values.0.insert(DISTANT.name.into(), self.distant.into());
        values
    }
}

/// Data that shading reads.
#[derive(Debug, Clone, PartialEq)]
pub struct Cubes {
    /// The central direction.
    pub centre: Centre,
    /// The direction that y_pq are functions of.
    pub of: Argument,
    /// y_pq up to P: in world directions, or, where q = 0 alone is left, about C, which needs no frame.
    pub harmonics: Harmonics,
    /// B̂_pq over C.
    pub maps: Bundle,
    /// Factor of the sum, by elevation.
    pub scale: ScaleTable,
    /// Radiance of the diffuse part over n.
    pub diffuse: Option<Bundle>,
    /// Suns that no map holds.
    pub suns: Vec<Sun>,
    /// Is the viewer far away, so that one map is made per frame?
    pub distant: bool,
    halves: bool,
}

/// Joins light and slices; the error is computed from both.
pub fn link(
    light: &SunlitSpectrum,
    kernels: &Kernels,
    p: &Params,
    task: &Task,
) -> Result<(Cubes, Report), BakeError> {
    let slug = ShrmGlobal::CARD.slug;
    // B̂_pq has frequencies up to F + P.
    let apart = |size| 1.3 * spacing(size);
    let (expansion, report) = choose(slug, light, kernels, &p.orders, apart, HIGHEST, task)?;
    let lpq = &expansion.lpq;
    let size = p.orders.size.unwrap_or(expansion.size.min(MOST));
    let harmonics = Harmonics::new(lpq.p, if expansion.q == 0 { 0 } else { lpq.p });
    let need = (harmonics.len() * 6 * (size + 1) * (size + 1) * 12) as u64;
    if 2 * need > task.max_memory() {
        return Err(BakeError::Memory { slug, need: 2 * need, allowed: task.max_memory() });
    }
    let mut maps = global_maps(slug, &expansion, size, task)?;
    let mut diffuse = diffuse_map(slug, &expansion, task)?;
    if p.orders.halves {
        maps.halve();
        diffuse.iter_mut().for_each(Bundle::halve);
    }
    let made = Cubes {
        centre: lpq.centre,
        of: lpq.of,
        harmonics,
        maps,
        scale: expansion.scale,
        diffuse,
        suns: expansion.apart.suns,
        distant: p.distant,
        halves: p.orders.halves,
    };
    let bytes = made.bytes() as f64;
    Ok((made, report.detail("bytes", bytes)))
}

fn flag(b: bool) -> f64 {
    f64::from(u8::from(b))
}

impl Part for Cubes {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let head = vec![
            self.centre.number(),
            self.harmonics.p() as f64,
            flag(self.diffuse.is_some()),
            flag(self.distant),
            self.of.number(),
            self.harmonics.q() as f64,
        ];
        put_f64(to, format!("{prefix}.head"), vec![6], head);
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
        let [centre, p, split, distant, of, q] = head[..] else { return Err(bad()) };
        let centre = Centre::from_number(centre).ok_or_else(bad)?;
        let harmonics = Harmonics::new(p as usize, if q > 0.0 { p as usize } else { 0 });
        let name = format!("{prefix}.maps");
        let maps = Bundle::load(from, &name)?;
        if maps.terms() != harmonics.len() || maps.is_globe() {
            return Err(PartError::Unexpected(name));
        }
        let halves = Bundle::is_half(from, &name);
        let name = format!("{prefix}.diffuse");
        let diffuse = if split > 0.0 { Some(Bundle::load(from, &name)?) } else { None };
        if diffuse.as_ref().is_some_and(|d| d.terms() != 1 || !d.is_globe()) {
            return Err(PartError::Unexpected(name));
        }
        let scale = ScaleTable::load(from, prefix)?;
        let (of, distant) = (Argument::from_number(of), distant > 0.0);
        let suns = load_suns(from, &format!("{prefix}.suns"))?;
        Ok(Self { centre, of, harmonics, maps, scale, diffuse, suns, distant, halves })
    }

    fn bytes(&self) -> usize {
        let maps = self.maps.bytes() + self.diffuse.as_ref().map_or(0, Bundle::bytes);
        maps + self.scale.bytes() + sun::BYTES * self.suns.len()
    }
}
