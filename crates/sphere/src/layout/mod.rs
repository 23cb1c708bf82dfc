//! Layouts: how images cover the sphere. One file per layout; all of them are pure functions of the size.

mod angular;
pub(crate) mod cube;
pub(crate) mod disc;
mod latlong;
mod octahedral;
pub(crate) mod paraboloid;
mod sphere_map;

use glam::DVec3;

/// How an image's texels map to directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layout {
    /// Equirectangular; any width and height: `u = 0.5 + atan2(z, x)/2π`, `v = acos(y)/π`, row 0 at +Y.
    LatLong,
    /// Six square faces +X −X +Y −Y +Z −Z in the Khronos orientation.
    Cube,
    /// Two square faces (front +Z, back −Z): (s, t) = (x, y)/(1 + |z|), s to the right, t upwards on both.
    /// A face ends at the disc s² + t² ≤ 1; its corners hold the same formula's continuation into the other
    /// hemisphere (so that a plain bilinear lookup is right up to the rim) and have no solid angle.
    DualParaboloid,
    /// Mirror ball: what a distant camera that looks along −Z sees in a reflecting sphere. The centre shows
    /// +Z, the rim −Z, +X is to the right and +Y up.
    SphereMap,
    /// Debevec's light probe: the distance from the centre is proportional to the angle from −Z, +X is to the
    /// right and +Y up; the rim shows +Z.
    AngularMap,
    /// The angular map with texel (i, j) at the lattice point (i, j) instead of the centre of a cell: the
    /// disc's centre is the texel (W/2, H/2). So reads Ramamoorthi's prefilter.c (2001), and with it the
    /// published coefficients of the classic probes; half a texel shifts them by up to 1 % of L00. A texel's
    /// cell reaches half a texel to each side; the last column's and row's end at the rim.
    AngularLattice,
    /// Octahedral, square: +Y at the centre, +X to the right, +Z downwards; −Y at the four corners.
    Octahedral,
}

/// A continuous position in an image: texel (i, j) covers [i, i+1) × [j, j+1), its centre is at (i+½, j+½).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Face index.
    pub face: usize,
    /// Column coordinate.
    pub x: f64,
    /// Row coordinate, downwards.
    pub y: f64,
}

impl Layout {
    /// Every layout.
    pub const ALL: [Self; 6] = [
        Self::LatLong,
        Self::Cube,
        Self::DualParaboloid,
        Self::SphereMap,
        Self::AngularMap,
        Self::Octahedral,
    ];

