//! f_cos as a table of spherical harmonic coefficients over the view: Kautz, Sloan & Snyder (2002), *Fast,
//! Arbitrary BRDF Shading for Low-Frequency Lighting Using Spherical Harmonics*, section 3; STAR04 eqs 47–49.
//!
//! > c_i(wo) = ∫ y_i(wi) f(wi, wo) ⟨n·wi⟩ dwi
//!
//! in the local frame (t, b, n), wo on the paraboloid (s, t) = (x, y)/(1 + z), bilinear. Texels reach one
//! beyond the rim ρ = 1 on all sides, where they continue the table linearly, so that grazing views are not
//! blended with anything else.
//!
//! Where f grows without end towards grazing views, as (n·wo)^p with p < 0 (Minnaert 1941 with k < 1 has p =
//! k − 1), texels hold c_i/(n·wo)^p and lookups multiply: linear interpolation of the power itself is off by
//! a quarter between 88° and 90°.

mod energy;
mod frames;
mod kernel;
mod local;
mod look;
mod part;
mod places;
mod shorts;
mod sites;
#[cfg(test)]
mod tests;
mod vectors;
mod wgsl;
mod world;

pub use frames::SiteFrames;
pub use kernel::{LightLanes, shade, shade_places};
pub use local::{LocalLight, MOST_BANDS, shade_local};
pub use part::Views;
pub use places::{MOST_NODES, PLANE, Places};
pub use sites::shade_sites;
pub use wgsl::{
    fixed_modules, light_uniforms, local_modules, modules, place_modules, site_modules, views_buffer,
};
pub use world::WorldViews;

use crate::shared::tables::aligned::Aligned;
use crate::tensors::{PartError, TensorFile, get_f32, get_f64, put_f32, put_f64};
use glam::DVec3;
use shorts::Shorts;
use steradian_base::{Cancelled, Task};
use steradian_brdf::Brdf;
use steradian_brdf::views::paraboloid::{GRAZING, LEAST_POLE, Layout, fill, lattice, pole};

/// Fewest and most bands.
pub const BANDS: [usize; 2] = [3, 15];
/// Coefficients over the view.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewTable {
    bands: usize,
    size: usize,
    /// Number of tables, stored one after the other: one, or several where the reflectance varies
    /// ([`Places`]).
    tables: usize,
    /// One channel, which [`ViewTable::tint`] makes three, or three.
    channels: usize,
    tint: [f32; 3],
    /// The power p of n·wo that lookups multiply with: below 0, or 0 for none.
    pole: f32,
    /// Numbers from channel to channel: bands² filled up with zeros to whole registers.
    stride: usize,
    /// Table by table, row by row from t = −1, then channel, then l² + l + m.
    data: Aligned<f32>,
    /// Rounded copy as 16-bit integers, present where the table is of 16-bit floats and no power of n·wo is
    /// factored out.
    shorts: Option<Shorts>,
}

/// Numbers of a channel of a texel.
fn stride(bands: usize) -> usize {
    (bands * bands).next_multiple_of(16)
}

impl ViewTable {
    /// Bytes that [`ViewTable::bake`] needs.
    pub fn need(bands: usize, size: usize) -> u64 {
        (size * size * 3 * stride(bands) * 4) as u64
    }

    /// The table of a reflectance: `size`² texels, 8 at least.
    pub fn bake(brdf: &dyn Brdf, bands: usize, size: usize, task: &Task) -> Result<Self, Cancelled> {
        Self::of_all(&[brdf], bands, size, task)
    }

    /// Tables of several reflectances one after the other.
    pub fn of_all(brdfs: &[&dyn Brdf], bands: usize, size: usize, task: &Task) -> Result<Self, Cancelled> {
        let mut rgb = Self {
            bands,
            size,
            tables: brdfs.len(),
            channels: 3,
            tint: [1.0; 3],
            // The lowest power of all is factored out of every table; lookups multiply it back.
            pole: brdfs.iter().map(|b| pole(*b)).fold(0.0, f64::min) as f32,
            stride: stride(bands),
            data: Aligned::default(),
            shorts: None,
        };
        let mut data = Vec::new();
        for brdf in brdfs {
            let layout = Layout { bands, size, stride: rgb.stride, pole: rgb.pole };
            data.extend(fill(*brdf, layout, task)?);
        }
        rgb.data = Aligned::from(&data[..]);
        Ok(rgb.condensed())
    }

    /// Stores a single channel and a tint where the channels are proportional.
    fn condensed(self) -> Self {
        let plane = |c: usize| self.data.chunks_exact(self.stride).skip(c).step_by(3).flatten();
        let energy = |c: usize| plane(c).map(|x| f64::from(*x).powi(2)).sum::<f64>();
        let Some(first) =
            (0..3).max_by(|a, b| energy(*a).total_cmp(&energy(*b))).filter(|c| energy(*c) > 0.0)
        else {
            return Self { channels: 1, data: plane(0).copied().collect(), ..self };
        };
        let product =
            |c: usize| plane(c).zip(plane(first)).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>();
        let tint = [0, 1, 2].map(|c| (product(c) / energy(first)) as f32);
        let largest = plane(first).fold(0.0f32, |m, x| m.max(x.abs()));
        let same =
            |c: usize| plane(c).zip(plane(first)).all(|(a, b)| (a - tint[c] * b).abs() <= 2e-6 * largest);
        if (0..3).all(same) {
            Self { channels: 1, tint, data: plane(first).copied().collect(), ..self }
        } else {
            self
        }
    }

    /// Bands.
    pub fn bands(&self) -> usize {
        self.bands
    }

    /// Texels along an edge.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of tables.
    pub fn tables(&self) -> usize {
        self.tables
    }

