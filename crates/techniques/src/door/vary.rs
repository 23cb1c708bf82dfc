//! What may differ from point to point: the width of the lobe, and the normals under the point.

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
}

impl PointLobe {
    /// The material's own lobe about one normal.
    pub const PLAIN: Self = Self { alpha: -1.0, widen: 0.0, least: 0.0, spread: [0.0; 3] };
    /// Numbers of a lobe.
    pub const LEN: usize = 6;

    /// alpha, widen, least, tt, tb, bb.
    pub fn to_array(self) -> [f32; Self::LEN] {
        let [tt, tb, bb] = self.spread;
        [self.alpha, self.widen, self.least, tt, tb, bb]
    }

    /// From [`PointLobe::to_array`].
    #[inline(always)]
    pub fn from_array([alpha, widen, least, tt, tb, bb]: [f32; Self::LEN]) -> Self {
        Self { alpha, widen, least, spread: [tt, tb, bb] }
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
}

impl Varies {
    /// Everything.
    pub const ALL: Self = Self { alpha: true, normals: true };
    /// Nothing.
    pub const NONE: Self = Self { alpha: false, normals: false };

    /// What of a surface with these properties is left out, in words.
    pub fn left_out(self, roughness_map: bool, filtered_normals: bool) -> Vec<&'static str> {
        let all = [
            (roughness_map && !self.alpha, "the variation of roughness"),
            (filtered_normals && !self.normals, "the filtering of its normal map, which may alias"),
        ];
        all.into_iter().filter(|l| l.0).map(|l| l.1).collect()
    }
}
