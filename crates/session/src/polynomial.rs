//! Polynomial texture maps from photographs under known lights.

use crate::btf::Source;
use crate::inspect::is_lp;
use crate::scene::below;
use crate::{Error, Kind, Session};
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_formats::{
    LightPosition, Photograph, Ptm, PtmPlanes, PtmTexels, Raster, line_of_light, read_lp, read_photograph,
    read_ptm, read_text, write_ptm_planes,
};
use steradian_parallel::prelude::*;
use steradian_relight::polynomial::{
    self, Basis, Channels, Fit, FitError, LUMINANCE, Photographs, Polynomials, brightest, evaluate,
};
use steradian_scene::surface::{Texture, Wrap};

/// Extensions of polynomial texture maps.
pub const POLYNOMIALS: [&str; 1] = ["ptm"];

/// Value of white in files.
const WHITE: f32 = 255.0;

/// Quantity of a polynomial texture map that becomes a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PolynomialPart {
    /// The direction of the light under which a texel is brightest.
    Normal,
    /// Radiance reflected of that light, times π over its irradiance.
    Albedo,
}

/// Quantity that a map's polynomials describe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PolynomialKind {
    /// Luminance, which scales one colour (`PTM_FORMAT_LRGB`).
    #[default]
    Lrgb,
    /// Red, green and blue separately (`PTM_FORMAT_RGB`): colours may change with the light.
    Rgb,
}

impl PolynomialKind {
    fn channels(self) -> Channels {
        match self {
            Self::Lrgb => Channels::Luminance,
            Self::Rgb => Channels::Colour,
        }
    }
}

/// Photographs that are decoded at a time, each by a thread: with the sums they take this part of the memory
/// limit at most, 910 MiB by default, and one is decoded whatever it takes. All of them go over the sums
/// once.
const PART: u64 = 9;
/// As many as there are threads, and these where there are fewer.
const AT_ONCE: u64 = 4;

/// Relative RMS error of one colour a texel that is told.
const TOLD: f64 = 0.02;
/// Most texels at which this error is measured.
const LOOKED_AT: usize = 4096;

/// Facts of a polynomial texture map made from photographs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolynomialFacts {
    /// Quantity that the polynomials describe.
    pub kind: PolynomialKind,
    /// Width in texels.
    pub width: usize,
    /// Height in texels.
    pub height: usize,
    /// Photographs, each of one light.
    pub photographs: usize,
    /// Ratio of the largest singular value of the lights' polynomials to the smallest: how much errors may
    /// grow.
    pub condition: f64,
}

impl Session {
    /// Fits the polynomial texture map `path` to the photographs that a list of light positions names, in its
    /// folder or below. Coefficients in the file are bytes: off by half a step of their range over all
    /// texels. Where one colour a texel loses more than 2 %, that is told.
    pub fn fit_polynomials(
        &mut self,
        list: &Path,
        path: &Path,
        kind: PolynomialKind,
    ) -> Result<PolynomialFacts, Error> {
        let (sums, facts) = self.photographs::<6>(list, kind)?;
        if kind == PolynomialKind::Lrgb && sums.lost > TOLD {
            self.say(format_args!(
                "{}: colours change with the light, of which one colour a texel loses {:.1} %: polynomials of red, green and blue keep them \
                 (`ptm` rgb)",
                list.display(),
                100.0 * sums.lost
            ));
        }
        let (width, height) = (facts.width, facts.height);
        let polynomials = sums.of.planes.iter().map(|p| p.each_ref().map(|p| &p[..])).collect();
        let color = sums.of.color.as_deref();
        write_ptm_planes(path, &PtmPlanes { width, height, polynomials, color })?;
        Ok(facts)
    }

    /// A photograph that a list names.
    fn photograph(&self, folder: &Path, name: &str) -> Result<(PathBuf, Photograph), Error> {
        let file = below(folder, name)?;
        let photograph = read_photograph(&file, &self.limits())?;
        if let Some((x, y, channel)) = photograph.first_non_finite() {
            let why = format!("pixel ({x}, {y}) of channel {channel} is not finite");
            return Err(Error::input(format!("{}: {why}", file.display())));
        }
        Ok((file, photograph))
    }

