//! Facts of the files of reflectance transformation imaging: polynomial texture maps and light positions.

use crate::btf::Source;
use crate::{Error, Session};
use std::path::Path;
use steradian_formats::{PtmTexels, read_lp, read_ptm};

/// Facts of a polynomial texture map.
#[derive(Debug, Clone, PartialEq)]
pub struct PtmFacts {
    /// Width in texels.
    pub width: usize,
    /// Height in texels.
    pub height: usize,
    /// Its kind as the file names it.
    pub kind: &'static str,
    /// For each polynomial (luminance, or red, green and blue): smallest and largest of the coefficients of
    /// u², v², uv, u, v and 1.
    pub polynomials: Vec<(&'static str, [(f32, f32); 6])>,
    /// Smallest and largest of red, green and blue, which a polynomial of luminance scales.
    pub color: Option<[(u8, u8); 3]>,
    /// Where it comes from, by the record of a capture in its folder.
    pub source: Option<Source>,
}

/// Facts of a list of light positions.
#[derive(Debug, Clone, PartialEq)]
pub struct LightPositionFacts {
    /// Photographs, each of one light.
    pub lights: usize,
    /// Smallest and largest x, y and z.
    pub ranges: [(f64, f64); 3],
    /// Smallest and largest distance from the origin; both 1 where positions are unit vectors.
    pub distances: (f64, f64),
    /// Ratio of the largest singular value of the lights' polynomials of six coefficients to the smallest, or
    /// why these cannot be fitted.
    pub polynomials: Result<f64, String>,
    /// Where it comes from, by the record of a capture in its folder.
    pub source: Option<Source>,
}

/// Is this the name of a polynomial texture map?
pub fn is_ptm(what: &str) -> bool {
    what.to_lowercase().ends_with(".ptm")
}

/// Is this the name of a list of light positions?
pub fn is_lp(what: &str) -> bool {
    what.to_lowercase().ends_with(".lp")
}

impl Session {
    /// Facts of a polynomial texture map.
    pub fn inspect_ptm(&mut self, path: &Path) -> Result<PtmFacts, Error> {
        let ptm = read_ptm(path, &self.limits())?;
        self.note_input(path);
        let polynomials = ptm.texels.polynomials().into_iter();
        let ranges = polynomials.map(|(name, texels)| {
            let mut all = [(f32::INFINITY, f32::NEG_INFINITY); 6];
            for t in texels {
                all.iter_mut().zip(t).for_each(|(r, v)| *r = (r.0.min(*v), r.1.max(*v)));
            }
            (name, all)
        });
        let color = match &ptm.texels {
            PtmTexels::Rgb(_) => None,
            PtmTexels::Lrgb { color, .. } => {
                let mut all = [(u8::MAX, u8::MIN); 3];
                for t in color {
                    all.iter_mut().zip(t).for_each(|(r, v)| *r = (r.0.min(*v), r.1.max(*v)));
                }
                Some(all)
            }
        };
        let polynomials = ranges.collect();
        let (width, height, kind) = (ptm.width, ptm.height, ptm.texels.kind());
        Ok(PtmFacts { width, height, kind, polynomials, color, source: Source::beside(path) })
    }

    /// Facts of a list of light positions.
    pub fn inspect_lp(&mut self, path: &Path) -> Result<LightPositionFacts, Error> {
        let lights = read_lp(path, &self.limits())?;
        self.note_input(path);
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut ranges, mut distances) = ([none; 3], none);
        let grow = |r: &mut (f64, f64), v: f64| *r = (r.0.min(v), r.1.max(v));
        for l in &lights {
            ranges.iter_mut().zip(l.position).for_each(|(r, v)| grow(r, v));
            grow(&mut distances, l.position.iter().map(|v| v * v).sum::<f64>().sqrt());
        }
        let polynomials = self.condition(path, &lights);
        let source = Source::beside(path);
        Ok(LightPositionFacts { lights: lights.len(), ranges, distances, polynomials, source })
    }
}
