//! The geometry's factor of glossy techniques: a transfer matrix per site.
//!
//! Sloan, Kautz & Snyder (2002), *Precomputed Radiance Transfer*, section 4.2; STAR04 7.5.1: M_ij = ∫ V y_i
//! y_j dw takes the coefficients of the light to those of the light that is not blocked, L' = M L. Both are
//! about world axes, so that L' may be interpolated between sites whose frames differ. M is exact for the
//! bands of V that were baked, by the integrals of three harmonics ([`Products`]). It is symmetric: its lower
//! triangle is kept, row by row, number i(i + 1)/2 + j for j ≤ i.

use crate::gpu::Numbers;
use crate::shared::geometry::grouped::{GROUP, Grouped, Groups};
use crate::shared::geometry::transport;
use crate::shared::maths::number::Number;
use crate::tensors::{PartError, TensorFile};
use crate::{BakeError, Geometry, Part};
use steradian_base::Task;
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, Vector, prefetch};
use steradian_sphere::sh;
use steradian_transfer::{Products, Settings, Site, Transfer};

/// Most bands: 64 coefficients, 2080 numbers a site.
pub const MAX_BANDS: usize = 8;
/// Most coefficients.
pub const MAX_COEFFICIENTS: usize = MAX_BANDS * MAX_BANDS;
/// Groups that a thread takes at a time.
const SHARE: usize = 32;

/// Visibility that a matrix assumes in directions below the horizon of its site.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Below {
    /// Directions below the horizon are open, so that M of an open site is the identity: for reflectance
    /// whose coefficients end at the horizon.
    Open,
    /// Directions below the horizon are blocked, so that M of an open site is that of a half space: for
    /// kernels that reach below the horizon.
    Blocked,
}

/// Numbers of a matrix of `n` coefficients.
pub const fn packed(n: usize) -> usize {
    n * (n + 1) / 2
}

/// Coefficients of a channel with those that fill up whole registers.
pub const fn padded(n: usize) -> usize {
    n.next_multiple_of(16)
}

/// Bands and precision of the matrices.
#[derive(Debug, Clone, Copy)]
pub struct Accuracy {
    /// Bands of light and transferred light.
    pub bands: usize,
    /// Absolute error of the coefficients of ∫ V (n·w)₊ y dw; those of V have five times that.
    pub precision: f64,
}

/// Visibility of the sites of `g` in 2·bands − 1 bands, which is all that the matrices depend on.
pub fn visibility(
    slug: &'static str,
    g: &Geometry,
    of: Accuracy,
    task: &Task,
) -> Result<(Vec<Site>, Transfer), BakeError> {
    let settings =
        Settings { bands: of.bands, tolerance: of.precision, matrices: true, ..Settings::default() };
    let transfer = transport::bake(slug, g, [0.0; 3], settings, task)?;
    Ok((transport::sites(slug, g)?, transfer))
}

/// Refuses a bake that needs more memory than the task allows.
pub fn affordable(slug: &'static str, need: u64, task: &Task) -> Result<(), BakeError> {
    let allowed = task.max_memory();
    if need > allowed { Err(BakeError::Memory { slug, need, allowed }) } else { Ok(()) }
}

/// Coefficients of V of a site in 2·bands − 1 bands, completed below the horizon as `below` says; zero for an
/// absent site.
pub fn seen(site: &Site, v: &[f32], below: Below) -> Vec<f64> {
    let mut out: Vec<f64> = v.iter().map(|x| f64::from(*x)).collect();
    if site.is_absent() {
        out.fill(0.0);
    } else if below == Below::Open {
        // The sphere less the hemisphere.
        let order = v.len().isqrt() - 1;
        let mut y = vec![0.0; v.len()];
        sh::eval(order, site.n.as_dvec3().normalize(), &mut y);
        let hemisphere = sh::zonal::phong(order, 0.0);
        out.iter_mut().zip(&y).enumerate().for_each(|(i, (x, y))| *x -= hemisphere[i.isqrt()] * y);
        out[0] += (4.0 * std::f64::consts::PI).sqrt();
    }
    out
}