    /// The fault of photograph `k` of a list, with the list's name and its line.
    fn listed(&self, list: &Path, k: usize, e: Error) -> Error {
        if e.kind() != Kind::Input {
            return e;
        }
        let text = read_text(list, 1 << 24, "a list of lights").unwrap_or_default();
        let line = line_of_light(&text, k).map_or(String::new(), |line| format!("line {line}: "));
        Error::input(format!("{}: {line}{e}", list.display()))
    }

    /// Why the lights of a list give no polynomials.
    fn unfit(&self, list: &Path, lights: &[LightPosition], e: FitError) -> Error {
        match e {
            FitError::Below(k, x, y, z) => {
                let why = format!("{}: its light {}", lights[k].file, polynomial::below([x, y, z]));
                self.listed(list, k, Error::input(why))
            }
            e => Error::input(format!("{}: {e}", list.display())),
        }
    }

    /// Ratio of the largest singular value of the lights' polynomials of six coefficients to the smallest, or
    /// why these cannot be fitted.
    pub(crate) fn condition(&self, list: &Path, lights: &[LightPosition]) -> Result<f64, String> {
        let directions: Vec<DVec3> = lights.iter().map(|l| DVec3::from(l.position)).collect();
        let fit = Fit::<6>::new(&directions).map_err(|e| self.unfit(list, lights, e).to_string())?;
        Ok(fit.condition())
    }

