//! Data of objects and of the backdrop for shaders, as bytes and texels.

use crate::scene::{Backdrop, Level, Object};
use glam::{Affine3A, Mat3A};
use steradian_scene::surface::{NormalFiltering, Texture, Wrap};

/// Little-endian bytes of floats.
pub fn bytes<'a>(floats: impl IntoIterator<Item = &'a f32>) -> Vec<u8> {
    floats.into_iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// Textures of an object.
pub const TEXTURES: usize = 7;

/// The texture that multiplies the radiance, mean normals, their covariance, alpha², albedo, f0, emission.
pub fn textures(object: &Object) -> [Option<&Texture>; TEXTURES] {
    let maps = &object.maps;
    let normal = maps.normal.as_deref();
    let colours = maps.colours.as_ref();
    [
        object.base_colour.as_deref(),
        normal.map(|n| n.mean()),
        normal.map(|n| n.spread()),
        maps.alpha2.as_deref(),
        colours.map(|c| &*c.albedo),
        colours.map(|c| &*c.f0),
        maps.emission.as_deref(),
    ]
}

/// The numbers of `struct GpuObject`: first id, triangles, filtering and 4 with vertex colours; levels, rows
/// and wrap of each texture.
#[derive(Debug, Clone, Copy)]
pub struct Counts {
    object: [u32; 3],
    images: [[u32; 4]; TEXTURES],
}

impl Counts {
    /// The data of `object`, whose triangles get ids from `first`.
    pub fn of(object: &Object, first: u32) -> Self {
        let image = |t: &Texture| {
            let [u, v] = t.wrap().map(wrap_word);
            [t.levels().count() as u32, t.size().1 as u32, u | v << 2, 0]
        };
        let filtering = match object.maps.filtering {
            NormalFiltering::None => 0,
            NormalFiltering::Isotropic => 1,
            NormalFiltering::Covariance => 2,
        } + if object.triangles.colors.is_empty() { 0 } else { 4 };
        Self {
            object: [first, object.triangles.indices.len() as u32, filtering],
            images: textures(object).map(|t| t.map_or([0, 1, 0, 0], image)),
        }
    }

    /// `struct GpuObject`.
    pub fn uniforms(&self, transform: &Affine3A) -> Vec<u8> {
        let m = transform.matrix3;
        let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
        let normals =
            Mat3A::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
                * sign;
        let mut floats = glam::Mat4::from(*transform).to_cols_array().to_vec();
        for c in [normals.x_axis, normals.y_axis, normals.z_axis] {
            floats.extend([c.x, c.y, c.z, 0.0]);
        }
        let mut out = bytes(&floats);
        let words = self.object.iter().copied().chain([u32::from(sign < 0.0)]);
        let words = words.chain(self.images.iter().flatten().copied());
        out.extend(words.flat_map(u32::to_le_bytes));
        out
    }
}

/// Code of a wrap mode for `gpu_columns`.
fn wrap_word(w: Wrap) -> u32 {
    match w {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }
}

/// The texture with its levels one below the other, each at the left edge: software adapters read one level
/// of a mip chain for all threads of a group, whichever each needs. A black texel where there is no texture.
pub fn stack(texture: Option<&Texture>) -> Level {
    let none = || Level { width: 1, height: 1, texels: vec![[0.0; 3]] };
    texture.map_or_else(none, |t| {
        let width = t.size().0;
        let mut out = Level { width, height: 0, texels: Vec::new() };
        for (columns, _, texels) in t.levels() {
            for row in texels.chunks_exact(columns) {
                out.texels.extend_from_slice(row);
                out.height += 1;
                out.texels.resize(out.height * width, [0.0; 3]);
            }
        }
        out
    })
}

/// Texels beyond each side that the bicubic lookup reads.
pub const BORDER: usize = 2;

/// The image with its border: columns go on around the seam, a row beyond a pole is the row reflected and
/// turned by half a turn (for odd widths the mean of two columns).
pub fn bordered(image: &Level) -> Level {
    let (w, h) = (image.width as isize, image.height as isize);
    let row = |j: isize, i: isize| image.texels[(j * w + i.rem_euclid(w)) as usize];
    let texel = |j: isize, i: isize| {
        if (0..h).contains(&j) {
            return row(j, i);
        }
        let beyond = if j < 0 { -1 - j } else { 2 * h - 1 - j }.clamp(0, h - 1);
        let (a, b) = (row(beyond, i + w / 2), row(beyond, i + (w + 1) / 2));
        std::array::from_fn(|c| 0.5 * (a[c] + b[c]))
    };
    let border = BORDER as isize;
    let texels = (-border..h + border).flat_map(|j| (-border..w + border).map(move |i| (j, i)));
    Level {
        width: image.width + 2 * BORDER,
        height: image.height + 2 * BORDER,
        texels: texels.map(|(j, i)| texel(j, i)).collect(),
    }
}

/// `struct GpuBackdrop`.
pub fn backdrop_uniforms(backdrop: &Backdrop) -> Vec<u8> {
    let [r, g, b] = backdrop.colour;
    let mut uniforms = bytes(&[r, g, b, 0.0]);
    let counts = [backdrop.disks.len() as u32, u32::from(backdrop.image.is_some()), 0, 0];
    uniforms.extend(counts.into_iter().flat_map(u32::to_le_bytes));
    uniforms
}

/// Two rows a disk, unit direction and angular radius, and radiance; those of a black one where there is
/// none.
pub fn disks(backdrop: &Backdrop) -> Vec<[f32; 4]> {
    let mut disks = Vec::new();
    for d in &backdrop.disks {
        disks.push(d.direction.extend(d.angular_radius).to_array());
        disks.push([d.radiance[0], d.radiance[1], d.radiance[2], 0.0]);
    }
    disks.resize(disks.len().max(2), [0.0; 4]);
    disks
}
