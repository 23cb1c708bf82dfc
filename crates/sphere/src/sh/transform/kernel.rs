//! The Legendre stage for one m: sums over degrees at groups of rings, and over rings for blocks of degrees,
//! with the recursion's state and six even and six odd parts in registers.

use super::recursion::{Starts, Step};
use super::rings::BLOCK;
use steradian_simd::{Arch, Kernel, Vector};

/// Cosine and sine terms of red, green and blue.
pub(super) type Row = [f64; 6];

/// Numbers that a block of rings holds for one m: even parts of the six terms, then odd ones, ring by ring.
pub(super) const CELL: usize = 12 * BLOCK;

/// Steps of the recursion whose sums over rings stay in the first-level cache.
const STEPS: usize = 32;

/// What both directions share: one m and a range of rings.
#[derive(Clone, Copy)]
pub(super) struct Part<'a> {
    pub(super) steps: &'a [Step],
    pub(super) starts: &'a Starts,
    pub(super) x: &'a [f64],
    pub(super) x2: &'a [f64],
    /// The first ring's index in `starts`.
    pub(super) ring: usize,
    /// cos and sin of mφ0, times the norm of the azimuthal functions.
    pub(super) phase: [f64; 2],
}

/// The first `n` numbers of a buffer from a cache line's start, so that no vector straddles two lines.
pub(super) fn aligned(buffer: &mut Vec<f64>, n: usize) -> &mut [f64] {
    if buffer.len() < n + BLOCK {
        buffer.resize(n + BLOCK, 0.0);
    }
    let start = buffer.as_ptr().align_offset(64).min(BLOCK);
    &mut buffer[start..start + n]
}

/// One worker's buffers.
#[derive(Default)]
pub(super) struct Scratch {
    state: Vec<f64>,
    sums: Vec<f64>,
    rows: Vec<[f64; 16]>,
    active: Vec<Active>,
}

/// A group of rings that has a part in the sums: from step `begin`; all its rings take part from step `all`.
#[derive(Clone, Copy)]
struct Active {
    ring: usize,
    begin: usize,
    all: usize,
}

impl Part<'_> {
    #[inline(always)]
    fn active(&self, ring: usize, n: usize) -> Option<Active> {
        let (mut begin, mut all) = (f64::INFINITY, -1.0);
        for &f in &self.starts.first[self.ring + ring..][..n] {
            begin = f.min(begin);
            all = if f < f64::INFINITY && f > all { f } else { all };
        }
        (all >= 0.0).then(|| Active { ring, begin: begin as usize, all: all as usize + 1 })
    }

    #[inline(always)]
    fn vectors<V: Vector, const N: usize>(x: &[f64], ring: usize) -> [V; N] {
        // Loops, not closures: these would be compiled for themselves, without the instruction set.
        let mut vectors = [V::splat(0.0); N];
        for v in 0..N {
            vectors[v] = V::load(&x[ring + v * V::LANES..]);
        }
        vectors
    }

    /// Sets lanes that start at step k.
    #[inline(always)]
    fn inject<V: Vector, const N: usize>(
        &self,
        ring: usize,
        k: usize,
        now: &mut [V; N],
        before: &mut [V; N],
    ) {
        let k = V::splat(k as f64);
        for v in 0..N {
            let at = self.ring + ring + v * V::LANES;
            let first = V::load(&self.starts.first[at..]);
            now[v] = now[v].replace_if_equal(first, k, V::load(&self.starts.now[at..]));
            before[v] = before[v].replace_if_equal(first, k, V::load(&self.starts.before[at..]));
        }
    }
}

/// Where in a cell row `c` of the vector that starts at `ring` lies, in cells of blocks `stride` apart.
#[inline(always)]
fn place(ring: usize, stride: usize, c: usize) -> usize {
    ring / BLOCK * stride + c * BLOCK + ring % BLOCK
}

/// out[k] += Σ_rings r_k · (even or odd part).
pub(super) struct Analysis<'a> {
    pub(super) part: Part<'a>,
    /// Cells of blocks, `stride` apart, from the one of this m.
    pub(super) cells: &'a [f64],
    pub(super) stride: usize,
    pub(super) column: &'a mut [Row],
    pub(super) scratch: &'a mut Scratch,
}

impl Kernel for Analysis<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        if A::F64::REGISTERS >= 32 { self.with::<A::F64, 2>() } else { self.with::<A::F64, 1>() }
    }
}