    /// Is one channel kept for three?
    pub fn is_mono(&self) -> bool {
        self.channels == 1
    }

    /// Factors of the single channel that give three; 1 where three are stored.
    pub fn tint(&self) -> [f32; 3] {
        self.tint
    }

    /// Rounded to 16-bit floats.
    pub fn halve(&mut self) {
        self.data.iter_mut().for_each(|x| *x = half::f16::from_f32(*x).to_f32());
        self.find_shorts();
    }

    /// Stores the numbers as 16-bit integers too, if lookups need no power of n·wo and all numbers are 16-bit
    /// floats.
    fn find_shorts(&mut self) {
        let is_half = |x: &f32| {
            let half = half::f16::from_f32(*x);
            half.is_finite() && half.to_f32() == *x
        };
        let are = self.pole == 0.0 && self.data.iter().all(is_half);
        self.shorts = are.then(|| Shorts::new(&self.data, self.stride, self.bands * self.bands));
    }

    /// The coefficients at a local view, by channel, of the first table.
    pub fn lookup(&self, wo: DVec3) -> [Vec<f32>; 3] {
        self.lookup_of(0, wo)
    }

    /// The coefficients at a local view, by channel, of table `k`.
    pub fn lookup_of(&self, k: usize, wo: DVec3) -> [Vec<f32>; 3] {
        let [reach, h] = lattice(self.size);
        let at = |x: f64| {
            let p = ((x / (1.0 + wo.z) + reach) / h).clamp(0.0, (self.size - 1) as f64);
            let i = (p as usize).min(self.size - 2);
            (i, (p - i as f64) as f32)
        };
        let ((i, u), (j, v)) = (at(wo.x), at(wo.y));
        let power = self.power(wo.z as f32);
        let texel = |i: usize, j: usize, c: usize| {
            let texel = (k * self.size + j) * self.size + i;
            let at = (texel * self.channels + c % self.channels) * self.stride;
            &self.data[at..at + self.bands * self.bands]
        };
        std::array::from_fn(|c| {
            let four =
                [(0, 0, (1.0 - u) * (1.0 - v)), (1, 0, u * (1.0 - v)), (0, 1, (1.0 - u) * v), (1, 1, u * v)];
            let mut out = vec![0.0; self.bands * self.bands];
            for (x, y, w) in four {
                out.iter_mut()
                    .zip(texel(i + x, j + y, c))
                    .for_each(|(o, t)| *o += power * w * self.tint[c] * t);
            }
            out
        })
    }

    /// (n·wo)^p, with n·wo clamped to the lowest at which reflectance is tabulated.
    fn power(&self, cosine: f32) -> f32 {
        if self.pole == 0.0 { 1.0 } else { cosine.max(GRAZING as f32).powf(self.pole) }
    }

    /// The texels of the first table's channel `c`, coefficient `k`, row by row, without the power of n·wo: a
    /// plane of the paper's figure 2.
    pub fn plane(&self, c: usize, k: usize) -> Vec<f32> {
        let tint = self.tint[c];
        let of = |t: &[f32]| tint * t[(c % self.channels) * self.stride + k];
        self.data.chunks_exact(self.channels * self.stride).take(self.size * self.size).map(of).collect()
    }

    /// Bytes of the texels.
    pub fn bytes(&self) -> usize {
        4 * self.data.len() / self.stride * self.bands * self.bands
    }

    /// Writes the table under names that begin with `prefix`.
    pub fn save(&self, to: &mut TensorFile, prefix: &str) {
        let n = self.bands * self.bands;
        let data = self.data.chunks_exact(self.stride).flat_map(|c| &c[..n]).copied().collect();
        // Tables of several reflectances are saved one below the other.
        let rows = self.tables * self.size;
        put_f32(to, format!("{prefix}.views"), vec![rows, self.size, self.channels, n], data);
        put_f64(to, format!("{prefix}.tint"), vec![3], self.tint.map(f64::from).to_vec());
        put_f64(to, format!("{prefix}.pole"), vec![1], vec![f64::from(self.pole)]);
    }

    /// Reads a table that [`ViewTable::save`] wrote.
    pub fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.views");
        let (shape, v) = get_f32(from, &name, 4)?;
        let [rows, size, channels, n] = shape[..] else { return Err(PartError::Unexpected(name)) };
        let bands = n.isqrt();
        let sound = rows > 0
            && rows.is_multiple_of(size.max(1))
            && (8..=1 << 12).contains(&size)
            && [1, 3].contains(&channels)
            && bands * bands == n
            && (BANDS[0]..=BANDS[1]).contains(&bands);
        if !sound {
            return Err(PartError::Unexpected(name));
        }
        let name = format!("{prefix}.tint");
        let (_, tint) = get_f64(from, &name, 1)?;
        let [r, g, b] = tint[..] else { return Err(PartError::Unexpected(name)) };
        let name = format!("{prefix}.pole");
        let (_, pole) = get_f64(from, &name, 1)?;
        let [pole] = pole[..] else { return Err(PartError::Unexpected(name)) };
        if !(LEAST_POLE..=0.0).contains(&pole) {
            return Err(PartError::Unexpected(name));
        }
        let mut data = Vec::with_capacity(v.len() / n * stride(bands));
        for c in v.chunks_exact(n) {
            data.extend(c);
            data.resize(data.len().next_multiple_of(stride(bands)), 0.0);
        }
        let (tint, pole) = ([r, g, b].map(|x| x as f32), pole as f32);
        let data = Aligned::from(&data[..]);
        let tables = rows / size;
        let mut out =
            Self { bands, size, tables, channels, tint, pole, stride: stride(bands), data, shorts: None };
        out.find_shorts();
        Ok(out)
    }
}
