//! Outputs that an accuracy was asked of.

/// A missed tolerance.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("tolerance {asked} missed: the error reached is {reached:.3e}")]
pub struct Missed {
    /// What was asked for.
    pub asked: f64,
    /// What was reached.
    pub reached: f64,
}

/// An output, and whether it is as accurate as was asked for. The output is had by saying what a miss means:
/// [`Outcome::met`] makes it an error, [`Outcome::even_if_missed`] takes it all the same.
#[derive(Debug, Clone)]
#[must_use = "the tolerance may have been missed: call met() or even_if_missed()"]
pub struct Outcome<T> {
    output: T,
    missed: Option<Missed>,
}

impl<T> Outcome<T> {
    /// An output of error `reached`, of which `asked` was asked; nothing was where it is `None`.
    pub fn new(output: T, asked: Option<f64>, reached: f64) -> Self {
        let missed =
            asked.filter(|a| reached.is_nan() || reached > *a).map(|asked| Missed { asked, reached });
        Self { output, missed }
    }

    /// The output where the tolerance was met, or where there was none.
    pub fn met(self) -> Result<T, Missed> {
        match self.missed {
            None => Ok(self.output),
            Some(missed) => Err(missed),
        }
    }

    /// The output, and the miss where there is one.
    pub fn even_if_missed(self) -> (T, Option<Missed>) {
        (self.output, self.missed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_miss_is_an_error_unless_it_is_accepted() {
        let of = |asked, reached| Outcome::new('x', asked, reached);
        assert_eq!(of(Some(0.01), 0.01).met(), Ok('x'));
        assert_eq!(of(None, 0.6).met(), Ok('x'));
        let missed = Missed { asked: 0.01, reached: 0.61 };
        assert_eq!(of(Some(0.01), 0.61).met(), Err(missed));
        assert_eq!(of(Some(0.01), 0.61).even_if_missed(), ('x', Some(missed)));
        assert!(of(Some(0.01), f64::NAN).met().is_err());
        assert_eq!(missed.to_string(), "tolerance 0.01 missed: the error reached is 6.100e-1");
    }
}
