//! Scattering textures: which texel each texel sees along fixed directions (Heidrich, Daubert, Kautz & Seidel
//! 2000; Kautz 2004 (STAR), 6.4.3).

use super::HeightField;
use glam::Vec3;
use steradian_parallel::prelude::*;

/// A ray is followed over this many periods at most, as horizons are.
const PERIODS: usize = 4;
/// Crossings of columns or rows of a ray that is not parallel to them.
const PARALLEL: f32 = 1e-7;

/// A field prepared for rays: the highest corner of each square.
pub struct Caster<'a> {
    field: &'a HeightField,
    tops: Vec<f32>,
    highest: f32,
}

impl<'a> Caster<'a> {
    /// Prepares a field.
    pub fn new(field: &'a HeightField) -> Self {
        let (w, h) = (field.width, field.height);
        let top = |k: usize| {
            let [a, b, c, d] = corners(field, k % w, k / w);
            a.max(b).max(c.max(d))
        };
        Self { field, tops: (0..w * h).map(top).collect(), highest: field.range().1 }
    }

    /// The texel nearest to where the ray from the vertex of column `i` and row `j` in the unit direction `d`
    /// (x to the right, y up, z out of the picture) first meets the surface of triangles; `None` where it
    /// leaves upwards, and after four periods.
    ///
    /// A direction that leaves the vertex below a triangle there, as directions about a mean normal may,
    /// meets that triangle at once: of its other two vertices the nearer one is hit.
    pub fn hit(&self, i: usize, j: usize, d: Vec3) -> Option<usize> {
        let (w, h) = (self.field.width, self.field.height);
        let across = d.x.hypot(d.y);
        // False for NaN too.
        let level = across > PARALLEL * d.z.abs();
        if !level {
            return None;
        }
        // Rows count downwards.
        let ([right, down], slope) = ([d.x / across, -d.y / across], d.z / across);
        let z0 = self.field.z[j * w + i];
        let reach = (PERIODS * w.max(h)) as f32;
        // Distance from one column to the next, and from one row to the next.
        let step = |rate: f32| if rate.abs() > PARALLEL { 1.0 / rate.abs() } else { f32::INFINITY };
        let (columns, rows) = (step(right), step(down));
        let before = |k: usize, n: usize, rate: f32| if rate < 0.0 { (k + n - 1) % n } else { k };
        let (mut ci, mut cj) = (before(i, w, right), before(j, h, down));
        // Start of the ray in the square's own coordinates, incremented as squares are passed.
        let (mut at_i, mut at_j) = (f32::from(u8::from(right < 0.0)), f32::from(u8::from(down < 0.0)));
        let (mut passed_i, mut passed_j) = (1.0f32, 1.0f32);
        let mut s0 = 0.0f32;
        loop {
            let (to_column, to_row) = (passed_i * columns, passed_j * rows);
            let s1 = to_column.min(to_row);
            let (z_in, z_out) = (z0 + slope * s0, z0 + slope * s1);
            if z_in.min(z_out) <= self.tops[cj * w + ci]
                && let Some([u, v]) =
                    self.square([ci, cj], [at_i, at_j], [right, down], [z0, slope], [s0, s1])
            {
                return Some((cj + usize::from(v >= 0.5)) % h * w + (ci + usize::from(u >= 0.5)) % w);
            }
            if s1 > reach || (slope >= 0.0 && z_out > self.highest) {
                return None;
            }
            if to_column <= to_row {
                ci = if right < 0.0 { before(ci, w, -1.0) } else { (ci + 1) % w };
                at_i -= right.signum();
                passed_i += 1.0;
            }
            if to_row <= to_column {
                cj = if down < 0.0 { before(cj, h, -1.0) } else { (cj + 1) % h };
                at_j -= down.signum();
                passed_j += 1.0;
            }
            s0 = s1;
        }
    }