/// The numbers of the matrix of a visibility with the coefficients `seen`: row i, column j ≤ i at index i(i +
/// 1)/2 + j.
pub fn matrix(products: &Products, seen: &[f64]) -> Vec<f32> {
    let n = products.bands().pow(2);
    let full = products.matrix(seen);
    (0..n).flat_map(|i| full[i * n..][..=i].iter().map(|x| *x as f32).collect::<Vec<_>>()).collect()
}

/// A transfer matrix per site.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrices {
    n: usize,
    numbers: Grouped,
}

impl Default for Matrices {
    fn default() -> Self {
        Self::from_sites(1, &[], false)
    }
}

impl Matrices {
    /// The matrices of the sites of `g`; 16-bit numbers where `halves`.
    pub fn bake(
        slug: &'static str,
        g: &Geometry,
        of: Accuracy,
        below: Below,
        halves: bool,
        task: &Task,
    ) -> Result<Self, BakeError> {
        let n = of.bands * of.bands;
        let sites = transport::sites(slug, g)?.len();
        let each = packed(n) * if halves { 2 } else { 4 };
        affordable(slug, (each * sites.next_multiple_of(GROUP)) as u64, task)?;
        let (sites, transfer) = visibility(slug, g, of, task)?;
        task.check()?;
        let products = Products::new(of.bands);
        let numbers = Grouped::new(packed(n), sites.len(), halves, |s, put| {
            let m = matrix(&products, &seen(&sites[s], transfer.visibility(s), below));
            m.iter().enumerate().for_each(|(e, x)| put(e, *x));
        });
        Ok(Self { n, numbers })
    }

    /// Coefficients of light and of transferred light.
    pub fn coefficients(&self) -> usize {
        self.n
    }

    /// Number of matrices.
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Are there none?
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    /// Are they of 16-bit floats?
    pub fn is_half(&self) -> bool {
        self.numbers.is_half()
    }

    /// All numbers, site after site.
    pub fn by_site(&self) -> Numbers {
        self.numbers.by_site()
    }

    /// Matrices from [`packed`] numbers of each site, given site after site.
    pub fn from_sites(n: usize, data: &[f32], halves: bool) -> Self {
        Self { n, numbers: Grouped::from_sites(packed(n), data, halves) }
    }

    /// Transferred light of every site, L' = M L: three channels of [`padded`] numbers each; coefficient i is
    /// multiplied by `scale[i]` and stored at index `place[i]` of its channel. Runs on all threads; the bits
    /// do not depend on their number.
    pub fn transferred(&self, light: &[[f32; 3]], scale: &[f32], place: &[usize]) -> Vec<f32> {
        let mut out = vec![0.0; self.len() * 3 * padded(self.n)];
        self.transfer(light, scale, place, &mut out);
        out
    }

    /// [`Matrices::transferred`] into the memory of an earlier frame.
    pub fn transfer(&self, light: &[[f32; 3]], scale: &[f32], place: &[usize], out: &mut [f32]) {
        let share = |(k, out): (usize, &mut [f32])| {
            let first = k * SHARE;
            steradian_simd::run(Transferred { matrices: self, first, light, scale, place, out });
        };
        out.par_chunks_mut(SHARE * GROUP * 3 * padded(self.n)).enumerate().for_each(share);
    }
}

struct Transferred<'a> {
    matrices: &'a Matrices,
    /// The first group.
    first: usize,
    light: &'a [[f32; 3]],
    scale: &'a [f32],
    place: &'a [usize],
    out: &'a mut [f32],
}

