//! What may differ from point to point: the width of the lobe, the normals under the point, and the colours of the
//! reflectance.

/// A point's own lobe. [`PointLobe::PLAIN`] is the material's, with one normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLobe {
    /// Width alpha = perceptual_roughness² in place of the material's; negative keeps the material's.
    pub alpha: f32,
    /// Added to alpha², albedo unchanged: twice the variance of the normals' slopes where it is taken as round
    /// (Olano & Baker 2010, *LEAN Mapping*: alpha'² = alpha² + 2σ²).
    pub widen: f32,
    /// Least alpha of the lookup: what the pixel's own footprint in the reflection blurs (K06: the level is the
    /// larger one of the roughness's and the minification's).
    pub least: f32,
    /// Covariance of the unit normals under the point about n, in the frame (t, n × t): tt, tb, bb.
    pub spread: [f32; 3],
    /// Albedo of the diffuse part in place of the material's; negative keeps the material's.
    pub albedo: [f32; 3],
    /// Reflectance of the specular part at normal incidence in place of the material's; negative keeps the material's.
    pub f0: [f32; 3],
}

impl PointLobe {
    /// The material's own lobe about one normal.
    pub const PLAIN: Self =
        Self { alpha: -1.0, widen: 0.0, least: 0.0, spread: [0.0; 3], albedo: [-1.0; 3], f0: [-1.0; 3] };
    /// Numbers of a lobe.
    pub const LEN: usize = 12;

    /// alpha, widen, least, tt, tb, bb, albedo, f0.
    pub fn to_array(self) -> [f32; Self::LEN] {
        let ([tt, tb, bb], [r, g, b], [x, y, z]) = (self.spread, self.albedo, self.f0);
        [self.alpha, self.widen, self.least, tt, tb, bb, r, g, b, x, y, z]
    }

    /// From [`PointLobe::to_array`].
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

/// What of [`PointLobe`] a bake shades with. What it does not is left out, and whoever asks for it says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Varies {
    /// The width of the lobe; also where the reflectance has no width to vary.
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

    /// What of a surface with these properties is left out, in words.
    pub fn left_out(self, roughness_map: bool, filtered_normals: bool, colours: bool) -> Vec<&'static str> {
        let all = [
            (colours && !self.colours, "the variation of base colour and metalness"),
            (roughness_map && !self.alpha, "the variation of roughness"),
            (filtered_normals && !self.normals, "the filtering of its normal map, which may alias"),
        ];
        all.into_iter().filter(|l| l.0).map(|l| l.1).collect()
    }
}
