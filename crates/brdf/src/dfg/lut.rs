//! Tables over n·wo and roughness, for lookups by shaders.

use super::charlie::{Albedo, Visibility};
use super::{DfgTable, average_albedo, ggx};
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;

/// Contents of a table's channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// A and B of Karis 2013: F_ss = f0 A + B; and E_avg.
    ScaleBias,
    /// B, E = A + B and the albedo of Charlie sheen (Neubelt's V): Filament, F_ss = B + f0 (E − B).
    Filament,
    /// A, B and the albedo of Charlie sheen (Estevez & Kulla's V): the Khronos sample viewer's `outputLUT`.
    Khronos,
    /// The albedo of Charlie sheen with Estevez & Kulla's V (KHR_materials_sheen).
    Charlie,
    /// The albedo of Charlie sheen with Neubelt's V.
    CharlieNeubelt,
}

impl Layout {
    /// Every layout.
    pub const ALL: [Self; 5] =
        [Self::ScaleBias, Self::Filament, Self::Khronos, Self::Charlie, Self::CharlieNeubelt];

    /// The name that commands and files use.
    pub fn name(self) -> &'static str {
        match self {
            Self::ScaleBias => "ggx",
            Self::Filament => "filament",
            Self::Khronos => "khronos",
            Self::Charlie => "charlie",
            Self::CharlieNeubelt => "charlie-neubelt",
        }
    }

    /// The layout of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|l| l.name().eq_ignore_ascii_case(name))
    }

    /// Meaning of each channel.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::ScaleBias => &[
                "scale A: multiplies f0",
                "bias B: added",
                "E_avg: hemispherical mean of A + B, the same in a row",
            ],
            Self::Filament => &["B", "E = A + B", "albedo of Charlie sheen, Neubelt's visibility"],
            Self::Khronos => &[
                "scale A: multiplies f0",
                "bias B: added",
                "albedo of Charlie sheen, Estevez & Kulla's visibility",
            ],
            Self::Charlie => &["albedo of Charlie sheen, Estevez & Kulla's visibility"],
            Self::CharlieNeubelt => &["albedo of Charlie sheen, Neubelt's visibility"],
        }
    }

    /// The albedo of sheen in it.
    fn sheen(self) -> Option<Visibility> {
        match self {
            Self::ScaleBias => None,
            Self::Filament | Self::CharlieNeubelt => Some(Visibility::Neubelt),
            Self::Khronos | Self::Charlie => Some(Visibility::EstevezKulla),
        }
    }

    /// The channels at cosine n·wo and perceptual roughness, each 0 … 1; absent channels are 0.
    pub fn at(self, mu: f64, perceptual_roughness: f64) -> [f64; 3] {
        Row::new(self, perceptual_roughness).at(mu)
    }
}

/// A table at one perceptual roughness.
struct Row {
    layout: Layout,
    alpha: f64,
    /// E_avg where the layout has it.
    average: f64,
    sheen: Option<Albedo>,
}

impl Row {
    fn new(layout: Layout, perceptual_roughness: f64) -> Self {
        let alpha = (perceptual_roughness * perceptual_roughness).max(1e-4);
        let average = if layout == Layout::ScaleBias { average_albedo(alpha) } else { 0.0 };
        Self { layout, alpha, average, sheen: layout.sheen().map(|v| Albedo::new(alpha, v)) }
    }

    fn at(&self, mu: f64) -> [f64; 3] {
        let sheen = self.sheen.as_ref().map_or(0.0, |s| s.at(mu));
        if matches!(self.layout, Layout::Charlie | Layout::CharlieNeubelt) {
            return [sheen, 0.0, 0.0];
        }
        let d = ggx(mu, self.alpha);
        match self.layout {
            Layout::ScaleBias => [d.scale, d.bias, self.average],
            Layout::Filament => [d.bias, d.albedo(), sheen],
            _ => [d.scale, d.bias, sheen],
        }
    }
}

/// A table.
#[derive(Debug, Clone, PartialEq)]
pub struct Lut {
    /// Contents of the channels.
    pub layout: Layout,
    /// Texels per side.
    pub size: usize,
    /// Row by row: column i at n·wo = (i + ½)/size, row j at perceptual roughness (j + ½)/size, alpha its
    /// square and at least 1e-4.
    pub values: Vec<[f32; 3]>,
}

