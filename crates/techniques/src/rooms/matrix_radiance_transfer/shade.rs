//! Shading of a point: the four hats around the view are evaluated in the frame of each corner of the
//! triangle, and summed by the weights of the site.

use super::MatrixRadianceTransfer;
use super::bake::Compressed;
use super::frame::{Frame, WIDEST, of_hat, padded};
use super::hats::Hats;
use crate::gpu::{Buffer, Entry, Numbers};
use crate::shared::geometry::by_group::{SORTED, Share, Sorted};
use crate::shared::geometry::site_sum::MOST;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique};
use half::slice::HalfFloatSliceExt;
use steradian_simd::{Arch, Kernel, Single, Vector};

/// Number of corners that are summed in lanes.
const LANES: usize = WIDEST;

pub(super) fn shade(hats: Hats, t: &Compressed, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    out.rgb.iter_mut().for_each(|c| c.fill(0.0));
    if q.site.index.iter().all(|s| s.len() == q.len()) && q.site.weight.iter().all(|s| s.len() == q.len()) {
        steradian_simd::run(Shade { hats, t, f, q, out });
    }
}

struct Shade<'a, 'q, 'o> {
    hats: Hats,
    t: &'a Compressed,
    f: &'a Frame,
    q: &'a Points<'q>,
    out: &'a mut Radiance<'o>,
}

impl Kernel for Shade<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        match padded(self.t.components) {
            8 => self.by_cluster::<A, 8>(),
            _ => self.by_cluster::<A, MOST>(),
        }
    }
}

impl Shade<'_, '_, '_> {
    /// Shades points cluster by cluster, with P numbers of components for each hat and channel.
    #[inline(always)]
    fn by_cluster<A: Arch, const P: usize>(self) {
        let Self { hats, t, f, q, out } = self;
        let row = t.components + 1;
        let halves: &[u16] = t.sites.reinterpret_cast();
        let hat = of_hat(P);
        let each = hat * hats.len();
        let mut sorted = Sorted::empty();
        for first in (0..q.len()).step_by(SORTED) {
            let q = Share::of(q, first, (q.len() - first).min(SORTED));
            let cluster = |site: u32| halves.get(site as usize * row).map(|bits| whole(*bits));
            let clusters = sorted.sort(f.radiance.len() / each, cluster, &q);
            let mut from = 0;
            for k in 0..clusters {
                let end = usize::from(sorted.ends[k]);
                let radiance = &f.radiance[k * each..(k + 1) * each];
                while from < end {
                    let some = &sorted.order[from..end.min(from + LANES)];
                    from += some.len();
                    let (mut n, mut v) = ([[0.0f32; LANES]; 3], [[0.0f32; LANES]; 3]);
                    let mut sites = [0; LANES];
                    for (lane, corner) in some.iter().enumerate() {
                        let (i, corner) = (usize::from(corner / 3), usize::from(corner % 3));
                        sites[lane] = q.index[corner][i] as usize;
                        let own = &t.normals[3 * sites[lane]..][..3];
                        for k in 0..3 {
                            (n[k][lane], v[k][lane]) = (own[k], q.wo[k][i]);
                        }
                    }
                    let (cells, values) = cells::<A>(hats, &n, &v);
                    let mut parts = [[A::Octet::splat(0.0); LANES]; 3];
                    let mut means = [[0.0f32; LANES]; 3];
                    for lane in 0..some.len() {
                        let cell = cells[lane] as usize;
                        let pairs = [
                            &radiance[cell * hat..][..2 * hat],
                            &radiance[(cell + hats.side) * hat..][..2 * hat],
                        ];
                        let (mut w, mut spare) = ([0.0f32; MOST], [0; MOST]);
                        let own = own(halves, sites[lane] * row + 1, &mut spare);
                        let mut k = 0;
                        while k < P {
                            A::F32::load_half(&own[k..]).store(&mut w[k..]);
                            k += A::F32::LANES;
                        }
                        let mut sums = [A::Octet::splat(0.0); 3];
                        for h in 0..4 {
                            let (l, value) = (&pairs[h / 2][h % 2 * hat..][..hat], values[h][lane]);
                            let mut k = 0;
                            while k < P {
                                let w = A::Octet::load(&w[k..]).mul(A::Octet::splat(value));
                                for c in 0..3 {
                                    sums[c] = A::Octet::load(&l[c * P + k..]).fma(w, sums[c]);
                                }
                                k += 8;
                            }
                            for c in 0..3 {
                                means[c][lane] += value * l[3 * P + c];
                            }
                        }
                        for c in 0..3 {
                            parts[c][lane] = sums[c];
                        }
                    }
                    for c in 0..3 {
                        let mut sums = [0.0f32; LANES];
                        for lane in [0, 8] {
                            A::Octet::lane_sums(&mut parts[c][lane..lane + 8]).store(&mut sums[lane..]);
                        }
                        for (lane, corner) in some.iter().enumerate() {
                            let (i, corner) = (usize::from(corner / 3), usize::from(corner % 3));
                            out.rgb[c][first + i] += q.weight(i, corner) * (means[c][lane] + sums[lane]);
                        }
                    }
                }
            }
        }
    }
}