impl Analysis<'_> {
    #[inline(always)]
    fn with<V: Vector, const N: usize>(mut self) {
        let (n, rings) = (N * V::LANES, self.part.x2.len());
        let Scratch { state, sums, rows, active } = std::mem::take(self.scratch);
        let (mut state, mut sums, mut rows, mut active) = (state, sums, rows, active);
        active.clear();
        for ring in (0..rings).step_by(n) {
            if let Some(unit) = self.part.active(ring, n) {
                active.push(unit);
            }
        }
        state.clear();
        state.resize(2 * n * active.len(), 0.0);
        rows.clear();
        rows.resize(self.part.steps.len(), [0.0; 16]);
        let width = 12 * V::LANES;
        for from in (0..self.part.steps.len()).step_by(STEPS) {
            let to = self.part.steps.len().min(from + STEPS);
            let sums = aligned(&mut sums, (to - from) * width);
            sums.fill(0.0);
            for (unit, state) in active.iter().zip(state.chunks_exact_mut(2 * n)) {
                if unit.begin < to {
                    self.block::<V, N>(*unit, from, to, state, sums);
                }
            }
            for (sums, row) in sums.chunks_exact(width).zip(&mut rows[from..to]) {
                V::add_sums(&Part::vectors(sums, 0), row);
            }
        }
        self.finish(&rows);
        *self.scratch = Scratch { state, sums, rows, active };
    }

    /// Steps from…to of one group of rings.
    #[inline(always)]
    fn block<V: Vector, const N: usize>(
        &self,
        unit: Active,
        from: usize,
        to: usize,
        state: &mut [f64],
        sums: &mut [f64],
    ) {
        let part = self.part;
        let x2: [V; N] = Part::vectors(part.x2, unit.ring);
        let mut now: [V; N] = Part::vectors(state, 0);
        let mut before: [V; N] = Part::vectors(state, N * V::LANES);
        let mut values = [[V::splat(0.0); N]; 12];
        for c in 0..12 {
            for v in 0..N {
                let at = place(unit.ring + v * V::LANES, self.stride, c);
                values[c][v] = V::load(&self.cells[at..]);
            }
        }
        let width = 12 * V::LANES;
        let begin = from.max(unit.begin);
        let all = unit.all.clamp(begin, to);
        for k in begin..all {
            part.inject(unit.ring, k, &mut now, &mut before);
            let sums = &mut sums[(k - from) * width..(k - from + 1) * width];
            step(&part.steps[k], &x2, &values, &mut now, &mut before, sums);
        }
        let sums = sums[(all - from) * width..].chunks_exact_mut(width);
        for (step_k, sums) in part.steps[all..to].iter().zip(sums) {
            step(step_k, &x2, &values, &mut now, &mut before, sums);
        }
        for v in 0..N {
            now[v].store(&mut state[v * V::LANES..]);
            before[v].store(&mut state[(N + v) * V::LANES..]);
        }
    }

    /// From sums over rings to coefficients.
    #[inline(always)]
    fn finish(&mut self, rows: &[[f64; 16]]) {
        for (k, (step, row)) in self.part.steps.iter().zip(rows).enumerate() {
            let mut turned = [0.0; 12];
            turn(self.part.phase, &row[..12], &mut turned);
            let (even, odd) = turned.split_at(6);
            let after = &mut self.column[2 * k..];
            for c in 0..6 {
                after[0][c] += step.even[0] * even[c];
            }
            if let Some(row) = after.get_mut(1) {
                for c in 0..6 {
                    row[c] += step.odd * odd[c];
                }
            }
            if let Some(row) = after.get_mut(2) {
                for c in 0..6 {
                    row[c] += step.even[1] * even[c];
                }
            }
        }
    }
}

/// (cosine, sine) terms turned by an angle.
#[inline(always)]
fn turn([cos, sin]: [f64; 2], from: &[f64], to: &mut [f64]) {
    for (t, f) in to.chunks_exact_mut(2).zip(from.chunks_exact(2)) {
        (t[0], t[1]) = (cos * f[0] - sin * f[1], sin * f[0] + cos * f[1]);
    }
}

