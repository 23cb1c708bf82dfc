//! Bidirectional texture functions: their pictures, and surfaces whose pictures are computed.

mod capture;
mod lobes;
mod mark;

pub use capture::{Captured, FORMATS, MOST_DIRECTIONS, Shape, Surface};
pub use lobes::{LobeFacts, MOST_LOBES};
pub use mark::Source;
pub use steradian_relight::height::Pattern;

use crate::inputs::all_finite;
use crate::scene::below;
use crate::{Error, Session};
use glam::DVec3;
use std::path::Path;
use steradian_formats::{BtfList, Raster, read_btf, read_image};
use steradian_parallel::prelude::*;
use steradian_relight::btf::{Btf, BtfError, Pairing, around, spread};

/// Facts of a list of pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct BtfFacts {
    /// Pictures.
    pub pictures: usize,
    /// Views.
    pub views: usize,
    /// Lights.
    pub lights: usize,
    /// Width and height of the first picture; all must have them.
    pub size: (usize, usize),
    /// Largest angle of a view from the normal, and of a light, degrees.
    pub angles: [f64; 2],
    /// Where they come from, by the list, or by the record of the capture in its folder.
    pub source: Option<Source>,
}

/// The directions to light and viewer of each picture.
fn directions(list: &BtfList) -> Vec<(DVec3, DVec3)> {
    let of = |[theta, phi]: [f64; 2]| around(theta.to_radians(), phi.to_radians());
    list.pictures.iter().map(|p| (of(p.light), of(p.view))).collect()
}

/// Why the pictures of a list are no function, by their names.
fn fault(path: &Path, list: &BtfList, e: BtfError) -> Error {
    let name = |k: usize| &list.pictures[k].file;
    match e {
        BtfError::Twice(a, b) => {
            let why = format!("{} and {} are of the same view and light", name(a), name(b));
            Error::input(format!("{}: {why}", path.display()))
        }
        e => Error::input(format!("{}: {e}", path.display())),
    }
}

/// Refuses a list that lacks all pictures of a view or of a light, where every view that is left has every
/// light. The record of a capture says which pictures there should be. Other lists are refused where most
/// directions of the light have a view and every view is one of them: such sets look from where they light.
fn complete(path: &Path, list: &BtfList, pairing: &Pairing) -> Result<(), Error> {
    let name = |d: DVec3| {
        let [theta, phi] = capture::angles(d);
        format!("theta {theta:.2}, phi {phi:.2}")
    };
    let rows = list.pictures.len();
    if let Some([views, lights]) = mark::captured(path) {
        let sides = [("views", "view", &pairing.views, views), ("lights", "light", &pairing.lights, lights)];
        for (many, one, found, count) in sides {
            let lost = not_found(found, count);
            if let Some(first) = lost.first() {
                let why = format!(
                    "lacks {} of the {count} {many} that were captured, the {one} at {} the first: {} of {} rows are missing",
                    lost.len(),
                    name(*first),
                    (views * lights).saturating_sub(rows),
                    views * lights
                );
                return Err(Error::input(format!("{}: {why}", path.display())));
            }
        }
        return Ok(());
    }
    let unseen = pairing.unseen();
    let Some(first) = unseen.first() else { return Ok(()) };
    let why = format!(
        "lacks {} of the views: light comes from {} directions, of which all but these have a view, the one at {} the \
         first: {} rows are missing",
        unseen.len(),
        pairing.lights.len(),
        name(*first),
        unseen.len() * pairing.lights.len()
    );
    Err(Error::input(format!("{}: {why}", path.display())))
}

/// The directions of a capture that are not among those found.
fn not_found(found: &[DVec3], count: usize) -> Vec<DVec3> {
    if found.len() >= count {
        return Vec::new();
    }
    let all = spread(count).into_iter();
    // Angles of a list are rounded.
    all.filter(|d| !found.iter().any(|f| f.distance(*d) < 1e-6)).collect()
}

