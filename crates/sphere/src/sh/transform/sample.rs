//! Samples of image planes: f32 or f64.

/// A sample of an image plane.
pub trait Sample: Copy + Send + Sync {
    /// As f64.
    fn to_f64(self) -> f64;
    /// The nearest representable value.
    fn from_f64(x: f64) -> Self;
    /// The samples, if they are f32.
    fn singles(_: &[Self]) -> Option<&[f32]> {
        None
    }
    /// The samples, if they are f32.
    fn singles_mut(_: &mut [Self]) -> Option<&mut [f32]> {
        None
    }
    /// The samples, if they are f64.
    fn doubles(_: &[Self]) -> Option<&[f64]> {
        None
    }
    /// The samples, if they are f64.
    fn doubles_mut(_: &mut [Self]) -> Option<&mut [f64]> {
        None
    }
}

impl Sample for f32 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self.into()
    }
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x as Self
    }
    #[inline(always)]
    fn singles(x: &[Self]) -> Option<&[f32]> {
        Some(x)
    }
    #[inline(always)]
    fn singles_mut(x: &mut [Self]) -> Option<&mut [f32]> {
        Some(x)
    }
}

impl Sample for f64 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn doubles(x: &[Self]) -> Option<&[f64]> {
        Some(x)
    }
    #[inline(always)]
    fn doubles_mut(x: &mut [Self]) -> Option<&mut [f64]> {
        Some(x)
    }
}