/// The whole number that a 16-bit float is, if it is one from 0 to 2047.
#[inline(always)]
fn whole(bits: u16) -> usize {
    let exponent = bits >> 10;
    if (15..=25).contains(&exponent) { usize::from((0x400 | (bits & 0x3ff)) >> (25 - exponent)) } else { 0 }
}

/// Numbers from `start` on, as many as a site has at most; `spare` pads them with zeros beyond the end.
#[inline(always)]
fn own<'a>(halves: &'a [u16], start: usize, spare: &'a mut [u16; MOST]) -> &'a [u16; MOST] {
    let all = halves.get(start..).unwrap_or(&[]);
    if let Some(own) = all.first_chunk() {
        return own;
    }
    spare.iter_mut().zip(all).for_each(|(to, from)| *to = *from);
    spare
}

/// For each lane the first of the four hats that are non-zero at a view, and the values of all four:
/// [`Hats::at`] of the view in the frame of [`super::bake::axes`], whose choice of an axis is the same to the
/// bit.
#[inline(always)]
fn cells<A: Arch>(
    hats: Hats,
    n: &[[f32; LANES]; 3],
    v: &[[f32; LANES]; 3],
) -> ([u32; LANES], [[f32; LANES]; 4]) {
    let (zero, one, half) = (A::F32::splat(0.0), A::F32::splat(1.0), A::F32::splat(0.5));
    let (last, before) = (A::F32::splat((hats.side - 1) as f32), A::F32::splat((hats.side - 2) as f32));
    let mut cells = [0u32; LANES];
    let mut values = [[0.0f32; LANES]; 4];
    for lane in (0..LANES).step_by(A::F32::LANES) {
        let [nx, ny, nz] =
            [A::F32::load(&n[0][lane..]), A::F32::load(&n[1][lane..]), A::F32::load(&n[2][lane..])];
        let [vx, vy, vz] =
            [A::F32::load(&v[0][lane..]), A::F32::load(&v[1][lane..]), A::F32::load(&v[2][lane..])];
        let size = zero.sub(ny.min(zero.sub(ny)));
        let sideways = A::F32::splat(0.99).sub(size);
        // The cross product of the y or the x axis and n.
        let tx = sideways.if_positive(nz, zero);
        let ty = sideways.if_positive(zero, zero.sub(nz));
        let tz = sideways.if_positive(zero.sub(nx), ny);
        let square = tx.fma(tx, ty.fma(ty, tz.mul(tz)));
        let by = square.if_positive(one.div(square.sqrt()), zero);
        let (tx, ty, tz) = (tx.mul(by), ty.mul(by), tz.mul(by));
        let x = tx.fma(vx, ty.fma(vy, tz.mul(vz)));
        let bx = ny.mul(tz).sub(nz.mul(ty));
        let by = nz.mul(tx).sub(nx.mul(tz));
        let bz = nx.mul(ty).sub(ny.mul(tx));
        let y = bx.fma(vx, by.fma(vy, bz.mul(vz)));
        let z = nx.fma(vx, ny.fma(vy, nz.mul(vz)));
        let scale = one.div(one.add(z.if_positive(z, zero)));
        let mut at = [x, y];
        let mut cell = [zero; 2];
        for k in 0..2 {
            let place = at[k].mul(scale).add(one).mul(half).mul(last);
            let place = place.if_positive(place, zero).min(last);
            cell[k] = place.truncate().min(before);
            at[k] = place.sub(cell[k]);
        }
        cell[1].fma(A::F32::splat(hats.side as f32), cell[0]).store_whole(&mut cells[lane..]);
        let (near, far) = ([one.sub(at[0]), at[0]], [one.sub(at[1]), at[1]]);
        for k in 0..4 {
            near[k % 2].mul(far[k / 2]).store(&mut values[k][lane..]);
        }
    }
    (cells, values)
}

