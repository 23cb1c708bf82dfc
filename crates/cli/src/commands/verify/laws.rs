//! Which kernel a profile expects of each level, and which law the levels of a file follow.

use super::fit::{Family, Kernel};
use crate::commands::prefilter::engines::{Curve, ENGINES, Engine};
use steradian_light::load::{PROFILES, Profile};
use steradian_render::scenefile::unknown;

/// What a consumer expects of a file.
#[derive(Debug, Clone, Copy)]
pub struct Consumer {
    pub name: &'static str,
    pub profile: &'static Profile,
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
    pub fn parse(text: &str) -> Result<Self, String> {
        if let Ok(e) = Engine::parse(text) {
            let profile = Profile::find(e.recorded()).ok_or_else(|| format!("'{text}' cannot be read"))?;
            return Ok(Self { name: e.name, profile, law: Law::Roughness(e.curve) });
        }
        let names: Vec<&str> =
            ENGINES.iter().map(|e| e.name).chain(PROFILES.iter().map(|p| p.name)).collect();
        let profile = Profile::find(text).ok_or_else(|| unknown("profile", text, &names))?;
        let law = match profile.name {
            "cmft" => Law::Gloss,
            "cmgen" => Law::Roughness(Curve::Sqrt),
            _ => Law::Roughness(Curve::Linear),
        };
        Ok(Self { name: profile.name, profile, law })
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

/// The laws that files are compared with: name, and perceptual roughness of level m of 0 … last.
type Named = (&'static str, fn(usize, usize) -> f64);

const LAWS: [Named; 7] = [
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
    ("log2 (Unreal)", |m, l| Curve::Log2.roughness(m, l)),
    ("unity (m = L r (1.7 - 0.7 r))", |m, l| Curve::Unity.roughness(m, l)),
];

/// The law that fitted roughnesses (level, r) follow best, and the RMS distance.
pub fn closest(fitted: &[(usize, f64)], last: usize) -> Option<(&'static str, f64)> {
    let distance = |law: fn(usize, usize) -> f64| {
        let sum: f64 = fitted.iter().map(|(m, r)| (law(*m, last) - r).powi(2)).sum();
        (sum / fitted.len() as f64).sqrt()
    };
    let all = LAWS.iter().map(|(name, law)| (*name, distance(*law)));
    if fitted.is_empty() { None } else { all.min_by(|a, b| a.1.total_cmp(&b.1)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_are_recognised() {
        for (name, law) in LAWS {
            let fitted: Vec<(usize, f64)> = (1..5).map(|m| (m, law(m, 5) + 0.004)).collect();
            assert_eq!(closest(&fitted, 5).unwrap().0, name);
        }
        assert!(closest(&[], 5).is_none());
    }

    #[test]
    fn cmft_s_exponents_are_the_published_ones() {
        let cmft = Consumer::parse("cmft").unwrap();
        for (m, n) in [(1, 862.0), (2, 363.0), (3, 153.0), (4, 65.0), (5, 28.0), (6, 12.3), (7, 5.8)] {
            let k = cmft.kernel(m, 8);
            assert!((k.width / n - 1.0).abs() < 0.02, "{m}: {k:?}");
        }
        assert!(Consumer::parse("bevi").unwrap_err().contains("bevy"));
    }
}
