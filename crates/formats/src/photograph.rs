//! Images that are read once, run by run of pixels.

use crate::Raster;
use crate::ldr::{Curve, Samples};

/// An image that gives linear red, green and blue and lies in memory as its file has it: a photograph of 12
/// megapixels as 36 MB of bytes, where its planes would be 144.
#[derive(Debug)]
pub struct Photograph(Held);

#[derive(Debug)]
enum Held {
    Codes(Samples, Curve),
    /// An image, and which of its planes are red, green and blue.
    Planes(Raster, [usize; 3]),
}

impl Photograph {
    pub(crate) fn coded(samples: Samples) -> Self {
        let curve = samples.curve();
        Self(Held::Codes(samples, curve))
    }

    /// Of an image with red, green and blue, or with luminance, which serves as all three. `None` where there
    /// is neither.
    pub fn of(raster: Raster) -> Option<Self> {
        let at = |name: &str| raster.channels.iter().position(|c| c.name == name);
        let planes = match (at("R"), at("G"), at("B")) {
            (Some(r), Some(g), Some(b)) => [r, g, b],
            _ => [at("Y")?; 3],
        };
        Some(Self(Held::Planes(raster, planes)))
    }

    /// Pixels a row and rows.
    pub fn size(&self) -> (usize, usize) {
        match &self.0 {
            Held::Codes(s, _) => (s.width, s.height),
            Held::Planes(r, _) => (r.width, r.height),
        }
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        match &self.0 {
            Held::Codes(s, _) => s.bytes(),
            Held::Planes(r, _) => r.channels.iter().map(|c| 4 * c.data.len()).sum(),
        }
    }

    /// Linear red, green and blue of as many pixels as `out` takes, in rows from the top, from pixel `from`
    /// on.
    ///
    /// # Panics
    /// If the image ends before.
    pub fn linear(&self, from: usize, out: [&mut [f32]; 3]) {
        match &self.0 {
            Held::Codes(s, curve) => s.linear(curve, from, out),
            Held::Planes(r, planes) => {
                for (plane, out) in planes.iter().zip(out) {
                    out.copy_from_slice(&r.channels[*plane].data[from..from + out.len()]);
                }
            }
        }
    }

    /// The first pixel that is not finite, as [`Raster::first_non_finite`] gives it.
    pub fn first_non_finite(&self) -> Option<(usize, usize, &str)> {
        match &self.0 {
            Held::Codes(..) => None,
            Held::Planes(r, _) => r.first_non_finite(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, Limits, WriteOptions, read_image, read_photograph, write_image};

    /// Every run of every kind of file has the bits of its planes, and bytes stay bytes.
    #[test]
    fn runs_are_those_of_the_planes() {
        let dir = tempfile::tempdir().expect("a folder");
        let (w, h) = (7, 5);
        let plane =
            |c: usize| (0..w * h).map(|k| ((k * 31 + c * 17) % 97) as f32 / 96.0).collect::<Vec<f32>>();
        let colour = Raster::rgb(w, h, [plane(0), plane(1), plane(2)]);
        let alpha = Channel { name: "A".into(), data: plane(3) };
        let mut clear = colour.clone();
        clear.channels.push(alpha.clone());
        let mut grey = colour.clone();
        grey.channels = vec![Channel { name: "Y".into(), data: plane(1) }];
        let mut clear_grey = grey.clone();
        clear_grey.channels.push(alpha);
        for (raster, channels) in [(&colour, 3), (&clear, 4), (&grey, 1), (&clear_grey, 2)] {
            for (name, bits, bytes) in [("a.png", 8, 1), ("a.png", 16, 2), ("a.pfm", 8, 4), ("a.exr", 8, 4)] {
                if name == "a.pfm" && channels % 2 == 0 {
                    continue;
                }
                let path = dir.path().join(name);
                let options = WriteOptions { png_bits: bits, ..WriteOptions::default() };
                write_image(&path, raster, &options).expect("written");
                let limits = Limits::default();
                let want = read_image(&path, &limits).expect("an image");
                let got = read_photograph(&path, &limits).expect("a photograph");
                assert_eq!((got.size(), got.first_non_finite()), ((w, h), None));
                if name == "a.png" {
                    assert_eq!(got.bytes(), w * h * channels * bytes, "{channels} {bits}");
                }
                let want = want.into_rgb().expect("colour");
                for (from, n) in [(0, w * h), (3, 9), (w * h - 1, 1)] {
                    let mut out = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
                    let [r, g, b] = &mut out;
                    got.linear(from, [r, g, b]);
                    for (out, want) in out.iter().zip(&want) {
                        assert_eq!(out[..], want[from..from + n], "{name} {bits} {channels}");
                    }
                }
            }
        }
        grey.channels.clear();
        assert!(Photograph::of(grey).is_none());
    }
}