    /// Position in a square, as parts of its sides, at which the ray meets one of its two triangles between
    /// the distances `from` and `to`.
    fn square(
        &self,
        [ci, cj]: [usize; 2],
        at: [f32; 2],
        rate: [f32; 2],
        [z0, slope]: [f32; 2],
        [from, to]: [f32; 2],
    ) -> Option<[f32; 2]> {
        let [z00, z10, z01, z11] = corners(self.field, ci, cj);
        let place = |s: f32| [0, 1].map(|k| (at[k] + s * rate[k]).clamp(0.0, 1.0));
        // The diagonal runs from the upper left to the lower right.
        let surface = |[u, v]: [f32; 2]| {
            if u > v {
                z00 + u * (z10 - z00) + v * (z11 - z10)
            } else {
                z00 + v * (z01 - z00) + u * (z11 - z01)
            }
        };
        let above = |s: f32| z0 + slope * s - surface(place(s));
        let middle = (at[1] - at[0]) / (rate[0] - rate[1]);
        let ends = [if middle > from && middle < to { middle } else { to }, to];
        let (mut s, mut gap) = (from, if from > 0.0 { above(from).max(0.0) } else { 0.0 });
        for end in ends {
            let next = above(end);
            if next < 0.0 {
                // From the vertex itself into a triangle: the hit is at its opposite end.
                let meets = if s == 0.0 { end } else { s + (end - s) * gap / (gap - next) };
                return Some(place(meets));
            }
            (s, gap) = (end, next);
        }
        None
    }
}

/// Heights of a square's corners: upper left, upper right, lower left, lower right.
fn corners(field: &HeightField, i: usize, j: usize) -> [f32; 4] {
    let (w, h) = (field.width, field.height);
    let (next, below) = (if i + 1 < w { i + 1 } else { 0 }, if j + 1 < h { j + 1 } else { 0 });
    [field.z[j * w + i], field.z[j * w + next], field.z[below * w + i], field.z[below * w + next]]
}

/// The texel that every texel sees along each of a set of directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Scattering {
    directions: usize,
    links: Vec<u32>,
}

impl Scattering {
    /// The link of a direction that leaves the surface.
    pub const NONE: u32 = u32::MAX;

    /// The links of all texels of a field along `count` directions each: `along(texel, k)` is unit direction
    /// k there, texels in rows from the top. `None` where `go_on` says no.
    pub fn new(
        field: &HeightField,
        count: usize,
        along: &(dyn Fn(usize, usize) -> Vec3 + Sync),
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let caster = Caster::new(field);
        let mut links = vec![Self::NONE; field.z.len() * count];
        links.par_chunks_mut((field.width * count).max(1)).enumerate().for_each(|(j, out)| {
            if !go_on() {
                return;
            }
            for (i, out) in out.chunks_exact_mut(count).enumerate() {
                let texel = j * field.width + i;
                for (k, link) in out.iter_mut().enumerate() {
                    *link = caster.hit(i, j, along(texel, k)).map_or(Self::NONE, |t| t as u32);
                }
            }
        });
        go_on().then_some(Self { directions: count, links })
    }

    /// Directions of a texel.
    pub fn directions(&self) -> usize {
        self.directions
    }

    /// All links, texel by texel, direction by direction.
    pub fn links(&self) -> &[u32] {
        &self.links
    }

    /// The texel that `texel` sees along direction `k`.
    #[inline(always)]
    pub fn link(&self, texel: usize, k: usize) -> Option<usize> {
        let link = self.links[texel * self.directions + k];
        (link != Self::NONE).then_some(link as usize)
    }

    /// The part of all directions that meet the surface.
    pub fn met(&self) -> f64 {
        let met = self.links.iter().filter(|l| **l != Self::NONE).count();
        met as f64 / self.links.len().max(1) as f64
    }

