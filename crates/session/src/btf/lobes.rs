//! Lobes by texel from pictures.

use crate::{Error, Session};
use std::path::Path;
use steradian_formats::{Raster, WriteOptions};
use steradian_relight::lobes::{self, Lobe};

/// Lobes of a texel at most, as many as `lafortune_svbrdf` reads images of.
pub const MOST_LOBES: usize = 2;

/// Facts of lobes fitted to pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct LobeFacts {
    /// Width in texels.
    pub width: usize,
    /// Height in texels.
    pub height: usize,
    /// Pictures.
    pub pictures: usize,
    /// Relative RMS error of all pictures, of the pixels' values.
    pub error: f64,
    /// The images that were written, in the folder.
    pub files: Vec<String>,
}

impl Session {
    /// Fits lobes, texel by texel, to the pictures that a list (.csv) names, and writes them as the images
    /// that `lafortune_svbrdf` reads: `rho_d.exr`, and `rho_k.exr`, `c_k.exr` and `n_k.exr` of the lobes from
    /// k = 1, into a folder.
    pub fn fit_lobes(&mut self, list: &Path, count: usize, folder: &Path) -> Result<LobeFacts, Error> {
        let btf = self.btf(list)?;
        self.spares_in(folder, |file| {
            let image = |name: &str| file == Path::new(name);
            image("rho_d.exr")
                || (1..=count).any(|k| ["rho", "c", "n"].iter().any(|n| image(&format!("{n}_{k}.exr"))))
        })?;
        let (width, height) = btf.size();
        self.task.begin("lobes", btf.texels() as u64);
        let task = &self.task;
        let go_on = || {
            task.advance(1);
            task.check().is_ok()
        };
        let all = lobes::of_btf(&btf, count, &go_on);
        self.task.check()?;
        self.task.end();
        let all = all.ok_or_else(|| Error::failed("lobes were not fitted"))?;
        std::fs::create_dir_all(folder)
            .map_err(|e| Error::failed(format!("{}: cannot be written: {e}", folder.display())))?;
        let mut files = Vec::new();
        let mut write = |name: String, texel: &dyn Fn(usize) -> [f64; 3]| -> Result<(), Error> {
            let planes = [0, 1, 2].map(|c| (0..all.len()).map(|x| texel(x)[c] as f32).collect());
            let raster = Raster::rgb(width, height, planes);
            self.write_image(&folder.join(&name), &raster, WriteOptions::default())?;
            files.push(name);
            Ok(())
        };
        write("rho_d.exr".into(), &|x| all[x].rho_d)?;
        for k in 0..count {
            let of = |x: usize| -> &Lobe { &all[x].lobes[k] };
            let name = |what: &str| format!("{what}_{}.exr", k + 1);
            write(name("rho"), &|x| of(x).rho)?;
            write(name("c"), &|x| of(x).c.to_array())?;
            write(name("n"), &|x| [of(x).n; 3])?;
        }
        Ok(LobeFacts { width, height, pictures: btf.pairs(), error: lobes::error(&all), files })
    }
}
