//! Shadowing of light by bumps: horizons and their ellipses as textures.

use crate::inputs::all_finite;
use crate::{Error, Session};
use std::path::Path;
use steradian_base::Cancelled;
use steradian_formats::{
    ReadOptions, Supercompression, TexelFormat, TextureArray, WriteReport, read_image_with, write_ktx2_array,
};
use steradian_relight::height::{Ellipses, HeightField, Horizons};

/// Extensions of textures of horizons.
pub const HORIZONS: [&str; 1] = ["ktx2"];
/// Azimuths of a horizon at most.
pub const MAX_AZIMUTHS: usize = 256;

/// Form in which horizons are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HorizonForm {
    /// Elevations at this many azimuths, linear between them.
    Azimuths(usize),
    /// One conic, five numbers.
    Ellipses,
}

/// Facts of a height map's horizons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HorizonFacts {
    /// Texels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Images in the texture, of four numbers a texel.
    pub layers: usize,
    /// Mean part of the hemisphere's projected solid angle that is open: ambient occlusion by the bumps.
    pub open: f64,
    /// Values that the texels could not hold.
    pub written: WriteReport,
}

impl Session {
    /// Writes the horizons of each texel of the height map `file` to the array texture `path`. The map
    /// repeats; white is `relief` of its width above black. Heights are the image's alpha where it has one,
    /// else its luminance.
    ///
    /// Azimuths: elevations of the horizon in radians at azimuths 2π k/n from the right of the picture to its
    /// top, four a layer. Ellipses: a, b, c, d in the first layer and e in the second, of a x² + b xy + c
    /// y² + d x + e y ≤ 1 where light comes from the unit direction (x, y, z).
    pub fn horizons(
        &mut self,
        (file, relief): (&Path, f64),
        form: HorizonForm,
        (path, format): (&Path, TexelFormat),
    ) -> Result<HorizonFacts, Error> {
        let field = self.height_field(file, relief)?;
        let (width, height) = (field.width(), field.height());
        let texels = width * height;
        let task = &self.task;
        let go_on = || task.check().is_ok();
        self.check()?;
        task.begin("horizons", 1);
        let layers = match form {
            HorizonForm::Azimuths(n) => n.div_ceil(4),
            HorizonForm::Ellipses => 2,
        };
        let need = (16 * layers * texels) as u64;
        if need > task.max_memory() {
            let why = format!("{layers} layers of {width} x {height} texels take {} MiB", need >> 20);
            return Err(Error::failed(format!("{}: {why}: raise `max-memory`", file.display())));
        }
        let mut level = vec![0.0; 4 * layers * texels];
        let mut put = |texel: usize, k: usize, v: f32| level[4 * (k / 4 * texels + texel) + k % 4] = v;
        let mut metadata = vec![("steradian.relief".to_string(), relief.to_string())];
        match form {
            HorizonForm::Azimuths(n) => {
                let h = Horizons::new(&field, n, &go_on).ok_or(Cancelled)?;
                for texel in 0..texels {
                    (0..n).for_each(|k| put(texel, k, h.sample(texel, k)));
                }
                metadata.push(("steradian.horizons".into(), format!("{n} azimuths: elevations, radians")));
            }
            HorizonForm::Ellipses => {
                let all = Ellipses::new(&field, &go_on).ok_or(Cancelled)?;
                for (texel, e) in all.0.iter().enumerate() {
                    e.0.iter().enumerate().for_each(|(k, v)| put(texel, k, *v));
                }
                let of = "ellipses: x², xy, y², x, y of what is at most 1 in the light";
                metadata.push(("steradian.horizons".into(), of.into()));
            }
        }
        task.end();
        let open = open(&field, &go_on).ok_or(Cancelled)?;
        metadata.extend(self.provenance_pairs());
        let array = TextureArray { width, height, layers, levels: vec![level], metadata };
        let written = write_ktx2_array(path, array, format, Supercompression::None)?;
        Ok(HorizonFacts { width, height, layers, open, written })
    }

    /// The heights of an image, 0 … 1, in rows from the top: its alpha where it has one, else its luminance.
    pub(crate) fn heights(&mut self, file: &Path) -> Result<(usize, usize, Vec<f32>), Error> {
        let options = ReadOptions { limits: self.limits(), data: true, ..ReadOptions::default() };
        let raster = all_finite(file, read_image_with(file, &options)?)?;
        self.note_input(file);
        let (width, height) = (raster.width, raster.height);
        let alpha = raster.channel("A").filter(|a| a.iter().any(|v| *v != a[0])).map(<[f32]>::to_vec);
        let heights = match alpha {
            Some(a) => Some(a),
            None => raster.into_rgb().map(|[r, g, b]| {
                let luminance = |((r, g), b): ((f32, f32), f32)| 0.2126 * r + 0.7152 * g + 0.0722 * b;
                r.into_iter().zip(g).zip(b).map(luminance).collect()
            }),
        };
        let heights = heights.ok_or_else(|| Error::input(format!("{}: has no heights", file.display())))?;
        Ok((width, height, heights))
    }

    fn height_field(&mut self, file: &Path, relief: f64) -> Result<HeightField, Error> {
        let (width, height, heights) = self.heights(file)?;
        let scale = (relief * width as f64) as f32;
        let z = heights.into_iter().map(|v| v * scale).collect();
        HeightField::new(width, height, z).map_err(|e| Error::input(format!("{}: {e}", file.display())))
    }
}

/// Mean over all texels of the visible part of the disk below the hemisphere: ∫ cos² e dφ/2π.
fn open(field: &HeightField, go_on: &(dyn Fn() -> bool + Sync)) -> Option<f64> {
    const AZIMUTHS: usize = 16;
    let h = Horizons::new(field, AZIMUTHS, go_on)?;
    let texels = field.width() * field.height();
    let one = |texel: usize| (0..AZIMUTHS).map(|k| f64::from(h.sample(texel, k)).cos().powi(2)).sum::<f64>();
    Some((0..texels).map(one).sum::<f64>() / (texels * AZIMUTHS) as f64)
}
