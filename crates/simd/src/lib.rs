//! Run-time instruction-set dispatch: the only crate of Steradian that contains `unsafe`.
//!
//! [`dispatch`] runs a closure compiled for the best instruction set of this machine. Everything that the
//! closure calls must be `#[inline(always)]` to be compiled along with it. The environment variable
//! `STERADIAN_ISA` (`portable`, `avx2`, `avx512`) pins the choice, for bit-identical results across machines.
//! It is read once; what cannot be met is refused: programs ask [`check`] first and say so, elsewhere [`isa`]
//! panics.
//!
//! On aarch64 plain loops with fused multiplication and addition stand for NEON, which compilers map to its
//! vectors; `scripts/test-aarch64.sh` runs the tests there under emulation.

pub mod functions;
mod lanes;
#[cfg(any(test, not(target_arch = "x86_64")))]
mod plain;
mod vector;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use lanes::Lanes;
#[cfg(any(test, not(target_arch = "x86_64")))]
use plain::Plain;
use std::sync::OnceLock;
pub use vector::{Double, Short, Single, Vector};
#[cfg(target_arch = "x86_64")]
use x86::{EightSingle, FourSingle, Pair, Sixteen, SseLanes, TwoDouble};

/// An instruction set that kernels are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Isa {
    /// What the target guarantees (SSE2 on x86-64, NEON on aarch64).
    Portable,
    /// AVX2 with FMA and F16C.
    Avx2,
    /// AVX-512 F, BW, DQ, VL.
    Avx512,
}

impl Isa {
    /// All, from the narrowest.
    const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// Those that this machine has, whatever `STERADIAN_ISA` says, from the narrowest.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().take_while(|isa| *isa <= detect())
    }

    /// The name that `STERADIAN_ISA` takes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }
}

/// `STERADIAN_ISA` names what cannot be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IsaError {
    /// The instruction set exists, but this machine lacks it.
    Lacking(Isa),
    /// No instruction set has this name.
    Unknown(String),
}

impl std::fmt::Display for IsaError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Lacking(isa) => write!(f, "STERADIAN_ISA={}: this machine lacks it; it has", isa.name())?,
            Self::Unknown(name) => {
                let short: String = name.chars().take(40).collect();
                write!(f, "STERADIAN_ISA={short:?}: no such instruction set; this machine has")?;
            }
        }
        Isa::available().try_for_each(|isa| write!(f, " {}", isa.name()))?;
        write!(f, " (unset: the last)")
    }
}

impl std::error::Error for IsaError {}

/// What a setting of `STERADIAN_ISA` asks for on a machine whose best is `best`. An empty one is none.
fn resolve(setting: Option<&str>, best: Isa) -> Result<Isa, IsaError> {
    let Some(name) = setting.filter(|name| !name.is_empty()) else { return Ok(best) };
    match Isa::ALL.into_iter().find(|isa| isa.name() == name) {
        Some(isa) if isa <= best => Ok(isa),
        Some(isa) => Err(IsaError::Lacking(isa)),
        None => Err(IsaError::Unknown(name.into())),
    }
}

/// The instruction set in use: the best that the machine has, or what `STERADIAN_ISA` pins.
///
/// # Errors
/// If `STERADIAN_ISA` names an instruction set that the machine lacks, or none.
pub fn check() -> Result<Isa, IsaError> {
    static ISA: OnceLock<Result<Isa, IsaError>> = OnceLock::new();
    let read = || {
        let setting = std::env::var_os("STERADIAN_ISA");
        resolve(setting.map(|s| s.to_string_lossy().into_owned()).as_deref(), detect())
    };
    ISA.get_or_init(read).clone()
}

/// The instruction set in use: the best that the machine has, or what `STERADIAN_ISA` pins.
///
/// # Panics
/// If `STERADIAN_ISA` names an instruction set that the machine lacks, or none; [`check`] tells it as an
/// error.
#[inline]
pub fn isa() -> Isa {
    static ISA: OnceLock<Isa> = OnceLock::new();
    *ISA.get_or_init(|| check().unwrap_or_else(|e| panic!("{e}")))
}

