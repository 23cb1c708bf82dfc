//! Adaptive quadrature of a colour over an interval.

/// A value and the sum of its absolute error estimates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Estimate {
    pub value: [f64; 3],
    pub error: f64,
}

/// Kronrod 1965; Piessens et al. 1983, QUADPACK, qk15: nodes in (0, 1], from the end to the middle.
pub(crate) const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
/// Weights of the fifteen points, in the order of [`NODES`].
pub(crate) const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_22,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_83,
];
/// Gauss's weights at every second node.
pub(crate) const GAUSS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_93, 0.417_959_183_673_469_4];

/// A part of the interval.
struct Segment {
    a: f64,
    b: f64,
    estimate: Estimate,
}

/// Integrates `f` over the parts between the ascending `breaks`, splitting the worst part until the error is
/// below `relative` times the value or below `absolute`, at most `splits` times.
pub(crate) fn integrate(
    f: &mut dyn FnMut(f64) -> [f64; 3],
    breaks: &[f64],
    relative: f64,
    absolute: f64,
    splits: usize,
) -> Estimate {
    let mut parts: Vec<Segment> = breaks.windows(2).map(|w| segment(f, w[0], w[1])).collect();
    for _ in 0..splits {
        let sum = total(&parts);
        let size = sum.value.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if sum.error <= (relative * size).max(absolute) {
            break;
        }
        let worst =
            (0..parts.len()).max_by(|i, j| parts[*i].estimate.error.total_cmp(&parts[*j].estimate.error));
        let Some(worst) = worst else { break };
        let (a, b) = (parts[worst].a, parts[worst].b);
        let middle = 0.5 * (a + b);
        parts[worst] = segment(f, a, middle);
        parts.push(segment(f, middle, b));
    }
    total(&parts)
}

fn total(parts: &[Segment]) -> Estimate {
    let mut sum = Estimate { value: [0.0; 3], error: 0.0 };
    for part in parts {
        sum.value = crate::math::plus(sum.value, part.estimate.value);
        sum.error += part.estimate.error;
    }
    sum
}

/// Gauss–Kronrod 7-15; the error estimate is QUADPACK's (200 |K − G|/scale)^{3/2} · scale, scale = |K|.
fn segment(f: &mut dyn FnMut(f64) -> [f64; 3], a: f64, b: f64) -> Segment {
    let (middle, radius) = (0.5 * (a + b), 0.5 * (b - a));
    let (mut kronrod, mut gauss) = ([0.0; 3], [0.0; 3]);
    for i in 0..8 {
        let v = if i == 7 {
            f(middle)
        } else {
            crate::math::plus(f(middle - radius * NODES[i]), f(middle + radius * NODES[i]))
        };
        for c in 0..3 {
            kronrod[c] += radius * KRONROD[i] * v[c];
            if i % 2 == 1 {
                gauss[c] += radius * GAUSS[i / 2] * v[c];
            }
        }
    }
    let error = (0..3).map(|c| difference(kronrod[c], gauss[c])).fold(0.0, f64::max);
    Segment { a, b, estimate: Estimate { value: kronrod, error } }
}

fn difference(kronrod: f64, gauss: f64) -> f64 {
    let (d, scale) = ((kronrod - gauss).abs(), kronrod.abs());
    if scale == 0.0 { d } else { scale * (200.0 * d / scale).powf(1.5).min(d / scale) }
}

/// `lo`, `hi` and, between them, each centre with steps of width·4^k on both sides.
pub(crate) fn graded(lo: f64, hi: f64, centres: &[(f64, f64)]) -> Vec<f64> {
    let mut breaks = vec![lo, hi];
    for &(centre, width) in centres {
        breaks.push(centre);
        let mut step = width.max(1e-9 * (hi - lo));
        while step < hi - lo {
            breaks.extend([centre - step, centre + step]);
            step *= 4.0;
        }
    }
    breaks.retain(|x| (lo..=hi).contains(x));
    breaks.sort_by(f64::total_cmp);
    breaks.dedup_by(|x, y| *x - *y < 1e-12 * (hi - lo));
    breaks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_and_peaked_functions() {
        let mut f = |x: f64| [x.exp(), 1.0 / (1e-6 + x * x), x.abs().sqrt()];
        let got = integrate(&mut f, &graded(-1.0, 1.0, &[(0.0, 1e-3)]), 1e-9, 0.0, 400);
        let want = [1f64.exp() - (-1f64).exp(), 2e3 * 1e3f64.atan(), 4.0 / 3.0];
        for c in 0..3 {
            assert!((got.value[c] / want[c] - 1.0).abs() < 1e-7, "{c}: {} {}", got.value[c], want[c]);
        }
    }
}
