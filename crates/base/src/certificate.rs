//! What is known of an output's error.

/// How an error is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Known {
    /// A bound that holds for every input.
    Proved,
    /// A model or extrapolation.
    Estimated,
    /// A comparison with the reference at sample points.
    Measured,
}

impl Known {
    /// The word that reports use.
    pub fn word(self) -> &'static str {
        match self {
            Self::Proved => "proved",
            Self::Estimated => "estimated",
            Self::Measured => "measured",
        }
    }
}

/// How an error is spread over the points at which it was measured. A relative RMS error is ruled by the few points that see
/// a sun; this says what the others see.
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

/// The error that an output reached, and how that is known.
///
/// `error` is the relative RMS error of outgoing radiance over normals and views unless `metric` says
/// otherwise. It is squared in the energy measure of Ramamoorthi & Hanrahan (2002), eqs 5.16–5.18.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// The error reached.
    pub error: f64,
    /// How it is known.
    pub known: Known,
    /// What `error` measures, in words.
    pub metric: String,
    /// Further figures by name: orders used, sample counts, energies lost.
    pub details: Vec<(String, f64)>,
    /// What single points err by, where that was measured.
    pub spread: Option<Spread>,
}

impl Certificate {
    /// A certificate of relative RMS radiance error.
    pub fn new(error: f64, known: Known) -> Self {
        let metric = "relative RMS error of outgoing radiance".into();
        Self { error, known, metric, details: Vec::new(), spread: None }
    }

    /// An output that equals what it stands for, up to rounding.
    pub fn exact() -> Self {
        Self::new(0.0, Known::Proved)
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_in_words() {
        let s = Spread { median: 0.031, ninetieth: 0.204, stops: 0.127, top_hundredth: 0.004 };
        let words = "0.40 % of its square in 1 % of all points; single points: median 3.1 %, one in ten above 20 %, \
                     0.13 stops in the mean";
        assert_eq!(s.to_string(), words);
        assert_eq!(Certificate::exact().spread(s).spread, Some(s));
    }
}