impl Kernel for Transferred<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let n = self.matrices.n;
        let stride = padded(n);
        let mut at = [None; MAX_COEFFICIENTS];
        self.place.iter().enumerate().for_each(|(i, p)| at[*p] = Some((i, self.scale[i])));
        let mut sums = [[0.0f32; GROUP]; 3 * MAX_COEFFICIENTS];
        for (k, out) in self.out.chunks_mut(GROUP * 3 * stride).enumerate() {
            for line in (0..out.len()).step_by(16) {
                prefetch(out, line);
            }
            match self.matrices.numbers.groups(self.first + k) {
                Groups::Single(v) => group::<A, f32>(n, v, self.light, &mut sums),
                Groups::Half(v) => group::<A, u16>(n, v, self.light, &mut sums),
            }
            by_site::<A>(&sums, &at[..stride], out);
        }
    }
}

/// Transposes a group's sums, in which each number lies for all sites, to rows of all numbers of a site, in
/// the order of `at` and scaled.
#[inline(always)]
fn by_site<A: Arch>(
    sums: &[[f32; GROUP]; 3 * MAX_COEFFICIENTS],
    at: &[Option<(usize, f32)>],
    out: &mut [f32],
) {
    let lanes = A::F32::LANES;
    let sites = out.len() / (3 * at.len());
    let mut square = [A::F32::splat(0.0); GROUP];
    for c in 0..3 {
        let mut first = 0;
        while first < at.len() {
            let mut lane = 0;
            while lane < GROUP {
                for (to, at) in square.iter_mut().zip(&at[first..first + lanes]) {
                    *to = match at {
                        Some((i, scale)) => A::F32::load(&sums[3 * i + c][lane..]).mul(A::F32::splat(*scale)),
                        None => A::F32::splat(0.0),
                    };
                }
                A::F32::transpose(&mut square[..lanes]);
                for (k, site) in (lane..sites.min(lane + lanes)).enumerate() {
                    square[k].store(&mut out[(3 * site + c) * at.len() + first..]);
                }
                lane += lanes;
            }
            first += lanes;
        }
    }
}

/// M L of the first group of sites of `numbers`: coefficient i of channel c in `sums[3 i + c]`. Two rows of
/// the triangle at a time: each of its numbers is M_ij and M_ji.
#[inline(always)]
fn group<A: Arch, T: Number>(
    n: usize,
    numbers: &[T],
    light: &[[f32; 3]],
    sums: &mut [[f32; GROUP]; 3 * MAX_COEFFICIENTS],
) {
    let mut rows = [[[0.0f32; GROUP]; MAX_COEFFICIENTS]; 2];
    let light = &light[..n];
    let each = packed(n) * GROUP;
    // Time goes mostly to reading matrices from memory, so the next group's are prefetched.
    let (mut asked, line) = (0, 64 / size_of::<T>());
    let mut rest = &numbers[..each];
    let mut i = 0;
    while i < n {
        let two = (n - i).min(2);
        for (k, row) in rows.iter_mut().enumerate().take(two) {
            let (own, others) = rest.split_at((i + k + 1) * GROUP);
            rest = others;
            while asked < each - rest.len() {
                prefetch(numbers, each + asked);
                asked += line;
            }
            for (to, from) in row.iter_mut().zip(own.chunks_exact(GROUP)) {
                let mut at = 0;
                while at < GROUP {
                    T::load::<A::F32>(&from[at..]).store(&mut to[at..]);
                    at += A::F32::LANES;
                }
            }
        }
        let next = if two == 2 { light[i + 1] } else { [0.0; 3] };
        let mut own = [[A::F32::splat(0.0); 3]; 2];
        for c in 0..3 {
            own[0][c] = A::F32::splat(light[i][c]);
            own[1][c] = A::F32::splat(next[c]);
        }
        let [first, second] = &rows;
        let mut lane = 0;
        while lane < GROUP {
            let mut sum = [[A::F32::splat(0.0); 3]; 2];
            for (j, l) in light[..i].iter().enumerate() {
                let m = [A::F32::load(&first[j][lane..]), A::F32::load(&second[j][lane..])];
                for c in 0..3 {
                    let to = &mut sums[3 * j + c][lane..];
                    m[1].fma(own[1][c], m[0].fma(own[0][c], A::F32::load(to))).store(to);
                    let l = A::F32::splat(l[c]);
                    sum[0][c] = m[0].fma(l, sum[0][c]);
                    sum[1][c] = m[1].fma(l, sum[1][c]);
                }
            }
            // The end of the first row, and the last two numbers of the second.
            let end = A::F32::load(&first[i][lane..]);
            for c in 0..3 {
                let mut whole = end.fma(own[0][c], sum[0][c]);
                if two == 2 {
                    let m = [A::F32::load(&second[i][lane..]), A::F32::load(&second[i + 1][lane..])];
                    whole = m[0].fma(own[1][c], whole);
                    let other = m[1].fma(own[1][c], m[0].fma(own[0][c], sum[1][c]));
                    other.store(&mut sums[3 * (i + 1) + c][lane..]);
                }
                whole.store(&mut sums[3 * i + c][lane..]);
            }
            lane += A::F32::LANES;
        }
        i += 2;
    }
}

