//! The light's factor of techniques that shade suns exactly: [`SunlitSpectrum`].

use super::spectrum::{self, Spectrum};
use super::sun::{BYTES, load_suns, save_suns};
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Part};
use steradian_base::Task;
use steradian_light::Lights;
pub use steradian_prefilter::SunlitSpectrum;

/// Analyses everything in `lights` up to `order`; refuses point lights.
pub fn bake(
    slug: &'static str,
    lights: &Lights,
    order: usize,
    task: &Task,
) -> Result<SunlitSpectrum, BakeError> {
    spectrum::check(slug, lights, task)?;
    Ok(SunlitSpectrum::new(lights, order, task)?)
}

impl Part for SunlitSpectrum {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        spectrum::save(&self.spectrum, to, prefix);
        save_suns(&self.suns, to, format!("{prefix}.suns"));
        put_f64(to, format!("{prefix}.beyond"), vec![3], self.beyond.to_vec());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.beyond");
        let (_, beyond) = get_f64(from, &name, 1)?;
        let beyond = <[f64; 3]>::try_from(beyond).ok().filter(|b| b.iter().all(|x| *x >= 0.0));
        Ok(Self {
            spectrum: Spectrum::load(from, prefix)?.sh,
            suns: load_suns(from, &format!("{prefix}.suns"))?,
            beyond: beyond.ok_or(PartError::Unexpected(name))?,
        })
    }

    fn bytes(&self) -> usize {
        spectrum::bytes(&self.spectrum) + 2 * BYTES * self.suns.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::trials::lights;

    #[test]
    fn a_saved_one_is_the_same() {
        let made = bake("test", &lights::sunny(), 20, &Task::quiet()).expect("bakes");
        assert!(!made.suns.is_empty());
        let mut file = TensorFile::default();
        made.save(&mut file, "light");
        assert_eq!(SunlitSpectrum::load(&file, "light"), Ok(made));
    }
}
