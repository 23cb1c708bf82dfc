//! Primaries of RGB files, and the way to linear Rec. 709.
//!
//! The matrix of a set of chromaticities follows SMPTE RP 177 (1993): the columns are the primaries' XYZ,
//! scaled so that their sum is the white. Where a file's white differs from D65, the linear Bradford
//! transform (Lam 1985; ICC.1:2010 annex E) adapts it, so that the file's white (1, 1, 1) stays (1, 1, 1).

use crate::Raster;

type M = [[f64; 3]; 3];

/// CIE 1931 chromaticities of red, green, blue and white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Primaries(pub [[f64; 2]; 4]);

/// ITU-R BT.709-6 (2015), table 1, with white D65.
pub(crate) const REC709: Primaries = Primaries([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]]);

/// What Radiance assumes of its own pictures (Ward, `color.h`): nominal CRT primaries with the equal-energy
/// white.
pub(crate) const RADIANCE: Primaries =
    Primaries([[0.64, 0.33], [0.29, 0.60], [0.15, 0.06], [1. / 3., 1. / 3.]]);

/// XYZ to the cone responses in which white points are adapted (Lam 1985; ICC.1:2010, annex E).
const BRADFORD: M = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

impl Primaries {
    /// Equal within the digits that files carry?
    pub fn close(&self, other: &Self) -> bool {
        self.0.iter().flatten().zip(other.0.iter().flatten()).all(|(a, b)| (a - b).abs() < 2e-3)
    }

    /// The matrix to XYZ, white Y = 1. `None` where the primaries span no plane.
    fn to_xyz(self) -> Option<M> {
        let [r, g, b, w] = self.0.map(xyz);
        let p = [[r[0], g[0], b[0]], [r[1], g[1], b[1]], [r[2], g[2], b[2]]];
        let s = apply(&inverse(&p)?, w);
        Some(p.map(|row| [row[0] * s[0], row[1] * s[1], row[2] * s[2]]))
    }

    /// The matrix from these primaries to linear Rec. 709. `None` where they are nonsense.
    pub fn to_rec709(self) -> Option<M> {
        let from = apply(&BRADFORD, xyz(self.0[3]));
        let to = apply(&BRADFORD, xyz(REC709.0[3]));
        let gain = [[to[0] / from[0], 0., 0.], [0., to[1] / from[1], 0.], [0., 0., to[2] / from[2]]];
        let adapt = product(&inverse(&BRADFORD)?, &product(&gain, &BRADFORD));
        let m = product(&xyz_to_rec709()?, &product(&adapt, &self.to_xyz()?));
        m.iter().flatten().all(|v| v.is_finite() && v.abs() < 1e4).then_some(m)
    }
}

/// XYZ of a chromaticity, Y = 1.
fn xyz(c: [f64; 2]) -> [f64; 3] {
    [c[0] / c[1], 1.0, (1.0 - c[0] - c[1]) / c[1]]
}

/// The matrix from XYZ to linear Rec. 709 without adaptation: XYZ of D65 with Y = 1 becomes (1, 1, 1).
pub(crate) fn xyz_to_rec709() -> Option<M> {
    inverse(&REC709.to_xyz()?)
}

/// Applies `m` to the planes R, G and B.
pub(crate) fn transform(raster: &mut Raster, m: &M) {
    let index = |name| raster.channels.iter().position(|c| c.name == name);
    let (Some(r), Some(g), Some(b)) = (index("R"), index("G"), index("B")) else { return };
    let mut planes = [r, g, b].map(|i| std::mem::take(&mut raster.channels[i].data));
    let [pr, pg, pb] = &mut planes;
    for ((r, g), b) in pr.iter_mut().zip(pg).zip(pb) {
        let v = apply(m, [f64::from(*r), f64::from(*g), f64::from(*b)]);
        (*r, *g, *b) = (v[0] as f32, v[1] as f32, v[2] as f32);
    }
    for (i, plane) in [r, g, b].into_iter().zip(planes) {
        raster.channels[i].data = plane;
    }
}

/// m·v.
pub(crate) fn apply(m: &M, v: [f64; 3]) -> [f64; 3] {
    m.map(|r| r[0] * v[0] + r[1] * v[1] + r[2] * v[2])
}

fn product(a: &M, b: &M) -> M {
    let column = |j: usize| apply(a, [b[0][j], b[1][j], b[2][j]]);
    let [x, y, z] = [column(0), column(1), column(2)];
    [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]
}

fn inverse(m: &M) -> Option<M> {
    let cof = |a: usize, b: usize, c: usize, d: usize| m[a][b] * m[c][d] - m[a][d] * m[c][b];
    let adj = [
        [cof(1, 1, 2, 2), -cof(0, 1, 2, 2), cof(0, 1, 1, 2)],
        [-cof(1, 0, 2, 2), cof(0, 0, 2, 2), -cof(0, 0, 1, 2)],
        [cof(1, 0, 2, 1), -cof(0, 0, 2, 1), cof(0, 0, 1, 1)],
    ];
    let det = m[0][0] * adj[0][0] + m[0][1] * adj[1][0] + m[0][2] * adj[2][0];
    (det.is_finite() && det.abs() > 1e-12).then(|| adj.map(|r| r.map(|v| v / det)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn xyz_to_rec709_is_the_published_matrix() {
        // IEC 61966-2-1 (1999), eq. 7.
        let want = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]];
        let got = xyz_to_rec709().unwrap();
        for (g, w) in got.iter().flatten().zip(want.iter().flatten()) {
            assert!((g - w).abs() < 6e-4, "{g} {w}");
        }
    }

    #[test]
    fn white_stays_white_and_rec709_stays_itself() {
        let acescg = Primaries([[0.713, 0.293], [0.165, 0.83], [0.128, 0.044], [0.32168, 0.33767]]);
        for p in [REC709, RADIANCE, acescg] {
            let m = p.to_rec709().unwrap();
            assert!(apply(&m, [1.0; 3]).iter().all(|v| (v - 1.0).abs() < 1e-12));
        }
        let id = REC709.to_rec709().unwrap();
        for i in 0..3 {
            for j in 0..3 {
                assert!((id[i][j] - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
        // ACES technical bulletin TB-2014-004 adapted by Bradford: AP1 red in Rec. 709.
        let red = apply(&acescg.to_rec709().unwrap(), [1.0, 0.0, 0.0]);
        for (g, w) in red.iter().zip([1.705, -0.130, -0.024]) {
            assert!((g - w).abs() < 2e-3, "{red:?}");
        }
        assert!(Primaries([[0.3, 0.3]; 4]).to_rec709().is_none());
        assert!(Primaries([[0.0, 0.0]; 4]).to_rec709().is_none());
    }
}
