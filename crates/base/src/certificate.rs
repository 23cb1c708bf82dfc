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
}

impl Certificate {
    /// A certificate of relative RMS radiance error.
    pub fn new(error: f64, known: Known) -> Self {
        Self { error, known, metric: "relative RMS error of outgoing radiance".into(), details: Vec::new() }
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

    /// Was `tolerance` met? An explicit tolerance that is missed makes the command exit 4.
    pub fn meets(&self, tolerance: f64) -> bool {
        self.error <= tolerance
    }
}
