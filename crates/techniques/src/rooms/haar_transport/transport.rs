//! Transport of all sites as sparse columns, one for each wavelet; that of blocked light.

use crate::Part;
use crate::shared::geometry::transport::PerSite;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use steradian_formats::{Tensor, TensorData};
use steradian_parallel::prelude::*;

/// Most sites, so that an entry's 32 bits hold a site's index and a value of 8 bits.
pub const MOST_SITES: usize = 1 << 24;

/// What the 127 magnitudes of an entry stand for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Scale {
    /// Multiples of 1/127 of the largest of a column.
    #[default]
    Even,
    /// Parts of the largest of a column in steps of an octave's ninth, each off by 4 % at most: neighbours
    /// that have the tail of a lobe where others have its peak would all be rounded alike, most of them to
    /// zero.
    Octaves,
}

/// Steps of an octave.
const STEPS: f32 = 9.0;

impl Scale {
    /// The number, −127 to 127, that stands for `x`, in steps of 1/127 of the largest.
    fn rounded(self, x: f32) -> i32 {
        let value = match self {
            Self::Even => x.round().clamp(-127.0, 127.0),
            Self::Octaves => (127.0 + STEPS * (x.abs() / 127.0).log2()).round().clamp(0.0, 127.0).copysign(x),
        };
        value as i32
    }

    /// What the lowest 8 bits of an entry stand for, in steps of 1/127 of the largest.
    fn values(self) -> [f32; 256] {
        std::array::from_fn(|k| {
            let value = k as i32 - 128;
            match self {
                Self::Octaves if value != 0 => {
                    let value = value as f32;
                    (127.0 * ((value.abs() - 127.0) / STEPS).exp2()).copysign(value)
                }
                _ => value as f32,
            }
        })
    }
}

/// A row for each site, a column for each wavelet.
///
/// The scaling coefficient of each face is held in full precision. Of all other coefficients a site keeps the
/// largest, each in eight bits relative to the largest of its column.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Columns {
    /// Number of sites.
    pub sites: usize,
    /// Scaling coefficients of the six faces, `sites` each.
    pub scaling: Vec<f32>,
    /// Index of the first entry of each column, and of the end of the last one.
    pub starts: Vec<u32>,
    /// Value of a step of the 8-bit entries of each column.
    pub steps: Vec<f32>,
    /// Entries of the columns, sites ascending: site · 256 + value + 128.
    pub entries: Vec<u32>,
    /// What values stand for.
    pub scale: Scale,
}

/// Transport of light that is blocked, B = H b.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Transport {
    /// Texels a side of a face.
    pub side: usize,
    /// Unit normals of the sites; zero where there is no surface.
    pub normals: Vec<[f32; 3]>,
    /// B.
    pub columns: Columns,
    /// Length of each column over all sites, coefficients that are not kept included: √Σ b².
    pub norms: Vec<f32>,
    /// Vectors of reflected light in spherical harmonics: none, one or three a site.
    pub reflected: PerSite,
}

/// Transport of a site: the six scaling coefficients, and those coefficients that are kept, by index.
#[derive(Debug, Clone, Default)]
pub struct Row {
    pub scaling: [f32; 6],
    pub kept: Vec<(u32, f32)>,
}

impl Row {
    /// The largest of `all` (the transformed faces of a site) that leave at most √`left` of the vector's
    /// length.
    pub fn of(all: &[f32], side: usize, mut left: f64) -> Self {
        let face = side * side;
        let scaling = std::array::from_fn(|f| all[f * face]);
        // The smallest coefficients are left out, as many as the limit allows.
        let mut others: Vec<(u32, f32)> = (0u32..)
            .zip(all)
            .filter(|(k, x)| !(*k as usize).is_multiple_of(face) && **x != 0.0)
            .map(|(k, x)| (k, *x))
            .collect();
        others.sort_unstable_by(|a, b| a.1.abs().total_cmp(&b.1.abs()).then(a.0.cmp(&b.0)));
        let mut out = 0;
        for (_, x) in &others {
            left -= f64::from(*x).powi(2);
            if left < 0.0 {
                break;
            }
            out += 1;
        }
        others.drain(..out);
        Self { scaling, kept: others }
    }
}

impl Columns {
    /// Builds the columns from the rows of all sites.
    pub fn new(rows: &[Row], side: usize, scale: Scale) -> Self {
        let columns = 6 * side * side;
        let (mut counts, mut largest) = (vec![0u32; columns + 1], vec![0.0f32; columns]);
        for (k, x) in rows.iter().flat_map(|r| &r.kept) {
            counts[*k as usize + 1] += 1;
            largest[*k as usize] = largest[*k as usize].max(x.abs());
        }
        for k in 0..columns {
            counts[k + 1] += counts[k];
        }
        let starts = counts.clone();
        let steps: Vec<f32> = largest.iter().map(|x| x / 127.0).collect();
        let mut entries = vec![0; starts[columns] as usize];
        for (site, row) in (0u32..).zip(rows) {
            for (k, x) in &row.kept {
                let step = steps[*k as usize];
                let value = if step > 0.0 { scale.rounded(x / step) } else { 0 };
                let at = &mut counts[*k as usize];
                entries[*at as usize] = (site << 8) | (value + 128) as u32;
                *at += 1;
            }
        }
        let scaling = (0..6).flat_map(|f| rows.iter().map(move |r| r.scaling[f])).collect();
        Self { sites: rows.len(), scaling, starts, steps, entries, scale }
    }

