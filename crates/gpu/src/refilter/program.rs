//! Jobs: one dispatch's numbers, and the tiles that a budget hands out.

/// A compute pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Pass {
    /// Light → equiangular cube.
    #[default]
    Source,
    /// Light → level of the chain.
    Mirror,
    /// Suns onto a mirror.
    Suns,
    /// Cube → wider Gaussian.
    Gauss,
    /// Gaussians and low bands → level.
    Mix,
    /// Cube → partial sums of coefficients.
    Project,
    /// Adds up partial sums.
    Sum,
    /// Coefficients → a technique's matrices.
    Quadric,
    /// Light → finest box.
    Box,
    /// Box → next.
    Halve,
    /// Boxes → level.
    Boxed,
    /// Boxes → paraboloid maps.
    Parabola,
    /// Both kernels over them.
    Lobes,
    /// Paraboloid maps → level.
    Unfold,
}

impl Pass {
    /// All, in the order of their numbers.
    pub const ALL: [Self; 14] = [
        Self::Source,
        Self::Mirror,
        Self::Suns,
        Self::Gauss,
        Self::Mix,
        Self::Project,
        Self::Sum,
        Self::Quadric,
        Self::Box,
        Self::Halve,
        Self::Boxed,
        Self::Parabola,
        Self::Lobes,
        Self::Unfold,
    ];

    /// Its entry point.
    pub fn entry(self) -> &'static str {
        match self {
            Self::Source => "refilter_source",
            Self::Mirror => "refilter_mirror",
            Self::Suns => "refilter_suns",
            Self::Gauss => "refilter_gauss",
            Self::Mix => "refilter_mix",
            Self::Project => "refilter_project",
            Self::Sum => "refilter_sum",
            Self::Quadric => "refilter_quadric",
            Self::Box => "refilter_box",
            Self::Halve => "refilter_halve",
            Self::Boxed => "refilter_boxed",
            Self::Parabola => "refilter_parabola",
            Self::Lobes => "refilter_lobes",
            Self::Unfold => "refilter_unfold",
        }
    }
}

/// One dispatch: `struct Job` of the shaders, and its cost.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Job {
    pub pass: Pass,
    /// The level of the chain that it makes, where it makes one.
    pub level: Option<usize>,
    /// Threads.
    pub outputs: u64,
    /// Texels that each reads, about.
    pub reads: u64,
    pub span: [u32; 4],
    pub at: [u32; 4],
    pub tables: [u32; 4],
    pub place: [u32; 4],
    pub a: [f32; 4],
    pub kernel: [f32; 4],
}

/// Bytes between jobs in the uniform buffer: the largest alignment of any device.
pub(super) const JOB_BYTES: u64 = 256;

impl Job {
    /// The uniform's bytes, for outputs from `first`.
    pub fn bytes(&self, first: u64) -> [u8; JOB_BYTES as usize] {
        let span = [first as u32, self.outputs as u32, self.span[2], self.span[3]];
        let words = [span, self.at, self.tables, self.place].into_iter().flatten();
        let words = words.chain([self.a, self.kernel].into_iter().flatten().map(f32::to_bits));
        let mut out = [0; JOB_BYTES as usize];
        for (to, word) in out.as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *to = word.to_le_bytes();
        }
        out
    }
}

/// A part of a job: outputs from `first`, whole workgroups.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tile {
    pub job: usize,
    pub first: u64,
    pub groups: u32,
    /// Texels read, about.
    pub reads: u64,
}

/// Threads of a workgroup.
pub(super) const GROUP: u64 = 64;
/// Approximate number of texels that a tile reads: half a millisecond on a small device.
const TILE: u64 = 1 << 20;

/// All jobs with their shared tables.
#[derive(Debug, Clone, Default)]
pub(super) struct Work {
    pub jobs: Vec<Job>,
    pub tiles: Vec<Tile>,
    pub tables: Vec<[f32; 4]>,
    /// Texels of `maps`.
    pub maps: u32,
    /// vec4s of `harmonics`.
    pub harmonics: u32,
}

/// Offset of a technique's matrices, after the coefficients of most bands; partial sums follow.
pub(super) const QUADRIC: u32 = 256;
pub(super) const PARTIAL: u32 = QUADRIC + 16;

/// The trapezoid's weights with end corrections by first and second differences (J. Gregory 1670): 3/8, 7/6,
/// 23/24, 1 …
const GREGORY: [f64; 3] = [3.0 / 8.0, 7.0 / 6.0, 23.0 / 24.0];

/// Collects jobs, tables and places.
#[derive(Default)]
pub(super) struct Builder {
    work: Work,
    even: Vec<(u32, u32)>,
    recurrence: Option<u32>,
}

impl Builder {
    /// Texels of `maps`.
    pub fn reserve(&mut self, texels: u32) -> u32 {
        self.work.maps += texels;
        self.work.maps - texels
    }

    /// Rows of `tables`; where they lie.
    pub fn table(&mut self, rows: impl IntoIterator<Item = [f32; 4]>) -> u32 {
        let at = self.work.tables.len() as u32;
        self.work.tables.extend(rows);
        at
    }

    /// Adds a job.
    pub fn push(&mut self, job: Job) {
        self.work.jobs.push(job);
    }

