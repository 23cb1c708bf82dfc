//! Light fields as named tensors.

use super::{MAX_BANDS, Places, Probe, Probes};
use crate::lights::sound;
use glam::{DVec3, UVec3};
use steradian_formats::{Tensor, TensorData, TensorFile};
use steradian_sphere::sh::ShRgb;
use steradian_sphere::{Layout, SphereImage};
use thiserror::Error;

/// What is wrong with a file of probes.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("no light field: {0}")]
pub struct NoProbes(String);

/// Key of the metadata that says the form of the file.
const FORM: (&str, &str) = ("steradian.probes", "1");
/// Key of the number of bands.
const BANDS: &str = "steradian.probes.bands";

impl Probes {
    /// As tensors: `sh` (probes, 3, bands²), zeros inside solids; `outside` (probes), 1 or 0; of a grid
    /// `bounds` (2, 3) and `size` (3), else `positions` (probes, 3); where there are images, `image` (probes,
    /// 3, height, width).
    pub fn tensors(&self) -> TensorFile {
        let bands = self.bands().max(1);
        let (n, count) = (self.light.len(), bands * bands);
        let mut sh = Vec::with_capacity(n * 3 * count);
        for light in &self.light {
            match light {
                Some(light) => sh.extend(light.sh.c.iter().flatten()),
                None => sh.resize(sh.len() + 3 * count, 0.0),
            }
        }
        let outside = self.light.iter().map(|l| u32::from(l.is_some())).collect();
        let mut file = TensorFile::default();
        let whole = |data: Vec<u32>| Tensor { shape: vec![data.len()], data: TensorData::U32(data) };
        let mut put = |name: &str, tensor: Tensor| file.tensors.insert(name.into(), tensor);
        put("sh", Tensor::f64([n, 3, count], sh));
        put("outside", whole(outside));
        match &self.places {
            Places::Grid { bounds, size } => {
                put("bounds", Tensor::f64([2, 3], bounds.iter().flat_map(|b| b.to_array()).collect()));
                put("size", whole(size.to_array().to_vec()));
            }
            Places::Points(p) => {
                put("positions", Tensor::f64([n, 3], p.iter().flat_map(|p| p.to_array()).collect()));
            }
        }
        if let Some((w, h)) = self.image_size() {
            let mut texels = Vec::with_capacity(n * 3 * w * h);
            for light in &self.light {
                match light.as_ref().and_then(|l| l.image.as_ref()) {
                    Some(image) => texels.extend(image.planes.iter().flatten()),
                    None => texels.resize(texels.len() + 3 * w * h, 0.0),
                }
            }
            put("image", Tensor::f32([n, 3, h, w], texels));
        }
        file.metadata.insert(FORM.0.into(), FORM.1.into());
        file.metadata.insert(BANDS.into(), bands.to_string());
        file
    }

    /// Do the tensors say that they are a light field?
    pub fn is_one(file: &TensorFile) -> bool {
        file.metadata.get(FORM.0).is_some_and(|f| f == FORM.1)
    }

