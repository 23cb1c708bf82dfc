//! From pixels to faces: crosses, strips, six files, pairs.

use super::{FileLayout, LightError};
use steradian_sphere::{Layout, SphereImage};

/// Planes of one decoded file.
pub struct Pixels {
    pub name: String,
    pub width: usize,
    pub height: usize,
    pub planes: [Vec<f32>; 3],
}

/// Column, row and half-turn of face k in units of faces.
type Place = (usize, usize, bool);

/// +Y above +Z; −X +Z +X −Z in the middle row; −Y below +Z.
const HORIZONTAL_CROSS: [Place; 6] =
    [(2, 1, false), (0, 1, false), (1, 0, false), (1, 2, false), (1, 1, false), (3, 1, false)];

/// The same with −Z upside down under −Y.
const VERTICAL_CROSS: [Place; 6] =
    [(2, 1, false), (0, 1, false), (1, 0, false), (1, 2, false), (1, 1, false), (1, 3, true)];

/// Faces from left to right.
const STRIP: [Place; 6] =
    [(0, 0, false), (1, 0, false), (2, 0, false), (3, 0, false), (4, 0, false), (5, 0, false)];

/// The layout that an aspect ratio stands for. A square is an angular map, the classic light probe; a mirror
/// ball or an octahedral map is square too and must be named.
pub fn guess(width: usize, height: usize) -> Option<FileLayout> {
    let (w, h) = (width, height);
    Some(match () {
        () if w == 2 * h => FileLayout::LatLong,
        () if w == h => FileLayout::AngularMap,
        () if 3 * w == 4 * h => FileLayout::HorizontalCross,
        () if 4 * w == 3 * h => FileLayout::VerticalCross,
        () if w == 6 * h => FileLayout::HorizontalStrip,
        () if 6 * w == h => FileLayout::VerticalStrip,
        () => return None,
    })
}

/// Cuts or moves the pixels of one file into faces.
pub fn one(pixels: Pixels, layout: FileLayout) -> Result<SphereImage, LightError> {
    let (w, h) = (pixels.width, pixels.height);
    let whole = |layout| SphereImage { layout, width: w, height: h, planes: [vec![], vec![], vec![]] };
    let mut image = match layout {
        FileLayout::LatLong => whole(Layout::LatLong),
        FileLayout::AngularMap => whole(Layout::AngularMap),
        FileLayout::SphereMap => whole(Layout::SphereMap),
        FileLayout::Octahedral => whole(Layout::Octahedral),
        // Faces one below the other are our own order in memory.
        FileLayout::VerticalStrip if h == 6 * w => {
            SphereImage { layout: Layout::Cube, width: w, height: w, planes: [vec![], vec![], vec![]] }
        }
        FileLayout::HorizontalStrip if w == 6 * h => return Ok(cut(&pixels, h, STRIP)),
        FileLayout::HorizontalCross if 3 * w == 4 * h => return Ok(cut(&pixels, h / 3, HORIZONTAL_CROSS)),
        FileLayout::VerticalCross if 4 * w == 3 * h => return Ok(cut(&pixels, w / 3, VERTICAL_CROSS)),
        FileLayout::ParaboloidPair if w == 2 * h => return Ok(cut_pair(&pixels, h, true)),
        FileLayout::ParaboloidPair if h == 2 * w => return Ok(cut_pair(&pixels, w, false)),
        _ => {
            let why = format!("{w} x {h} pixels are not a {} ({})", layout.name(), layout.aspect());
            return Err(LightError::invalid(pixels.name, why));
        }
    };
    image.planes = pixels.planes;
    Ok(image)
}

/// Copies faces of `n` × `n` pixels from their places.
fn cut<const F: usize>(pixels: &Pixels, n: usize, places: [Place; F]) -> SphereImage {
    let layout = if F == 6 { Layout::Cube } else { Layout::DualParaboloid };
    let mut out = SphereImage::new(layout, n, n);
    for (source, target) in pixels.planes.iter().zip(&mut out.planes) {
        for (face, &(column, row, turned)) in places.iter().enumerate() {
            for j in 0..n {
                let at = (row * n + j) * pixels.width + column * n;
                let line = &source[at..at + n];
                let to = (face * n + if turned { n - 1 - j } else { j }) * n;
                target[to..to + n].copy_from_slice(line);
                if turned {
                    target[to..to + n].reverse();
                }
            }
        }
    }
    out
}

fn cut_pair(pixels: &Pixels, n: usize, beside: bool) -> SphereImage {
    cut(pixels, n, [(0, 0, false), if beside { (1, 0, false) } else { (0, 1, false) }])
}

/// Joins six faces (+X −X +Y −Y +Z −Z) or a front and a back paraboloid, each from its own file.
pub fn several(files: Vec<Pixels>) -> Result<SphereImage, LightError> {
    let layout = match files.len() {
        6 => Layout::Cube,
        2 => Layout::DualParaboloid,
        n => {
            let why =
                format!("{n} files; an environment takes one, two (front, back) or six (+X -X +Y -Y +Z -Z)");
            return Err(LightError::invalid("environment", why));
        }
    };
    let n = files[0].width;
    for f in &files {
        if f.width != n || f.height != n {
            let why = format!(
                "{} x {} pixels; every face must be square and {n} wide, as the first",
                f.width, f.height
            );
            return Err(LightError::invalid(&f.name, why));
        }
    }
    let mut planes: [Vec<f32>; 3] = std::array::from_fn(|_| Vec::with_capacity(files.len() * n * n));
    for mut f in files {
        for (all, one) in planes.iter_mut().zip(&mut f.planes) {
            all.append(one);
        }
    }
    Ok(SphereImage { layout, width: n, height: n, planes })
}
