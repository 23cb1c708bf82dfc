//! How images on the sphere are laid out in files that are written.

use super::latlong_size;
use steradian_base::unknown;
use steradian_formats::Raster;
use steradian_sphere::{Layout, SphereImage};

/// How a written file arranges the faces of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrangement {
    /// 2 : 1.
    LatLong,
    /// Faces one below the other, or in files of their own.
    Cube,
    /// 4 : 3.
    Cross,
    /// 3 : 4, -Z upside down at the foot.
    VerticalCross,
    /// 6 : 1.
    Strip,
    /// Debevec's light probe.
    Angular,
    /// Mirror ball.
    SphereMap,
    /// One square.
    Octahedral,
    /// Front and back side by side.
    Paraboloid,
}

const NAMES: [(Arrangement, &str); 10] = [
    (Arrangement::LatLong, "latlong"),
    (Arrangement::Cube, "vertical-strip"),
    (Arrangement::Cube, "cube"),
    (Arrangement::Cross, "cross"),
    (Arrangement::VerticalCross, "vertical-cross"),
    (Arrangement::Strip, "strip"),
    (Arrangement::Angular, "angular"),
    (Arrangement::SphereMap, "sphere-map"),
    (Arrangement::Octahedral, "octahedral"),
    (Arrangement::Paraboloid, "paraboloid"),
];

impl Arrangement {
    /// The arrangement called `text`; `-` and `_` are the same.
    pub fn parse(text: &str) -> Result<Self, String> {
        let found = NAMES.iter().find(|(_, n)| *n == text.replace('_', "-"));
        found.map(|(t, _)| *t).ok_or_else(|| unknown("layout", text, &NAMES.map(|n| n.1)))
    }

    /// Its name, by which the file is read again.
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(t, _)| *t == self).map_or("", |(_, n)| n)
    }

    /// The arrangement that keeps a layout.
    pub fn of(layout: Layout) -> Self {
        match layout {
            Layout::LatLong => Self::LatLong,
            Layout::Cube => Self::Cube,
            Layout::DualParaboloid => Self::Paraboloid,
            Layout::SphereMap => Self::SphereMap,
            Layout::AngularMap | Layout::AngularLattice => Self::Angular,
            Layout::Octahedral => Self::Octahedral,
        }
    }

    /// The layout of its faces.
    pub fn layout(self) -> Layout {
        match self {
            Self::LatLong => Layout::LatLong,
            Self::Cube | Self::Cross | Self::VerticalCross | Self::Strip => Layout::Cube,
            Self::Angular => Layout::AngularMap,
            Self::SphereMap => Layout::SphereMap,
            Self::Octahedral => Layout::Octahedral,
            Self::Paraboloid => Layout::DualParaboloid,
        }
    }

    /// The size of a face from what a user wrote: a single number is a side, and of a lat-long image the
    /// width. Faces of the other layouts are square.
    pub fn side(self, (w, h): (usize, usize)) -> Result<(usize, usize), String> {
        match self {
            Self::LatLong if w == h => Ok((w, (w / 2).max(1))),
            Self::LatLong => Ok((w, h)),
            _ if w == h => Ok((w, h)),
            _ => Err(format!("faces of {} are square", self.name())),
        }
    }

    /// The image in this layout and the given size of a face; by default what the image resolves.
    pub fn shaped(self, image: SphereImage, size: Option<(usize, usize)>) -> SphereImage {
        let layout = self.layout();
        let (w, h) = size.unwrap_or_else(|| natural(&image, layout));
        if image.layout == layout && (image.width, image.height) == (w, h) {
            return image;
        }
        image.resample(layout, w, h)
    }

    /// The faces arranged in one image. What the loader reads back by this name is this image.
    pub fn arranged(self, image: SphereImage) -> Raster {
        let n = image.width;
        let Some((places, columns, rows)) = places(self) else {
            // One face, or faces one below the other, as they lie in memory: moved, not copied.
            return Raster::rgb(image.width, image.height * image.layout.faces(), image.planes);
        };
        let width = columns * n;
        let planes = image.planes.map(|source| {
            let mut out = vec![0.0; width * rows * n];
            for (f, &(column, row, turned)) in places.iter().enumerate() {
                for j in 0..n {
                    let from = (f * n + if turned { n - 1 - j } else { j }) * n;
                    let at = (row * n + j) * width + column * n;
                    out[at..at + n].copy_from_slice(&source[from..from + n]);
                    if turned {
                        out[at..at + n].reverse();
                    }
                }
            }
            out
        });
        Raster::rgb(width, rows * n, planes)
    }

    /// What a file says of its own layout.
    pub fn metadata(self) -> Vec<(String, String)> {
        let mut pairs = vec![("steradian.layout".to_string(), self.name().to_string())];
        if self == Self::LatLong {
            pairs.push(("envmap".into(), "latlong".into()));
        }
        pairs
    }
}

