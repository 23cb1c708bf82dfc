//! Pictures: planar linear radiance with coverage, and the same developed for a display.

use crate::Background;
use steradian_formats::Raster;
use steradian_scene::Camera;

/// Linear Rec. 709 radiance and coverage, one plane each, rows from the top.
///
/// Pixels that a surface covers partly hold the mix with the background behind it; `alpha` is the covered
/// part of the pixel, and `background` the part of the radiance that comes from behind.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Film {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green and blue radiance, W sr⁻¹ m⁻².
    pub rgb: [Vec<f32>; 3],
    /// Coverage by surfaces, 0 … 1.
    pub alpha: Vec<f32>,
    /// Part of red, green and blue that comes from behind the surfaces.
    pub background: [Vec<f32>; 3],
}

impl Film {
    /// A black film without coverage.
    pub fn new(width: usize, height: usize) -> Self {
        let n = width * height;
        let black = || std::array::from_fn(|_| vec![0.0; n]);
        Self { width, height, rgb: black(), alpha: vec![0.0; n], background: black() }
    }

    /// A film of radiance and coverage with nothing behind the surfaces.
    pub fn without_background(width: usize, height: usize, rgb: [Vec<f32>; 3], alpha: Vec<f32>) -> Self {
        let background = std::array::from_fn(|_| vec![0.0; width * height]);
        Self { width, height, rgb, alpha, background }
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.alpha.len()
    }

    /// Has it no pixel at all?
    pub fn is_empty(&self) -> bool {
        self.alpha.is_empty()
    }

    /// Pixel `i` in row order.
    pub fn pixel(&self, i: usize) -> [f32; 3] {
        [self.rgb[0][i], self.rgb[1][i], self.rgb[2][i]]
    }

    /// Sets the background to what a camera sees through the middle of each pixel, weighted by the part that
    /// no surface covers.
    pub fn set_background(&mut self, camera: &Camera, background: &Background) {
        let (width, height) = (self.width, self.height);
        for i in 0..self.len() {
            let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
            let seen = background.radiance(camera.ray(x, y, width as u32, height as u32).direction);
            let open = 1.0 - self.alpha[i];
            (0..3).for_each(|c| self.background[c][i] = (open * seen[c]).min(self.rgb[c][i]));
        }
    }

    /// The surfaces' radiance in each pixel and their coverage, without the background: associated alpha, as
    /// in OpenEXR.
    pub fn into_associated(mut self) -> Raster {
        for (plane, behind) in self.rgb.iter_mut().zip(&self.background) {
            plane.iter_mut().zip(behind).for_each(|(v, b)| *v -= b);
        }
        self.into_raster()
    }

    /// The planes R, G, B and A as plain data for a writer, the background included.
    pub fn into_raster(self) -> Raster {
        let [r, g, b] = self.rgb;
        let channels = [("R", r), ("G", g), ("B", b), ("A", self.alpha)]
            .into_iter()
            .map(|(name, data)| steradian_formats::Channel { name: name.into(), data })
            .collect();
        Raster { width: self.width, height: self.height, channels, low_range: false, metadata: Vec::new() }
    }

    /// A film of an image that was read; coverage is its plane A, else 1. `None` where it has no colour.
    pub fn from_raster(raster: Raster) -> Option<Self> {
        let (width, height) = (raster.width, raster.height);
        let alpha = raster.channel("A").map_or_else(|| vec![1.0; width * height], <[f32]>::to_vec);
        Some(Self::without_background(width, height, raster.into_rgb()?, alpha))
    }
}

/// An sRGB-encoded 8-bit picture, three bytes a pixel, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Display {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `3·width·height` bytes.
    pub rgb: Vec<u8>,
}

impl Display {
    /// A picture of one colour.
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Self { width, height, rgb: colour.repeat(width * height) }
    }

    /// The pixel in column `x` of row `y`.
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        let k = 3 * (y * self.width + x);
        [self.rgb[k], self.rgb[k + 1], self.rgb[k + 2]]
    }

    /// Copies `other` to (x, y), clipped to this picture.
    pub fn paste(&mut self, other: &Self, x: usize, y: usize) {
        let columns = other.width.min(self.width.saturating_sub(x));
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            let to = 3 * ((y + row) * self.width + x);
            let from = 3 * row * other.width;
            self.rgb[to..to + 3 * columns].copy_from_slice(&other.rgb[from..from + 3 * columns]);
        }
    }

    /// Mixes `colour` into a pixel with weight `cover` in 0 … 1; positions outside are ignored.
    pub fn blend(&mut self, x: usize, y: usize, colour: [u8; 3], cover: f32) {
        if x >= self.width || y >= self.height {
            return;
        }
        let k = 3 * (y * self.width + x);
        for (c, to) in self.rgb[k..k + 3].iter_mut().zip(colour) {
            let mixed = f32::from(*c) + (f32::from(to) - f32::from(*c)) * cover.clamp(0.0, 1.0);
            *c = mixed.round() as u8;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paste_leaves_out_what_falls_outside() {
        let mut page = Display::filled(4, 3, [0, 0, 0]);
        page.paste(&Display::filled(3, 3, [255, 0, 0]), 2, 1);
        assert_eq!(page.pixel(3, 2), [255, 0, 0]);
        assert_eq!(page.pixel(1, 1), [0, 0, 0]);
        page.paste(&Display::filled(2, 2, [9, 9, 9]), 7, 7);
    }

    #[test]
    fn raster_round_trip_keeps_coverage() {
        let mut f = Film::new(2, 1);
        f.rgb[1][1] = 3.0;
        f.alpha[0] = 0.5;
        assert_eq!(Film::from_raster(f.clone().into_raster()), Some(f.clone()));
        // A blue sky behind a pixel that a surface covers to a half.
        (f.rgb[2][0], f.background[2][0]) = (2.5, 2.0);
        let raster = f.into_associated();
        assert_eq!(raster.channel("B"), Some(&[0.5, 0.0][..]));
        assert_eq!(raster.channel("G"), Some(&[0.0, 3.0][..]));
    }
}
