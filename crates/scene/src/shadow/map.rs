//! Shadow maps (Williams 1978, *Casting Curved Shadows on Curved Surfaces*).

use super::{Blocker, Flat, LightAt, meant};
use crate::{Bvh, Mesh, Ray};
use glam::{Mat3, Vec2, Vec3};
use steradian_base::{ParamInfo, ParamValues};

/// Size and filter of shadow maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapOptions {
    /// Texels of a side: of a distant light's map, and of each of the six of a near one's cube.
    pub size: usize,
    /// Texels of a side of the square whose comparisons are averaged (Reeves, Salesin & Cook 1987, *Rendering
    /// Antialiased Shadows with Depth Maps*); 1 compares one.
    pub taps: usize,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self::USUAL
    }
}

impl MapOptions {
    const USUAL: Self = Self { size: 1024, taps: 3 };
    const SIZE: ParamInfo =
        ParamInfo::whole("size", [16.0, 16384.0], Self::USUAL.size as f64, "texels of a side of a map");
    const TAPS: ParamInfo =
        ParamInfo::whole("taps", [1.0, 15.0], Self::USUAL.taps as f64, "texels of a side of the filter, odd");

    /// Reads `size=N,taps=N`; either may be left out.
    pub fn parse(text: &str) -> Result<Self, String> {
        let values = ParamValues::parse(text, &[Self::SIZE, Self::TAPS]).map_err(|e| e.to_string())?;
        let [size, taps] = [Self::SIZE, Self::TAPS].map(|info| values.number(&info).map(|n| n as usize));
        let found = Self { size: size.map_err(|e| e.to_string())?, taps: taps.map_err(|e| e.to_string())? };
        if found.taps.is_multiple_of(2) {
            return Err(format!(
                "taps = {} is even: a square about a texel has 1, 3, 5 … a side",
                found.taps
            ));
        }
        Ok(found)
    }
}

/// Largest slope of a receiver, as a tangent: 84°; steeper ones are treated as this steep.
const STEEPEST: f32 = 10.0;
/// Bias towards the light in texels, for a receiver that faces it and for each unit of its slope's tangent.
/// Texels compare with the receiver's plane (Isidoro 2006, *Shadow Mapping: GPU-based Tips and Techniques*),
/// so that this has to cover curvature and the angle between shading normals and facets alone.
const BIAS: [f32; 2] = [0.5, 0.5];

/// Depth maps of some lights; a texel holds the nearest surface along its centre's ray. Both sides of a
/// triangle block.
///
/// A point is blocked where its depth exceeds a texel's by more than a bias of half a texel or more, which
/// lets light leak that far under objects that touch a surface.
#[derive(Debug, Clone)]
pub struct ShadowMaps {
    maps: Vec<(LightAt, Map)>,
    taps: isize,
}

#[derive(Debug, Clone)]
enum Map {
    /// Orthographic: the axes x, y and to the light, the middle, half a side in metres, and depths: metres
    /// towards the light. Points whose texels are not all within it are looked up in the wider map.
    Plane { axes: Mat3, middle: Vec2, half: f32, size: usize, depth: Vec<f32>, wider: Option<Box<Map>> },
    /// Six faces about a point: depths along the face's axis, metres.
    Cube { size: usize, depth: Vec<f32> },
}

impl ShadowMaps {
    /// Bytes of the maps of so many distant and near lights at most.
    pub fn bytes(distant: usize, near: usize, options: MapOptions) -> u64 {
        (2 * distant as u64 + 6 * near as u64) * (options.size as u64).pow(2) * 4
    }

    /// The maps of `lights` over `mesh`, whose hierarchy is `bvh`.
    pub fn new(mesh: &Mesh, bvh: &Bvh, lights: &[LightAt], options: MapOptions) -> Self {
        let size = options.size.max(1);
        let map = |light: &LightAt| match *light {
            LightAt::Far(d) => plane(mesh, bvh, d.normalize_or(Vec3::Y), size),
            LightAt::Near(p) => cube(bvh, p, size),
        };
        let taps = options.taps.max(1) as isize;
        Self { maps: lights.iter().map(|l| (*l, map(l))).collect(), taps }
    }
}