    /// What [`Probes::tensors`] made.
    ///
    /// # Errors
    /// If a tensor is missing, of another shape than the others say, or not finite.
    pub fn read(file: &TensorFile) -> Result<Self, NoProbes> {
        if !Self::is_one(file) {
            return Err(NoProbes("holds no probes: steradian probes writes them".into()));
        }
        let tensor = |name: &str| file.require(name).map_err(NoProbes);
        let places = places(file)?;
        let TensorData::U32(outside) = &tensor("outside")?.data else {
            return Err(wrong("'outside' is of whole numbers"));
        };
        let sh = tensor("sh")?;
        let &[probes, 3, count] = sh.shape.as_slice() else {
            return Err(wrong("'sh' is of probes, 3 channels and squares of bands"));
        };
        let n = places.count();
        if n != Some(probes) || probes == 0 || outside.len() != probes {
            return Err(NoProbes(format!(
                "its places are {}, its probes {probes} and {}",
                n.map_or("beyond number".into(), |n| n.to_string()),
                outside.len()
            )));
        }
        let bands = count.isqrt();
        if bands == 0 || bands > MAX_BANDS || bands * bands != count {
            return Err(NoProbes(format!("{count} coefficients are no square of 1 to {MAX_BANDS} bands")));
        }
        let said = file.metadata.get(BANDS);
        if let Some(said) = said.filter(|b| b.parse() != Ok(bands)) {
            return Err(NoProbes(format!("says {said} bands and holds {bands}")));
        }
        let values = sh.data.to_f64();
        if let Some(k) = values.iter().position(|v| !sound(*v)) {
            let why =
                format!("probe {} holds {:e}: light is finite, and 1e30 at most", k / (3 * count), values[k]);
            return Err(NoProbes(why));
        }
        let images = images(file, probes)?;
        let probe = |(k, v): (usize, &[f64])| {
            let sh = ShRgb { order: bands - 1, c: [0, 1, 2].map(|c| v[c * count..(c + 1) * count].to_vec()) };
            Some(Probe { sh, image: images.as_ref().map(|all| all[k].clone()) }).filter(|_| outside[k] != 0)
        };
        let light = values.chunks_exact(3 * count).enumerate().map(probe).collect();
        Ok(Self { places, light })
    }
}

fn wrong(why: &str) -> NoProbes {
    NoProbes(why.into())
}

fn places(file: &TensorFile) -> Result<Places, NoProbes> {
    let numbers = |name: &str| -> Result<Vec<f64>, NoProbes> {
        let t = file.require(name).map_err(NoProbes)?;
        if t.shape.len() != 2 || t.shape[1] != 3 {
            return Err(NoProbes(format!("'{name}' is of rows of 3 numbers")));
        }
        let v = t.data.to_f64().to_vec();
        if v.iter().all(|x| x.abs() <= 1e15) {
            Ok(v)
        } else {
            Err(NoProbes(format!("'{name}' is not finite, or beyond 1e15")))
        }
    };
    if file.tensors.contains_key("positions") {
        let p = numbers("positions")?;
        return Ok(Places::Points(p.chunks_exact(3).map(DVec3::from_slice).collect()));
    }
    let bounds = numbers("bounds")?;
    let &[a, b, c, d, e, f] = bounds.as_slice() else { return Err(wrong("'bounds' are 6 numbers")) };
    let TensorData::U32(size) = &file.require("size").map_err(NoProbes)?.data else {
        return Err(wrong("'size' is of whole numbers"));
    };
    let &[x, y, z] = size.as_slice() else { return Err(wrong("'size' is 3 numbers")) };
    let bounds = [DVec3::new(a, b, c), DVec3::new(d, e, f)];
    if bounds[0].cmpgt(bounds[1]).any() {
        return Err(wrong("its bounds end before they begin"));
    }
    Ok(Places::Grid { bounds, size: UVec3::new(x, y, z) })
}

fn images(file: &TensorFile, probes: usize) -> Result<Option<Vec<SphereImage>>, NoProbes> {
    let Some(t) = file.tensors.get("image") else { return Ok(None) };
    let &[n, 3, h, w] = t.shape.as_slice() else {
        return Err(wrong("'image' is of probes, 3 channels, rows and columns"));
    };
    if n != probes || w == 0 || h == 0 {
        return Err(NoProbes(format!("{n} images of {w} x {h} for {probes} probes")));
    }
    let values = t.data.to_f32();
    if let Some(k) = values.iter().position(|v| !sound(f64::from(*v))) {
        let why = format!(
            "the image of probe {} holds {:e}: light is finite, and 1e30 at most",
            k / (3 * w * h),
            values[k]
        );
        return Err(NoProbes(why));
    }
    let image = |v: &[f32]| {
        let mut image = SphereImage::new(Layout::LatLong, w, h);
        for (plane, v) in image.planes.iter_mut().zip(v.chunks_exact(w * h)) {
            plane.copy_from_slice(v);
        }
        image
    };
    Ok(Some(values.chunks_exact(3 * w * h).map(image).collect()))
}