/// sums += Σ r_k · values, then r_{k+1}.
#[inline(always)]
fn step<V: Vector, const N: usize>(
    step: &Step,
    x2: &[V; N],
    values: &[[V; N]; 12],
    now: &mut [V; N],
    before: &mut [V; N],
    sums: &mut [f64],
) {
    for c in 0..12 {
        let mut sum = V::load(&sums[c * V::LANES..]);
        for v in 0..N {
            sum = now[v].fma(values[c][v], sum);
        }
        sum.store(&mut sums[c * V::LANES..]);
    }
    advance(step.a, step.b, x2, now, before);
}

#[inline(always)]
fn advance<V: Vector, const N: usize>(a: f64, b: f64, x2: &[V; N], now: &mut [V; N], before: &mut [V; N]) {
    for v in 0..N {
        let next = x2[v].fma(V::splat(a), V::splat(b)).fma(now[v], before[v]);
        before[v] = now[v];
        now[v] = next;
    }
}

/// cells = (Σ_k even parts · r_k, x Σ_k odd parts · r_k).
pub(super) struct Synthesis<'a> {
    pub(super) part: Part<'a>,
    pub(super) column: &'a [Row],
    /// Cells of blocks, `stride` apart, from the one of this m.
    pub(super) cells: &'a mut [f64],
    pub(super) stride: usize,
    pub(super) scratch: &'a mut Scratch,
}

impl Kernel for Synthesis<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        if A::F64::REGISTERS >= 32 { self.with::<A::F64, 2>() } else { self.with::<A::F64, 1>() }
    }
}

impl Synthesis<'_> {
    #[inline(always)]
    fn with<V: Vector, const N: usize>(self) {
        prepare(&self.part, self.column, &mut self.scratch.rows);
        let n = N * V::LANES;
        for ring in (0..self.part.x2.len()).step_by(n) {
            let sums = match self.part.active(ring, n) {
                Some(unit) => contract::<V, N>(&self.part, unit, &self.scratch.rows),
                None => [[V::splat(0.0); N]; 12],
            };
            for v in 0..N {
                let ring = ring + v * V::LANES;
                let x = V::load(&self.part.x[ring..]);
                for c in 0..12 {
                    let sum = if c < 6 { sums[c][v] } else { sums[c][v].mul(x) };
                    sum.store(&mut self.cells[place(ring, self.stride, c)..]);
                }
            }
        }
    }
}

/// A_k, B_k, and the six even and six odd terms of every step.
#[inline(always)]
fn prepare(part: &Part<'_>, column: &[Row], rows: &mut Vec<[f64; 16]>) {
    let back = [part.phase[0], -part.phase[1]];
    rows.clear();
    rows.resize(part.steps.len(), [0.0; 16]);
    let mut even = [0.0; 6];
    turn(back, &column[0], &mut even);
    for (k, (step, row)) in part.steps.iter().zip(rows).enumerate() {
        let (mut odd, mut next) = ([0.0; 6], [0.0; 6]);
        if let Some(c) = column.get(2 * k + 1) {
            turn(back, c, &mut odd);
        }
        if let Some(c) = column.get(2 * k + 2) {
            turn(back, c, &mut next);
        }
        (row[0], row[1]) = (step.a, step.b);
        for c in 0..6 {
            row[2 + c] = step.even[0] * even[c] + step.even[1] * next[c];
            row[8 + c] = step.odd * odd[c];
        }
        even = next;
    }
}

#[inline(always)]
fn contract<V: Vector, const N: usize>(part: &Part<'_>, unit: Active, rows: &[[f64; 16]]) -> [[V; N]; 12] {
    let x2: [V; N] = Part::vectors(part.x2, unit.ring);
    let mut now = [V::splat(0.0); N];
    let mut before = now;
    let mut sums = [[V::splat(0.0); N]; 12];
    for k in unit.begin..unit.all {
        part.inject(unit.ring, k, &mut now, &mut before);
        contribute(&rows[k], &x2, &mut now, &mut before, &mut sums);
    }
    for row in &rows[unit.all..] {
        contribute(row, &x2, &mut now, &mut before, &mut sums);
    }
    sums
}

#[inline(always)]
fn contribute<V: Vector, const N: usize>(
    row: &[f64; 16],
    x2: &[V; N],
    now: &mut [V; N],
    before: &mut [V; N],
    sums: &mut [[V; N]; 12],
) {
    for c in 0..12 {
        let term = V::splat(row[2 + c]);
        for v in 0..N {
            sums[c][v] = now[v].fma(term, sums[c][v]);
        }
    }
    advance(row[0], row[1], x2, now, before);
}
