use super::*;

/// Numbers without a pattern.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        // Marsaglia 2003, xorshift.
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }
}

fn through(rgba: &[f32], size: (usize, usize), signed: bool) -> (Vec<f32>, WriteReport) {
    let (mut bytes, mut report) = (Vec::new(), WriteReport::default());
    encode(rgba, size, signed, &mut bytes, &mut report);
    assert_eq!(bytes.len(), image_bytes(size.0, size.1));
    (decode(&bytes, size, signed), report)
}

/// Root mean square of log2(given/got).
fn log_error(a: &[f32], b: &[f32]) -> f64 {
    let mut sum = (0.0, 0.0);
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)).flat_map(|(a, b)| a[..3].iter().zip(&b[..3])) {
        sum.0 += (f64::from(a.max(1e-4)).log2() - f64::from(b.max(1e-4)).log2()).powi(2);
        sum.1 += 1.0;
    }
    (sum.0 / sum.1).sqrt()
}

#[test]
fn single_colours_of_any_size_come_back_to_half_precision() {
    for (w, h) in [(1, 1), (2, 2), (3, 5), (8, 4), (7, 1)] {
        for rgb in [[0.0; 3], [1.0; 3], [65504.0, 0.001, 3.0], [0.3, 1e-6, 700.0]] {
            let image: Vec<f32> = (0..w * h).flat_map(|_| [rgb[0], rgb[1], rgb[2], 1.0]).collect();
            let (back, report) = through(&image, (w, h), false);
            for (a, b) in image.iter().zip(&back) {
                // One code of a half is 2⁻¹⁰ of the value, or 2⁻²⁴.
                assert!((a - b).abs() <= 1.01e-3 * a + 6e-8, "{rgb:?}: {a} {b}");
            }
            assert_eq!(report, WriteReport::default());
        }
    }
}

#[test]
fn ramps_and_edges_are_kept() {
    // A ramp along one line: 16 levels. An edge between two colours that lie on no line with the ramps on it.
    let (w, h) = (16, 16);
    let texel = |k: usize| {
        let (x, y) = ((k % w) as f32, (k / w) as f32);
        let ramp = 1.0 + 0.02 * x + 0.01 * y;
        if x < y {
            [2.0 * ramp, 0.5 * ramp, 0.1 * ramp, 1.0]
        } else {
            [0.3 * ramp, 1.5 * ramp, 4.0 * ramp, 1.0]
        }
    };
    let image: Vec<f32> = (0..w * h).flat_map(texel).collect();
    let (back, _) = through(&image, (w, h), false);
    let e = log_error(&image, &back);
    assert!(e < 0.02, "{e}");
}

/// Prefiltered light is smooth: the error is a fraction of a per cent.
#[test]
fn smooth_light_keeps_three_digits() {
    let (w, h) = (64, 64);
    let texel = |k: usize| {
        let (x, y) = ((k % w) as f32 / 64.0, (k / w) as f32 / 64.0);
        let sun = 500.0 * (-40.0 * ((x - 0.4).powi(2) + (y - 0.3).powi(2))).exp();
        [0.2 + 0.1 * y + sun, 0.3 + 0.2 * y + 0.9 * sun, 0.7 * y + 0.1 + 0.7 * sun, 1.0]
    };
    let image: Vec<f32> = (0..w * h).flat_map(texel).collect();
    let (back, _) = through(&image, (w, h), false);
    let e = log_error(&image, &back);
    assert!(e < 0.03, "{e}");
    assert_eq!(through(&image, (w, h), false).0, back);
}

#[test]
fn signs_are_kept_where_the_format_has_them() {
    let mut random = Random(7);
    let mut value = |_: usize| (random.unit() - 0.5) * 8.0;
    let a: Vec<f32> = (0..3).map(&mut value).collect();
    let image: Vec<f32> = (0..64usize)
        .flat_map(|k| {
            let t = 1.0 + 0.01 * (k % 16) as f32;
            [a[0] * t, -a[1] * t, a[2], 1.0]
        })
        .collect();
    let (back, report) = through(&image, (8, 8), true);
    assert_eq!(report.clipped, 0);
    for (a, b) in image.iter().zip(&back) {
        assert!((a - b).abs() < 0.01 * a.abs(), "{a} {b}");
    }
}

