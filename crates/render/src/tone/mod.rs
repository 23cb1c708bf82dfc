//! From radiance to a display: exposure, tone mapping, sRGB.

mod curves;
mod srgb;

pub use srgb::{srgb_decode, srgb_encode};

use crate::{Display, Film};
use steradian_parallel::prelude::*;

/// Curve that maps radiance to the range of a display.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ToneMapper {
    /// Clamped to 0 … 1.
    Linear,
    /// Reinhard, Stark, Shirley & Ferwerda 2002, eq. 4 (extended), on luminance, white at 4.
    Reinhard,
    /// Hable 2010, "Filmic Tonemapping Operators" (Uncharted 2).
    Hable,
    /// Hill's fit of the ACES reference rendering and sRGB output transforms (2016).
    Aces,
    /// Narkowicz's fit of the ACES curve per channel (2016).
    AcesNarkowicz,
    /// Sobotka's AgX in Wrensch's polynomial approximation (2023), default look.
    Agx,
    /// Khronos PBR Neutral (2024), which preserves base colours.
    #[default]
    Neutral,
}

impl ToneMapper {
    /// Every tone mapper.
    pub const ALL: [Self; 7] = [
        Self::Linear,
        Self::Reinhard,
        Self::Hable,
        Self::Aces,
        Self::AcesNarkowicz,
        Self::Agx,
        Self::Neutral,
    ];

    /// The name that a user writes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Reinhard => "reinhard",
            Self::Hable => "hable",
            Self::Aces => "aces",
            Self::AcesNarkowicz => "aces-narkowicz",
            Self::Agx => "agx",
            Self::Neutral => "neutral",
        }
    }

    /// The tone mapper called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }

    /// Display-linear values in 0 … 1 of a linear Rec. 709 colour; NaN gives 0.
    pub fn map(self, rgb: [f32; 3]) -> [f32; 3] {
        let x = rgb.map(|c| if c > 0.0 { c.min(1e6) } else { 0.0 });
        let y = match self {
            Self::Linear => x,
            Self::Reinhard => curves::reinhard(x, 4.0),
            Self::Hable => curves::hable(x),
            Self::Aces => curves::aces_hill(x),
            Self::AcesNarkowicz => x.map(curves::aces_narkowicz),
            Self::Agx => curves::agx(x),
            Self::Neutral => curves::neutral(x),
        };
        y.map(|c| c.clamp(0.0, 1.0))
    }
}

/// Exposure and tone mapper of one picture.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Develop {
    /// Exposure value: radiance is multiplied by 2^`ev` first.
    pub ev: f32,
    /// The tone mapper.
    pub mapper: ToneMapper,
}

impl Develop {
    /// The sRGB bytes of one colour.
    pub fn pixel(&self, rgb: [f32; 3]) -> [u8; 3] {
        let gain = self.ev.exp2();
        self.mapper.map(rgb.map(|c| c * gain)).map(|c| (255.0 * srgb_encode(c)).round() as u8)
    }

    /// The picture that a display shows.
    pub fn film(&self, film: &Film) -> Display {
        let mut rgb = vec![0u8; 3 * film.len()];
        let row = film.width.max(1);
        rgb.par_chunks_mut(3 * row).enumerate().for_each(|(y, out)| {
            for (x, px) in out.chunks_exact_mut(3).enumerate() {
                px.copy_from_slice(&self.pixel(film.pixel(y * row + x)));
            }
        });
        Display { width: film.width, height: film.height, rgb }
    }
}

/// Value to which automatic exposure brings the mean: a lit object is brighter than the 0.18 of a whole
/// scene.
const KEY: f64 = 0.3;

/// The exposure value that brings the mean logarithm of the luminance to 0.3 (Reinhard et al. 2002, eqs 1–2;
/// their key of 0.18 is that of a whole scene), over the pixels that `weight` counts.
pub fn auto_exposure(film: &Film, weight: impl Fn(usize) -> f32) -> f32 {
    let (mut sum, mut total) = (0.0f64, 0.0f64);
    for i in 0..film.len() {
        let w = f64::from(weight(i));
        let y = luminance(film.pixel(i));
        if w > 0.0 && y > 0.0 && y.is_finite() {
            sum += w * f64::from(y.max(1e-6).ln());
            total += w;
        }
    }
    if total == 0.0 { 0.0 } else { (KEY.log2() - sum / total / std::f64::consts::LN_2) as f32 }
}

/// Rec. 709 luminance, Y = 0.2126 R + 0.7152 G + 0.0722 B.
#[inline]
pub fn luminance(c: [f32; 3]) -> f32 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mapper_keeps_black_grows_and_stays_in_range() {
        for t in ToneMapper::ALL {
            assert!(t.map([0.0; 3]).iter().all(|&c| c < 2e-3), "{t:?} {:?}", t.map([0.0; 3]));
            let mut last = -1.0;
            for k in 0..200 {
                let x = 1e-3 * 1.08f32.powi(k);
                let y = t.map([x; 3]);
                assert!(y.iter().all(|c| (0.0..=1.0).contains(c)));
                assert!(y[1] >= last - 2e-3, "{t:?} falls at {x}");
                last = y[1];
            }
            assert!(last > 0.95, "{t:?} does not reach white: {last}");
            assert!(t.map([f32::NAN, f32::INFINITY, -1.0]).iter().all(|c| c.is_finite()));
            assert_eq!(ToneMapper::from_name(t.name()), Some(t));
        }
    }

    #[test]
    fn develop_is_srgb_of_exposed_radiance() {
        let d = Develop { ev: 1.0, mapper: ToneMapper::Linear };
        // 0.5·2 = 1 → 255; 0.09·2 = 0.18 → sRGB 0.4614 → 118.
        assert_eq!(d.pixel([0.5, 0.09, 0.0]), [255, 118, 0]);
    }

    #[test]
    fn auto_exposure_brings_the_mean_to_the_key() {
        let mut f = Film::new(4, 4);
        f.rgb.iter_mut().for_each(|p| p.fill(1.2));
        assert!((auto_exposure(&f, |_| 1.0) + 2.0).abs() < 1e-5);
    }
}