#[cfg(target_arch = "x86_64")]
fn detect() -> Isa {
    let avx2 = is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("f16c");
    let avx512 = avx2
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl");
    if avx512 {
        Isa::Avx512
    } else if avx2 {
        Isa::Avx2
    } else {
        Isa::Portable
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn detect() -> Isa {
    Isa::Portable
}

/// Runs `f` compiled for [`isa`]. Mark `f`'s callees `#[inline(always)]`. Only a closure that is inlined
/// itself gains, and no attribute can force that on one that is large: where it matters, use [`run`].
#[inline]
pub fn dispatch<R>(f: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma,f16c,bmi1,bmi2")]
        fn avx2<R>(f: impl FnOnce() -> R) -> R {
            f()
        }
        #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,f16c,bmi1,bmi2")]
        fn avx512<R>(f: impl FnOnce() -> R) -> R {
            f()
        }
        match isa() {
            // SAFETY: `isa` returns this only where the features were detected.
            Isa::Avx512 => return unsafe { avx512(f) },
            // SAFETY: as above.
            Isa::Avx2 => return unsafe { avx2(f) },
            Isa::Portable => {}
        }
    }
    f()
}

/// Asks for the cache line of number `at` of `x`, so that a load some hundred instructions later need not
/// wait for it. It changes nothing but time; beyond the end of `x`, and where there is no such instruction,
/// it does nothing.
#[inline(always)]
pub fn prefetch<T>(x: &[T], at: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(x) = x.get(at) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: the instruction is part of SSE, which every x86-64 has, and reads nothing that a program
        // sees.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(x).cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (x, at);
}

/// What a kernel may know of the instruction set that it is compiled for.
pub trait Arch: Copy {
    /// Eight f32.
    type F32x8: Lanes;
    /// Four f64.
    type F64x4: Vector<T = f64>;
    /// Eight f32, with fused multiplication and addition where there is one.
    type Octet: Vector<T = f32>;
    /// The widest register of f64.
    type F64: Double;
    /// The widest register of f32.
    type F32: Single<Double = Self::F64>;

    /// `a·b + c`: fused where the instruction set has it, two roundings elsewhere (a call to the fused
    /// routine of the C library would be slower by an order of magnitude).
    fn fma(a: f64, b: f64, c: f64) -> f64;
}

/// Fused multiply-add in hardware, with registers V of f32.
#[derive(Clone, Copy)]
struct Fused<V>(std::marker::PhantomData<V>);

impl<V: Single> Arch for Fused<V> {
    type F64 = V::Double;
    type F32 = V;
    #[cfg(target_arch = "x86_64")]
    type F32x8 = lanes::Avx;
    #[cfg(not(target_arch = "x86_64"))]
    type F32x8 = lanes::Plain;
    #[cfg(target_arch = "x86_64")]
    type F64x4 = x86::Four;
    #[cfg(target_arch = "x86_64")]
    type Octet = EightSingle;
    #[cfg(not(target_arch = "x86_64"))]
    type F64x4 = Plain<f64, 4, true>;
    #[cfg(not(target_arch = "x86_64"))]
    type Octet = Plain<f32, 8, true>;
    #[inline(always)]
    fn fma(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
}

/// SSE2: separate multiplication and addition.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
struct Sse;

#[cfg(target_arch = "x86_64")]
impl Arch for Sse {
    type F32x8 = SseLanes;
    type F64x4 = Pair<TwoDouble>;
    type Octet = Pair<FourSingle>;
    type F64 = TwoDouble;
    type F32 = FourSingle;

    #[inline(always)]
    fn fma(a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }
}

/// Plain loops over arrays, with separate multiplication and addition.
#[cfg(any(test, not(any(target_arch = "x86_64", target_arch = "aarch64"))))]
#[derive(Clone, Copy)]
struct Separate;

#[cfg(any(test, not(any(target_arch = "x86_64", target_arch = "aarch64"))))]
impl Arch for Separate {
    type F32x8 = lanes::Plain;
    type F64x4 = Plain<f64, 4, false>;
    type Octet = Plain<f32, 8, false>;
    type F64 = Plain<f64, 2, false>;
    type F32 = Plain<f32, 4, false>;

    #[inline(always)]
    fn fma(a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }
}

/// A computation that [`run`] compiles once per instruction set. Mark `run` and all that it calls
/// `#[inline(always)]`.
pub trait Kernel {
    /// What it returns.
    type Output;
    /// The computation.
    fn run<A: Arch>(self) -> Self::Output;
}

/// Runs a kernel compiled for [`isa`].
#[inline]
pub fn run<K: Kernel>(kernel: K) -> K::Output {
    // SAFETY: `isa` returns what was detected, or less.
    unsafe { run_unchecked(isa(), kernel) }
}

/// Runs a kernel compiled for `wanted`, or for the best that this machine has if that is less.
#[inline]
pub fn run_on<K: Kernel>(wanted: Isa, kernel: K) -> K::Output {
    // SAFETY: the features were detected.
    unsafe { run_unchecked(wanted.min(detect()), kernel) }
}

/// Runs a kernel compiled for `isa`.
///
/// # Safety
/// The machine must have the instruction set.
#[inline]
unsafe fn run_unchecked<K: Kernel>(isa: Isa, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma,f16c,bmi1,bmi2")]
        fn avx2<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<Fused<EightSingle>>()
        }
        #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,f16c,bmi1,bmi2")]
        fn avx512<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<Fused<Sixteen>>()
        }
        match isa {
            // SAFETY: the caller vouches for the features.
            Isa::Avx512 => return unsafe { avx512(kernel) },
            // SAFETY: as above.
            Isa::Avx2 => return unsafe { avx2(kernel) },
            Isa::Portable => {}
        }
    }
    let _ = isa;
    #[cfg(target_arch = "x86_64")]
    return kernel.run::<Sse>();
    #[cfg(target_arch = "aarch64")]
    return kernel.run::<Fused<Plain<f32, 4, true>>>();
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    kernel.run::<Separate>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_that_cannot_be_met_are_refused() {
        for best in Isa::ALL {
            assert_eq!(resolve(None, best), Ok(best));
            assert_eq!(resolve(Some(""), best), Ok(best));
            for isa in Isa::ALL {
                let met = if isa <= best { Ok(isa) } else { Err(IsaError::Lacking(isa)) };
                assert_eq!(resolve(Some(isa.name()), best), met);
            }
        }
        assert_eq!(resolve(Some("AVX2"), Isa::Avx512), Err(IsaError::Unknown("AVX2".into())));
        let said = IsaError::Unknown("x\n".repeat(1000)).to_string();
        assert!(said.len() < 200 && !said.contains('\n') && said.contains("portable"), "{said}");
        let said = IsaError::Lacking(Isa::Avx512).to_string();
        assert!(said.starts_with("STERADIAN_ISA=avx512: this machine lacks it; it has portable"), "{said}");
    }

    #[test]
    fn dispatch_returns_what_the_closure_returns() {
        let x: Vec<f32> = (0..1000).map(|i| i as f32).collect();
        assert_eq!(dispatch(|| x.iter().sum::<f32>()), 499_500.0);
        assert!(isa() <= detect());
    }

    struct Dot<'a>(&'a [f64], &'a [f64]);

    impl Kernel for Dot<'_> {
        type Output = f64;
        #[inline(always)]
        fn run<A: Arch>(self) -> f64 {
            self.0.iter().zip(self.1).fold(0.0, |s, (a, b)| A::fma(*a, *b, s))
        }
    }

    /// Every operation on lanes with every kind of number, as bits.
    struct Operations;

    impl Kernel for Operations {
        type Output = Vec<u32>;
        #[inline(always)]
        fn run<A: Arch>(self) -> Vec<u32> {
            let x = [0.0, -0.0, 1.5, -2.5, f32::NAN, f32::INFINITY, 3e38, 1e-40];
            let mut out = Vec::new();
            for turn in 0..8 {
                let mut y = x;
                y.rotate_left(turn);
                let (a, b) = (A::F32x8::load(&x), A::F32x8::load(&y));
                for v in [a.add(b), a.sub(b), a.mul(b), a.div(b), a.min(b), a.max(b), A::F32x8::splat(y[0])] {
                    out.extend(v.store().map(|v| if v.is_nan() { 1 } else { v.to_bits() }));
                }
                out.extend([a.lt(b), a.le(b), a.eq(b)]);
            }
            out
        }
    }

    #[test]
    fn lanes_give_the_same_bits_on_every_instruction_set() {
        let plain = Operations.run::<Separate>();
        for isa in Isa::available() {
            assert_eq!(run_on(isa, Operations), plain, "{isa:?}");
        }
        // A lane compared with itself: all are equal but NaN, none is less.
        assert_eq!(plain[56..59], [0, 0b1110_1111, 0b1110_1111]);
    }

    #[test]
    fn a_kernel_computes_the_same_on_every_instruction_set() {
        let x: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(run(Dot(&x, &x)), 328_350.0);
        assert_eq!(Dot(&x, &x).run::<Separate>(), 328_350.0);
    }

    /// Twelve vectors from 192 numbers, summed over their lanes; at last the number of lanes.
    struct Sums<'a, T>(&'a [T]);

    impl Kernel for Sums<'_, f64> {
        type Output = [f64; 16];
        #[inline(always)]
        fn run<A: Arch>(self) -> [f64; 16] {
            let v: [A::F64; 12] = std::array::from_fn(|k| A::F64::load(&self.0[16 * k..]));
            let three = A::F64::splat(3.0);
            let v = v.map(|v| v.fma(three, v).replace_if_equal(v, three, three));
            let mut sums = [0.5; 16];
            A::F64::add_sums(&v, &mut sums);
            sums[15] = A::F64::LANES as f64;
            sums
        }
    }

    impl Kernel for Sums<'_, f32> {
        type Output = [f64; 16];
        #[inline(always)]
        fn run<A: Arch>(self) -> [f64; 16] {
            let v: [A::F32; 12] = std::array::from_fn(|k| A::F32::load(&self.0[16 * k..]));
            let two = A::F32::splat(2.0);
            let v = v.map(|v| v.fma(two, v).add(v.mul(A::F32::splat(1.0))));
            let mut sums = [0.5; 16];
            A::F32::add_sums(&v, &mut sums);
            sums[15] = A::F32::LANES as f64;
            sums
        }
    }

    #[test]
    fn vectors_sum_their_lanes() {
        let x: Vec<f64> = (0..192).map(f64::from).collect();
        let y: Vec<f32> = x.iter().map(|x| *x as f32).collect();
        for isa in Isa::available() {
            for (s, special) in [(run_on(isa, Sums(&x[..])), true), (run_on(isa, Sums(&y[..])), false)] {
                let lanes = s[15] as usize;
                for k in 0..12 {
                    let f = |v: f64| if special && v == 3.0 { 3.0 } else { 4.0 * v };
                    let direct: f64 = x[16 * k..16 * k + lanes].iter().map(|v| f(*v)).sum();
                    assert_eq!(s[k], direct + 0.5, "{isa:?} {k}");
                }
                assert_eq!(s[14], 0.5);
            }
        }
    }

    struct Narrow<'a>(&'a [f64]);

    impl Kernel for Narrow<'_> {
        type Output = Vec<f32>;
        #[inline(always)]
        fn run<A: Arch>(self) -> Vec<f32> {
            let (n, mut out) = (A::F64::LANES, vec![0.0; A::F32::LANES]);
            A::F32::narrow(A::F64::load(self.0), A::F64::load(&self.0[n..])).store(&mut out);
            out
        }
    }

    #[test]
    fn two_registers_of_f64_make_one_of_f32() {
        let x: Vec<f64> = (0..16).map(|k| 1.0 / f64::from(k + 1)).collect();
        for isa in Isa::available() {
            let y = run_on(isa, Narrow(&x));
            assert!(y.iter().zip(&x).all(|(y, x)| *y == *x as f32), "{isa:?}");
        }
    }

    /// Division, root, smaller, truncation, choice, halves and whole numbers, of as many numbers as a
    /// register holds.
    struct SingleOnly<'a>(&'a [f32], &'a [u16]);

    impl Kernel for SingleOnly<'_> {
        type Output = Vec<Vec<f32>>;
        #[inline(always)]
        fn run<A: Arch>(self) -> Vec<Vec<f32>> {
            let mut out = vec![Vec::new(); 7];
            for (x, half) in self.0.chunks_exact(A::F32::LANES).zip(self.1.chunks_exact(A::F32::LANES)) {
                let (v, three) = (A::F32::load(x), A::F32::splat(3.0));
                let all = [
                    v.div(three),
                    v.sqrt(),
                    v.min(three),
                    v.truncate(),
                    v.if_positive(three, v),
                    A::F32::load_half(half),
                ];
                for (to, v) in out.iter_mut().zip(all) {
                    let mut lanes = [0.0; 16];
                    v.store(&mut lanes);
                    to.extend(&lanes[..A::F32::LANES]);
                }
                let mut whole = [0; 16];
                v.mul(v)
                    .truncate()
                    .if_positive(v.mul(v).truncate(), A::F32::splat(0.0))
                    .store_whole(&mut whole);
                out[6].extend(whole[..A::F32::LANES].iter().map(|x| *x as f32));
            }
            out
        }
    }

    #[test]
    fn single_precision_is_the_same_on_every_instruction_set() {
        let mut x: Vec<f32> = (0..32).map(|k| (k as f32 - 7.5) * 1.37).collect();
        x[3] = f32::NAN;
        x[9] = 0.0;
        // Zeros, the least and the largest numbers, and one below normal ones.
        let mut half: Vec<u16> = (0..32).map(|k| 0x3c00 + 97 * k).collect();
        half[..8].copy_from_slice(&[0, 0x8000, 1, 0x83ff, 0x0400, 0x7bff, 0xfbff, 0xbc01]);
        for isa in Isa::available() {
            let out = run_on(isa, SingleOnly(&x, &half));
            for (k, x) in x.iter().enumerate() {
                let want = [
                    x / 3.0,
                    x.sqrt(),
                    if *x < 3.0 { *x } else { 3.0 },
                    if x.is_nan() { f32::NAN } else { x.trunc() },
                    if *x > 0.0 { 3.0 } else { *x },
                ];
                for (i, want) in want.into_iter().enumerate() {
                    // What becomes of NaN when truncated is not said.
                    if !(i == 3 && x.is_nan()) {
                        let same = out[i][k] == want || (out[i][k].is_nan() && want.is_nan());
                        assert!(same, "{isa:?} {i} {k}: {} {want}", out[i][k]);
                    }
                }
                assert_eq!(out[6][k], if x.is_nan() { 0.0 } else { (x * x).trunc() }, "{isa:?} {k}");
                let (sign, exponent, digits) = (half[k] >> 15, half[k] >> 10 & 31, f32::from(half[k] & 1023));
                let size = if exponent == 0 {
                    digits
                } else {
                    (1024.0 + digits) * 2f32.powi(i32::from(exponent) - 1)
                };
                let want = if sign == 1 { -size } else { size } * 2f32.powi(-24);
                assert_eq!(out[5][k], want, "{isa:?} {:#x}", half[k]);
            }
        }
    }

    /// Sums, fractions and products of pairs of as many i16 as there are, as whole numbers.
    struct Shorts<'a>([&'a [i16]; 2]);

    impl Kernel for Shorts<'_> {
        type Output = Vec<f32>;
        #[inline(always)]
        fn run<A: Arch>(self) -> Vec<f32> {
            type S<A> = <<A as Arch>::F32 as Single>::Short;
            let (lanes, one, mut out) = (2 * A::F32::LANES, S::<A>::splat(1), Vec::new());
            for (a, b) in self.0[0].chunks_exact(lanes).zip(self.0[1].chunks_exact(lanes)) {
                let (a, b) = (S::<A>::load(a), S::<A>::load(b));
                // Sums and fractions are seen by products: with (1, 1).
                for v in [a.pairs(b), a.add(b).pairs(one), a.fraction(b).pairs(one)] {
                    let mut lanes = [0.0; 16];
                    v.store(&mut lanes);
                    out.extend(&lanes[..A::F32::LANES]);
                }
            }
            // In the order of the numbers, whatever the lanes.
            let n = A::F32::LANES;
            let kind = |k: usize| out.chunks_exact(n).skip(k).step_by(3).flatten().copied();
            (0..3).flat_map(kind).collect()
        }
    }

    #[test]
    fn sixteen_bit_numbers_are_the_same_on_every_instruction_set() {
        let mut x: Vec<i16> = (0..64).map(|k: i32| (k * 7919 % 65536 - 32768) as i16).collect();
        x[..8].copy_from_slice(&[32767, -32767, 0, 1, -1, 16384, -16384, -32768]);
        let mut y: Vec<i16> = x.iter().rev().map(|x| x.wrapping_mul(31) | 1).collect();
        y[..8].copy_from_slice(&[32767, 32767, -32768, 16384, 16384, 1, 1, 3]);
        let pairs = |f: &dyn Fn(i32, i32) -> i32| -> Vec<f32> {
            let each: Vec<i32> = x.iter().zip(&y).map(|(x, y)| f(i32::from(*x), i32::from(*y))).collect();
            each.chunks_exact(2).map(|p| (p[0] + p[1]) as f32).collect()
        };
        let sum = |a: i32, b: i32| i32::from((a + b) as i16);
        let fraction = |a: i32, b: i32| (a * b + (1 << 14)) >> 15;
        let want = [pairs(&|a, b| a * b), pairs(&sum), pairs(&fraction)].concat();
        assert_eq!(Shorts([&x, &y]).run::<Separate>(), want);
        for isa in Isa::available() {
            assert_eq!(run_on(isa, Shorts([&x, &y])), want, "{isa:?}");
        }
    }

    /// A square of numbers, turned over its diagonal; c − a·b and a − b of its first two rows.
    struct Square<'a, T>(&'a mut [T]);

    /// The same of the registers of four f64 and of eight f32.
    struct Fixed<'a, T>(&'a mut [T]);

    macro_rules! square {
        ($kernel:ident, $t:ident, $register:ident) => {
            impl Kernel for $kernel<'_, $t> {
                type Output = usize;
                #[inline(always)]
                fn run<A: Arch>(self) -> usize {
                    let lanes = A::$register::LANES;
                    let mut v = [A::$register::splat(0.0); 16];
                    for k in 0..lanes {
                        v[k] = A::$register::load(&self.0[k * lanes..]);
                    }
                    let other = v[0].fnma(v[1], v[0].sub(v[1]));
                    let sums = A::$register::lane_sums(&mut v.clone()[..lanes]);
                    A::$register::transpose(&mut v[..lanes]);
                    let all = A::$register::view(self.0);
                    for k in 0..lanes {
                        all[k] = v[k];
                    }
                    all[lanes] = other;
                    all[lanes + 1] = sums;
                    lanes
                }
            }
        };
    }

    square!(Square, f64, F64);
    square!(Square, f32, F32);
    square!(Fixed, f64, F64x4);
    square!(Fixed, f32, Octet);

    // Elsewhere the narrowest fuse.
    #[cfg(target_arch = "x86_64")]
    #[test]
    fn plain_loops_sum_to_the_same_bits_as_the_narrowest_registers() {
        let x: Vec<f64> = (0..192).map(|k| 1.0 / f64::from(k + 1)).collect();
        let y: Vec<f32> = x.iter().map(|x| *x as f32).collect();
        assert_eq!(run_on(Isa::Portable, Sums(&x[..])), Sums(&x[..]).run::<Separate>());
        assert_eq!(run_on(Isa::Portable, Sums(&y[..])), Sums(&y[..]).run::<Separate>());
        let half: Vec<u16> = (0..32).map(|k| 0x3c00 + 97 * k).collect();
        assert_eq!(
            run_on(Isa::Portable, SingleOnly(&y[..32], &half)),
            SingleOnly(&y[..32], &half).run::<Separate>()
        );
    }

    #[test]
    fn squares_are_transposed() {
        #[repr(align(64))]
        struct Aligned<T>([T; 288]);
        let check = |isa, fixed| {
            let mut single = Aligned(std::array::from_fn(|k| k as f32));
            let mut double = Aligned(std::array::from_fn(|k| k as f64));
            let (x, y) = (&mut single.0[..], &mut double.0[..]);
            let (n, m) = if fixed {
                (run_on(isa, Fixed(x)), run_on(isa, Fixed(y)))
            } else {
                (run_on(isa, Square(x)), run_on(isa, Square(y)))
            };
            assert!(!fixed || (n, m) == (8, 4), "{isa:?}");
            for i in 0..n * n {
                assert_eq!(single.0[i], (i % n * n + i / n) as f32, "{isa:?}");
            }
            for i in 0..m * m {
                assert_eq!(double.0[i], (i % m * m + i / m) as f64, "{isa:?}");
            }
            for i in 0..m {
                assert_eq!(double.0[m * m + i], -(m as f64) - (i * (m + i)) as f64);
                assert_eq!(double.0[m * (m + 1) + i], (m * (m * i) + m * (m - 1) / 2) as f64);
            }
            for i in 0..n {
                assert_eq!(single.0[n * (n + 1) + i], (n * (n * i) + n * (n - 1) / 2) as f32, "{isa:?}");
            }
        };
        for isa in Isa::available() {
            check(isa, false);
            check(isa, true);
        }
    }
}