    /// The name that commands and files use.
    pub fn name(self) -> &'static str {
        match self {
            Self::LatLong => "latlong",
            Self::Cube => "cube",
            Self::DualParaboloid => "paraboloid",
            Self::SphereMap => "sphere-map",
            Self::AngularMap => "angular",
            Self::AngularLattice => "angular-lattice",
            Self::Octahedral => "octahedral",
        }
    }

    /// The layout of a name; `-` and `_` are the same.
    pub fn from_name(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().replace('_', "-").as_str() {
            "latlong" | "lat-long" | "equirect" | "equirectangular" => Some(Self::LatLong),
            "cube" | "cubemap" => Some(Self::Cube),
            "paraboloid" | "dual-paraboloid" => Some(Self::DualParaboloid),
            "sphere-map" | "spheremap" | "mirror-ball" => Some(Self::SphereMap),
            "angular" | "angular-map" | "probe" => Some(Self::AngularMap),
            "angular-lattice" => Some(Self::AngularLattice),
            "octahedral" => Some(Self::Octahedral),
            _ => None,
        }
    }

    /// Number of faces.
    pub fn faces(self) -> usize {
        match self {
            Self::Cube => 6,
            Self::DualParaboloid => 2,
            _ => 1,
        }
    }

    /// The direction at a position of a `width` × `height` face; `None` outside the part of the image that
    /// the layout uses (corners of a probe).
    ///
    /// On a disc (sphere map, angular map) a texel is in use where it overlaps the disc: there, positions
    /// beyond the rim continue on the opposite side, and a texel centre has a direction exactly where
    /// [`Layout::solid_angle`] is positive. On the faces of a cube, positions beyond the face lie on its
    /// extended plane.
    pub fn direction(self, width: usize, height: usize, at: Position) -> Option<DVec3> {
        let (w, h) = (width as f64, height as f64);
        match self {
            Self::LatLong => Some(latlong::direction(at.x / w, at.y / h)),
            Self::Cube => cube::direction(at.face, 2.0 * at.x / w - 1.0, 2.0 * at.y / h - 1.0),
            Self::Octahedral => Some(octahedral::direction(2.0 * at.x / w - 1.0, 2.0 * at.y / h - 1.0)),
            Self::DualParaboloid => {
                paraboloid::direction(at.face, 2.0 * at.x / w - 1.0, 1.0 - 2.0 * at.y / h)
            }
            Self::SphereMap | Self::AngularMap | Self::AngularLattice => {
                let o = self.offset();
                let (s, t) = (2.0 * (at.x - o) / w - 1.0, 1.0 - 2.0 * (at.y - o) / h);
                if !disc::in_use(w, h, at.x, at.y, o) {
                    return None;
                }
                Some(if self == Self::SphereMap {
                    sphere_map::direction(s, t)
                } else {
                    angular::direction(s, t)
                })
            }
        }
    }

    /// The direction at the centre of texel (i, j) of `face`.
    #[inline]
    pub fn texel_direction(
        self,
        width: usize,
        height: usize,
        face: usize,
        i: usize,
        j: usize,
    ) -> Option<DVec3> {
        self.direction(width, height, Position { face, x: i as f64 + 0.5, y: j as f64 + 0.5 })
    }

    /// The position that shows unit direction `d`.
    pub fn position(self, width: usize, height: usize, d: DVec3) -> Position {
        let (w, h) = (width as f64, height as f64);
        // s to the right, t down on square maps, up on discs.
        let (face, s, t) = match self {
            Self::LatLong => {
                let (u, v) = latlong::position(d);
                let x = u * w;
                return Position { face: 0, x: if x >= w { x - w } else { x }, y: v * h };
            }
            Self::Cube => cube::position(d),
            Self::Octahedral => octahedral::position(d),
            Self::DualParaboloid => {
                let (face, s, t) = paraboloid::position(d);
                (face, s, -t)
            }
            Self::SphereMap => {
                let (s, t) = sphere_map::position(d);
                (0, s, -t)
            }
            Self::AngularMap | Self::AngularLattice => {
                let (s, t) = angular::position(d);
                (0, s, -t)
            }
        };
        let o = self.offset();
        Position { face, x: 0.5 * (s + 1.0) * w + o, y: 0.5 * (t + 1.0) * h + o }
    }

    /// Exact solid angle of texel (i, j) of `face`, in steradians; 0 outside the used part. A texel that the
    /// rim of a disc cuts has the solid angle of its part inside.
    pub fn solid_angle(self, width: usize, height: usize, face: usize, i: usize, j: usize) -> f64 {
        let _ = face;
        let (w, h) = (width as f64, height as f64);
        if self == Self::LatLong {
            return latlong::solid_angle(w, h, j as f64);
        }
        let [x0, x1, y0, y1] = self.cell(width, height, i, j);
        match self {
            Self::LatLong | Self::Cube => cube::solid_angle(x0, x1, y0, y1),
            Self::Octahedral => octahedral::solid_angle(x0, x1, y0, y1),
            Self::DualParaboloid => disc::integrate(x0, x1, y0, y1, paraboloid::edge, paraboloid::RIM),
            Self::SphereMap => disc::integrate(x0, x1, y0, y1, sphere_map::edge, sphere_map::RIM),
            Self::AngularMap | Self::AngularLattice => {
                disc::integrate(x0, x1, y0, y1, angular::edge, angular::RIM)
            }
        }
    }

    /// Part of the area of texel (i, j) that the layout uses, 0 … 1: 1 but for texels at the rim of a disc
    /// and beyond it.
    pub fn coverage(self, width: usize, height: usize, i: usize, j: usize) -> f64 {
        if !self.is_disc() {
            return 1.0;
        }
        let [x0, x1, y0, y1] = self.cell(width, height, i, j);
        disc::integrate(x0, x1, y0, y1, disc::area_edge, disc::AREA_RIM) / ((x1 - x0) * (y1 - y0))
    }

    /// Borders of texel (i, j) on the square [−1, 1]², y downwards: x0, x1, y0, y1.
    pub(crate) fn cell(self, width: usize, height: usize, i: usize, j: usize) -> [f64; 4] {
        let o = self.offset();
        let edge = |k: usize, n: usize| if k == n { 1.0 } else { 2.0 * (k as f64 - o) / n as f64 - 1.0 };
        [edge(i, width), edge(i + 1, width), edge(j, height), edge(j + 1, height)]
    }

    /// Where the corner of texel (0, 0) of the square lies, in texels.
    pub(crate) fn offset(self) -> f64 {
        if self == Self::AngularLattice { 0.5 } else { 0.0 }
    }

    /// Does the layout use only the disc of each face?
    pub fn is_disc(self) -> bool {
        matches!(self, Self::DualParaboloid | Self::SphereMap | Self::AngularMap | Self::AngularLattice)
    }
}

#[cfg(test)]
mod tests;