impl Lut {
    /// Arrangement of texels, in words.
    pub const AXES: &'static str = "column i: n.v = (i + 0.5)/N; row j from the top: perceptual roughness = \
        (j + 0.5)/N, alpha = its square, at least 1e-4; read bilinearly at (n.v, perceptual roughness)";

    /// The table of `layout` with `size` texels a side.
    pub fn new(layout: Layout, size: usize, task: &Task) -> Result<Self, Cancelled> {
        let at = |k: usize| (k as f64 + 0.5) / size as f64;
        let row = |j: usize| -> Result<Vec<[f32; 3]>, Cancelled> {
            task.check()?;
            let row = Row::new(layout, at(j));
            Ok((0..size).map(|i| row.at(at(i)).map(|v| v as f32)).collect())
        };
        let rows: Result<Vec<_>, _> = (0..size).into_par_iter().map(row).collect();
        Ok(Self { layout, size, values: rows?.concat() })
    }

    /// Bilinear lookup at n·wo and perceptual roughness, both clamped to the outermost texel centres.
    pub fn lookup(&self, mu: f64, perceptual_roughness: f64) -> [f64; 3] {
        let (i, x) = DfgTable::split_at(self.size, mu);
        let (j, y) = DfgTable::split_at(self.size, perceptual_roughness);
        let last = self.size.saturating_sub(1);
        let at = |i: usize, j: usize| {
            self.values.get(j.min(last) * self.size + i.min(last)).copied().unwrap_or_default()
        };
        std::array::from_fn(|c| {
            let row = |j: usize| f64::from(at(i, j)[c]) * (1.0 - x) + f64::from(at(i + 1, j)[c]) * x;
            row(j) * (1.0 - y) + row(j + 1) * y
        })
    }

    /// The largest difference between lookups and the exact values at `n` × `n` points between the outermost
    /// centres, and its root mean square, over the channels.
    pub fn interpolation_error(&self, n: usize) -> (f64, f64) {
        let edge = 0.5 / self.size as f64;
        // Away from the centres, where lookups are exact.
        let at = |k: usize| edge + (1.0 - 2.0 * edge) * (k as f64 + 0.5) / n as f64;
        let row = |j: usize| {
            let r = at(j);
            let row = Row::new(self.layout, r);
            let mut e = (0.0f64, 0.0f64);
            for i in 0..n {
                let (got, exact) = (self.lookup(at(i), r), row.at(at(i)));
                for c in 0..self.layout.channels().len() {
                    let d = (got[c] - exact[c]).abs();
                    e = (e.0.max(d), e.1 + d * d);
                }
            }
            e
        };
        let rows: Vec<(f64, f64)> = (0..n).into_par_iter().map(row).collect();
        let (worst, sum) = rows.iter().fold((0.0f64, 0.0), |a, b| (a.0.max(b.0), a.1 + b.1));
        (worst, (sum / (n * n * self.layout.channels().len()).max(1) as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_agree_with_each_other() {
        let task = Task::quiet();
        let all = Layout::ALL.map(|l| Lut::new(l, 8, &task).unwrap());
        let [ggx, filament, khronos, charlie, neubelt] = &all;
        for k in 0..64 {
            let (g, f, h) = (ggx.values[k], filament.values[k], khronos.values[k]);
            assert!((g[0] + g[1] - f[1]).abs() < 1e-6 && g[1] == f[0]);
            assert_eq!((g[0], g[1]), (h[0], h[1]));
            assert_eq!((h[2], f[2]), (charlie.values[k][0], neubelt.values[k][0]));
        }
        assert_eq!(Layout::from_name("Filament"), Some(Layout::Filament));
    }

    #[test]
    fn lookups_meet_centres_and_miss_little_between() {
        let lut = Lut::new(Layout::ScaleBias, 32, &Task::quiet()).unwrap();
        let v = lut.lookup(10.5 / 32.0, 20.5 / 32.0);
        assert!((v[0] - f64::from(lut.values[20 * 32 + 10][0])).abs() < 1e-6);
        let (worst, rms) = lut.interpolation_error(16);
        assert!(worst < 0.02 && rms < 2e-3, "{worst} {rms}");
    }
}
