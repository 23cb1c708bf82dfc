//! Parameters that describe themselves: commands, windows and the book make their controls from this.

use std::collections::BTreeMap;

/// Name, unit, range and default of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParamInfo {
    /// The name that a user writes.
    pub name: &'static str,
    /// Unit, or "" for a pure number.
    pub unit: &'static str,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Value where the user says nothing.
    pub default: f64,
    /// Whole numbers only.
    pub integer: bool,
    /// One line of meaning.
    pub doc: &'static str,
}

impl ParamInfo {
    /// A real number in a range, pure until [`ParamInfo::unit`] says otherwise.
    pub const fn real(name: &'static str, [min, max]: [f64; 2], default: f64, doc: &'static str) -> Self {
        Self { name, unit: "", min, max, default, integer: false, doc }
    }

    /// A whole number in a range.
    pub const fn whole(name: &'static str, range: [f64; 2], default: f64, doc: &'static str) -> Self {
        Self { integer: true, ..Self::real(name, range, default, doc) }
    }

    /// 1 or 0: on or off.
    pub const fn switch(name: &'static str, on: bool, doc: &'static str) -> Self {
        Self::whole(name, [0.0, 1.0], if on { 1.0 } else { 0.0 }, doc)
    }

    /// With a unit.
    #[must_use]
    pub const fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }
}

/// A value that is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParamError {
    /// No such parameter.
    #[error("no parameter '{}'; there {}", crate::brief(.name), known(.available))]
    Unknown {
        /// What the user wrote.
        name: String,
        /// What exists.
        available: Vec<&'static str>,
    },
    /// Outside the range.
    #[error("parameter '{name}' = {value} is outside {min} … {max}")]
    Range {
        /// The parameter.
        name: &'static str,
        /// What the user gave.
        value: f64,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// Not a whole number.
    #[error("parameter '{name}' = {value} must be a whole number")]
    Whole {
        /// The parameter.
        name: &'static str,
        /// What the user gave.
        value: f64,
    },
}

fn known(names: &[&str]) -> String {
    if names.is_empty() { "are none".into() } else { format!("is: {}", names.join(", ")) }
}

/// Values by name as a user gave them; names that are absent take their defaults.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ParamValues(pub BTreeMap<String, f64>);

impl ParamValues {
    /// Checks every given value against `infos`.
    pub fn check(&self, infos: &[ParamInfo]) -> Result<(), ParamError> {
        for (name, &value) in &self.0 {
            let Some(info) = infos.iter().find(|i| i.name == name) else {
                return Err(ParamError::Unknown {
                    name: name.clone(),
                    available: infos.iter().map(|i| i.name).collect(),
                });
            };
            // A NaN lies in no range.
            if !(info.min..=info.max).contains(&value) {
                return Err(ParamError::Range { name: info.name, value, min: info.min, max: info.max });
            }
            if info.integer && value.fract() != 0.0 {
                return Err(ParamError::Whole { name: info.name, value });
            }
        }
        Ok(())
    }

    /// The value of `info`, or its default.
    pub fn get(&self, info: &ParamInfo) -> f64 {
        self.0.get(info.name).copied().unwrap_or(info.default)
    }
}

/// A technique's parameters.
pub trait Params: Sized + Clone + Send + Sync + 'static {
    /// Every parameter.
    const INFO: &'static [ParamInfo];
    /// Made from checked values.
    fn from_values(values: &ParamValues) -> Result<Self, ParamError>;
    /// Back to values, for provenance and for files.
    fn to_values(&self) -> ParamValues;
}

impl Params for () {
    const INFO: &'static [ParamInfo] = &[];

    fn from_values(values: &ParamValues) -> Result<Self, ParamError> {
        values.check(Self::INFO)
    }

    fn to_values(&self) -> ParamValues {
        ParamValues::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BANDS: ParamInfo =
        ParamInfo { name: "bands", unit: "", min: 1.0, max: 16.0, default: 5.0, integer: true, doc: "" };

    fn values(name: &str, v: f64) -> ParamValues {
        ParamValues([(name.to_string(), v)].into())
    }

    #[test]
    fn refuses_unknown_outside_and_fractional() {
        assert!(matches!(values("x", 1.0).check(&[BANDS]), Err(ParamError::Unknown { .. })));
        assert!(matches!(values("bands", 17.0).check(&[BANDS]), Err(ParamError::Range { .. })));
        assert!(matches!(values("bands", f64::NAN).check(&[BANDS]), Err(ParamError::Range { .. })));
        assert!(matches!(values("bands", 2.5).check(&[BANDS]), Err(ParamError::Whole { .. })));
        assert_eq!(values("bands", 3.0).check(&[BANDS]), Ok(()));
        assert_eq!(ParamValues::default().get(&BANDS), 5.0);
    }
}
