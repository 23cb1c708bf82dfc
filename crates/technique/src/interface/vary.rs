//! Properties that may vary from point to point: the width of the lobe, the normals under the point, the
//! colours of the reflectance, and how texture coordinates lie on the surface.

/// A point's own lobe. [`PointLobe::PLAIN`] is the material's, with one normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLobe {
    /// Width alpha = perceptual_roughness² in place of the material's; negative keeps the material's.
    pub alpha: f32,
    /// Added to alpha², albedo unchanged: twice the variance of the normals' slopes along one axis, for a
    /// distribution taken as isotropic (Olano & Baker 2010, *LEAN Mapping*: alpha'² = alpha² + 2σ²).
    pub widen: f32,
    /// Least alpha of the lookup, by which the pixel's own footprint in the reflection blurs it (K06: the
    /// level of the lookup is the larger of those of roughness and minification).
    pub least: f32,
    /// Covariance of the unit normals under the point about n, in the frame (t, n × t): tt, tb, bb.
    pub spread: [f32; 3],
    /// Albedo of the diffuse part in place of the material's; negative keeps the material's.
    pub albedo: [f32; 3],
    /// Reflectance of the specular part at normal incidence in place of the material's; negative keeps the
    /// material's.
    pub f0: [f32; 3],
}

impl PointLobe {
    /// The material's own lobe about one normal.
    pub const PLAIN: Self =
        Self { alpha: -1.0, widen: 0.0, least: 0.0, spread: [0.0; 3], albedo: [-1.0; 3], f0: [-1.0; 3] };
    /// Numbers of a lobe.
    pub const LEN: usize = 12;

    /// The array alpha, widen, least, tt, tb, bb, albedo, f0.
    pub fn to_array(self) -> [f32; Self::LEN] {
        let ([tt, tb, bb], [r, g, b], [x, y, z]) = (self.spread, self.albedo, self.f0);
        [self.alpha, self.widen, self.least, tt, tb, bb, r, g, b, x, y, z]
    }

    /// The lobe of an array that [`PointLobe::to_array`] made.
    #[inline(always)]
    pub fn from_array([alpha, widen, least, tt, tb, bb, r, g, b, x, y, z]: [f32; Self::LEN]) -> Self {
        Self { alpha, widen, least, spread: [tt, tb, bb], albedo: [r, g, b], f0: [x, y, z] }
    }
}

impl Default for PointLobe {
    fn default() -> Self {
        Self::PLAIN
    }
}

/// How texture coordinates lie on the surface at a point, for techniques with data per texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointChart {
    /// Unit normal of the surface itself, before any normal map, on the viewer's side.
    pub n: [f32; 3],
    /// Unit tangent across it, along which u grows.
    pub t: [f32; 3],
    /// 1 where the bitangent, against which v grows, is n × t, −1 where it is t × n.
    pub side: f32,
    /// Side of the square, in texture coordinates, over which textures are averaged at the point.
    pub footprint: f32,
}

impl PointChart {
    /// Numbers of a chart.
    pub const LEN: usize = 8;

    /// The array n, t, side, footprint.
    pub fn to_array(self) -> [f32; Self::LEN] {
        let ([nx, ny, nz], [tx, ty, tz]) = (self.n, self.t);
        [nx, ny, nz, tx, ty, tz, self.side, self.footprint]
    }

    /// The chart of an array that [`PointChart::to_array`] made.
    #[inline(always)]
    pub fn from_array([nx, ny, nz, tx, ty, tz, side, footprint]: [f32; Self::LEN]) -> Self {
        Self { n: [nx, ny, nz], t: [tx, ty, tz], side, footprint }
    }
}

/// The properties of [`PointLobe`] that a bake shades with. It ignores the other ones, and callers that set
/// these report so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Varies {
    /// The width of the lobe. True also where the reflectance has no width, so that nothing is ignored.
    pub alpha: bool,
    /// The normals under the point.
    pub normals: bool,
    /// Albedo and f0.
    pub colours: bool,
}

impl Varies {
    /// Width and normals, not the colours.
    pub const SHAPE: Self = Self { alpha: true, normals: true, colours: false };
    /// Everything.
    pub const ALL: Self = Self { alpha: true, normals: true, colours: true };
    /// Nothing.
    pub const NONE: Self = Self { alpha: false, normals: false, colours: false };

    /// Names, for messages, those properties of a surface that a bake ignores.
    pub fn left_out(self, roughness_map: bool, filtered_normals: bool, colours: bool) -> Vec<&'static str> {
        let all = [
            (colours && !self.colours, "the variation of base colour and metalness"),
            (roughness_map && !self.alpha, "the variation of roughness"),
            (filtered_normals && !self.normals, "the filtering of its normal map, which may alias"),
        ];
        all.into_iter().filter(|l| l.0).map(|l| l.1).collect()
    }
}
