//! Polynomial texture maps from photographs under known lights.

use crate::inputs::all_finite;
use crate::scene_file::below;
use crate::{Error, Session};
use glam::DVec3;
use std::path::Path;
use steradian_formats::{Ptm, PtmTexels, read_image, read_lp, write_ptm};
use steradian_relight::polynomial::{Fit, FitError, Photographs};

/// Extensions of polynomial texture maps.
pub const POLYNOMIALS: [&str; 1] = ["ptm"];

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
        write_ptm(path, &Ptm { width, height, texels })?;
        Ok(PolynomialFacts { width, height, photographs: lights.len(), condition: fit.condition() })
    }
}
