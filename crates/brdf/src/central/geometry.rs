//! Position of a centre, and the part of the sphere about it that is above the horizon.

use super::CentralError;
use crate::Brdf;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_base::{Field, ParamInfo, Value};

/// The central direction C about which f_cos is expanded (Ramamoorthi & Hanrahan 2002, section 5.3.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Centre {
    /// The mirror direction of wo: θ_o is twice the angle between n and wo.
    Reflection,
    /// The normal: θ_o is the angle between n and wo.
    Normal,
    /// The tangent, for reflectance that depends on t·wi and t·wo only: θ_o is the angle between t and wo,
    /// and q = 0.
    Tangent,
}

impl Centre {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Reflection, Self::Normal, Self::Tangent];
    /// Their names as parameters have them, in the same order.
    pub const NAMES: [&'static str; 3] = ["mirror-direction", "normal", "tangent"];

    /// The centre's number in files and on GPUs.
    pub fn number(self) -> f64 {
        match self {
            Self::Reflection => 1.0,
            Self::Normal => 2.0,
            Self::Tangent => 3.0,
        }
    }

    /// The centre of a number in a file.
    pub fn from_number(number: f64) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.number() == number)
    }

    /// The slice about this centre at elevation θ_o, radians.
    pub fn slice(self, theta_o: f64) -> Slice {
        match self {
            Self::Reflection => Slice::reflection(0.5 * theta_o),
            Self::Normal => Slice::normal(theta_o),
            Self::Tangent => Slice::tangent(theta_o),
        }
    }

    /// The largest θ_o at which there is a viewer, radians.
    pub fn reach(self) -> f64 {
        if self == Self::Normal { FRAC_PI_2 } else { PI }
    }
}

/// The direction that the harmonics y_pq of an expansion are functions of, seen about C; its azimuth is φ_o.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Argument {
    /// The view, at θ_o from C, as published (5.10). A view at −C sees surfaces of every normal perpendicular
    /// to it, and there y_pq have one value for all of these, or vanish.
    View,
    /// The normal, at γ from C: about the mirror direction at θ_o/2, half way to the view. Grazing views are
    /// then at the equator about C, where y_pq tell their azimuths apart. About the normal and the tangent γ
    /// is constant, and tells nothing.
    Normal,
}

/// The value of a parameter that is a choice among [`Centre::NAMES`].
impl Field for Centre {
    fn from_value(value: &Value, info: &ParamInfo) -> Option<Self> {
        usize::from_value(value, info).and_then(|k| Self::ALL.get(k).copied())
    }

    fn to_value(&self, info: &ParamInfo) -> Value {
        Self::ALL.iter().position(|c| c == self).unwrap_or_default().to_value(info)
    }
}

impl Argument {
    /// The argument's number in files and on GPUs.
    pub fn number(self) -> f64 {
        match self {
            Self::View => 0.0,
            Self::Normal => 1.0,
        }
    }

    /// The argument of a number in a file.
    pub fn from_number(number: f64) -> Self {
        if number == Self::Normal.number() { Self::Normal } else { Self::View }
    }
}

/// One elevation of the viewer and the centre about which it is seen. C lies in the plane of n and wo, at
/// angle γ from n away from wo; θ_o = θ_v + γ. The azimuth φ = 0 about C is on the side of wo and of n, which
/// stays defined for every viewer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slice {
    /// Angle between n and wo, radians; negative only about the tangent, on the tangent's own side.
    pub theta_v: f64,
    /// Angle between n and C, radians, −π/2 … π/2; negative leans towards the viewer.
    pub gamma: f64,
}

/// Views nearer than this to the horizon (0.06°) are moved up to it, and so are their mirror directions:
/// lobes degenerate at the horizon itself.
const GRAZING: f64 = 1e-3;

impl Slice {
    /// The slice about the mirror direction.
    pub fn reflection(theta_v: f64) -> Self {
        Self { theta_v, gamma: theta_v }
    }

    /// The slice about the normal.
    pub fn normal(theta_v: f64) -> Self {
        Self { theta_v, gamma: 0.0 }
    }

    /// The slice about the tangent, wo at `theta_o` from it, and above the horizon.
    pub fn tangent(theta_o: f64) -> Self {
        let theta_v = (theta_o - FRAC_PI_2).clamp(GRAZING - FRAC_PI_2, FRAC_PI_2 - GRAZING);
        Self { theta_v, gamma: FRAC_PI_2 }
    }

    /// The slice about the middle of the lobe at `theta_v`, the direction of ∫ f_cos² wi dwi: off the mirror
    /// direction at grazing views, where the lobe needs fewer orders in q about it.
    pub fn leaning(brdf: &dyn Brdf, theta_v: f64) -> Result<Self, CentralError> {
        super::choose::leaning(brdf, theta_v)
    }

    /// Angle between C and wo, radians.
    pub fn theta_o(&self) -> f64 {
        self.theta_v + self.gamma
    }

    /// Angle from C of the argument of the harmonics, radians.
    pub fn polar(&self, of: Argument) -> f64 {
        match of {
            Argument::View => self.theta_o(),
            Argument::Normal => self.gamma,
        }
    }