    /// Σ_k L_k B_k at every site over wavelets `chosen` (number and light, per channel) and the six scaling
    /// coefficients of the light.
    pub fn apply(&self, scaling: &[[f32; 3]; 6], chosen: &[(u32, [f32; 3])]) -> Vec<[f32; 3]> {
        let mut out = vec![[0.0f32; 3]; self.sites];
        self.add(scaling, chosen, &mut out);
        out
    }

    /// Adds [`Columns::apply`] to `out`, which has a place for each site.
    pub fn add(&self, scaling: &[[f32; 3]; 6], chosen: &[(u32, [f32; 3])], out: &mut [[f32; 3]]) {
        // Number of sites of a block, whose values stay in the cache while columns are read.
        const BLOCK: usize = 4096;
        let values = self.scale.values();
        out.par_chunks_mut(BLOCK).enumerate().for_each(|(b, block)| {
            let first = b * BLOCK;
            for (f, l) in scaling.iter().enumerate() {
                let column = &self.scaling[f * self.sites + first..][..block.len()];
                for (to, t) in block.iter_mut().zip(column) {
                    (0..3).for_each(|c| to[c] += l[c] * t);
                }
            }
            let end = first + block.len();
            for (k, l) in chosen {
                let k = *k as usize;
                let column = &self.entries[self.starts[k] as usize..self.starts[k + 1] as usize];
                let from = column.partition_point(|e| (e >> 8) < first as u32);
                let l = l.map(|l| l * self.steps[k]);
                for e in column[from..].iter().take_while(|e| (**e >> 8) < end as u32) {
                    let t = values[(e & 255) as usize];
                    let to = &mut block[(e >> 8) as usize - first];
                    (0..3).for_each(|c| to[c] += l[c] * t);
                }
            }
        });
    }

    /// Bytes of the numbers.
    pub fn bytes(&self) -> usize {
        4 * (self.scaling.len() + self.starts.len() + self.steps.len() + self.entries.len())
    }
}

/// Transport of all sites towards one eye.
pub struct Seen {
    /// A channel, or three.
    pub channels: Vec<Columns>,
    /// Length of each column over all sites and channels, coefficients that are not kept included.
    pub norms: Vec<f32>,
}

impl Part for Transport {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let name = |n: &str| format!("{prefix}.{n}");
        let Columns { sites, scaling, starts, steps, entries, .. } = &self.columns;
        put_f32(to, name("normals"), vec![*sites, 3], self.normals.concat());
        put_f32(to, name("scaling"), vec![6, *sites], scaling.clone());
        put_f32(to, name("steps"), vec![steps.len()], steps.clone());
        put_f32(to, name("norms"), vec![steps.len()], self.norms.clone());
        for (n, v) in [("starts", starts), ("entries", entries)] {
            let tensor = Tensor { shape: vec![v.len()], data: TensorData::U32(v.clone()) };
            to.tensors.insert(name(n), tensor);
        }
        self.reflected.save(to, &name("reflected"));
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = |n: &str| format!("{prefix}.{n}");
        let unexpected = |n: &str| PartError::Unexpected(name(n));
        let words = |n: &str| match from.tensors.get(&name(n)) {
            Some(Tensor { shape, data: TensorData::U32(v) }) if *shape == [v.len()] => Ok(v.clone()),
            _ => Err(unexpected(n)),
        };
        let (shape, scaling) = get_f32(from, &name("scaling"), 2)?;
        let (_, normals) = get_f32(from, &name("normals"), 2)?;
        let (_, steps) = get_f32(from, &name("steps"), 1)?;
        let (_, norms) = get_f32(from, &name("norms"), 1)?;
        let (starts, entries) = (words("starts")?, words("entries")?);
        let (columns, sites) = (steps.len(), shape[1]);
        let side = (columns / 6).isqrt();
        if shape[0] != 6 || columns > 0 && (6 * side * side != columns || !side.is_power_of_two()) {
            return Err(unexpected("scaling"));
        }
        if normals.len() != 3 * sites {
            return Err(unexpected("normals"));
        }
        let normals = normals.as_chunks::<3>().0.to_vec();
        let rising = starts.windows(2).all(|w| w[0] <= w[1]);
        let ends = starts.len() == columns + 1 && starts.last().is_some_and(|e| *e as usize == entries.len());
        if norms.len() != columns || !rising || !ends {
            return Err(unexpected("starts"));
        }
        for k in 0..columns {
            let column = &entries[starts[k] as usize..starts[k + 1] as usize];
            let inside = column.last().is_none_or(|e| ((e >> 8) as usize) < sites);
            if !inside || column.windows(2).any(|w| w[0] >> 8 >= w[1] >> 8) {
                return Err(unexpected("entries"));
            }
        }
        let reflected = PerSite::load(from, &name("reflected"))?;
        let columns = Columns { sites, scaling, starts, steps, entries, scale: Scale::Even };
        Ok(Self { side, normals, columns, norms, reflected })
    }

    fn bytes(&self) -> usize {
        4 * (3 * self.normals.len() + self.norms.len()) + self.columns.bytes() + self.reflected.bytes()
    }
}