fn plane(mesh: &Mesh, bvh: &Bvh, d: Vec3, size: usize) -> Map {
    let (x, y) = d.any_orthonormal_pair();
    let axes = Mat3::from_cols(x, y, d);
    let used = || mesh.triangles.iter().flatten().map(|i| axes.transpose() * mesh.positions[*i as usize]);
    let (lo, hi) = used()
        .filter(|p| p.is_finite())
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    if lo.x > hi.x {
        let depth = vec![f32::NEG_INFINITY];
        return Map::Plane { axes, middle: Vec2::ZERO, half: 1.0, size: 1, depth, wider: None };
    }
    let from_light = |(middle, half): (Vec2, f32), size: usize, start: f32| -> Vec<Ray> {
        let origin = |k| axes * (middle + half * centre(k, size)).extend(start);
        (0..size * size).map(|k| Ray { origin: origin(k), direction: -d }).collect()
    };
    let map = |square: (Vec2, f32), start: f32, wider: Option<Box<Map>>| {
        let hits = bvh.closest_many(&from_light(square, size, start), f32::INFINITY);
        let depth = hits.into_iter().map(|hit| hit.map_or(f32::NEG_INFINITY, |h| start - h.t)).collect();
        Map::Plane { axes, middle: square.0, half: square.1, size, depth, wider }
    };
    let start = hi.z + 0.01 * (hi.z - lo.z) + 1e-3 * (hi - lo).truncate().max_element().max(1e-6);
    let whole = square(lo.truncate(), hi.truncate(), size);
    let touching = OFF * (hi - lo).max_element();
    let first = from_light(whole, COARSE, start);
    let (lo, hi) = layered(mesh, bvh, &first, d, touching)
        .into_iter()
        .map(|p| axes.transpose() * p)
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    // Each sampled point represents its surroundings, so the square is enlarged.
    let around = (2.0 * whole.1 / COARSE as f32).min(0.05 * (hi - lo).truncate().max_element());
    let near = square(lo.truncate() - around, hi.truncate() + around, size);
    // Rays from close by, since those from above a ground of kilometres arrive with an error of millimetres.
    let above = (hi.z + around + 0.05 * (hi.z - lo.z)).min(start);
    match lo.x <= hi.x && near.1 < WORTH * whole.1 {
        true => map(near, above, Some(Box::new(map(whole, start, None)))),
        false => map(whole, start, None),
    }
}

/// Rays a side by which a distant light's map finds surfaces behind surfaces.
const COARSE: usize = 128;
/// Surfaces closer than this, in diameters of the mesh, count as one: just above the rounding of single
/// precision, since a ground that reaches the horizon has a diameter of 20 000 times the object's.
const OFF: f32 = 2e-6;
/// A separate map of a part of the mesh is made where the part is smaller than this share of the whole.
const WORTH: f32 = 0.7;
/// Up to this number of triangles their corners are sampled too; for more their centres are close enough.
const FEW: usize = 1 << 18;

/// Centre and half the side of the square around a rectangle, with a margin of a texel on each side, so that
/// points at the border have texels to compare with.
fn square(lo: Vec2, hi: Vec2, size: usize) -> (Vec2, f32) {
    (0.5 * (lo + hi), (0.5 * (hi - lo).max_element()).max(1e-6) * (1.0 + 2.0 / size as f32))
}

/// Points that shadow something, or are shadowed, in a distant light from `d`: of triangles, and of where
/// `first`, rays from the light, arrive. A map that covers them leaves out a ground's far parts, which
/// nothing shadows.
fn layered(mesh: &Mesh, bvh: &Bvh, first: &[Ray], d: Vec3, touching: f32) -> Vec<Vec3> {
    let corners = mesh.triangles.len() <= FEW;
    let mut points: Vec<Vec3> = (0..mesh.triangles.len())
        .flat_map(|i| {
            let c = mesh.corners(i);
            let middle = (c[0] + c[1] + c[2]) / 3.0;
            let inwards = move |p: Vec3| p.lerp(middle, 0.01);
            std::iter::once(middle).chain(c.into_iter().take(if corners { 3 } else { 0 }).map(inwards))
        })
        .filter(|p| p.is_finite())
        .collect();
    let hits = bvh.closest_many(first, f32::INFINITY);
    points.extend(
        first.iter().zip(&hits).filter_map(|(ray, hit)| Some(ray.origin + hit.as_ref()?.t * ray.direction)),
    );
    let towards = |d: Vec3| {
        let ray = |p: &Vec3| Ray { origin: *p + touching * d, direction: d };
        bvh.occluded_many(&points.iter().map(ray).collect::<Vec<_>>(), f32::INFINITY)
    };
    let (shadowed, shadows) = (towards(d), towards(-d));
    let layered = shadowed.into_iter().zip(shadows).map(|(a, b)| a || b);
    points.iter().zip(layered).filter(|p| p.1).map(|p| *p.0).collect()
}