impl Session {
    /// One picture: its planes.
    fn picture(&self, folder: &Path, name: &str) -> Result<(usize, usize, [Vec<f32>; 3]), Error> {
        let file = below(folder, name)?;
        let raster: Raster = all_finite(&file, read_image(&file, &self.limits())?)?;
        let (w, h) = (raster.width, raster.height);
        let planes = raster.into_rgb();
        planes.map(|p| (w, h, p)).ok_or_else(|| Error::input(format!("{}: has no colour", file.display())))
    }

    /// The function whose pictures a list (.csv) names, in its folder or below, in half precision.
    pub fn btf(&mut self, path: &Path) -> Result<Btf, Error> {
        let list = read_btf(path, &self.limits())?;
        self.note_input(path);
        let pairing = Pairing::new(&directions(&list)).map_err(|e| fault(path, &list, e))?;
        complete(path, &list, &pairing)?;
        self.note_source(Source::of_list(&list, path).as_ref());
        let folder = path.parent().unwrap_or(Path::new(""));
        list.pictures.iter().for_each(|p| self.reads(&folder.join(&p.file)));
        let (views, lights) = (pairing.views.len(), pairing.lights.len());
        let (width, height, _) = self.picture(folder, &list.pictures[0].file)?;
        let bytes = (width as u64 * height as u64).saturating_mul(6 * list.pictures.len() as u64);
        if bytes > self.task.max_memory() {
            let why = format!(
                "{} pictures of {width} x {height} texels take {} MiB",
                list.pictures.len(),
                bytes >> 20
            );
            return Err(Error::failed(format!("{}: {why}: raise `max-memory`", path.display())));
        }
        let made = Btf::new((width, height), &pairing.views, &pairing.lights, true);
        let mut btf = made.map_err(|e| fault(path, &list, e))?;
        self.task.begin("pictures", list.pictures.len() as u64);
        for v in 0..views {
            self.task.check()?;
            let names: Vec<&str> =
                (0..lights).map(|l| list.pictures[pairing.pictures[v * lights + l]].file.as_str()).collect();
            let this = &*self;
            let read: Vec<Result<_, Error>> =
                names.par_iter().with_max_len(1).map(|name| this.picture(folder, name)).collect();
            for (l, picture) in read.into_iter().enumerate() {
                let ((w, h, planes), name) = (picture?, names[l]);
                if (w, h) != (width, height) {
                    let first = &list.pictures[0].file;
                    let why = format!("is {w} x {h} where {first} is {width} x {height}");
                    return Err(Error::input(format!("{}: {why}", folder.join(name).display())));
                }
                let set = btf.set(v, l, [&planes[0], &planes[1], &planes[2]]);
                set.map_err(|e| Error::input(format!("{}: {e}", folder.join(name).display())))?;
            }
            self.task.advance(lights as u64);
        }
        self.task.end();
        Ok(btf)
    }

    /// Facts of a list of pictures; checks that all exist, and reads the first.
    pub fn inspect_btf(&mut self, path: &Path) -> Result<BtfFacts, Error> {
        let list = read_btf(path, &self.limits())?;
        self.note_input(path);
        let pairing = Pairing::new(&directions(&list)).map_err(|e| fault(path, &list, e))?;
        complete(path, &list, &pairing)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        for p in &list.pictures {
            let file = below(folder, &p.file)?;
            if !file.is_file() {
                return Err(Error::input(format!("{}: no such file", file.display())));
            }
        }
        let (width, height, _) = self.picture(folder, &list.pictures[0].file)?;
        let largest =
            |all: &[DVec3]| all.iter().map(|d| d.z.min(1.0).acos().to_degrees()).fold(0.0, f64::max);
        Ok(BtfFacts {
            pictures: list.pictures.len(),
            views: pairing.views.len(),
            lights: pairing.lights.len(),
            size: (width, height),
            angles: [largest(&pairing.views), largest(&pairing.lights)],
            source: Source::of_list(&list, path),
        })
    }
}