    /// Bytes of the links.
    pub fn bytes(&self) -> usize {
        4 * self.links.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use std::f64::consts::TAU;

    fn field(w: usize, h: usize, z: impl Fn(usize, usize) -> f64) -> HeightField {
        HeightField::new(w, h, (0..w * h).map(|k| z(k % w, k / w) as f32).collect()).expect("finite")
    }

    /// Direction `k` of `n`, cosine-distributed about z.
    fn cosine(k: usize, n: usize) -> DVec3 {
        let r2 = (k as f64 + 0.5) / n as f64;
        let (s, c) = (2.399_963_229_728_653 * k as f64).sin_cos();
        DVec3::new(r2.sqrt() * c, r2.sqrt() * s, (1.0 - r2).sqrt())
    }

    /// A ray upwards meets something exactly where horizons say that light does not arrive.
    #[test]
    fn rays_meet_what_hides_light() {
        let noise =
            |i: usize, j: usize| f64::from((i * 7919 + j * 104_729 + i * j * 31) as u32 % 1009) / 500.0;
        let waves = |i: usize, j: usize| 3.0 * (0.4 * i as f64).sin() * (TAU * j as f64 / 20.0).cos();
        for f in [field(23, 17, noise), field(40, 20, waves), field(1, 9, noise)] {
            let caster = Caster::new(&f);
            let (mut hidden, mut wrong) = (0, 0);
            for k in 0..3000 {
                let (i, j) = (k * 7 % f.width(), k * 5 % f.height());
                let d = cosine(k, 3000);
                let meets = caster.hit(i, j, d.as_vec3()).is_some();
                hidden += usize::from(meets);
                // At a grazed edge rounding decides.
                wrong += usize::from(meets == f.sees(i, j, d));
            }
            assert!(hidden > 100 && wrong <= 2, "{hidden} hidden, {wrong} wrong");
        }
    }

    /// The hit is the texel nearest to the point where small steps first get below the surface.
    #[test]
    fn rays_meet_the_first_thing() {
        let f = field(31, 29, |i, j| {
            2.5 * (0.61 * i as f64 + 0.3 * j as f64).sin() + (TAU * j as f64 / 7.25).cos()
        });
        let caster = Caster::new(&f);
        let surface = |x: f64, y: f64| {
            let (i, j, u, v) = (x.floor() as i64, y.floor() as i64, x - x.floor(), y - y.floor());
            let at = |a, b| f64::from(f.at(i + a, j + b));
            let (z00, z11) = (at(0, 0), at(1, 1));
            if u > v {
                z00 + u * (at(1, 0) - z00) + v * (z11 - at(1, 0))
            } else {
                z00 + v * (at(0, 1) - z00) + u * (z11 - at(0, 1))
            }
        };
        let (mut met, mut off) = (0, 0);
        for k in 0..2000usize {
            let (i, j) = (k * 11 % 31, k * 13 % 29);
            // Downwards too.
            let d = (cosine(k, 2000) - DVec3::Z * 0.4 * f64::from(k as u32 % 3)).normalize();
            let across = d.x.hypot(d.y);
            let place = |s: f64| (i as f64 + s * d.x / across, j as f64 - s * d.y / across);
            let below = |s: f64| {
                let (x, y) = place(s);
                f64::from(f.at(i as i64, j as i64)) + s * d.z / across < surface(x, y) - 1e-6
            };
            let first = (1..12_000).map(|n| 0.005 * f64::from(n)).find(|s| below(*s));
            let got = caster.hit(i, j, d.as_vec3());
            // A hit at the vertex itself is another vertex of its triangle.
            let Some(s) = first.filter(|s| *s > 0.01) else { continue };
            let (x, y) = place(s);
            met += 1;
            let near = got.is_some_and(|t| {
                let apart = |a: f64, b: usize, n: f64| {
                    let e = (a - b as f64).rem_euclid(n);
                    e.min(n - e)
                };
                apart(x, t % 31, 31.0) < 0.52 && apart(y, t / 31, 29.0) < 0.52
            });
            off += usize::from(!near);
        }
        assert!(met > 300 && off <= 3, "{met} met, {off} elsewhere");
    }

    /// The form factor between the walls of a groove of opening α is 1 − sin(α/2), and flat ground sees
    /// nothing.
    #[test]
    fn walls_of_a_groove_see_each_other() {
        for slope in [0.5, 1.0, 2.0] {
            let (n, count) = (256usize, 256);
            let f = field(n, 1, |i, _| slope * (i as f64 - 128.0).abs());
            let along = |texel: usize, k: usize| {
                let n = f.normal(texel, 0).as_dvec3();
                let t = DVec3::new(n.z, 0.0, -n.x);
                let d = cosine(k, count);
                (t * d.x + DVec3::Y * d.y + n * d.z).as_vec3()
            };
            let s = Scattering::new(&f, count, &along, &|| true).expect("not stopped");
            let want = 1.0 - 1.0 / (1.0 + slope * slope).sqrt();
            assert!((s.met() - want).abs() < 0.01, "{slope}: {} {want}", s.met());
            assert_eq!(s.bytes(), 4 * n * count);
            assert!(Scattering::new(&f, count, &along, &|| false).is_none());
        }
        let flat = field(8, 8, |_, _| 3.0);
        let up = |_: usize, k: usize| cosine(k, 64).as_vec3();
        assert_eq!(Scattering::new(&flat, 64, &up, &|| true).expect("not stopped").met(), 0.0);
    }
}