pub(super) fn gpu(b: &Bake<MatrixRadianceTransfer>, f: &Frame) -> GpuTechnique {
    let t = &*b.transfer;
    let row = t.components + 1;
    let hats = b.material.hats;
    let head = format!("const HATS: u32 = {}u;\nconst ROW: u32 = {row}u;\n", hats.side);
    GpuTechnique {
        slug: MatrixRadianceTransfer::CARD.slug,
        modules: vec![head.into(), include_str!("shade.wgsl").into()],
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: Vec::new(),
        buffers: vec![
            Buffer { name: "weights", stride: row, data: Numbers::F16(t.sites.clone()) },
            Buffer { name: "normals", stride: 3, data: Numbers::F32(t.normals.clone()) },
            Buffer { name: "radiance", stride: 3 * row, data: Numbers::F32(f.by_hat(t.components)) },
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::super::bake::axes;
    use super::super::frame::place;
    use super::*;
    use crate::PointsBuf;
    use glam::{Vec2, Vec3};
    use half::f16;
    use steradian_testkit::on_every_isa;

    #[test]
    fn clusters_are_whole_numbers() {
        assert!((0..2048).all(|k| whole(f16::from_f32(k as f32).to_bits()) == k));
    }

    /// Shading by registers is the sum of the formula in f64, of all sizes that registers do not divide, at
    /// points inside triangles too.
    #[test]
    fn registers_sum_what_the_formula_says() {
        let number = |k: usize| ((k as f64 * 0.754_877_666).fract() - 0.5) as f32;
        for (side, components, clusters) in [(2, 0, 1), (5, 3, 4), (8, 8, 3), (7, 16, 2)] {
            let (hats, row, count) = (Hats { side }, components + 1, 23usize);
            let normals: Vec<Vec3> = (0..count)
                .map(|k| Vec3::new(number(k), number(2 * k + 1), number(3 * k + 2)))
                .map(|n| if n.y > 0.45 { Vec3::new(0.01, 0.9999, 0.005) } else { n }.normalize())
                .collect();
            let weights = (0..count).flat_map(|s| {
                (0..row).map(move |k| if k == 0 { (s % clusters) as f32 } else { number(s * row + k) })
            });
            let t = Compressed {
                n: 1,
                components,
                sites: weights.map(f16::from_f32).collect(),
                normals: normals.iter().flat_map(|n| n.to_array()).collect(),
                ..Compressed::default()
            };
            let one = |k: usize| [number(3 * k), number(3 * k + 1), number(3 * k + 2)];
            let each = of_hat(components);
            let mut f = Frame { radiance: vec![0.0; clusters * hats.len() * each] };
            for (hat, l) in f.radiance.chunks_exact_mut(each).enumerate() {
                for k in 0..row {
                    (0..3).for_each(|c| l[place(components, k, c)] = one(hat * row + k)[c]);
                }
            }
            let mut q = PointsBuf::default();
            for k in 0..3 * count {
                let n = normals[k % count];
                let wo = (n + 0.7 * Vec3::new(number(k), number(k + 9), number(k + 5))).normalize();
                q.push(n, n.any_orthonormal_vector(), wo, Vec3::ZERO);
                let near = [k, k + 1, 2 * k].map(|s| (s % count) as u32);
                q.locate(Vec2::ZERO, near, if k % 2 == 0 { [0.2, 0.5] } else { [0.0; 2] });
            }
            let corner = |site: usize, wo: Vec3| -> [f64; 3] {
                let n = normals[site];
                let [x, y] = axes(n.to_array()).map(Vec3::from_array);
                let (places, values) = hats.at([x.dot(wo), y.dot(wo), n.dot(wo)]);
                let mut sum = [0.0; 3];
                for (hat, g) in places.into_iter().zip(values) {
                    for k in 0..row {
                        let w = if k == 0 { 1.0 } else { t.sites[site * row + k].to_f64() };
                        let l = one((site % clusters * hats.len() + hat) * row + k);
                        (0..3).for_each(|c| sum[c] += f64::from(g) * w * f64::from(l[c]));
                    }
                }
                sum
            };
            on_every_isa(|| {
                let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
                shade(hats, &t, &f, &q.as_points(), &mut Radiance::of(&mut rgb));
                let points = q.as_points();
                for i in 0..q.len() {
                    let wo = Vec3::from_array(points.wo.map(|v| v[i]));
                    let [u, v] = points.site.weight.map(|w| w[i]);
                    let mut want = [0.0; 3];
                    for (s, w) in points.site.index.iter().zip([1.0 - u - v, u, v]) {
                        let l = corner(s[i] as usize, wo);
                        (0..3).for_each(|c| want[c] += f64::from(w) * l[c]);
                    }
                    for c in 0..3 {
                        let off = (f64::from(rgb[c][i]) - want[c]).abs();
                        assert!(off < 2e-5, "{side} {components} {i}: {} {}", rgb[c][i], want[c]);
                    }
                }
            });
        }
    }
}