    /// s = tan(πa/4) of the samples of an equiangular cube, and (1 + s²) times the weight of the sample:
    /// factors of the solid angle dω = (π/4)² (1+s²)(1+t²)(1+s²+t²)^(−3/2) da db. Coordinate lines bend where
    /// faces meet, so the weights are Gregory's, which integrate each face on its own: those of the
    /// trapezoidal rule would be off by a percent at the corners.
    pub fn even_weights(&mut self, n: u32) -> u32 {
        if let Some((_, at)) = self.even.iter().find(|(m, _)| *m == n) {
            return *at;
        }
        let row = |i: u32| {
            let a = f64::from(2 * i) / f64::from(n) - 1.0;
            let s = if a.abs() == 1.0 { a } else { (std::f64::consts::FRAC_PI_4 * a).tan() };
            let end = GREGORY.get(i.min(n - i) as usize).copied().unwrap_or(1.0);
            [s as f32, (end * (1.0 + s * s)) as f32, 0.0, 0.0]
        };
        let at = self.table((0..=n).map(row));
        self.even.push((n, at));
        at
    }

    /// A_lm and B_lm of P_lm = A z P_{l−1,m} − B P_{l−2,m} at l² + l + m, and P_mm (with √2 for m > 0) at l =
    /// m.
    pub fn recurrence(&mut self) -> u32 {
        if let Some(at) = self.recurrence {
            return at;
        }
        let bands = super::plan::MOST_BANDS;
        let mut rows = vec![[0.0f32; 4]; bands * bands];
        let mut diagonal = (0.25 / std::f64::consts::PI).sqrt();
        for m in 0..bands {
            if m > 0 {
                let q = m as f64;
                diagonal *= ((2.0 * q + 1.0) / (2.0 * q)).sqrt() * if m == 1 { 2f64.sqrt() } else { 1.0 };
            }
            rows[m * m + 2 * m] = [diagonal as f32, 0.0, 0.0, 0.0];
            for l in m + 1..bands {
                let (x, q) = ((l * l) as f64, (m * m) as f64);
                let a = ((4.0 * x - 1.0) / (x - q)).sqrt();
                let y = ((l - 1) * (l - 1)) as f64;
                let b = a * ((y - q) / (4.0 * y - 1.0)).max(0.0).sqrt();
                rows[l * l + l + m] = [a as f32, b as f32, 0.0, 0.0];
            }
        }
        let at = self.table(rows);
        self.recurrence = Some(at);
        at
    }

    /// Projection of the equiangular cube at `from`: partial sums of 64 samples, then sums of 32 until one is
    /// left, times `factors`.
    pub fn project(&mut self, n: u32, from: u32, bands: usize, factors: &[f64]) {
        // 25,350 samples of a cube of 64 come to 397 sums, 13 and 1: three passes.
        const SAMPLES: u32 = 64;
        const FAN: u32 = 32;
        let (even, recurrence) = (self.even_weights(n), self.recurrence());
        let factors = self.table(factors.iter().map(|f| [*f as f32, 0.0, 0.0, 0.0]));
        let count = (bands * bands) as u32;
        let mut chunks = (6 * (n + 1) * (n + 1)).div_ceil(SAMPLES);
        let mut at = PARTIAL;
        self.push(Job {
            pass: Pass::Project,
            outputs: u64::from(chunks) * bands as u64,
            reads: u64::from(SAMPLES) * bands as u64,
            span: [0, 0, 0, n],
            at: [at, from, SAMPLES, 0],
            tables: [even, recurrence, 0, bands as u32],
            a: [self.step(even, n) as f32, 0.0, 0.0, 0.0],
            ..Job::default()
        });
        while chunks > 0 {
            let groups = chunks.div_ceil(FAN);
            let last = groups == 1;
            let to = if last { 0 } else { at + chunks * count };
            self.push(Job {
                pass: Pass::Sum,
                outputs: u64::from(groups * count),
                reads: FAN.into(),
                at: [to, at, FAN, chunks],
                tables: [factors, 0, 0, bands as u32],
                a: [f32::from(u8::from(last)), 0.0, 0.0, 0.0],
                ..Job::default()
            });
            self.work.harmonics = self.work.harmonics.max(at + chunks * count);
            (at, chunks) = (to, if last { 0 } else { groups });
        }
    }

    /// The step da db (π/4)² that makes the solid angles of all samples add up to 4π.
    fn step(&self, even: u32, n: u32) -> f64 {
        let rows = &self.work.tables[even as usize..=(even + n) as usize];
        let mut sum = 0.0;
        for t in rows {
            for s in rows {
                let q = 1.0 + f64::from(s[0]).powi(2) + f64::from(t[0]).powi(2);
                sum += f64::from(s[1]) * f64::from(t[1]) * q.powf(-1.5);
            }
        }
        4.0 * std::f64::consts::PI / (6.0 * sum)
    }

    /// Everything, cut into tiles.
    pub fn finish(mut self) -> Work {
        for (job, j) in self.work.jobs.iter().enumerate() {
            let each = (TILE / j.reads.max(1)).max(GROUP).next_multiple_of(GROUP);
            let mut first = 0;
            while first < j.outputs {
                let outputs = each.min(j.outputs - first);
                let groups = outputs.div_ceil(GROUP) as u32;
                self.work.tiles.push(Tile { job, first, groups, reads: outputs * j.reads });
                first += each;
            }
        }
        self.work.maps = self.work.maps.max(1);
        self.work.harmonics = self.work.harmonics.max(PARTIAL);
        self.work.tables.push([0.0; 4]);
        self.work
    }
}
