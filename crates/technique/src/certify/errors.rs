//! The measured error of a technique, and the certificate that states it.

use super::Report;
use steradian_base::{Certificate, Elevation, Evidence, Spread};

/// Definition of the stated error where it was measured, as certificates print it.
const METRIC: &str = "relative RMS error of outgoing radiance, normals uniform over the sphere, views uniform in \
                      solid angle over the hemisphere";
/// Definition of the stated error where it was computed from spectra and nothing was measured.
pub(super) const COMPUTED: &str =
    "relative RMS error of outgoing radiance, computed from the spectra of light and reflectance";

/// Ranges of the view's angle from the normal, degrees, for each of which a certificate states an error.
const BELTS: [[f64; 2]; 5] = [[0.0, 30.0], [30.0, 60.0], [60.0, 75.0], [75.0, 85.0], [85.0, 90.0]];
/// A further range of angles, degrees. Where a technique computed its errors by angle, the certificate lists
/// those, and the error measured in this range after them: computed angles end before the horizon.
const LAST: [f64; 2] = [88.0, 90.0];
/// Where the exact radiance is below this part of its mean, the error of a single point is relative to that
/// part of the mean, so that dark points do not decide the distribution.
const DARK: f64 = 1e-3;

/// The measured errors of a technique's shading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Relative RMS error over all views, two standard errors above the measured one.
    pub all: f64,
    /// Error, as in `all`, of the views of each range 0–30°, 30–60°, 60–75°, 75–85° and 85–90° off the
    /// normal.
    pub belts: [f64; 5],
    /// Error, as in `all`, of the views from 88° to 90° off the normal.
    pub last: f64,
    /// Distribution of the error over single points.
    pub spread: Spread,
    /// The measured error itself.
    pub mean: f64,
    /// The measured error less one standard error.
    pub least: f64,
    /// Negative radiance that was shaded, relative to all that was shaded.
    pub negative: f64,
}

impl Errors {
    /// The certificate of a technique that reports `report`. An error that the technique computed itself is
    /// stated where it lies between one standard error below the measured error and two above it
    /// ([`Self::least`], [`Self::all`]); else the nearer of these two bounds is stated.
    pub fn certificate(&self, report: &Report) -> Certificate {
        let computed = report.estimate.as_ref();
        let error = computed.map_or(self.all, |e| e.error.max(self.least).min(self.all));
        let mut c = Certificate::new(error, Evidence::Measured).metric(METRIC).spread(self.spread);
        let belt = |range: [f64; 2], error: f64| Elevation::measured(range.map(f64::to_radians), error);
        c.elevations = match computed {
            Some(e) if !e.elevations.is_empty() => {
                e.elevations.iter().copied().chain([belt(LAST, self.last)]).collect()
            }
            _ => BELTS.into_iter().zip(self.belts).map(|(range, error)| belt(range, error)).collect(),
        };
        report.figures(&mut c);
        c.details.extend(computed.map(|e| ("error, computed from the spectra".to_string(), e.error)));
        c.detail("error, mean of the probes", self.mean).detail("negative", self.negative)
    }

    pub(super) fn of(samples: &[ProbeSample]) -> Self {
        let within = |[from, to]: [f64; 2]| {
            let inside = |l: &&ProbeSample| (from..to).contains(&l.degrees);
            upper(&samples.iter().filter(inside).collect::<Vec<_>>())
        };
        let sum =
            |f: fn(f64) -> f64| samples.iter().flat_map(|l| l.shaded.map(|x| l.weight * f(x))).sum::<f64>();
        let (below, all) = (sum(|x| (-x).max(0.0)), sum(f64::abs));
        let (belts, last) = (BELTS.map(within), within(LAST));
        let samples: Vec<&ProbeSample> = samples.iter().collect();
        Self {
            all: upper(&samples),
            belts,
            last,
            spread: spread(&samples),
            mean: ratio(&samples).0.sqrt(),
            least: bound(&samples, -1.0),
            negative: if all > 0.0 { below / all } else { 0.0 },
        }
    }
}

