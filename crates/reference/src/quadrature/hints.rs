//! Subdivision of rectangles that is needed whatever their samples say: near the lobes that a reflectance
//! declares.

use super::geometry::{Chart, Patch};
use glam::DVec3;
use steradian_brdf::Lobe;

/// Largest size of a rectangle, radians: samples are then less than 3° apart.
const LARGEST: f64 = 0.2;

/// Largest size at tolerances of [`ROUGH`] and more, for pictures: samples are then less than 11° apart.
const LARGEST_ROUGH: f64 = 0.8;

/// A tolerance at which eight-bit pictures do not show the error.
pub(super) const ROUGH: f64 = 1e-2;

/// Largest size relative to the distance from a lobe's ridge, or the ridge's width.
const FACTOR: f64 = 2.0;

/// The same at tolerances of [`ROUGH`] and more: of GGX floors (α .25 to .05) and spheres under a low sun,
/// 3000 to 4500 evaluations a point at a tolerance of .03 in place of 3700 to 5300, and errors of .001 to
/// .004 at most in place of .001.
const FACTOR_ROUGH: f64 = 4.0;

/// Hints subdivide down to this size, radians, at most.
const FINEST: f64 = 1e-5;

/// A ridge: directions at `angle` from `axis`; angle 0 is a peak, π/2 an arc.
#[derive(Debug, Clone, Copy)]
struct Ridge {
    axis: DVec3,
    angle: f64,
    /// Cosine of `angle`.
    cosine: f64,
    width: f64,
}

/// All ridges of f_cos(·, wo), and how thick the layer at the horizon is where it rises.
#[derive(Debug, Clone)]
pub(super) struct Hints {
    ridges: Vec<Ridge>,
    layer: f64,
    largest: f64,
    factor: f64,
}

impl Hints {
    /// Hints from a reflectance's lobes; those that are not finite are dropped.
    ///
    /// A ridge of half vectors narrows along its cone towards grazing angles, where n·h is small, in
    /// proportion to n·wo (`cosine`). Its single width cannot express that, and is therefore multiplied by
    /// this cosine.
    pub fn new(lobes: &[Lobe], cosine: f64, tolerance: f64) -> Self {
        let narrowing = cosine.clamp(0.02, 1.0);
        let ridge = |lobe: &Lobe| {
            let (axis, cosine, width) = match *lobe {
                Lobe::Axis { axis, width } => (axis, 1.0, width),
                Lobe::Cone { axis, cosine, width } => (axis, cosine.clamp(-1.0, 1.0), width * narrowing),
                Lobe::Arc { normal, width } => (normal, 0.0, width),
            };
            Ridge { axis, angle: cosine.acos(), cosine, width }
        };
        let sound = |r: &Ridge| {
            r.axis.is_finite() && r.axis != DVec3::ZERO && r.angle.is_finite() && r.width.is_finite()
        };
        let made = lobes.iter().map(ridge).filter(sound);
        let ridges =
            made.map(|r| Ridge { axis: r.axis.normalize(), width: r.width.max(FINEST), ..r }).collect();
        let (largest, factor) =
            if tolerance < ROUGH { (LARGEST, FACTOR) } else { (LARGEST_ROUGH, FACTOR_ROUGH) };
        Self { ridges, layer: cosine.max(0.02), largest, factor }
    }

    /// Is this rectangle too large to be sampled?
    pub fn must_cut(&self, chart: &Chart, patch: &Patch) -> bool {
        let [a, b] = patch.angular;
        let size = a.max(b);
        if size > self.largest || (patch.rect.size()[0] > 0.51 * std::f64::consts::PI && a > 1e-9) {
            return true;
        }
        if size <= self.factor * FINEST || self.ridges.is_empty() {
            return false;
        }
        let centre = chart.at(patch.centre);
        self.ridges.iter().any(|r| {
            let too_large = |distance: f64| size > self.factor * distance;
            // A lower bound of the angle to the ridge that needs no arc tangent: a chord, or the difference
            // of cosines.
            let short =
                if r.angle == 0.0 { centre.distance(r.axis) } else { (centre.dot(r.axis) - r.cosine).abs() };
            too_large(r.width)
                && too_large(short - patch.reach)
                && too_large((angle_between(centre, r.axis) - r.angle).abs() - patch.reach)
        })
    }

    /// Is this rectangle, which the horizon crosses, too large to be sampled? Shadowing by V-cavities creases
    /// where n·wi = n·wo, and so does much else at grazing views.
    pub fn must_cut_at_horizon(&self, patch: &Patch) -> bool {
        let [a, b] = patch.angular;
        a.max(b) > self.factor * self.layer
    }
}

/// The angle between unit vectors, accurate at both ends.
fn angle_between(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}
