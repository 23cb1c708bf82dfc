//! Record of a choice: the techniques that were tried, and the verdict on each.

use std::fmt::{Display, Formatter, Result};

/// Record of a session's choice of a technique.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Processor seconds in total: the sample, all trials, and the certificate of the chosen technique.
    pub seconds: f64,
    /// The techniques that accept the reflectance, in the order in which they were considered.
    pub trials: Vec<Trial>,
}

/// A technique that was considered.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Slug of the technique.
    pub technique: &'static str,
    /// Processor seconds that were spent on it.
    pub seconds: f64,
    /// Error in the picture where that was measured ([`crate::PictureError::apparent`]), else as certified.
    pub error: Option<f64>,
    /// Result of the trial.
    pub verdict: Verdict,
    /// What of the material it leaves out, which no error counts.
    pub left_out: Vec<&'static str>,
}

/// Verdict on a technique that was considered.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// It was chosen.
    Taken,
    /// Another technique has a smaller error, or, where a tolerance is given, smaller data.
    Beaten,
    /// Its error, the value here, is too large.
    Missed(f64),
    /// It refuses the light or the parameters.
    Refused(String),
    /// It was stopped when the time ran out.
    Stopped,
    /// It was not tried: it would take longer than the time that was left.
    TooDear,
    /// It was not tried: an earlier technique has an error too small to be seen, or represents the same by
    /// more numbers.
    Unneeded,
    /// It was not tried: it leaves out what the material gives, and another does not.
    LeavesOut,
}

impl Trial {
    pub(crate) fn new(technique: &'static str) -> Self {
        Self { technique, seconds: 0.0, error: None, verdict: Verdict::Beaten, left_out: Vec::new() }
    }
}

impl Verdict {
    /// One word, for reports.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Taken => "taken",
            Self::Beaten => "beaten",
            Self::Missed(_) => "missed",
            Self::Refused(_) => "refused",
            Self::Stopped => "stopped",
            Self::TooDear => "too-dear",
            Self::Unneeded => "unneeded",
            Self::LeavesOut => "leaves-out",
        }
    }
}

impl Display for Trial {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Self { technique, seconds, error, verdict, left_out } = self;
        write!(f, "{technique} ")?;
        match verdict {
            Verdict::Taken | Verdict::Beaten => write!(f, "{:.2} %", 100.0 * error.unwrap_or(f64::NAN))?,
            Verdict::Missed(e) => write!(f, "{:.2} %, too large", 100.0 * e)?,
            Verdict::Refused(_) => write!(f, "refuses")?,
            Verdict::Stopped => write!(f, "stopped")?,
            Verdict::TooDear | Verdict::Unneeded | Verdict::LeavesOut => return Ok(()),
        }
        if !left_out.is_empty() {
            write!(f, " without {}", left_out.join(" and "))?;
        }
        write!(f, " ({seconds:.1} s)")
    }
}

impl Display for Choice {
    /// One line: the techniques that were tried, and those that were not for lack of time.
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let tried =
            |t: &&Trial| !matches!(t.verdict, Verdict::TooDear | Verdict::Unneeded | Verdict::LeavesOut);
        let list = |l: Vec<String>| l.join(", ");
        write!(f, "chosen in {:.1} processor seconds", self.seconds)?;
        write!(f, " of: {}", list(self.trials.iter().filter(tried).map(Trial::to_string).collect()))?;
        let of = |verdict: Verdict| -> Vec<&Trial> {
            self.trials.iter().filter(|t| t.verdict == verdict).collect()
        };
        let names = |l: &[&Trial]| list(l.iter().map(|t| t.technique.to_string()).collect());
        let dear = of(Verdict::TooDear);
        if !dear.is_empty() {
            write!(f, "; for want of time not of: {}", names(&dear))?;
        }
        let partial = of(Verdict::LeavesOut);
        if !partial.is_empty() {
            write!(f, "; not of those that leave out parts of the material: {}", names(&partial))?;
        }
        Ok(())
    }
}
