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
pub use vector::{Double, MAX_F64_LANES, Short, Single, Vector};
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
mod tests;