    /// θ_v kept off the horizon.
    fn lifted(&self) -> f64 {
        self.theta_v.clamp(GRAZING - FRAC_PI_2, FRAC_PI_2 - GRAZING)
    }

    /// The angle between n and C that is integrated about: γ, or that of the lifted mirror direction.
    pub(super) fn lean(&self) -> f64 {
        if self.gamma == self.theta_v { self.lifted() } else { self.gamma }
    }

    /// wo in the local frame (t = x, n = z), on the side of −t for positive θ_v.
    pub fn view(&self) -> DVec3 {
        let theta = self.lifted();
        DVec3::new(-theta.sin(), 0.0, theta.cos())
    }

    /// C in the local frame.
    pub fn centre(&self) -> DVec3 {
        let gamma = self.lean();
        DVec3::new(gamma.sin(), 0.0, gamma.cos())
    }

    /// The direction ⊥ C of azimuth φ = 0: towards wo and towards n.
    pub(super) fn zero_azimuth(&self) -> DVec3 {
        let gamma = self.lean();
        DVec3::new(-gamma.cos(), 0.0, gamma.sin())
    }

    /// wi at (θ_i, φ) about C.
    pub fn light(&self, theta_i: f64, phi: f64) -> DVec3 {
        let ((s, c), (sp, cp)) = (theta_i.sin_cos(), phi.sin_cos());
        self.centre() * c + (self.zero_azimuth() * cp + DVec3::Y * sp) * s
    }

    pub(super) fn check(&self, centre: Centre) -> Result<(), CentralError> {
        let fault = |what| Err(CentralError::Slice { theta_v: self.theta_v, gamma: self.gamma, what });
        let in_plane = |x: f64| x.is_finite() && x.abs() <= FRAC_PI_2 + 1e-12;
        if !in_plane(self.theta_v) || !in_plane(self.gamma) {
            return fault("both must lie within 90 degrees");
        }
        if self.theta_o() < -1e-12 {
            return fault("the centre may not lean beyond the viewer");
        }
        if centre == Centre::Tangent && self.gamma != FRAC_PI_2 {
            return fault("about the tangent the centre lies at 90 degrees");
        }
        if centre != Centre::Tangent && self.theta_v < 0.0 {
            return fault("the view angle may not be negative");
        }
        Ok(())
    }
}

/// A stretch of elevations θ_i, with a parameter in which the azimuths that are above the horizon change
/// smoothly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Zone {
    /// θ_i itself; every azimuth.
    Full,
    /// θ_i = π/2 − γ cos s, γ > 0: |φ| < φ_max. n·wi = cos γ cos θ + sin γ sin θ cos φ vanishes at
    /// tan²(φ_max/2) = cos(θ − γ)/−cos(θ + γ) = sin(2γ cos²(s/2))/sin(2γ sin²(s/2)), which is analytic in s
    /// up to both ends, where φ_max as a function of θ has roots.
    Band {
        /// |γ|.
        gamma: f64,
        /// C leans towards the viewer: the azimuths above the horizon lie about π.
        behind: bool,
    },
}

/// An elevation, the azimuths to integrate over (0 … π represents both sides), and dθ/ds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Elevation {
    pub theta: f64,
    pub azimuths: [f64; 2],
    pub slope: f64,
}

impl Zone {
    /// The zones of a slice with the ends of their parameters.
    pub fn of(slice: &Slice, hemisphere: bool) -> Vec<(Self, [f64; 2])> {
        if !hemisphere {
            return vec![(Self::Full, [0.0, PI])];
        }
        let gamma = slice.lean().abs().min(FRAC_PI_2);
        let mut zones = Vec::new();
        if gamma < FRAC_PI_2 {
            zones.push((Self::Full, [0.0, FRAC_PI_2 - gamma]));
        }
        if gamma > 0.0 {
            zones.push((Self::Band { gamma, behind: slice.lean() < 0.0 }, [0.0, PI]));
        }
        zones
    }

    /// The elevation of a parameter.
    pub fn elevation(self, s: f64) -> Elevation {
        match self {
            Self::Full => Elevation { theta: s, azimuths: [0.0, PI], slope: 1.0 },
            Self::Band { gamma, behind } => {
                let (sine, cosine) = s.sin_cos();
                let (sh, ch) = (0.5 * s).sin_cos();
                let above = |x: f64| (2.0 * gamma * x * x).sin().max(0.0).sqrt();
                let end = 2.0 * above(ch).atan2(above(sh));
                let azimuths = if behind { [PI - end, PI] } else { [0.0, end] };
                Elevation { theta: FRAC_PI_2 - gamma * cosine, azimuths, slope: gamma * sine }
            }
        }
    }

    /// The parameter of an elevation, clamped to the zone.
    pub fn parameter(self, theta: f64) -> f64 {
        match self {
            Self::Full => theta,
            Self::Band { gamma, .. } => ((FRAC_PI_2 - theta) / gamma).clamp(-1.0, 1.0).acos(),
        }
    }
}