fn cube(bvh: &Bvh, origin: Vec3, size: usize) -> Map {
    let rays: Vec<Ray> = (0..6 * size * size)
        .map(|k| {
            let e = face_direction(k / (size * size), centre(k % (size * size), size));
            Ray { origin, direction: e.normalize() }
        })
        .collect();
    // Distance to depth along the axis: the direction's largest component is 1 before it is normalised.
    let along = |ray: &Ray, t: f32| t * ray.direction.abs().max_element();
    let hits = bvh.closest_many(&rays, f32::INFINITY);
    let depth = hits.iter().zip(&rays).map(|(hit, ray)| hit.map_or(f32::INFINITY, |h| along(ray, h.t)));
    Map::Cube { size, depth: depth.collect() }
}

/// The centre of texel `k` on the square [−1, 1]².
fn centre(k: usize, size: usize) -> Vec2 {
    let at = |i: usize| (2 * i + 1) as f32 / size as f32 - 1.0;
    Vec2::new(at(k % size), at(k / size))
}

/// The direction at (u, v) of a face: axis face / 2, positive for even ones, with the component 1 along it.
fn face_direction(face: usize, at: Vec2) -> Vec3 {
    let mut e = [0.0; 3];
    let axis = face / 2;
    e[axis] = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    (e[(axis + 1) % 3], e[(axis + 2) % 3]) = (at.x, at.y);
    Vec3::from_array(e)
}

/// Face and position on it that show direction `d`.
fn face_of(d: Vec3) -> (usize, Vec2) {
    let d = d.to_array();
    let axis = (0..3).max_by(|a, b| d[*a].abs().total_cmp(&d[*b].abs())).unwrap_or(0);
    let scale = 1.0 / d[axis].abs();
    let at = Vec2::new(d[(axis + 1) % 3], d[(axis + 2) % 3]) * scale;
    (2 * axis + usize::from(d[axis] < 0.0), at)
}

/// Bias towards the light in texels where the receiver's slope has this tangent.
fn bias(slope: f32) -> f32 {
    BIAS[0] + BIAS[1] * slope
}

impl Map {
    fn texels(&self) -> usize {
        match self {
            Self::Plane { depth, wider, .. } => depth.len() + wider.as_ref().map_or(0, |w| w.texels()),
            Self::Cube { depth, .. } => depth.len(),
        }
    }

