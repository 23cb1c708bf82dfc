//! Polynomial texture maps from photographs under known lights.

use crate::inputs::all_finite;
use crate::inspect::is_lp;
use crate::scene_file::below;
use crate::{Error, Session};
use glam::DVec3;
use std::path::Path;
use std::sync::Arc;
use steradian_formats::{Ptm, PtmTexels, Raster, read_image, read_lp, read_ptm, write_ptm};
use steradian_relight::polynomial::{Fit, FitError, LUMINANCE, Photographs, evaluate, normal};
use steradian_scene::surface::{Texture, Wrap};

/// Extensions of polynomial texture maps.
pub const POLYNOMIALS: [&str; 1] = ["ptm"];

/// What white is in files.
const WHITE: f32 = 255.0;

/// What of a polynomial texture map becomes a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PolynomialPart {
    /// The direction of the light under which a texel is brightest.
    Normal,
    /// What it reflects of that light, as a part of its irradiance times π.
    Albedo,
}

/// What photographs have become.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolynomialFacts {
    /// Width in texels.
    pub width: usize,
    /// Height in texels.
    pub height: usize,
    /// Photographs, each of one light.
    pub photographs: usize,
    /// Ratio of the largest singular value of the lights' polynomials to the smallest: how much errors may grow.
    pub condition: f64,
}

impl Session {
    /// Fits the polynomial texture map `path` (`PTM_FORMAT_LRGB`) to the photographs that a list of light positions names, in
    /// its folder or below. Coefficients in the file are bytes: off by half a step of their range over all texels.
    pub fn fit_polynomials(&mut self, list: &Path, path: &Path) -> Result<PolynomialFacts, Error> {
        let (map, facts) = self.photographs(list)?;
        write_ptm(path, &map)?;
        Ok(facts)
    }

    /// The polynomials of the photographs that a list of light positions names.
    fn photographs(&mut self, list: &Path) -> Result<(Ptm, PolynomialFacts), Error> {
        let lights = read_lp(list, &self.limits())?;
        self.note_input(list);
        let fault = |e: FitError| Error::input(format!("{}: {e}", list.display()));
        let directions: Vec<DVec3> = lights.iter().map(|l| DVec3::from(l.position)).collect();
        let fit = Fit::new(&directions).map_err(fault)?;
        let folder = list.parent().unwrap_or(Path::new(""));
        let mut size = None;
        let mut all = None;
        self.task.begin("photographs", lights.len() as u64);
        for light in &lights {
            self.task.check()?;
            let file = below(folder, &light.file)?;
            let raster = all_finite(&file, read_image(&file, &self.limits())?)?;
            self.note_input(&file);
            let (w, h) = (raster.width, raster.height);
            let (width, height) = *size.get_or_insert((w, h));
            if (w, h) != (width, height) {
                let why = format!("is {w} x {h} where the first photograph is {width} x {height}");
                return Err(Error::input(format!("{}: {why}", file.display())));
            }
            let planes = raster
                .into_rgb()
                .ok_or_else(|| Error::input(format!("{}: has no colour", file.display())))?;
            let sums: &mut Photographs<'_> = all.get_or_insert_with(|| Photographs::new(&fit, w * h));
            sums.add([&planes[0], &planes[1], &planes[2]]).map_err(fault)?;
            self.task.advance(1);
        }
        self.task.end();
        let (width, height) = size.unwrap_or_default();
        let texels = all.map_or(PtmTexels::Rgb(Default::default()), Photographs::finish);
        let facts = PolynomialFacts { width, height, photographs: lights.len(), condition: fit.condition() };
        Ok((Ptm { width, height, texels }, facts))
    }

    /// Polynomials of a file (.ptm), or of the photographs that a list of lights names (.lp).
    fn polynomials(&mut self, path: &Path) -> Result<Ptm, Error> {
        if is_lp(&path.to_string_lossy()) {
            return Ok(self.photographs(path)?.0);
        }
        let map = read_ptm(path, &self.limits())?;
        self.note_input(path);
        Ok(map)
    }

    /// The coefficients as six textures of red, green and blue, in units of which white is 1, and what is put behind their
    /// name.
    pub(crate) fn polynomial_planes(&mut self, path: &Path) -> Result<Vec<(String, Arc<Texture>)>, Error> {
        let map = self.polynomials(path)?;
        let n = map.width * map.height;
        let plane = |k: usize, c: usize| -> Vec<f32> {
            match &map.texels {
                PtmTexels::Lrgb { luminance, color } => {
                    let colour = |t: usize| f32::from(color[t][c]) / WHITE;
                    (0..n).map(|t| luminance[t][k] / WHITE * colour(t)).collect()
                }
                PtmTexels::Rgb(all) => all[c].iter().map(|a| a[k] / WHITE).collect(),
            }
        };
        let texture = |k: usize| {
            let t = Texture::new(map.width, map.height, &[plane(k, 0), plane(k, 1), plane(k, 2)]);
            let t = t.map(|t| Arc::new(t.with_wrap([Wrap::Clamp; 2])));
            t.ok_or_else(|| Error::input(format!("{}: is empty", path.display())))
        };
        (0..6).map(|k| Ok((format!(".{k}"), texture(k)?))).collect()
    }

    /// A map of a polynomial texture map: where each texel is brightest, as a tangent-space normal map, green up, or what it
    /// reflects there.
    pub fn polynomial_map(&mut self, path: &Path, part: PolynomialPart) -> Result<Raster, Error> {
        let map = self.polynomials(path)?;
        let (luminance, colour): (Vec<[f64; 6]>, Vec<[f64; 3]>) = match &map.texels {
            PtmTexels::Lrgb { luminance, color } => (
                luminance.iter().map(|a| a.map(f64::from)).collect(),
                color.iter().map(|c| c.map(|x| f64::from(x) / f64::from(WHITE))).collect(),
            ),
            PtmTexels::Rgb(all) => {
                let of = |t: usize| -> [f64; 6] {
                    std::array::from_fn(|k| (0..3).map(|c| LUMINANCE[c] * f64::from(all[c][t][k])).sum())
                };
                ((0..all[0].len()).map(of).collect(), Vec::new())
            }
        };
        let texel = |t: usize| -> [f32; 3] {
            let n = normal(&luminance[t]).unwrap_or(DVec3::Z);
            match (part, &map.texels) {
                (PolynomialPart::Normal, _) => (0.5 + 0.5 * n).as_vec3().to_array(),
                (PolynomialPart::Albedo, PtmTexels::Lrgb { .. }) => {
                    let l = evaluate(&luminance[t], n).max(0.0) / f64::from(WHITE);
                    colour[t].map(|c| (c * l) as f32)
                }
                (PolynomialPart::Albedo, PtmTexels::Rgb(all)) => [0, 1, 2].map(|c| {
                    let l = evaluate(&all[c][t].map(f64::from), n).max(0.0);
                    l as f32 / WHITE
                }),
            }
        };
        let all: Vec<[f32; 3]> = (0..map.width * map.height).map(texel).collect();
        let planes = [0, 1, 2].map(|c| all.iter().map(|x| x[c]).collect());
        Ok(Raster::rgb(map.width, map.height, planes))
    }
}