#[test]
fn what_does_not_fit_is_counted() {
    let (back, report) = through(&[-1.0, 1e6, 1e-9, 1.0], (1, 1), false);
    assert_eq!((report.clipped, report.vanished), (2, 1));
    assert!((report.lost - (1.0 + 1e6 - 65504.0)).abs() < 1e-6);
    assert_eq!((back[0], back[2], back[3]), (0.0, 0.0, 1.0));
    assert!((back[1] - 65504.0).abs() < 70.0, "{back:?}");
    let (back, report) = through(&[-1e6, 1.0, 0.0, 1.0], (1, 1), true);
    assert_eq!((report.clipped, report.vanished), (1, 0));
    assert!((back[0] + 65504.0).abs() < 70.0, "{back:?}");
}

/// Every bit pattern decodes, and noise never comes out worse than one line through it.
#[test]
fn any_block_decodes_and_any_colours_encode() {
    let mut random = Random(1);
    for k in 0..20_000u32 {
        let bytes: Vec<u8> = (0..2).flat_map(|_| random.next().to_le_bytes()).collect();
        let texels = decode(&bytes, (4, 4), k % 2 == 1);
        assert!(texels.iter().all(|v| v.is_finite()), "{bytes:?}");
        if k % 20 == 0 {
            let signed = k % 40 == 0;
            let noise: Vec<f32> = (0..64).map(|_| (20.0 * random.unit() - 10.0).exp2()).collect();
            let (back, _) = through(&noise, (4, 4), signed);
            assert!(log_error(&noise, &back) < 6.0);
        }
    }
}

/// What a block holds is found again: the encoder loses little on what some encoder wrote.
#[test]
fn blocks_of_every_mode_are_met_again() {
    let mut random = Random(3);
    let (mut sum, mut n) = (0.0, 0);
    for code in modes::MODES.iter().map(|m| (m.code, m.code_bits)) {
        for _ in 0..40 {
            let mut bytes: Vec<u8> = (0..2).flat_map(|_| random.next().to_le_bytes()).collect();
            bytes[0] = bytes[0] >> code.1 << code.1 | code.0 as u8;
            let image = decode(&bytes, (4, 4), false);
            let (back, _) = through(&image, (4, 4), false);
            sum += log_error(&image, &back).powi(2);
            n += 1;
        }
    }
    let e = (sum / f64::from(n)).sqrt();
    assert!(e < 0.35, "{e}");
}

/// The bits of all texels of many blocks of every code, the reserved ones too, as an independent decoder
/// (bcdec) gives them: their Fowler–Noll–Vo checksums. −0 is told from 0.
#[test]
fn another_decoder_gives_the_same_bits() {
    const CODES: [(u64, u32); 18] = [
        (0, 2),
        (1, 2),
        (2, 5),
        (6, 5),
        (10, 5),
        (14, 5),
        (18, 5),
        (22, 5),
        (26, 5),
        (30, 5),
        (3, 5),
        (7, 5),
        (11, 5),
        (15, 5),
        (19, 5),
        (23, 5),
        (27, 5),
        (31, 5),
    ];
    for (signed, sum) in [(false, 0xd7b6_3287_808a_5b76u64), (true, 0xd6aa_cd52_c699_2ce4)] {
        let (mut random, mut hash) = (Random(11), 0xcbf2_9ce4_8422_2325u64);
        for k in 0..18 * 128 {
            let (code, bits) = CODES[k % 18];
            let low = random.next() >> bits << bits | code;
            let block = u128::from(random.next()) << 64 | u128::from(low);
            for h in decode::block(block, signed).into_iter().flatten() {
                hash = (hash ^ u64::from(h)).wrapping_mul(0x100_0000_01b3);
            }
        }
        assert_eq!(hash, sum, "signed {signed}");
    }
}
