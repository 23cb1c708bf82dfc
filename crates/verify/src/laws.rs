//! Which kernel a profile expects of each level, and which law the levels of a file follow.

use crate::kernel::{Family, Kernel};
use steradian_engines::{Curve, ENGINES, Engine};
use steradian_light::load::{PROFILES, Profile};

/// What a consumer expects of a file.
#[derive(Debug, Clone, Copy)]
pub struct Consumer {
    /// The name that commands take.
    pub name: &'static str,
    /// How its files lie.
    pub profile: &'static Profile,
    /// What their levels hold.
    pub law: Law,
}

/// From levels to kernels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// GGX with alpha = r².
    Roughness(Curve),
    /// cmft's Phong: exponent 2^(10 g + 1) + 1, g = 1 − m/L (its --glossScale 10 --glossBias 1, phongbrdf); level 0 may
    /// be the light as it is (--excludeBase).
    Gloss,
}

impl Consumer {
    /// A profile that writes engines' files, or another tool's convention.
    pub fn find(name: &str) -> Option<Self> {
        if let Some(e) = Engine::find(name) {
            let profile = Profile::find(e.recorded())?;
            return Some(Self { name: e.name, profile, law: Law::Roughness(e.curve) });
        }
        let profile = Profile::find(name)?;
        let law = match profile.name {
            "cmft" => Law::Gloss,
            "cmgen" => Law::Roughness(Curve::Sqrt),
            _ => Law::Roughness(Curve::Linear),
        };
        Some(Self { name: profile.name, profile, law })
    }

    /// Every name.
    pub fn names() -> Vec<&'static str> {
        ENGINES.iter().map(|e| e.name).chain(PROFILES.iter().map(|p| p.name)).collect()
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

/// Curves that files are compared with: name, and perceptual roughness of level m of 0 … last.
pub type Named = (&'static str, fn(usize, usize) -> f64);

/// Every curve.
pub const LAWS: [Named; 8] = [
    ("linear (r = m/L: Bevy, glTF, Khronos)", |m, l| Curve::Linear.roughness(m, l)),
    ("sqrt (r = 1 - sqrt(1 - m/L): Filament, three.js)", |m, l| Curve::Sqrt.roughness(m, l)),
    ("alpha = m/L: the perceptual roughness of linear taken for alpha", |m, l| {
        Curve::Linear.roughness(m, l).sqrt()
    }),
    ("alpha = 1 - sqrt(1 - m/L): the perceptual roughness of sqrt taken for alpha", |m, l| {
        Curve::Sqrt.roughness(m, l).sqrt()
    }),
    ("r = (m/L)^2: alpha of linear taken for the perceptual roughness", |m, l| {
        Curve::Linear.roughness(m, l).powi(2)
    }),
    ("r = (1 - sqrt(1 - m/L))^2: alpha of sqrt taken for the perceptual roughness", |m, l| {
        Curve::Sqrt.roughness(m, l).powi(2)
    }),
    ("log2 (Unreal)", |m, l| Curve::Log2.roughness(m, l)),
    ("unity (m = L r (1.7 - 0.7 r))", |m, l| Curve::Unity.roughness(m, l)),
];

/// A wrong list: its name, and the roughness of level m of 0 … last by a curve.
pub type Slip = (&'static str, fn(Shape, usize, usize) -> f64);

/// Lists that come of counting levels wrongly, of a curve r(m, L).
pub const SLIPS: [Slip; 6] = [
    ("the list of one more level without its last one", |r, m, l| r(m, l + 1)),
    ("the list of one more level without its first one", |r, m, l| r(m + 1, l + 1)),
    ("the list of two more levels without the last two", |r, m, l| r(m, l + 2)),
    ("each level holds what the next one should (off by one)", |r, m, l| r((m + 1).min(l), l)),
    ("each level holds what the one before should (off by one)", |r, m, l| r(m.saturating_sub(1), l)),
    ("the list of two more levels without first and last", |r, m, l| r(m + 1, l + 2)),
];

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