/// The size of a face in `layout` that keeps what `image` resolves.
fn natural(image: &SphereImage, layout: Layout) -> (usize, usize) {
    if image.layout == layout {
        return (image.width, image.height);
    }
    let (w, h) = latlong_size(image.layout, image.width, image.height);
    let n = match layout {
        Layout::LatLong => return (w, h),
        Layout::Cube | Layout::DualParaboloid => w.div_ceil(4),
        Layout::SphereMap | Layout::Octahedral => h,
        Layout::AngularMap | Layout::AngularLattice => 2 * h,
    };
    (n.max(1), n.max(1))
}

/// One face as an image.
pub fn face(image: &SphereImage, face: usize) -> Raster {
    let n = image.width * image.height;
    let plane = |c: usize| image.planes[c][face * n..(face + 1) * n].to_vec();
    Raster::rgb(image.width, image.height, [plane(0), plane(1), plane(2)])
}

/// Column, row and half-turn of each face, in units of faces, and the grid's size.
type Places = (&'static [(usize, usize, bool)], usize, usize);

fn places(arrangement: Arrangement) -> Option<Places> {
    const CROSS: [(usize, usize, bool); 6] =
        [(2, 1, false), (0, 1, false), (1, 0, false), (1, 2, false), (1, 1, false), (3, 1, false)];
    const VERTICAL: [(usize, usize, bool); 6] =
        [(2, 1, false), (0, 1, false), (1, 0, false), (1, 2, false), (1, 1, false), (1, 3, true)];
    const STRIP: [(usize, usize, bool); 6] =
        [(0, 0, false), (1, 0, false), (2, 0, false), (3, 0, false), (4, 0, false), (5, 0, false)];
    const PAIR: [(usize, usize, bool); 2] = [(0, 0, false), (1, 0, false)];
    match arrangement {
        Arrangement::Cross => Some((&CROSS, 4, 3)),
        Arrangement::VerticalCross => Some((&VERTICAL, 3, 4)),
        Arrangement::Strip => Some((&STRIP, 6, 1)),
        Arrangement::Paraboloid => Some((&PAIR, 2, 1)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::{FileLayout, LoadOptions, from_raster};

    #[test]
    fn what_is_written_is_read_back() {
        let cube = SphereImage::from_fn(Layout::Cube, 4, 4, |d| [d.x as f32, d.y as f32, d.z as f32 + 2.0]);
        for target in [Arrangement::Cube, Arrangement::Cross, Arrangement::VerticalCross, Arrangement::Strip]
        {
            let raster = target.arranged(cube.clone());
            let layout = FileLayout::from_name(target.name());
            assert!(layout.is_some(), "{}", target.name());
            let back = from_raster("x", raster, &LoadOptions { layout, ..LoadOptions::default() }).unwrap();
            assert_eq!(back.image, cube, "{}", target.name());
        }
        let pair = SphereImage::from_fn(Layout::DualParaboloid, 4, 4, |d| [d.x as f32, 1.0, 0.0]);
        let raster = Arrangement::Paraboloid.arranged(pair.clone());
        assert_eq!((raster.width, raster.height), (8, 4));
    }

    #[test]
    fn sizes() {
        assert_eq!(Arrangement::LatLong.side((64, 64)).unwrap(), (64, 32));
        assert!(Arrangement::Cube.side((64, 32)).is_err());
        let image = SphereImage::new(Layout::LatLong, 64, 32);
        assert_eq!(natural(&image, Layout::Cube), (16, 16));
    }
}