    /// The polynomials of the photographs that a list of light positions names.
    fn photographs<const N: usize>(
        &mut self,
        list: &Path,
        kind: PolynomialKind,
    ) -> Result<(Sums<N>, PolynomialFacts), Error> {
        let lights = read_lp(list, &self.limits())?;
        self.note_input(list);
        let fault = |e: FitError| Error::input(format!("{}: {e}", list.display()));
        let directions: Vec<DVec3> = lights.iter().map(|l| DVec3::from(l.position)).collect();
        let fit = Fit::<N>::new(&directions).map_err(|e| self.unfit(list, &lights, e))?;
        self.note_source(Source::beside(list).as_ref());
        let folder = list.parent().unwrap_or(Path::new(""));
        let mut found: Option<((usize, usize), Photographs<'_, N>)> = None;
        let mut colours = Colours::default();
        self.task.begin("photographs", lights.len() as u64);
        let (mut taken, mut at_once) = (0, 1);
        while taken < lights.len() {
            self.task.check()?;
            let next = &lights[taken..(taken + at_once).min(lights.len())];
            let read: Vec<Result<(PathBuf, Photograph), Error>> = next
                .par_iter()
                .with_max_len(1)
                .map(|light: &LightPosition| self.photograph(folder, &light.file))
                .collect();
            let mut photographs = Vec::with_capacity(read.len());
            for (k, read) in (taken..).zip(read) {
                let (file, photograph) = read.map_err(|e| self.listed(list, k, e))?;
                self.note_input(&file);
                let (w, h) = photograph.size();
                if found.is_none() {
                    let bytes = photograph.bytes() as u64;
                    let sums = Photographs::<N>::bytes(kind.channels(), w * h);
                    let room = (self.task.max_memory() / PART).saturating_sub(sums) / bytes.max(1);
                    let threads = std::thread::available_parallelism().map_or(1, usize::from) as u64;
                    at_once = room.clamp(1, threads.max(AT_ONCE)) as usize;
                    let need = sums + at_once as u64 * bytes;
                    if need > self.task.max_memory() {
                        let why =
                            format!("sums over photographs of {w} x {h} texels take {} MiB", need >> 20);
                        return Err(Error::failed(format!("{}: {why}: raise `max-memory`", list.display())));
                    }
                }
                let (size, _) =
                    found.get_or_insert_with(|| ((w, h), Photographs::new(&fit, kind.channels(), w * h)));
                if (w, h) != *size {
                    let (width, height) = *size;
                    let why = format!("is {w} x {h} where the first photograph is {width} x {height}");
                    let e = Error::input(format!("{}: {why}", file.display()));
                    return Err(self.listed(list, k, e));
                }
                if kind == PolynomialKind::Lrgb {
                    colours.add(&photograph);
                }
                photographs.push(photograph);
            }
            if let Some((_, sums)) = &mut found {
                sums.add_all(&photographs).map_err(fault)?;
            }
            taken += photographs.len();
            self.task.advance(photographs.len() as u64);
        }
        self.task.end();
        let Some(((width, height), sums)) = found else {
            return Err(Error::input(format!("{}: holds no light", list.display())));
        };
        let (photographs, condition) = (lights.len(), fit.condition());
        let facts = PolynomialFacts { kind, width, height, photographs, condition };
        Ok((Sums { of: sums.finish(), lost: colours.lost() }, facts))
    }

    /// The coefficients as textures of red, green and blue, scaled so that white is 1, with the suffixes of
    /// their names: six for a file (.ptm), as many as the basis has for the photographs that a list of lights
    /// names (.lp).
    pub(crate) fn polynomial_planes(
        &mut self,
        path: &Path,
        basis: Basis,
    ) -> Result<Vec<(String, Arc<Texture>)>, Error> {
        if !is_lp(&path.to_string_lossy()) {
            let map = self.map_file(path, basis)?;
            let plane = |k: usize, c: usize| match &map.texels {
                PtmTexels::Lrgb { luminance, color } => coloured(luminance, color, k, c),
                PtmTexels::Rgb(all) => all[c].iter().map(|a| a[k] / WHITE).collect(),
            };
            return textures(path, (map.width, map.height), basis.terms(), plane);
        }
        match basis {
            Basis::Biquadratic => self.photographed_planes::<6>(path),
            Basis::Harmonics9 => self.photographed_planes::<9>(path),
            Basis::Harmonics16 => self.photographed_planes::<16>(path),
        }
    }

    fn photographed_planes<const N: usize>(
        &mut self,
        list: &Path,
    ) -> Result<Vec<(String, Arc<Texture>)>, Error> {
        let (mut sums, facts) = self.photographs::<N>(list, PolynomialKind::Rgb)?;
        // Each plane is given back once its texture is made.
        let plane = |k: usize, c: usize| {
            let mut plane = std::mem::take(&mut sums.of.planes[c][k]);
            plane.iter_mut().for_each(|a| *a /= WHITE);
            plane
        };
        textures(list, (facts.width, facts.height), N, plane)
    }

    /// A polynomial texture map of a file, which has six coefficients and no others.
    fn map_file(&mut self, path: &Path, basis: Basis) -> Result<Ptm, Error> {
        if basis != Basis::Biquadratic {
            let why = "holds biquadratic polynomials: spherical harmonics are fitted to photographs (.lp), for basis=";
            return Err(Error::usage(format!("{}: {why}{}", path.display(), basis.name())));
        }
        let map = read_ptm(path, &self.limits())?;
        self.note_input(path);
        self.note_source(Source::beside(path).as_ref());
        Ok(map)
    }

    /// A map derived from a polynomial texture map, or from the photographs that a list of lights names, by a
    /// basis: the direction of light in which each texel is brightest, as a tangent-space normal map, green
    /// up, or the reflected radiance there.
    pub fn polynomial_map(
        &mut self,
        path: &Path,
        part: PolynomialPart,
        basis: Basis,
    ) -> Result<Raster, Error> {
        if !is_lp(&path.to_string_lossy()) {
            let map = self.map_file(path, basis)?;
            let size = (map.width, map.height);
            return Ok(match &map.texels {
                PtmTexels::Lrgb { luminance, color } => mapped(size, |t| luminance[t], color, part),
                PtmTexels::Rgb(all) => {
                    let texel = |t: usize| {
                        let a = [0, 1, 2].map(|c| all[c][t].map(f64::from));
                        let grey: [f64; 6] =
                            std::array::from_fn(|k| (0..3).map(|c| LUMINANCE[c] * a[c][k]).sum());
                        let n = brightest(&grey).unwrap_or(DVec3::Z);
                        match part {
                            PolynomialPart::Normal => (0.5 + 0.5 * n).as_vec3().to_array(),
                            PolynomialPart::Albedo => a.map(|a| evaluate(&a, n).max(0.0) as f32 / WHITE),
                        }
                    };
                    raster(size, texel)
                }
            });
        }
        match basis {
            Basis::Biquadratic => self.photographed_map::<6>(path, part),
            Basis::Harmonics9 => self.photographed_map::<9>(path, part),
            Basis::Harmonics16 => self.photographed_map::<16>(path, part),
        }
    }

    fn photographed_map<const N: usize>(
        &mut self,
        list: &Path,
        part: PolynomialPart,
    ) -> Result<Raster, Error> {
        let (sums, facts) = self.photographs::<N>(list, PolynomialKind::Lrgb)?;
        let Polynomials { planes, color } = sums.of;
        let texel = |t: usize| std::array::from_fn::<f32, N, _>(|k| planes[0][k][t]);
        Ok(mapped((facts.width, facts.height), texel, &color.unwrap_or_default(), part))
    }
}

/// Polynomials of `N` coefficients a texel, in the file's units.
struct Sums<const N: usize> {
    of: Polynomials<N>,
    /// Relative RMS error of one colour a texel, where one was asked for.
    lost: f64,
}

/// Some texels of all photographs: how far each is from one colour.
#[derive(Default)]
struct Colours {
    /// `[photograph][texel]`
    seen: Vec<Vec<[f64; 3]>>,
}

impl Colours {
    fn add(&mut self, photograph: &Photograph) {
        let (w, h) = photograph.size();
        let texel = |k: usize| {
            let mut x = [[0.0f32]; 3];
            photograph.linear(k, x.each_mut().map(|x| &mut x[..]));
            x.map(|[x]| f64::from(x))
        };
        self.seen.push((0..w * h).step_by((w * h).div_ceil(LOOKED_AT).max(1)).map(texel).collect());
    }

