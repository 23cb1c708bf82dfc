//! Columns of Δ on their way down the rows, a few registers together.

use steradian_simd::Vector;

/// What exponents count: powers of 2^256.
const BIG: f64 = f64::from_bits((1023 + 256) << 52);
const SMALL: f64 = f64::from_bits((1023 - 256) << 52);

/// What is smaller has no part in sums, even after it grew over the rows of a block.
const NEGLIGIBLE: f64 = f64::from_bits((1023 - 150) << 52);

/// Rows between two looks at what has grown.
const BLOCK: usize = 8;

/// Numbers are padded to whole registers.
const LANES: usize = 8;

/// Row m of Δ, for `C` functions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row<const C: usize> {
    /// What n p_mn is multiplied with in the next row.
    pub(super) step: f64,
    /// Coefficients times g_m w_m.
    pub(super) values: [f64; C],
}

/// Columns n of one parity of l + n, upwards.
#[derive(Default)]
pub(super) struct Columns {
    pub(super) count: usize,
    /// n, as numbers.
    n: Vec<f64>,
    /// Δ_ln as v·2^(256·exponent).
    seeds: Vec<f64>,
    exponents: Vec<i32>,
    /// Cosines, then sines, of each function, each of `stride`.
    pub(super) sums: Vec<f64>,
    pub(super) stride: usize,
}

/// Row m = l of Δ, each entry with its own exponent: Δ_l0 = √((2l−1)!!/(2l)!!), then
/// Δ_{l,n+1}/Δ_ln = √((l−n)/(l+n+1)).
pub(super) fn seed(l: usize, functions: usize, columns: &mut [Columns; 2]) {
    for (parity, columns) in columns.iter_mut().enumerate() {
        let first = (l + parity) % 2;
        columns.count = if first > l { 0 } else { (l - first) / 2 + 1 };
        columns.stride = columns.count.next_multiple_of(LANES);
        columns.n.clear();
        columns.n.extend((0..columns.stride).map(|k| (first + 2 * k) as f64));
        columns.seeds.clear();
        columns.seeds.resize(columns.stride, 0.0);
        columns.exponents.clear();
        columns.exponents.resize(columns.stride, 0);
        columns.sums.resize(2 * functions * columns.stride, 0.0);
    }
    let square: f64 = (1..=l).map(|k| (2 * k - 1) as f64 / (2 * k) as f64).product();
    let (mut v, mut exponent) = (square.sqrt(), 0);
    for n in 0..=l {
        let columns = &mut columns[(l + n) % 2];
        (columns.seeds[n / 2], columns.exponents[n / 2]) = (v, exponent);
        v *= ((l - n) as f64 / (l + n + 1) as f64).sqrt();
        if v < SMALL {
            (v, exponent) = (v * BIG, exponent - 1);
        }
    }
}

/// K registers of columns on their way down the rows.
struct Descent<V, const K: usize> {
    n: [V; K],
    now: [V; K],
    before: [V; K],
}

impl<V: Vector<T = f64>, const K: usize> Descent<V, K> {
    #[inline(always)]
    fn step(&mut self, step: f64) {
        let step = V::splat(step);
        for v in 0..K {
            let next = self.n[v].mul(step).fma(self.now[v], self.before[v]);
            self.before[v] = self.now[v];
            self.now[v] = next;
        }
    }

    #[inline(always)]
    fn add<const C: usize>(&self, values: &[f64; C], sums: &mut [[V; K]; C]) {
        for c in 0..C {
            let value = V::splat(values[c]);
            for v in 0..K {
                sums[c][v] = self.now[v].fma(value, sums[c][v]);
            }
        }
    }

    /// Adds a row of even l + m and the next, and goes below them.
    #[inline(always)]
    fn pair<const C: usize>(&mut self, even: &Row<C>, odd: &Row<C>, sums: &mut [[[V; K]; C]; 2]) {
        self.add(&even.values, &mut sums[0]);
        self.step(even.step);
        self.add(&odd.values, &mut sums[1]);
        self.step(odd.step);
    }

    /// The largest number of a register, of two rows.
    #[inline(always)]
    fn peak(&self, v: usize) -> f64 {
        let (mut x, mut peak) = ([0.0; LANES], 0.0);
        for row in [self.now[v], self.before[v]] {
            row.store(&mut x);
            for k in 0..V::LANES {
                let size = x[k].abs();
                peak = if size > peak { size } else { peak };
            }
        }
        peak
    }
}

impl Columns {
    /// Δ_ln of a register from the k-th column, by the exponent of its first, the largest.
    #[inline(always)]
    fn start<V: Vector<T = f64>>(&self, k: usize) -> V {
        let mut x = [0.0; LANES];
        for i in 0..V::LANES {
            x[i] = match self.exponents[k] - self.exponents[k + i] {
                0 => self.seeds[k + i],
                1 => self.seeds[k + i] * SMALL,
                _ => 0.0,
            };
        }
        V::load(&x)
    }

    /// Sums of K registers of columns from the k-th.
    #[inline(always)]
    pub(super) fn group<V: Vector<T = f64>, const K: usize, const C: usize>(
        &mut self,
        k: usize,
        rows: &[Row<C>],
    ) {
        let zero = V::splat(0.0);
        let mut d = Descent { n: [zero; K], now: [zero; K], before: [zero; K] };
        // The exponent of each register; those without columns never take part.
        let mut exponents = [0; K];
        let mut waiting = [false; K];
        for v in 0..K {
            let at = k + v * V::LANES;
            d.n[v] = V::load(&self.n[at..]);
            d.now[v] = self.start::<V>(at);
            exponents[v] = self.exponents[at];
            waiting[v] = at < self.count;
        }
        let mut sums = [[[zero; K]; C]; 2];
        let (blocks, rest) = rows.as_chunks::<BLOCK>();
        let mut next = 0;
        // All wait, then some: what these add to their sums meanwhile is thrown away.
        while next < blocks.len() {
            let (mut begun, mut left) = (false, false);
            for v in 0..K {
                if !waiting[v] {
                    begun = true;
                    continue;
                }
                let mut peak = d.peak(v);
                if exponents[v] < 0 && peak > 1.0 {
                    d.now[v] = d.now[v].mul(V::splat(SMALL));
                    d.before[v] = d.before[v].mul(V::splat(SMALL));
                    (exponents[v], peak) = (exponents[v] + 1, peak * SMALL);
                }
                if exponents[v] == 0 && peak > NEGLIGIBLE {
                    waiting[v] = false;
                    begun = true;
                    for c in 0..C {
                        (sums[0][c][v], sums[1][c][v]) = (zero, zero);
                    }
                } else {
                    left = true;
                }
            }
            if begun && !left {
                break;
            }
            let block = &blocks[next];
            if begun {
                for i in 0..BLOCK / 2 {
                    d.pair(&block[2 * i], &block[2 * i + 1], &mut sums);
                }
            } else {
                for i in 0..BLOCK {
                    d.step(block[i].step);
                }
            }
            next += 1;
        }
        while next < blocks.len() {
            let block = &blocks[next];
            for i in 0..BLOCK / 2 {
                d.pair(&block[2 * i], &block[2 * i + 1], &mut sums);
            }
            next += 1;
        }
        for i in 0..rest.len() {
            d.add(&rest[i].values, &mut sums[i % 2]);
            d.step(rest[i].step);
        }
        for v in 0..K {
            for c in 0..C {
                for e in 0..2 {
                    let at = (2 * c + e) * self.stride + k + v * V::LANES;
                    sums[e][c][v].store(&mut self.sums[at..]);
                }
            }
        }
    }
}