impl Part for Matrices {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.numbers.save_as(to, format!("{prefix}.matrices"));
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.matrices");
        let numbers = Grouped::load_as(from, &name)?;
        let n = (1..=MAX_BANDS).map(|b| b * b).find(|n| packed(*n) == numbers.stride());
        Ok(Self { n: n.ok_or(PartError::Unexpected(name))?, numbers })
    }

    fn bytes(&self) -> usize {
        self.numbers.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sites;
    use std::sync::Arc;
    use steradian_scene::shapes;
    use steradian_testkit::on_every_isa;

    fn ring(halves: bool) -> (Matrices, Vec<Site>, Transfer) {
        let g = Geometry::new(Arc::new(shapes::torus(0.7, 0.3, 10)), Sites::Vertices);
        let of = Accuracy { bands: 4, precision: 0.02 };
        let m = Matrices::bake("test", &g, of, Below::Open, halves, &Task::quiet()).unwrap();
        let (sites, transfer) = visibility("test", &g, of, &Task::quiet()).unwrap();
        (m, sites, transfer)
    }

    /// The product in groups, from a triangle, on every instruction set, against the full matrix times the
    /// light.
    #[test]
    fn transferred_light_is_the_matrix_times_the_light() {
        let light: Vec<[f32; 3]> =
            (0..16).map(|i| [0, 1, 2].map(|c| ((3 * i + c) as f32 * 0.7).sin())).collect();
        let scale: Vec<f32> = (0..16).map(|i| 1.0 + 0.1 * i as f32).collect();
        let place: Vec<usize> = (0..16).map(|i| (5 * i) % 16).collect();
        for (halves, within) in [(false, 2e-5), (true, 4e-3)] {
            let (m, sites, transfer) = ring(halves);
            assert_ne!(sites.len() % GROUP, 0, "the last group is not full");
            let products = Products::new(4);
            on_every_isa(|| {
                let got = m.transferred(&light, &scale, &place);
                assert_eq!(got.len(), sites.len() * 48);
                for (s, site) in sites.iter().enumerate().step_by(7) {
                    let full = products.transfer(site.n.as_dvec3(), transfer.visibility(s));
                    for i in 0..16 {
                        for c in 0..3 {
                            let want: f64 = (0..16).map(|j| full[16 * i + j] * f64::from(light[j][c])).sum();
                            let got = f64::from(got[s * 48 + c * 16 + place[i]]);
                            assert!(
                                (got - want * f64::from(scale[i])).abs() < within,
                                "{s} {i}: {got} {want}"
                            );
                        }
                    }
                }
            });
        }
    }

    /// Matrices survive a save and a load, in both precisions; malformed tensors are refused.
    #[test]
    fn files_hold_the_same_numbers() {
        for halves in [false, true] {
            let (m, ..) = ring(halves);
            let mut file = TensorFile::default();
            m.save(&mut file, "transfer");
            assert_eq!(Matrices::load(&file, "transfer").unwrap(), m);
            assert_eq!(m.by_site().bytes(), m.bytes());
            file.tensors.get_mut("transfer.matrices").unwrap().shape = vec![1, 1];
            assert!(Matrices::load(&file, "transfer").is_err());
        }
    }
}
