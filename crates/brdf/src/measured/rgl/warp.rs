//! Bilinear functions on the unit square, one for each pair of two parameters: values between nodes, and as
//! densities the map to uniform numbers and back. Dupuy & Jakob 2018, sections 4.2 and 5.

use glam::DVec2;

/// `N` functions at nodes over the unit square (corner to corner), for every pair of the values of two
/// parameters.
#[derive(Debug, Clone)]
pub(super) struct Grids<const N: usize> {
    /// Columns and rows.
    size: [usize; 2],
    /// Slice by slice, row by row; the functions of a node side by side.
    values: Vec<[f32; N]>,
}

/// The slices about a pair of parameters, with their shares.
#[derive(Debug, Clone, Copy)]
pub(super) struct Blend {
    slices: [(usize, f64); 4],
    count: usize,
}

impl Blend {
    /// The first slice, whole.
    pub const FIRST: Self = Self { slices: [(0, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)], count: 1 };

    /// Slices that have a share.
    fn slices(&self) -> &[(usize, f64)] {
        &self.slices[..self.count]
    }
}

/// Position of `x` among ascending `nodes`: the index of the lower neighbour, and the weight of the upper
/// one.
fn place(nodes: &[f32], x: f64) -> (usize, f64) {
    if nodes.len() < 2 {
        return (0, 0.0);
    }
    let i = nodes.partition_point(|n| f64::from(*n) <= x).clamp(1, nodes.len() - 1) - 1;
    let (a, b) = (f64::from(nodes[i]), f64::from(nodes[i + 1]));
    (i, ((x - a) / (b - a)).clamp(0.0, 1.0))
}

/// The slices of [phi][theta] about (`phi`, `theta`).
pub(super) fn blend(phis: &[f32], thetas: &[f32], phi: f64, theta: f64) -> Blend {
    let ((p, tp), (t, tt)) = (place(phis, phi), place(thetas, theta));
    let slice =
        |dp: usize, dt: usize| (p + dp).min(phis.len() - 1) * thetas.len() + (t + dt).min(thetas.len() - 1);
    let all = [
        (slice(0, 0), (1.0 - tp) * (1.0 - tt)),
        (slice(0, 1), (1.0 - tp) * tt),
        (slice(1, 0), tp * (1.0 - tt)),
        (slice(1, 1), tp * tt),
    ];
    let mut out = Blend { count: 0, ..Blend::FIRST };
    for one in all.into_iter().filter(|(_, share)| *share > 0.0) {
        out.slices[out.count] = one;
        out.count += 1;
    }
    out
}

impl<const N: usize> Grids<N> {
    /// `values` are slices of `size[1]` rows of `size[0]` columns, two at least of both.
    pub fn new(size: [usize; 2], values: Vec<[f32; N]>) -> Self {
        Self { size, values }
    }

    /// Every node.
    pub fn values(&self) -> &[[f32; N]] {
        &self.values
    }

    #[inline]
    fn node(&self, blend: &Blend, x: usize, y: usize) -> [f64; N] {
        let [w, h] = self.size;
        let mut sum = [0.0; N];
        for (slice, share) in blend.slices() {
            let values = &self.values[(slice * h + y) * w + x];
            for k in 0..N {
                sum[k] += share * f64::from(values[k]);
            }
        }
        sum
    }

    /// The node below `u` along an axis of `n`, and the share of the next.
    fn cell(u: f64, n: usize) -> (usize, f64) {
        let t = u.clamp(0.0, 1.0) * (n - 1) as f64;
        let i = (t as usize).min(n - 2);
        (i, t - i as f64)
    }

    /// The bilinear values at `u`.
    #[inline]
    pub fn value(&self, blend: &Blend, u: DVec2) -> [f64; N] {
        let ((x, tx), (y, ty)) = (Self::cell(u.x, self.size[0]), Self::cell(u.y, self.size[1]));
        let row = |y: usize| mix(self.node(blend, x, y), self.node(blend, x + 1, y), tx);
        mix(row(y), row(y + 1), ty)
    }
}

