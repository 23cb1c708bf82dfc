//! Errors per elevation, where a certificate states them.

use steradian_base::Certificate;

/// Relative RMS errors by the angle between view and normal, radians, from the normal to the horizon.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Elevations(pub Vec<(f64, f64)>);

/// The centre of an expansion about the tangent, as certificates number it.
const TANGENT: f64 = 3.0;

impl Elevations {
    /// The details of a certificate that are called an error at so many degrees; none where these are not measured from
    /// the normal, as for fibres.
    pub fn of(c: &Certificate) -> Self {
        if c.details.iter().any(|(name, centre)| name.starts_with("centre") && *centre == TANGENT) {
            return Self::default();
        }
        let mut all: Vec<(f64, f64)> =
            c.details.iter().filter_map(|(name, e)| Some((degrees(name)?.to_radians(), *e))).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self(all)
    }

    /// The error at an angle, linear between those that are stated.
    pub fn at(&self, theta: f64) -> Option<f64> {
        let (first, last) = (self.0.first()?, self.0.last()?);
        let k = self.0.partition_point(|e| e.0 <= theta);
        Some(match (k.checked_sub(1).and_then(|i| self.0.get(i)), self.0.get(k)) {
            (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (theta - a.0) / (b.0 - a.0),
            (None, _) => first.1,
            (_, None) => last.1,
        })
    }
}

/// The number of a detail such as `error at 60 degrees`, or of the belt `error at 45 degrees (30 to 60)`.
fn degrees(name: &str) -> Option<f64> {
    let digits = name.strip_prefix("error at ")?.split_whitespace().next()?;
    digits.parse().ok().filter(|d: &f64| (0.0..=180.0).contains(d))
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_base::Known;

    #[test]
    fn errors_between_elevations_are_linear() {
        let c = Certificate::new(0.1, Known::Measured)
            .detail("order", 12.0)
            .detail("error at 90 degrees", 0.5)
            .detail("error at 0 degrees (0 to 1)", 0.1);
        let e = Elevations::of(&c);
        assert_eq!(e.0.len(), 2);
        for (angle, want) in [(0.0, 0.1), (45f64, 0.3), (90.0, 0.5), (100.0, 0.5)] {
            assert!((e.at(angle.to_radians()).unwrap() - want).abs() < 1e-12);
        }
        assert_eq!(Elevations::default().at(0.3), None);
        assert_eq!(Elevations::of(&c.detail("centre (3 tangent)", TANGENT)), Elevations::default());
    }
}
