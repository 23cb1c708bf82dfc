//! A hypothesis of how the file was made, and the cost of accepting it.

use crate::kernel::Kernel;
use crate::laws::Rule;
use crate::light::Alteration;
use crate::orientation::Orientation;
use crate::report::{Encoding, Fault};
use crate::scale::{Scale, Score};

/// Kernels of the levels.
#[derive(Debug, Clone, PartialEq)]
pub enum List {
    /// The expected ones.
    Expected,
    /// Kernels of another curve.
    Curve(Rule),
    /// Fitted ones: `free` numbers.
    Fitted {
        /// Number of widths that were fitted.
        free: usize,
        /// Another family than expected?
        family: bool,
    },
}

/// A hypothesis with its score.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    pub orientation: Orientation,
    pub channels: [usize; 3],
    pub light: Alteration,
    pub list: List,
    pub kernels: Vec<Kernel>,
    pub scale: Scale,
    pub encoding: Encoding,
    pub score: Score,
    /// Free numbers.
    pub free: usize,
}

/// Cost of one more fault, as ln of the factor, 2, by which it must lower the residual.
const PER_FAULT: f64 = std::f64::consts::LN_2;
/// Cost of each further fitted number.
const PER_NUMBER: f64 = 0.05;

/// Kinds of deviations in a hypothesis: two hypotheses of the same kinds differ in numbers only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kinds {
    turned: bool,
    channels: bool,
    /// 0 as expected, 1 another width, 2 another family.
    kernels: u8,
    /// 0 as it is, 1 reduced, 2 clipped.
    light: u8,
    scaled: bool,
    encoded: bool,
}

impl Kinds {
    /// Is all of `self` in `other` too?
    pub fn within(self, other: Self) -> bool {
        let has = |a: u8, b: u8| a == 0 || a == b;
        (!self.turned || other.turned)
            && (!self.channels || other.channels)
            && has(self.kernels, other.kernels)
            && has(self.light, other.light)
            && (!self.scaled || other.scaled)
            && (!self.encoded || other.encoded)
    }

    fn count(self) -> f64 {
        let flags = [self.turned, self.channels, self.kernels > 0, self.light > 0, self.scaled, self.encoded];
        flags.iter().map(|f| f64::from(u8::from(*f))).sum()
    }
}

impl Hypothesis {
    /// Cost of a hypothesis: its complexity, and the residual that it leaves; residuals below `floor` count
    /// as equal.
    pub fn cost(&self, floor: f64) -> f64 {
        let faces = if matches!(self.orientation, Orientation::Faces(_)) { 1.0 } else { 0.0 };
        self.score.residual.hypot(floor).ln()
            + PER_FAULT * (self.kinds().count() + faces)
            + PER_NUMBER * self.free as f64
    }

    /// Kinds of its deviations.
    pub fn kinds(&self) -> Kinds {
        Kinds {
            turned: !self.orientation.is_identity(),
            channels: self.channels != [0, 1, 2],
            kernels: match self.list {
                List::Expected => 0,
                List::Curve(_) | List::Fitted { family: false, .. } => 1,
                List::Fitted { family: true, .. } => 2,
            },
            light: match self.light {
                Alteration::None => 0,
                Alteration::Reduced { .. } => 1,
                Alteration::Clipped(_) => 2,
            },
            scaled: self.scale != Scale::One,
            encoded: self.encoding != Encoding::Linear,
        }
    }

    /// Its faults, compared with the `expected` kernels.
    pub fn faults(&self, expected: &[Kernel], conventions: Vec<&'static str>) -> Vec<Fault> {
        let mut out = Vec::new();
        if !self.orientation.is_identity() {
            out.push(Fault::Turned(self.orientation.clone(), conventions));
        }
        if self.channels != [0, 1, 2] {
            out.push(Fault::Channels(self.channels));
        }
        match &self.list {
            List::Expected => {}
            List::Curve(rule) => out.push(Fault::Curve(*rule)),
            List::Fitted { .. } => {
                let pairs = self.kernels.iter().zip(expected).enumerate();
                out.push(Fault::Kernels(
                    pairs.filter(|(_, (k, e))| k != e).map(|(m, (k, _))| (m, *k)).collect(),
                ));
            }
        }
        if self.light != Alteration::None {
            out.push(Fault::Light(self.light));
        }
        if self.scale != Scale::One {
            let gains = self.score.factors.iter().map(|f| f.iter().sum::<f64>() / 3.0).collect();
            out.push(Fault::Scale(self.scale, gains));
        }
        if self.encoding != Encoding::Linear {
            out.push(Fault::Encoded(self.encoding));
        }
        out
    }
}