    /// Relative RMS error of replacing each photograph by its luminance times the texel's colour over all
    /// photographs.
    fn lost(&self) -> f64 {
        let light = |x: &[f64; 3]| x.iter().zip(LUMINANCE).map(|(x, w)| x * w).sum::<f64>();
        let (mut off, mut all) = (0.0, 0.0);
        for k in 0..self.seen.first().map_or(0, Vec::len) {
            let sum = self.seen.iter().fold([0.0; 3], |s, p| [0, 1, 2].map(|c| s[c] + p[k][c].max(0.0)));
            let total = light(&sum).max(f64::MIN_POSITIVE);
            for x in self.seen.iter().map(|p| &p[k]) {
                for c in 0..3 {
                    off += (x[c] - light(x) * sum[c] / total).powi(2);
                    all += x[c] * x[c];
                }
            }
        }
        if all > 0.0 { (off / all).sqrt() } else { 0.0 }
    }
}

/// Coefficient `k` of a channel, white being 1.
fn coloured<const N: usize>(luminance: &[[f32; N]], color: &[[u8; 3]], k: usize, c: usize) -> Vec<f32> {
    let colour = |x: &[u8; 3]| f32::from(x[c]) / WHITE;
    luminance.iter().zip(color).map(|(a, x)| a[k] / WHITE * colour(x)).collect()
}

/// Textures of coefficients, with the suffixes .0, .1 …
fn textures(
    path: &Path,
    (width, height): (usize, usize),
    terms: usize,
    mut plane: impl FnMut(usize, usize) -> Vec<f32>,
) -> Result<Vec<(String, Arc<Texture>)>, Error> {
    let mut texture = |k: usize| {
        let t = Texture::new(width, height, &[plane(k, 0), plane(k, 1), plane(k, 2)]);
        let t = t.map(|t| Arc::new(t.with_wrap([Wrap::Clamp; 2])));
        t.ok_or_else(|| Error::input(format!("{}: is empty", path.display())))
    };
    (0..terms).map(|k| Ok((format!(".{k}"), texture(k)?))).collect()
}

/// The direction of light in which each texel is brightest, or the reflected radiance there.
fn mapped<const N: usize>(
    size: (usize, usize),
    luminance: impl Fn(usize) -> [f32; N] + Sync + Send,
    color: &[[u8; 3]],
    part: PolynomialPart,
) -> Raster {
    raster(size, |t| {
        let a = luminance(t).map(f64::from);
        let n = brightest(&a).unwrap_or(DVec3::Z);
        match part {
            PolynomialPart::Normal => (0.5 + 0.5 * n).as_vec3().to_array(),
            PolynomialPart::Albedo => {
                let l = evaluate(&a, n).max(0.0) / f64::from(WHITE);
                color[t].map(|c| (f64::from(c) / f64::from(WHITE) * l) as f32)
            }
        }
    })
}

fn raster((width, height): (usize, usize), texel: impl Fn(usize) -> [f32; 3] + Sync + Send) -> Raster {
    let all: Vec<[f32; 3]> = (0..width * height).into_par_iter().map(texel).collect();
    let planes = [0, 1, 2].map(|c| all.iter().map(|x| x[c]).collect());
    Raster::rgb(width, height, planes)
}