    /// The part of `taps` × `taps` texels that do not block the light at `p`.
    fn open(&self, light: LightAt, p: Vec3, normal: Vec3, taps: isize) -> f32 {
        let offsets = |k: isize| [k % taps - taps / 2, k / taps - taps / 2];
        let mut open = 0;
        match self {
            Self::Plane { axes, middle, half, size, depth, wider } => {
                let (local, n) = (axes.transpose() * p, axes.transpose() * normal);
                let texel = 2.0 * half / *size as f32;
                let at = ((local.truncate() - middle) / half + Vec2::ONE) * (0.5 * *size as f32);
                let [i, j] = [at.x, at.y].map(|x| x.floor().clamp(-1.0, *size as f32) as isize);
                let (reach, side) = (taps / 2, *size as isize);
                let within = |k: isize| k >= reach && k < side - reach;
                if let Some(wider) = wider.as_ref().filter(|_| !(within(i) && within(j))) {
                    return wider.open(light, p, normal, taps);
                }
                // Metres that the receiver's plane recedes from the light per metre across.
                let slope = steepness(n.truncate(), n.z);
                let margin = texel * bias(slope.length());
                for [dx, dy] in (0..taps * taps).map(offsets) {
                    let (x, y) = (i + dx, j + dy);
                    let inside = |k: isize| (0..*size as isize).contains(&k);
                    let stored = if inside(x) && inside(y) {
                        depth[y as usize * size + x as usize]
                    } else {
                        f32::NEG_INFINITY
                    };
                    let across = (Vec2::new(x as f32, y as f32) + 0.5 - at) * texel;
                    let own = local.z - slope.dot(across);
                    open += isize::from(stored <= own + margin);
                }
            }
            Self::Cube { size, depth } => {
                let LightAt::Near(origin) = light else { return 1.0 };
                let to = p - origin;
                let far = to.abs().max_element();
                if far == 0.0 {
                    return 1.0;
                }
                let (face, at) = face_of(to);
                let step = 2.0 / *size as f32;
                let cosine = -normal.dot(to) / to.length();
                let slope = ((1.0 - cosine * cosine).max(0.0).sqrt() / cosine.abs().max(1e-3)).min(STEEPEST);
                let margin = far * step * bias(slope);
                let nearest = |x: f32| ((x + 1.0) / step).floor().clamp(0.0, *size as f32 - 1.0);
                for [dx, dy] in (0..taps * taps).map(offsets) {
                    let tap = Vec2::new(nearest(at.x) + dx as f32, nearest(at.y) + dy as f32);
                    // Beyond the border of a face its extended plane leads to a texel of the neighbour.
                    let (face, at) = face_of(face_direction(face, (tap + 0.5) * step - 1.0));
                    let [x, y] = [at.x, at.y].map(|x| nearest(x) as usize);
                    let e = face_direction(face, centre(y * size + x, *size));
                    // Where the ray of this texel meets the receiver's plane; a plane seen from too steep is
                    // taken for one that faces the light.
                    let along = e.dot(normal);
                    let flat = far * e.abs().max_element();
                    let own = if along.abs() * STEEPEST > e.length() { to.dot(normal) / along } else { flat };
                    let own = if own > 0.0 { own } else { flat };
                    open += isize::from(depth[(face * size + y) * size + x] >= own - margin);
                }
            }
        }
        open as f32 / (taps * taps) as f32
    }
}

/// Slope of a plane seen from a light: metres that it recedes from the light per metre across. The plane's
/// normal has the components `across` the direction to the light and `towards` it.
fn steepness(across: Vec2, towards: f32) -> Vec2 {
    let slope = across / towards.abs().max(1e-6) * towards.signum();
    slope.clamp_length_max(STEEPEST)
}

impl Blocker for ShadowMaps {
    fn arriving(&self, ray: &Ray, normal: Vec3, distance: f32) -> f32 {
        let found = meant(&self.maps, ray, distance);
        found.map_or(1.0, |(light, map)| map.open(*light, ray.origin, normal, self.taps))
    }

    fn is_portable(&self) -> bool {
        self.maps.iter().map(|(_, map)| map.texels()).sum::<usize>() <= Flat::MOST
    }

    fn flat(&self) -> Option<Flat> {
        if !self.is_portable() {
            return None;
        }
        let (mut lights, mut depths) = (Vec::new(), Vec::new());
        for (light, map) in &self.maps {
            let (place, near) = match light {
                LightAt::Far(d) => (d, 0.0),
                LightAt::Near(p) => (p, 1.0),
            };
            let mut next = Some(map);
            while let Some(map) = next {
                let first = depths.len() as f32;
                let (axes, [x, y, half], size, depth, wider) = match map {
                    Map::Plane { axes, middle, half, size, depth, wider } => {
                        (*axes, [middle.x, middle.y, *half], size, depth, wider.as_deref())
                    }
                    Map::Cube { size, depth } => (Mat3::IDENTITY, [0.0; 3], size, depth, None),
                };
                let [a, b, c] = axes.to_cols_array_2d();
                let (size, more) = (*size as f32, f32::from(u8::from(wider.is_some())));
                lights.push([
                    place.x, place.y, place.z, near, a[0], a[1], a[2], x, b[0], b[1], b[2], y, c[0], c[1],
                    c[2], half, size, first, more, 0.0,
                ]);
                depths.extend_from_slice(depth);
                next = wider;
            }
        }
        Some(Flat::Maps { lights, depths, taps: self.taps as usize })
    }
}
