//! Layouts: how images cover the sphere.

use glam::DVec3;

/// How an image's texels map to directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layout {
    /// Equirectangular; any width and height.
    LatLong,
    /// Six square faces +X −X +Y −Y +Z −Z in the Khronos orientation.
    Cube,
    /// Two square faces (front +Z, back −Z).
    DualParaboloid,
    /// Mirror ball.
    SphereMap,
    /// Debevec's light probe.
    AngularMap,
    /// Octahedral, square.
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
    pub fn direction(self, width: usize, height: usize, at: Position) -> Option<DVec3> {
        let _ = (width, height, at);
        todo!()
    }

    /// The position that shows unit direction `d`.
    pub fn position(self, width: usize, height: usize, d: DVec3) -> Position {
        let _ = (width, height, d);
        todo!()
    }

    /// Exact solid angle of texel (i, j) of `face`, in steradians; 0 outside the used part.
    pub fn solid_angle(self, width: usize, height: usize, face: usize, i: usize, j: usize) -> f64 {
        let _ = (width, height, face, i, j);
        todo!()
    }
}
