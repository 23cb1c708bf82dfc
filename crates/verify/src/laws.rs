//! Kernels that a profile expects of each level, and laws that the levels of a file may follow instead.

use crate::kernel::{Family, Kernel};
use steradian_engines::{CoefficientForm, Curve, ENGINES, Engine};
use steradian_light::load::{PROFILES, Profile};

/// Expectations of a consumer of a file.
#[derive(Debug, Clone, Copy)]
pub struct Consumer {
    /// The name that commands take.
    pub name: &'static str,
    /// Layout of its files.
    pub profile: &'static Profile,
    /// Law of the levels' kernels.
    pub law: Law,
    /// Form of the nine coefficients of diffuse light in its files.
    pub coefficients: CoefficientForm,
}

/// Law that assigns kernels to levels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// GGX with alpha = r².
    Roughness(Curve),
    /// cmft's Phong: exponent 2^(10 g + 1) + 1, g = 1 − m/L (its --glossScale 10 --glossBias 1, phongbrdf);
    /// level 0 may be the unfiltered light (--excludeBase).
    Gloss,
}

impl Consumer {
    /// A profile that writes engines' files, or another tool's convention.
    pub fn find(name: &str) -> Option<Self> {
        if let Some(e) = Engine::find(name) {
            let (profile, law) = (e.profile(), Law::Roughness(e.curve));
            return Some(Self { name: e.name, profile, law, coefficients: e.coefficients });
        }
        let profile = Profile::find(name)?;
        let law = match profile.name {
            "cmft" => Law::Gloss,
            "cmgen" => Law::Roughness(Curve::Sqrt),
            _ => Law::Roughness(Curve::Linear),
        };
        // cmgen's; no other tool among them writes any.
        Some(Self { name: profile.name, profile, law, coefficients: CoefficientForm::Polynomial })
    }

    /// Are these files of this library, whose metadata give the roughness of each level?
    pub fn is_own(&self) -> bool {
        self.profile.name == Profile::own().name
    }

    /// Every name.
    pub fn names() -> Vec<&'static str> {
        let others = PROFILES.iter().map(|p| p.name).filter(|n| Engine::find(n).is_none());
        ENGINES.iter().map(|e| e.name).chain(others).collect()
    }

    /// The kernel of level `m` of levels 0 … `last`.
    pub fn kernel(&self, m: usize, last: usize) -> Kernel {
        match self.law {
            Law::Roughness(curve) => Kernel::at(Family::Ggx, curve.roughness(m, last)),
            Law::Gloss if m == 0 => Kernel::NONE,
            Law::Gloss => {
                let gloss = 1.0 - m as f64 / last.max(1) as f64;
                Kernel { family: Family::Phong, width: (10.0 * gloss + 1.0).exp2() + 1.0 }
            }
        }
    }
}

/// Rules by which files that deviate from their profile assign perceptual roughness to levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// A curve that some consumer has.
    Curve(Curve),
    /// Perceptual roughness of a curve was taken for alpha.
    RoughnessAsAlpha(Curve),
    /// Alpha of a curve was taken for the perceptual roughness.
    AlphaAsRoughness(Curve),
    /// The expected curve, with the levels counted wrongly.
    Counted(Slip),
}

/// Ways to count levels wrongly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slip {
    /// The curve of a chain with one level more, whose last level is missing.
    OneMoreWithoutLast,
    /// The curve of a chain with one level more, whose first level is missing.
    OneMoreWithoutFirst,
    /// The curve of a chain with two levels more, whose last two are missing.
    TwoMoreWithoutLast,
    /// Each level has the kernel of the next one.
    AsNext,
    /// Each level has the kernel of the one before.
    AsBefore,
    /// The curve of a chain with two levels more, whose first and last are missing.
    TwoMoreWithoutEnds,
}

impl Slip {
    /// Every way.
    pub const ALL: [Self; 6] = [
        Self::OneMoreWithoutLast,
        Self::OneMoreWithoutFirst,
        Self::TwoMoreWithoutLast,
        Self::AsNext,
        Self::AsBefore,
        Self::TwoMoreWithoutEnds,
    ];

    /// Perceptual roughness of level m of 0 … last by the curve r.
    fn roughness(self, r: Shape, m: usize, last: usize) -> f64 {
        match self {
            Self::OneMoreWithoutLast => r(m, last + 1),
            Self::OneMoreWithoutFirst => r(m + 1, last + 1),
            Self::TwoMoreWithoutLast => r(m, last + 2),
            Self::AsNext => r((m + 1).min(last), last),
            Self::AsBefore => r(m.saturating_sub(1), last),
            Self::TwoMoreWithoutEnds => r(m + 1, last + 2),
        }
    }
}

impl Rule {
    /// Every rule that files are compared with.
    pub fn all() -> impl Iterator<Item = Self> {
        let curves = [
            Self::Curve(Curve::Linear),
            Self::Curve(Curve::Sqrt),
            Self::RoughnessAsAlpha(Curve::Linear),
            Self::RoughnessAsAlpha(Curve::Sqrt),
            Self::AlphaAsRoughness(Curve::Linear),
            Self::AlphaAsRoughness(Curve::Sqrt),
            Self::Curve(Curve::Log2),
            Self::Curve(Curve::Unity),
            Self::Curve(Curve::Babylon),
        ];
        curves.into_iter().chain(Slip::ALL.map(Self::Counted))
    }

    /// Perceptual roughness of level m of 0 … last; `expected` is the curve that the file should follow.
    pub fn roughness(self, expected: Shape, m: usize, last: usize) -> f64 {
        match self {
            Self::Curve(c) => c.roughness(m, last),
            Self::RoughnessAsAlpha(c) => c.roughness(m, last).sqrt(),
            Self::AlphaAsRoughness(c) => c.roughness(m, last).powi(2),
            Self::Counted(slip) => slip.roughness(expected, m, last),
        }
    }
}

/// Perceptual roughness of level m of 0 … last.
pub type Shape = fn(usize, usize) -> f64;

impl Law {
    /// The curve as a function, where there is one.
    pub fn shape(self) -> Option<Shape> {
        Some(match self {
            Self::Roughness(Curve::Linear) => |m, l| Curve::Linear.roughness(m, l),
            Self::Roughness(Curve::Sqrt) => |m, l| Curve::Sqrt.roughness(m, l),
            Self::Roughness(Curve::Log2) => |m, l| Curve::Log2.roughness(m, l),
            Self::Roughness(Curve::Unity) => |m, l| Curve::Unity.roughness(m, l),
            Self::Roughness(Curve::Babylon) => |m, l| Curve::Babylon.roughness(m, l),
            Self::Gloss => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cmft_s_exponents_are_the_published_ones() {
        let cmft = Consumer::find("cmft").unwrap();
        for (m, n) in [(1, 862.0), (2, 363.0), (3, 153.0), (4, 65.0), (5, 28.0), (6, 12.3), (7, 5.8)] {
            let k = cmft.kernel(m, 8);
            assert!((k.width / n - 1.0).abs() < 0.02, "{m}: {k:?}");
        }
        assert!(Consumer::find("bevi").is_none() && Consumer::names().contains(&"bevy"));
    }
}
