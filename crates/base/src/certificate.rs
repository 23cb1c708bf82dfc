//! What is known of an output's error.

/// How an error is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evidence {
    /// A bound that holds for every input.
    Proved,
    /// A model or extrapolation.
    Estimated,
    /// A comparison with the reference at sample points.
    Measured,
}

impl Evidence {
    /// The word that reports use.
    pub fn word(self) -> &'static str {
        match self {
            Self::Proved => "proved",
            Self::Estimated => "estimated",
            Self::Measured => "measured",
        }
    }
}

/// How an error is spread over the points at which it was measured. A relative RMS error is ruled by the few
/// points that see a sun; this says what the others see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Half of all points err by less than this part of their own radiance.
    pub median: f64,
    /// Nine tenths of all points err by less than this part of their own radiance.
    pub ninetieth: f64,
    /// Mean |log2(luminance / exact luminance)| over all points: photographic stops.
    pub stops: f64,
    /// The part of the whole squared error that the worst hundredth of all points holds.
    pub top_hundredth: f64,
}

impl std::fmt::Display for Spread {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [top, median, ninetieth] =
            [self.top_hundredth, self.median, self.ninetieth].map(|x| Percent(100.0 * x));
        write!(
            f,
            "{top} of its square in 1 % of all points; single points: median {median}, one in ten above {ninetieth}, \
             {:.2} stops in the mean",
            self.stops
        )
    }
}

/// Two digits, or whole per cents.
struct Percent(f64);

impl std::fmt::Display for Percent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = usize::from(self.0 < 10.0) + usize::from(self.0 < 1.0);
        write!(f, "{:.digits$} %", self.0)
    }
}

/// The error towards views at one angle from the normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elevation {
    /// Angle between view and normal, radians.
    pub theta_o: f64,
    /// The angles that it stands for, radians; both `theta_o` where it was computed for that angle alone.
    pub range: [f64; 2],
    /// Relative RMS error of radiance towards these views.
    pub error: f64,
    /// The same relative to the radiance of the light without the suns that are shaded apart from the rest,
    /// where some are: what pictures show of the rest.
    pub beside_suns: Option<f64>,
    /// How both are known.
    pub known: Evidence,
}

impl Elevation {
    /// A computed error at one angle.
    pub fn computed(theta_o: f64, error: f64) -> Self {
        Self { theta_o, range: [theta_o; 2], error, beside_suns: None, known: Evidence::Estimated }
    }

    /// A measured error of views `from` … `to`.
    pub fn measured([from, to]: [f64; 2], error: f64) -> Self {
        Self {
            theta_o: 0.5 * (from + to),
            range: [from, to],
            error,
            beside_suns: None,
            known: Evidence::Measured,
        }
    }
}

/// The error that an output reached, and how that is known.
///
/// `error` is the relative RMS error of outgoing radiance over normals and views unless `metric` says
/// otherwise. It is squared in the energy measure of Ramamoorthi & Hanrahan (2002), eqs 5.16–5.18.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// The error reached.
    pub error: f64,
    /// How it is known.
    pub known: Evidence,
    /// What `error` measures, in words.
    pub metric: String,
    /// The tolerance that was asked for, where one was: a bound on `error`.
    pub tolerance: Option<f64>,
    /// The error by angle of view, ascending; empty where it is not known by that.
    pub elevations: Vec<Elevation>,
    /// The part of ∫f² that the output holds nothing of (1 − the share of Ramamoorthi & Hanrahan's eq. 5.18),
    /// where orders were chosen by it.
    pub missing_energy: Option<f64>,
    /// Further figures by name: orders used, sample counts, energies lost.
    pub details: Vec<(String, f64)>,
    /// What single points err by, where that was measured.
    pub spread: Option<Spread>,
}

impl Certificate {
    /// A certificate of relative RMS radiance error.
    pub fn new(error: f64, known: Evidence) -> Self {
        let metric = "relative RMS error of outgoing radiance".into();
        Self {
            error,
            known,
            metric,
            tolerance: None,
            elevations: Vec::new(),
            missing_energy: None,
            details: Vec::new(),
            spread: None,
        }
    }

    /// An output that equals what it stands for, up to rounding.
    pub fn exact() -> Self {
        Self::new(0.0, Evidence::Proved)
    }

    /// The same certificate saying what its error measures.
    pub fn metric(mut self, metric: impl Into<String>) -> Self {
        self.metric = metric.into();
        self
    }

    /// The same certificate with one more figure.
    pub fn detail(mut self, name: impl Into<String>, value: f64) -> Self {
        self.details.push((name.into(), value));
        self
    }

    /// The same certificate with what single points err by.
    pub fn spread(mut self, spread: Spread) -> Self {
        self.spread = Some(spread);
        self
    }

    /// The same certificate where other lights are shaded exactly beside the output: it covers the rest.
    pub fn beside_exact_lights(mut self) -> Self {
        self.metric += ", without the lights that are shaded exactly beside it";
        self
    }

    /// Was `tolerance` met? An explicit tolerance that is missed makes the command exit 4.
    pub fn meets(&self, tolerance: f64) -> bool {
        self.error <= tolerance
    }

    /// Was a tolerance asked for and not met? An error that is no number meets none.
    pub fn missed(&self) -> bool {
        self.tolerance.is_some_and(|t| !self.meets(t))
    }

    /// The error towards views at `theta_o` radians from the normal, linear between the angles that are
    /// stated; `None` where none is.
    pub fn at(&self, theta_o: f64) -> Option<f64> {
        let all = &self.elevations;
        let (first, last) = (all.first()?, all.last()?);
        let k = all.partition_point(|e| e.theta_o <= theta_o);
        Some(match (k.checked_sub(1).and_then(|i| all.get(i)), all.get(k)) {
            (Some(a), Some(b)) => {
                a.error + (b.error - a.error) * (theta_o - a.theta_o) / (b.theta_o - a.theta_o)
            }
            (None, _) => first.error,
            (_, None) => last.error,
        })
    }

    /// The further figure `name`.
    pub fn figure(&self, name: &str) -> Option<f64> {
        self.details.iter().find(|d| d.0 == name).map(|d| d.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_between_elevations_are_linear() {
        let mut c = Certificate::new(0.1, Evidence::Measured);
        assert_eq!(c.at(0.3), None);
        let [end, half] = [90f64.to_radians(), 45f64.to_radians()];
        c.elevations = vec![Elevation::computed(0.0, 0.1), Elevation::computed(end, 0.5)];
        for (angle, want) in [(0.0, 0.1), (half, 0.3), (end, 0.5), (1.1 * end, 0.5)] {
            assert!((c.at(angle).unwrap() - want).abs() < 1e-12);
        }
    }

    #[test]
    fn a_missed_tolerance_shows() {
        let asked =
            |error, tolerance| Certificate { tolerance, ..Certificate::new(error, Evidence::Measured) };
        assert!(!asked(0.1, None).missed() && !asked(0.1, Some(0.1)).missed());
        assert!(asked(0.11, Some(0.1)).missed() && asked(f64::NAN, Some(0.1)).missed());
    }

    #[test]
    fn a_spread_in_words() {
        let s = Spread { median: 0.031, ninetieth: 0.204, stops: 0.127, top_hundredth: 0.004 };
        let words = "0.40 % of its square in 1 % of all points; single points: median 3.1 %, one in ten above 20 %, \
                     0.13 stops in the mean";
        assert_eq!(s.to_string(), words);
        assert_eq!(Certificate::exact().spread(s).spread, Some(s));
    }
}
