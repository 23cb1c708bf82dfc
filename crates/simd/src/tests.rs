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
            v.mul(v).truncate().if_positive(v.mul(v).truncate(), A::F32::splat(0.0)).store_whole(&mut whole);
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
            let size =
                if exponent == 0 { digits } else { (1024.0 + digits) * 2f32.powi(i32::from(exponent) - 1) };
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
