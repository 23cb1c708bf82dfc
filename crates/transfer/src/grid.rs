//! The hemisphere as a square: a map of known density, and cells of it at every power of two.
//!
//! A point of the unit square goes to the unit disk by the concentric map (Shirley & Chiu 1997, "A Low
//! Distortion Map Between Disk and Square") and from there to a height z with density proportional to z + c:
//! between uniform in solid angle, best for integrals of V alone, and cosine-weighted, best for integrals of
//! V (n·w). Cells are numbered along Morton's curve, so that the children of cell i are 4i … 4i + 3 and
//! neighbours are near.

use glam::Vec3;
use std::f32::consts::FRAC_PI_4;
use std::f64::consts::PI;

/// c of the density. With it the tolerance of integrals of V (n·w) is a fifth of that of integrals of V.
pub const LIFT: f64 = 0.2;

/// ∫ (z + c) dω over the hemisphere.
pub const MEASURE: f64 = 2.0 * PI * (0.5 + LIFT);

/// The direction, about +z, of a point of the unit square.
#[inline(always)]
pub fn direction(a: f32, b: f32) -> Vec3 {
    const C: f32 = LIFT as f32;
    let (x, y) = (2.0 * a - 1.0, 2.0 * b - 1.0);
    // The larger of the two is the radius on the disk.
    let along = x.abs() > y.abs();
    let (r, q) = if along { (x, y) } else { (y, x) };
    let phi = if r == 0.0 { 0.0 } else { FRAC_PI_4 * (q / r) };
    let (s, c) = sin_cos(phi);
    let (u, v) = if along { (c, s) } else { (s, c) };
    // z² + 2cz = (1 + 2c)(1 − r²).
    let z = (C * C + (1.0 + 2.0 * C) * (1.0 - r * r).max(0.0)).sqrt() - C;
    let sine = r.signum() * (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(sine * u, sine * v, z)
}

/// Sine and cosine of |x| ≤ π/4 to the precision of f32 (their series).
#[inline(always)]
fn sin_cos(x: f32) -> (f32, f32) {
    let t = x * x;
    let s = x * (1.0 + t * (-1.0 / 6.0 + t * (1.0 / 120.0 + t * (-1.0 / 5040.0 + t * (1.0 / 362_880.0)))));
    let c = 1.0 + t * (-0.5 + t * (1.0 / 24.0 + t * (-1.0 / 720.0 + t * (1.0 / 40_320.0))));
    (s, c)
}

/// Column and row of cell `i`.
#[inline(always)]
pub fn place(i: u32) -> [u32; 2] {
    [even_bits(i), even_bits(i >> 1)]
}

#[inline(always)]
fn even_bits(i: u32) -> u32 {
    let mut x = i & 0x5555_5555;
    x = (x | (x >> 1)) & 0x3333_3333;
    x = (x | (x >> 2)) & 0x0f0f_0f0f;
    x = (x | (x >> 4)) & 0x00ff_00ff;
    (x | (x >> 8)) & 0xffff
}

/// The cell at a column and a row.
#[inline(always)]
pub fn cell_at(x: u32, y: u32) -> u32 {
    spread_bits(x) | spread_bits(y) << 1
}

#[inline(always)]
fn spread_bits(i: u32) -> u32 {
    let mut x = i & 0xffff;
    x = (x | (x << 8)) & 0x00ff_00ff;
    x = (x | (x << 4)) & 0x0f0f_0f0f;
    x = (x | (x << 2)) & 0x3333_3333;
    (x | (x << 1)) & 0x5555_5555
}

/// Cells of all levels above `level`: where that level begins in a pyramid.
pub fn start(level: u32) -> usize {
    ((1usize << (2 * level)) - 1) / 3
}

/// Where in its cell, column `x` and row `y` of a level, the point lies that a site's ray goes through, in
/// [0, 1)²: identical on every machine.
///
/// The points of a level's 4^level cells are a (0, 2·level, 2)-net in base 2 (Niederreiter 1987, "Point Sets
/// and Sequences with Small Discrepancy"): every rectangle of sides 2^−i × 2^−j and the area of a cell, at
/// multiples of its sides, has one, and so has every square of cells within itself. Such points are columns
/// and rows whose digits go on with those of the other one in reverse; a digital shift of each site and level
/// makes every place in a cell equally likely (Owen 1995, "Randomly Permuted (t, m, s)-Nets and (t,
/// s)-Sequences", on scrambles).
#[inline(always)]
pub fn offset(shift: [u32; 2], [x, y]: [u32; 2]) -> [f32; 2] {
    let unit = |digits: u32| (digits >> 8) as f32 * (1.0 / (1 << 24) as f32);
    [unit(y.reverse_bits() ^ shift[0]), unit(x.reverse_bits() ^ shift[1])]
}

/// Digital shift of a site's points of a level.
pub fn shift(seed: u32, level: u32) -> [u32; 2] {
    // Jarzynski & Olano 2020, "Hash Functions for GPU Rendering" (JCGT 9(3)): pcg3d.
    let step = |v: u32| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let (mut x, mut y, mut z) = (step(0), step(seed), step(level));
    x = x.wrapping_add(y.wrapping_mul(z));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    x ^= x >> 16;
    y ^= y >> 16;
    z ^= z >> 16;
    x = x.wrapping_add(y.wrapping_mul(z));
    y = y.wrapping_add(z.wrapping_mul(x));
    [x, y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::sampling::disk;

    #[test]
    fn the_map_is_the_concentric_one_and_has_its_density() {
        let n = 400;
        let (mut area, mut cosine) = (0.0, 0.0);
        for i in 0..n {
            for j in 0..n {
                let (a, b) = ((i as f64 + 0.5) / n as f64, (j as f64 + 0.5) / n as f64);
                let d = direction(a as f32, b as f32);
                assert!((d.length() - 1.0).abs() < 1e-6);
                let p = disk::sample(glam::DVec2::new(a, b));
                let (z, c) = (f64::from(d.z), LIFT);
                // The disk's area inside is the share of the measure above z.
                let share = 1.0 - (z * z + 2.0 * c * z) / (1.0 + 2.0 * c);
                assert!((p.length_squared() - share).abs() < 1e-5);
                let flat =
                    p.normalize_or_zero() - glam::DVec2::new(d.x.into(), d.y.into()).normalize_or_zero();
                assert!(flat.length() < 1e-4, "{flat}");
                let weight = MEASURE / (n * n) as f64 / (z + c);
                area += weight;
                cosine += weight * z;
            }
        }
        assert!((area - 2.0 * PI).abs() < 3e-3 && (cosine - PI).abs() < 1e-3, "{area} {cosine}");
    }

    #[test]
    fn cells_follow_mortons_curve() {
        assert_eq!([0, 1, 2, 3, 4].map(place), [[0, 0], [1, 0], [0, 1], [1, 1], [2, 0]]);
        assert_eq!(place(0xffff_ffff), [0xffff; 2]);
        for cell in [0, 77, 0x1234_5678, u32::MAX] {
            let [x, y] = place(cell);
            assert_eq!(cell_at(x, y), cell);
        }
        assert_eq!((0..4).map(start).collect::<Vec<_>>(), [0, 1, 5, 21]);
    }

    /// Every rectangle of the area of a cell has one point, whatever its shape.
    #[test]
    fn points_of_a_level_are_a_net() {
        for (level, seed) in [(1u32, 3), (3, 0), (4, 77)] {
            let (side, shift) = (1u32 << level, shift(seed, level));
            for across in 0..=2 * level {
                let (columns, rows) = (1u32 << across, 1u32 << (2 * level - across));
                let mut filled = vec![false; (columns * rows) as usize];
                for cell in 0..side * side {
                    let [x, y] = place(cell);
                    let [u, v] = offset(shift, [x, y]).map(f64::from);
                    let a = (f64::from(x) + u) / f64::from(side) * f64::from(columns);
                    let b = (f64::from(y) + v) / f64::from(side) * f64::from(rows);
                    let bin = &mut filled[(b as u32 * columns + a as u32) as usize];
                    assert!(!*bin, "level {level}, {columns} x {rows}");
                    *bin = true;
                }
            }
        }
    }

    /// χ² of 64 bins: the places in a cell fill it whatever is counted up, sites or levels.
    #[test]
    fn shifts_fill_the_square() {
        for which in 0..2 {
            let mut bins = [0u32; 64];
            for k in 0..6400 {
                let [x, y] = offset(if which == 0 { shift(k, 5) } else { shift(9, k) }, [7, 5]);
                bins[(8.0 * x) as usize + 8 * (8.0 * y) as usize] += 1;
            }
            let chi: f64 = bins.iter().map(|b| (f64::from(*b) - 100.0).powi(2) / 100.0).sum();
            // 63 degrees of freedom: mean 63, deviation 11.
            assert!(chi < 63.0 + 5.0 * 11.3, "{which}: {chi}");
        }
    }
}
