//! Kernels that a level may hold.

use std::f64::consts::FRAC_PI_2;
use steradian_prefilter::{Lobe, Zonal, quadrature};

/// A family of kernels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Trowbridge–Reitz with n = wo = r and the cosine, as the split sum weighs it.
    Ggx,
    /// The GGX kernel without the cosine of the light's direction.
    GgxPlain,
    /// Beckmann.
    Beckmann,
    /// Charlie sheen.
    Charlie,
    /// Phong about the reflected direction.
    Phong,
    /// A Gaussian of the angle.
    Gaussian,
    /// The cosine: E/π.
    Lambert,
    /// Means over the texels: box mips.
    Box,
    /// The light itself.
    None,
}

impl Family {
    /// Families that filter.
    pub const ALL: [Self; 7] = [
        Self::Ggx,
        Self::GgxPlain,
        Self::Beckmann,
        Self::Charlie,
        Self::Phong,
        Self::Gaussian,
        Self::Lambert,
    ];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ggx => "ggx",
            Self::GgxPlain => "ggx-without-cosine",
            Self::Beckmann => "beckmann",
            Self::Charlie => "charlie",
            Self::Phong => "phong",
            Self::Gaussian => "gaussian",
            Self::Lambert => "lambert",
            Self::Box => "box",
            Self::None => "none",
        }
    }

    /// The family that a kernel's name in files and commands stands for.
    pub fn from_name(name: &str) -> Option<Self> {
        let name = name.trim().to_ascii_lowercase();
        Self::ALL.into_iter().find(|f| f.name() == name)
    }

    /// The range of widths that are tried.
    pub fn range(self) -> Option<(f64, f64)> {
        match self {
            Self::Ggx | Self::GgxPlain | Self::Beckmann => Some((2e-3, 1.0)),
            Self::Charlie => Some((SHEEN, 1.0)),
            Self::Phong => Some((0.7, 2e5)),
            Self::Gaussian => Some((2e-3, 2.0)),
            Self::Lambert | Self::Box | Self::None => None,
        }
    }
}

/// Least alpha of Charlie's lobe; smaller values are clamped to it.
const SHEEN: f64 = 0.02;

/// A kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    /// Its family.
    pub family: Family,
    /// alpha of ggx, beckmann and charlie, exponent of phong, standard deviation of gaussian; 0 where there
    /// is none.
    pub width: f64,
}

impl Kernel {
    /// The mirror.
    pub const NONE: Self = Self { family: Family::None, width: 0.0 };

    /// A kernel of a family at a perceptual roughness; ggx and beckmann at 0 are a mirror.
    pub fn at(family: Family, r: f64) -> Self {
        match family {
            Family::Ggx | Family::GgxPlain | Family::Beckmann if r == 0.0 => Self::NONE,
            Family::Charlie => Self { family, width: (r * r).max(SHEEN) },
            Family::Lambert => Self { family, width: 0.0 },
            _ => Self { family, width: r * r },
        }
    }

    /// The kernel as the filters take it; `None` for the light itself and its means.
    pub fn zonal(self) -> Option<Box<dyn Zonal>> {
        Some(match self.family {
            Family::Ggx => Box::new(Lobe::ggx(self.width)),
            Family::GgxPlain => Box::new(Plain::new(self.width)),
            Family::Beckmann => Box::new(Lobe::beckmann(self.width)),
            Family::Charlie => Box::new(Lobe::charlie(self.width)),
            Family::Phong => Box::new(Lobe::phong(self.width)),
            Family::Gaussian => Box::new(Lobe::gaussian(self.width)),
            Family::Lambert => Box::new(Lobe::lambert()),
            Family::Box | Family::None => return None,
        })
    }

    /// Phong's exponent.
    pub fn exponent(&self) -> Option<f64> {
        (self.family == Family::Phong).then_some(self.width)
    }

    /// Perceptual roughness, where the family has one; 0 for a mirror.
    pub fn roughness(self) -> Option<f64> {
        match self.family {
            Family::Ggx | Family::GgxPlain | Family::Beckmann | Family::Charlie => Some(self.width.sqrt()),
            Family::None => Some(0.0),
            _ => None,
        }
    }

    /// The width in words.
    pub fn describe(self) -> String {
        match self.roughness() {
            Some(r) => format!("r {r:.3}"),
            None if self.family == Family::Gaussian => format!("σ {:.1}°", self.width.to_degrees()),
            None if self.width > 0.0 => format!("n {:.1}", self.width),
            None => self.family.name().into(),
        }
    }
}

/// D(n·h) of Trowbridge–Reitz over the hemisphere of the light, n·h = cos(θ/2), normalised.
struct Plain {
    alpha: f64,
    scale: f64,
}

impl Plain {
    fn new(alpha: f64) -> Self {
        let mut out = Self { alpha, scale: 1.0 };
        out.scale = quadrature(|x| out.value(x), out.width(), FRAC_PI_2, 0)[0].recip();
        out
    }
}

impl Zonal for Plain {
    fn value(&self, x: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        let (a2, s2) = (self.alpha * self.alpha, 0.5 * (1.0 - x));
        // cos² (α² − 1) + 1 = α² + (1 − α²) sin²
        let t = a2 + (1.0 - a2) * s2;
        self.scale * a2 / (t * t)
    }

    fn width(&self) -> f64 {
        self.alpha.min(1.0)
    }

    fn support(&self) -> f64 {
        FRAC_PI_2
    }
}
