//! How images on the sphere are laid out in files that are written.

use crate::failure::Failure;
use steradian_formats::Raster;
use steradian_light::load::latlong_size;
use steradian_render::scenefile::unknown;
use steradian_sphere::{Layout, SphereImage};

/// A layout of a written file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    LatLong,
    /// Faces one below the other, or in files of their own.
    Cube,
    Cross,
    VerticalCross,
    Strip,
    Angular,
    SphereMap,
    Octahedral,
    /// Front and back side by side.
    Paraboloid,
}

const NAMES: [(Target, &str); 10] = [
    (Target::LatLong, "latlong"),
    (Target::Cube, "vertical-strip"),
    (Target::Cube, "cube"),
    (Target::Cross, "cross"),
    (Target::VerticalCross, "vertical-cross"),
    (Target::Strip, "strip"),
    (Target::Angular, "angular"),
    (Target::SphereMap, "sphere-map"),
    (Target::Octahedral, "octahedral"),
    (Target::Paraboloid, "paraboloid"),
];

impl Target {
    /// The target called `text`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let found = NAMES.iter().find(|(_, n)| *n == text.replace('_', "-"));
        found.map(|(t, _)| *t).ok_or_else(|| unknown("layout", text, &NAMES.map(|n| n.1)))
    }

    /// Its name, by which the file is read again.
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(t, _)| *t == self).map_or("", |(_, n)| n)
    }

    /// The target that keeps a layout.
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

    /// The arrangement of its faces.
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
}

/// The size of a face from what a user wrote: a single number is a side, and of a lat-long image the width.
pub fn side((w, h): (usize, usize), target: Target) -> Result<(usize, usize), Failure> {
    match target {
        Target::LatLong if w == h => Ok((w, (w / 2).max(1))),
        Target::LatLong => Ok((w, h)),
        _ if w == h => Ok((w, h)),
        _ => Err(Failure::usage(format!("--size: faces of {} are square", target.name()))),
    }
}

/// The image in the target's layout and the given size of a face; by default what the image resolves.
pub fn shaped(image: SphereImage, target: Target, size: Option<(usize, usize)>) -> SphereImage {
    let layout = target.layout();
    let (w, h) = size.unwrap_or_else(|| natural(&image, layout));
    if image.layout == layout && (image.width, image.height) == (w, h) {
        return image;
    }
    image.resample(layout, w, h)
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

fn places(target: Target) -> Option<Places> {
    const CROSS: [(usize, usize, bool); 6] =
        [(2, 1, false), (0, 1, false), (1, 0, false), (1, 2, false), (1, 1, false), (3, 1, false)];
    const VERTICAL: [(usize, usize, bool); 6] =
        [(2, 1, false), (0, 1, false), (1, 0, false), (1, 2, false), (1, 1, false), (1, 3, true)];
    const STRIP: [(usize, usize, bool); 6] =
        [(0, 0, false), (1, 0, false), (2, 0, false), (3, 0, false), (4, 0, false), (5, 0, false)];
    const PAIR: [(usize, usize, bool); 2] = [(0, 0, false), (1, 0, false)];
    match target {
        Target::Cross => Some((&CROSS, 4, 3)),
        Target::VerticalCross => Some((&VERTICAL, 3, 4)),
        Target::Strip => Some((&STRIP, 6, 1)),
        Target::Paraboloid => Some((&PAIR, 2, 1)),
        _ => None,
    }
}

/// The faces arranged in one image. What the loader reads back by the target's name is this image.
pub fn arranged(image: SphereImage, target: Target) -> Raster {
    let n = image.width;
    let Some((places, columns, rows)) = places(target) else {
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
pub fn metadata(target: Target) -> Vec<(String, String)> {
    let mut pairs = vec![("steradian.layout".to_string(), target.name().to_string())];
    if target == Target::LatLong {
        pairs.push(("envmap".into(), "latlong".into()));
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_light::load::{FileLayout, LoadOptions, from_raster};

    #[test]
    fn what_is_written_is_read_back() {
        let cube = SphereImage::from_fn(Layout::Cube, 4, 4, |d| [d.x as f32, d.y as f32, d.z as f32 + 2.0]);
        for target in [Target::Cube, Target::Cross, Target::VerticalCross, Target::Strip] {
            let raster = arranged(cube.clone(), target);
            let layout = FileLayout::from_name(target.name());
            assert!(layout.is_some(), "{}", target.name());
            let back = from_raster("x", raster, &LoadOptions { layout, ..LoadOptions::default() }).unwrap();
            assert_eq!(back.image, cube, "{}", target.name());
        }
        let pair = SphereImage::from_fn(Layout::DualParaboloid, 4, 4, |d| [d.x as f32, 1.0, 0.0]);
        let raster = arranged(pair.clone(), Target::Paraboloid);
        assert_eq!((raster.width, raster.height), (8, 4));
    }

    #[test]
    fn sizes() {
        assert_eq!(side((64, 64), Target::LatLong).unwrap(), (64, 32));
        assert!(side((64, 32), Target::Cube).is_err());
        let image = SphereImage::new(Layout::LatLong, 64, 32);
        assert_eq!(natural(&image, Layout::Cube), (16, 16));
    }
}
