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
    /// Three planes.
    fn planes(x: [&[Self]; 3]) -> Planes<'_>;
    /// Three planes.
    fn planes_mut(x: [&mut [Self]; 3]) -> PlanesMut<'_>;
}

/// Three planes of one or the other type. What takes them is compiled here, once; generic functions would be
/// compiled again by each crate that calls them, transforms for all instruction sets among them.
pub enum Planes<'a> {
    /// f32.
    Single([&'a [f32]; 3]),
    /// f64.
    Double([&'a [f64]; 3]),
}

/// [`Planes`] to write.
pub enum PlanesMut<'a> {
    /// f32.
    Single([&'a mut [f32]; 3]),
    /// f64.
    Double([&'a mut [f64]; 3]),
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
    #[inline(always)]
    fn planes(x: [&[Self]; 3]) -> Planes<'_> {
        Planes::Single(x)
    }
    #[inline(always)]
    fn planes_mut(x: [&mut [Self]; 3]) -> PlanesMut<'_> {
        PlanesMut::Single(x)
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
    #[inline(always)]
    fn planes(x: [&[Self]; 3]) -> Planes<'_> {
        Planes::Double(x)
    }
    #[inline(always)]
    fn planes_mut(x: [&mut [Self]; 3]) -> PlanesMut<'_> {
        PlanesMut::Double(x)
    }
}

impl Planes<'_> {
    /// Are all of this length?
    pub(super) fn are_long(&self, length: usize) -> bool {
        match self {
            Self::Single(planes) => planes.iter().all(|p| p.len() == length),
            Self::Double(planes) => planes.iter().all(|p| p.len() == length),
        }
    }
}

impl PlanesMut<'_> {
    /// Are all of this length?
    pub(super) fn are_long(&self, length: usize) -> bool {
        match self {
            Self::Single(planes) => planes.iter().all(|p| p.len() == length),
            Self::Double(planes) => planes.iter().all(|p| p.len() == length),
        }
    }
}
