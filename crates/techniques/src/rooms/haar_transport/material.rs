//! The reflectance's factor: an albedo, or any reflectance that a fixed view looks at.

use super::params::{Fix, Params};
use crate::Part;
use crate::certify;
use crate::shared::light::sh_light::Albedo;
use crate::shared::material::reflectance::{kept, one_sided, put};
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use glam::DVec3;
use steradian_brdf::{Brdf, Form, SharedBrdf};
use steradian_sphere::sampling::{hammersley, hemisphere};

/// A material.
pub enum Matter {
    /// Lambert's: its transport is that of all views.
    Lambert(Albedo),
    /// Any other one.
    Glossy(Glossy),
}

/// A reflectance whose transport is made for a view.
#[derive(Clone)]
pub struct Glossy {
    pub brdf: SharedBrdf,
    /// What the first channel is multiplied by in each one, where all are proportional.
    pub tint: Option<[f32; 3]>,
}

/// Takes Lambert's reflectance.
pub fn lambert(brdf: &dyn Brdf) -> Result<(), String> {
    match brdf.form() {
        Form::Lambert { .. } => Ok(()),
        _ => Err(format!(
            "takes lambert only, not {}; with fix=view it takes any reflectance, for one camera",
            brdf.info().name
        )),
    }
}

/// Takes what bakes with these parameters do.
pub fn takes(brdf: &dyn Brdf, p: &Params) -> Result<(), String> {
    if p.fix() == Fix::Nothing || lambert(brdf).is_ok() {
        return lambert(brdf);
    }
    if p.bounces > 1 {
        let name = brdf.info().name;
        return Err(format!(
            "bounces={}: what surfaces of {name} reflect to each other goes towards each other, not towards the \
             camera: leave bounces out, or use lambert",
            p.bounces
        ));
    }
    one_sided(brdf)?;
    certify::measurable(brdf)
}

impl Matter {
    pub fn of(brdf: &SharedBrdf) -> Self {
        match brdf.form() {
            Form::Lambert { .. } => Self::Lambert(Albedo::of(&**brdf)),
            _ => Self::Glossy(Glossy { brdf: brdf.clone(), tint: tint(&**brdf) }),
        }
    }
}

/// The factors of the channels, where all are proportional: looked at for views and lights all over the
/// hemisphere, and where lobes point.
fn tint(brdf: &dyn Brdf) -> Option<[f32; 3]> {
    const VIEWS: u32 = 64;
    const LIGHTS: u32 = 64;
    let mut seen = Vec::new();
    for k in 0..VIEWS {
        let wo = hemisphere::sample(hammersley(k, VIEWS));
        let mut wi: Vec<DVec3> = (0..LIGHTS).map(|j| hemisphere::sample(hammersley(j, LIGHTS))).collect();
        wi.extend(brdf.lobes(wo).iter().filter_map(|l| match *l {
            steradian_brdf::Lobe::Axis { axis, .. } => Some(axis),
            _ => None,
        }));
        wi.push(DVec3::new(-wo.x, -wo.y, wo.z));
        let mut f = vec![[0.0; 3]; wi.len()];
        brdf.f_cos_batch(&wi, wo, &mut f);
        seen.extend(f);
    }
    let product = |c: usize| seen.iter().map(|f| f[0] * f[c]).sum::<f64>();
    let square = product(0);
    if square.is_nan() || square <= 0.0 {
        return None;
    }
    let tint = [1.0, product(1) / square, product(2) / square];
    let alike = |f: &[f64; 3]| (1..3).all(|c| (f[c] - tint[c] * f[0]).abs() <= 1e-6 * f[0].abs());
    seen.iter().all(alike).then(|| tint.map(|t| t as f32))
}

impl Part for Matter {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        match self {
            Self::Lambert(albedo) => albedo.save(to, prefix),
            Self::Glossy(g) => {
                put(to, &format!("steradian.{prefix}.brdf"), &*g.brdf);
                let tint = g.tint.map_or_else(Vec::new, |t| t.map(f64::from).to_vec());
                put_f64(to, format!("{prefix}.tint"), vec![tint.len()], tint);
            }
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let key = format!("steradian.{prefix}.brdf");
        if !from.metadata.contains_key(&key) {
            return Ok(Self::Lambert(Albedo::load(from, prefix)?));
        }
        let brdf = kept(from, &key)?;
        let name = format!("{prefix}.tint");
        let tint = match *get_f64(from, &name, 1)?.1 {
            [] => None,
            [a, b, c] => Some([a, b, c].map(|x| x as f32)),
            _ => return Err(PartError::Unexpected(name)),
        };
        // A file that was edited may name what no bake takes.
        if lambert(&*brdf).is_ok() || one_sided(&*brdf).is_err() || certify::measurable(&*brdf).is_err() {
            return Err(PartError::Unexpected(key));
        }
        Ok(Self::Glossy(Glossy { brdf, tint }))
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Lambert(albedo) => albedo.bytes(),
            Self::Glossy(_) => 0,
        }
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        match self {
            Self::Lambert(_) => None,
            Self::Glossy(g) => Some(&*g.brdf),
        }
    }
}