/// One evaluated probe.
#[derive(Debug, Clone, Copy)]
pub(super) struct ProbeSample {
    pub weight: f64,
    /// The view's angle from the normal.
    pub degrees: f64,
    pub shaded: [f64; 3],
    pub exact: [f64; 3],
}

impl ProbeSample {
    /// Squares of the difference and of the exact radiance.
    pub(super) fn squares(&self) -> [f64; 2] {
        let square = |v: [f64; 3]| self.weight * v.iter().map(|x| x * x).sum::<f64>();
        [square(std::array::from_fn(|c| self.shaded[c] - self.exact[c])), square(self.exact)]
    }
}

/// R of the samples (the squared error itself where everything is black), and the energy that R is relative
/// to.
pub(super) fn ratio(samples: &[&ProbeSample]) -> (f64, f64) {
    let [error, energy] =
        samples.iter().map(|l| l.squares()).fold([0.0; 2], |s, x| [s[0] + x[0], s[1] + x[1]]);
    (if energy > 0.0 { error / energy } else { error }, energy)
}

/// √(R + 2σ).
pub(super) fn upper(samples: &[&ProbeSample]) -> f64 {
    bound(samples, 2.0)
}

/// √(R + so many σ).
fn bound(samples: &[&ProbeSample], sigmas: f64) -> f64 {
    let (ratio, energy) = ratio(samples);
    if energy <= 0.0 {
        return ratio.sqrt();
    }
    let n = samples.len() as f64;
    let off = |l: &&ProbeSample| {
        let [error, exact] = l.squares();
        (error - ratio * exact).powi(2)
    };
    let rest: f64 = samples.iter().map(off).sum();
    let sigma = (rest * n / (n - 1.0).max(1.0)).sqrt() / energy;
    (ratio + sigmas * sigma).max(0.0).sqrt()
}

/// Quantiles of the relative error of single points, the mean error in stops, and the share of the squared
/// error that the worst hundredth of the points holds.
fn spread(samples: &[&ProbeSample]) -> Spread {
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let luminance = |v: [f64; 3]| 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2];
    let whole: f64 = samples.iter().map(|l| l.weight).sum();
    let mean = |f: &dyn Fn(&ProbeSample) -> f64| samples.iter().map(|l| l.weight * f(l)).sum::<f64>() / whole;
    let (dark, dim) = (DARK * mean(&|l| length(l.exact)), DARK * mean(&|l| luminance(l.exact).abs()));
    let off = |l: &ProbeSample| length(std::array::from_fn(|c| l.shaded[c] - l.exact[c]));
    let relative = |l: &ProbeSample| off(l) / length(l.exact).max(dark).max(f64::MIN_POSITIVE);
    let stops = |l: &ProbeSample| {
        let [a, b] = [l.shaded, l.exact].map(|v| luminance(v).max(dim).max(f64::MIN_POSITIVE));
        (a / b).log2().abs()
    };
    let sorted = |f: &dyn Fn(&ProbeSample) -> f64| {
        let mut all: Vec<(f64, f64)> = samples.iter().map(|l| (f(l), l.weight / whole)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all
    };
    let errors = sorted(&relative);
    let quantile = |share: f64| {
        let mut below = 0.0;
        let reached = errors.iter().find(|(_, w)| {
            below += w;
            below >= share
        });
        reached.or(errors.last()).map_or(0.0, |e| e.0)
    };
    let squares = sorted(&|l| off(l).powi(2));
    let (mut room, mut top) = (0.01, 0.0);
    for (square, w) in squares.iter().rev() {
        top += square * w.min(room);
        room = (room - w).max(0.0);
    }
    let all: f64 = squares.iter().map(|(square, w)| square * w).sum();
    Spread {
        median: quantile(0.5),
        ninetieth: quantile(0.9),
        stops: mean(&stops),
        top_hundredth: if all > 0.0 { top / all } else { 0.0 },
    }
}