/// Between `a` and `b`.
#[inline]
fn mix<const N: usize>(a: [f64; N], b: [f64; N], t: f64) -> [f64; N] {
    let mut out = a;
    for k in 0..N {
        out[k] = (1.0 - t) * a[k] + t * b[k];
    }
    out
}

/// [`Grids`] as densities: every slice integrates to 1.
#[derive(Debug, Clone)]
pub(super) struct Density {
    /// The density, and its ∫ along the row up to each node.
    nodes: Grids<2>,
    /// ∫ over the rows up to each row.
    rows: Vec<f32>,
}

impl Density {
    /// `None` where a slice has no mass.
    pub fn new(size: [usize; 2], mut values: Vec<f32>) -> Option<Self> {
        let [w, h] = size;
        let (dx, dy) = (1.0 / (w - 1) as f64, 1.0 / (h - 1) as f64);
        let mut along = vec![0.0f32; values.len()];
        let mut rows = vec![0.0f32; values.len() / w];
        let slices = values.chunks_exact_mut(w * h).zip(along.chunks_exact_mut(w * h));
        for ((values, along), rows) in slices.zip(rows.chunks_exact_mut(h)) {
            let mut sums = vec![0.0f64; w * h];
            let mut row_sums = vec![0.0f64; h];
            for y in 0..h {
                for x in 1..w {
                    let i = y * w + x;
                    sums[i] = sums[i - 1] + 0.5 * dx * (f64::from(values[i - 1]) + f64::from(values[i]));
                }
            }
            for y in 1..h {
                row_sums[y] = row_sums[y - 1] + 0.5 * dy * (sums[y * w - 1] + sums[(y + 1) * w - 1]);
            }
            let total = row_sums[h - 1];
            if total <= 0.0 || !total.is_finite() {
                return None;
            }
            values.iter_mut().for_each(|v| *v = (f64::from(*v) / total) as f32);
            along.iter_mut().zip(sums).for_each(|(a, s)| *a = (s / total) as f32);
            rows.iter_mut().zip(row_sums).for_each(|(r, s)| *r = (s / total) as f32);
        }
        let nodes = values.into_iter().zip(along).map(|(v, a)| [v, a]).collect();
        Some(Self { nodes: Grids::new(size, nodes), rows })
    }

    /// Two cells for each node: the density, its integral along the row up to the node and that over the rows
    /// up to the row, and the remainders of the integrals that half precision would lose.
    pub fn cells(&self) -> impl Iterator<Item = [f32; 3]> {
        let w = self.nodes.size[0];
        // Eleven bits, as a half has.
        let head = |v: f32| f32::from_bits(v.to_bits() & !0x1fff);
        self.nodes.values.iter().enumerate().flat_map(move |(i, &[density, along])| {
            let below = self.rows[i / w];
            [[density, head(along), head(below)], [0.0, along - head(along), below - head(below)]]
        })
    }

    fn row_sum(&self, blend: &Blend, y: usize) -> f64 {
        let h = self.nodes.size[1];
        blend.slices().iter().map(|(s, share)| share * f64::from(self.rows[s * h + y])).sum()
    }

    /// Density at `u`.
    pub fn pdf(&self, blend: &Blend, u: DVec2) -> f64 {
        let [density, _] = self.nodes.value(blend, u);
        density
    }

    /// The uniform numbers that [`Density::sample`] maps to `u`.
    pub fn invert(&self, blend: &Blend, u: DVec2) -> DVec2 {
        let [w, h] = self.nodes.size;
        let ((x, tx), (y, ty)) = (Grids::<2>::cell(u.x, w), Grids::<2>::cell(u.y, h));
        let (dx, dy) = (1.0 / (w - 1) as f64, 1.0 / (h - 1) as f64);
        let node = |x: usize, y: usize| self.nodes.node(blend, x, y);
        let between = |x: usize| mix(node(x, y), node(x, y + 1), ty);
        let ([a, before], [b, _]) = (between(x), between(x + 1));
        let within = before + dx * tx * (a + 0.5 * tx * (b - a));
        let ([_, r0], [_, r1]) = (node(w - 1, y), node(w - 1, y + 1));
        let row = (1.0 - ty) * r0 + ty * r1;
        let below = self.row_sum(blend, y) + dy * ty * (r0 + 0.5 * ty * (r1 - r0));
        DVec2::new(if row > 0.0 { within / row } else { tx }, below).clamp(DVec2::ZERO, DVec2::ONE)
    }

