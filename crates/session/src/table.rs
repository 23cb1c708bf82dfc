//! Tables of the split sum's second factor, with their errors.

use crate::{Error, IMAGES, Session, check_format, check_output};
use std::path::Path;
use steradian_brdf::dfg::text::{Language, source};
use steradian_brdf::dfg::{Layout, Lut};
use steradian_formats::{Container, Raster, TexelFormat, TextureLevels, WriteOptions, write_atomic};

/// Extensions of source text.
const TEXTS: [&str; 4] = ["wgsl", "glsl", "hlsl", "rs"];

/// Bound of the quadrature's absolute error, which the tables' tests check.
const QUADRATURE: f64 = 1e-4;
/// Points per axis at which lookups are compared with exact values.
const POINTS: usize = 24;

/// A table with its errors.
pub struct LookupTable {
    /// The table.
    pub lut: Lut,
    /// Bound of the absolute error of its texels.
    pub quadrature: f64,
    /// Error of bilinear lookups at the worst point.
    pub worst: f64,
    /// Root mean square error of bilinear lookups over all points.
    pub rms: f64,
    /// Number of those points.
    pub points: usize,
}

/// The language of a file of source text, by its extension.
fn language(path: &Path) -> Option<Language> {
    path.extension().and_then(|e| Language::of_extension(&e.to_string_lossy().to_lowercase()))
}

/// Refuses files that hold no table, and texels that tables have not; returns the usual side of a table
/// there, texels.
pub fn check_table(path: &Path, format: Option<TexelFormat>) -> Result<usize, Error> {
    check_output(path, &[IMAGES.as_slice(), &Container::EXTENSIONS, &TEXTS].concat())?;
    check_format(format, path)?;
    if let Some(f) = format.filter(|f| !matches!(f, TexelFormat::Rgba16f | TexelFormat::Rgba32f)) {
        return Err(Error::usage(format!("`format` {}: tables are rgba16f or rgba32f", f.name())));
    }
    Ok(if language(path).is_some() { 32 } else { 128 })
}

/// Metadata about the texels.
fn metadata(lut: &Lut) -> Vec<(String, String)> {
    let mut pairs = vec![
        ("steradian.table".to_string(), lut.layout.name().to_string()),
        ("steradian.axes".to_string(), Lut::AXES.to_string()),
    ];
    for (c, what) in ["red", "green", "blue"].iter().zip(lut.layout.channels()) {
        pairs.push((format!("steradian.{c}"), (*what).to_string()));
    }
    pairs
}

impl Session {
    /// A table of `size` texels a side.
    pub fn lookup_table(&mut self, layout: Layout, size: usize) -> Result<LookupTable, Error> {
        let lut = Lut::new(layout, size, &self.task)?;
        let (worst, rms) = lut.interpolation_error(POINTS);
        self.task.check()?;
        self.note_error(format!(
            "quadrature below {QUADRATURE:.0e}; bilinear lookup rms {rms:.1e}, worst {worst:.1e}"
        ));
        Ok(LookupTable { lut, quadrature: QUADRATURE, worst, rms, points: POINTS * POINTS })
    }

    /// Writes a table: as source text, as a texture of `format` or 32-bit floats, or as an image.
    pub fn write_lookup_table(
        &self,
        table: &LookupTable,
        path: &Path,
        format: Option<TexelFormat>,
    ) -> Result<(), Error> {
        let lut = &table.lut;
        if let Some(language) = language(path) {
            let text = source(lut, language, &self.provenance_lines());
            return Ok(write_atomic(path, |w| w.write_all(text.as_bytes()))?);
        }
        if let Some(container) = Container::of_name(path) {
            let mut pairs = self.provenance_pairs();
            pairs.extend(metadata(lut));
            let texels = lut.values.iter().flat_map(|v| [v[0], v[1], v[2], 1.0]).collect();
            let (width, height) = (lut.size, lut.size);
            let t = TextureLevels { width, height, faces: 1, levels: vec![texels], metadata: pairs };
            let report = container.write(path, &t, format.unwrap_or(TexelFormat::Rgba32f))?;
            self.tell_lost(path, report, None);
            return Ok(());
        }
        let plane = |c: usize| lut.values.iter().map(|v| v[c]).collect();
        let raster = Raster::rgb(lut.size, lut.size, [plane(0), plane(1), plane(2)]);
        let options = WriteOptions {
            metadata: metadata(lut),
            png_bits: 16,
            already_encoded: true,
            ..WriteOptions::default()
        };
        self.write_image(path, &raster, options).map(|_| ())
    }
}