    /// The place that two uniform numbers are mapped to, of density [`Density::pdf`].
    pub fn sample(&self, blend: &Blend, u: DVec2) -> DVec2 {
        let [w, h] = self.nodes.size;
        let (dx, dy) = (1.0 / (w - 1) as f64, 1.0 / (h - 1) as f64);
        let node = |x: usize, y: usize| self.nodes.node(blend, x, y);
        let total = self.row_sum(blend, h - 1);
        let wanted = u.y * total;
        let y = last(h - 1, |y| self.row_sum(blend, y) <= wanted);
        let ([_, r0], [_, r1]) = (node(w - 1, y), node(w - 1, y + 1));
        let ty = linear((wanted - self.row_sum(blend, y)) / dy, r0, r1);
        let between = |x: usize| mix(node(x, y), node(x, y + 1), ty);
        let wanted = u.x * between(w - 1)[1];
        let x = last(w - 1, |x| between(x)[1] <= wanted);
        let ([a, before], [b, _]) = (between(x), between(x + 1));
        let tx = linear((wanted - before) / dx, a, b);
        DVec2::new((x as f64 + tx) * dx, (y as f64 + ty) * dy)
    }
}

/// The last index of 0 … n − 1 for which `holds`, which is true up to some index; 0 where it never is.
fn last(n: usize, holds: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, n);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if holds(middle) { low = middle } else { high = middle }
    }
    low
}

/// t with ∫₀ᵗ a + s (b − a) ds = `mass`, in [0, 1]; the stable root of the quadratic.
fn linear(mass: f64, a: f64, b: f64) -> f64 {
    let root = (a * a + 2.0 * mass * (b - a)).max(0.0).sqrt();
    let sum = a + root;
    if sum > 0.0 { (2.0 * mass / sum).clamp(0.0, 1.0) } else { 0.5 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn density() -> Density {
        let values = (0..2 * 5 * 4).map(|i| ((i * 7919) % 13) as f32 + 0.1).collect();
        Density::new([5, 4], values).expect("mass")
    }

    #[test]
    fn sample_and_invert_are_each_others_inverse_and_the_density_is_theirs() {
        let d = density();
        let blend = blend(&[0.0], &[0.2, 1.0], 0.3, 0.5);
        let shares: f64 = blend.slices().iter().map(|b| b.1).sum();
        assert!((shares - 1.0).abs() < 1e-12);
        for i in 0..200 {
            let u =
                DVec2::new((0.1 + 0.754_877 * f64::from(i)).fract(), (0.3 + 0.569_84 * f64::from(i)).fract());
            let u = u * 0.98 + 0.01;
            let s = d.sample(&blend, u);
            assert!(d.invert(&blend, s).distance(u) < 1e-5, "{u}");
            // Density = 1/|Jacobian of sample|.
            let e = 1e-4;
            let (x, y) = (d.sample(&blend, u + DVec2::X * e), d.sample(&blend, u + DVec2::Y * e));
            let area = (x - s).perp_dot(y - s).abs() / (e * e);
            let smooth = (d.pdf(&blend, x) / d.pdf(&blend, s) - 1.0).abs() < 1e-3;
            assert!(!smooth || (area * d.pdf(&blend, s) - 1.0).abs() < 0.05, "{u} {area}");
        }
        assert!(Density::new([2, 2], vec![0.0; 4]).is_none());
    }

    #[test]
    fn nodes_and_between() {
        let g = Grids::new([2, 2], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0].map(|v| [v]).to_vec());
        let first = blend(&[0.0], &[0.0, 1.0], 0.0, 0.0);
        assert_eq!(g.value(&first, DVec2::new(1.0, 1.0)), [3.0]);
        assert_eq!(g.value(&first, DVec2::new(0.5, 0.0)), [0.5]);
        let half = blend(&[0.0], &[0.0, 1.0], 0.0, 0.5);
        assert_eq!(g.value(&half, DVec2::ZERO), [2.0]);
    }
}
