//! The suns of a whole light: disk lights, and suns in its image.

use super::{SunOptions, extract, luminance};
use crate::{DiskLight, Environment, Lights};
use serde_json::{Value, json};
use std::sync::Arc;

/// Suns that were taken out of a light.
#[derive(Debug, Clone, PartialEq)]
pub struct Taken {
    /// The suns: those that were disks already, then those of the image, the strongest first.
    pub suns: Vec<DiskLight>,
    /// Part of the whole luminous flux that each of them holds.
    pub shares: Vec<f64>,
    /// Largest relative change of a texel outside the regions of the suns.
    pub change: f64,
    /// Largest relative deviation of flux and vector flux of a channel from those of the original.
    pub deviation: f64,
}

/// Takes the suns out of `lights`: disk lights (of a sky), and suns in the image.
pub fn take(lights: &mut Lights) -> Taken {
    let known = std::mem::take(&mut lights.disks);
    let mut out = Taken { suns: known, shares: Vec::new(), change: 0.0, deviation: 0.0 };
    let image = lights.environment.as_ref().map(|e| e.image.clone());
    let flux = |d: &DiskLight| luminance(d.radiance) * d.solid_angle();
    let inside = image.as_ref().map_or(0.0, |i| luminance(i.integral()));
    let whole = inside + out.suns.iter().map(flux).sum::<f64>();
    if let Some(image) = image {
        let e = extract(&image, &SunOptions::default());
        lights.environment = Some(Arc::new(Environment { image: e.sunless }));
        out.suns.extend(e.suns);
        (out.change, out.deviation) = (e.change, e.deviation);
    }
    out.shares = out.suns.iter().map(|d| if whole > 0.0 { flux(d) / whole } else { 0.0 }).collect();
    out
}

/// A disk in a file of lights.
fn entry(d: &DiskLight) -> Value {
    let area = std::f64::consts::PI * d.angular_radius.sin().powi(2);
    json!({
        "kind": "disk",
        "direction": d.direction.to_array(),
        "angular_radius_degrees": d.angular_radius.to_degrees(),
        "solid_angle": d.solid_angle(),
        "irradiance": d.radiance.map(|l| l * area),
        "radiance": d.radiance,
    })
}

impl DiskLight {
    /// The document of a file of these disks that [`crate::Lamp::read`] reads.
    pub fn document(disks: &[Self]) -> Value {
        json!({ "lights": disks.iter().map(entry).collect::<Vec<_>>() })
    }
}

impl Taken {
    /// What was found, in words, line by line.
    pub fn lines(&self) -> Vec<String> {
        if self.suns.is_empty() {
            return vec!["no sun found: nothing in the light is small, round and bright enough".into()];
        }
        let line = |(d, share): (&DiskLight, &f64)| {
            let [x, y, z] = d.direction.to_array();
            let degrees = d.angular_radius.to_degrees();
            let percent = 100.0 * share;
            format!(
                "sun at ({x:.4}, {y:.4}, {z:.4}), angular radius {degrees:.3} degrees, {percent:.1} % of the flux"
            )
        };
        self.suns.iter().zip(&self.shares).map(line).collect()
    }

    /// The document of a file that [`crate::Lamp::read`] reads.
    pub fn json(&self) -> Value {
        let light = |(d, share): (&DiskLight, &f64)| {
            let mut entry = entry(d);
            entry["share_of_flux"] = json!(share);
            entry
        };
        json!({
            "lights": self.suns.iter().zip(&self.shares).map(light).collect::<Vec<_>>(),
            "largest_change_elsewhere": self.change,
            "moment_deviation": self.deviation,
        })
    }

    /// For files: the lights in one line.
    pub fn metadata(&self) -> (String, String) {
        let lights = self.json().get("lights").map(Value::to_string).unwrap_or_default();
        ("steradian.suns".into(), lights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lamp;
    use glam::DVec3;

    #[test]
    fn what_is_written_is_what_is_read() {
        let d = DiskLight {
            direction: DVec3::new(0.6, 0.64, 0.48),
            angular_radius: 0.0061,
            radiance: [3e4, 2e4, 1.7e4],
        };
        let taken = Taken { suns: vec![d], shares: vec![0.5], change: 0.0, deviation: 0.0 };
        let json = taken.json();
        let back = crate::lamps::lamps(&json.to_string()).expect("lights");
        let [Lamp::Disk(back)] = back[..] else { panic!("a disk") };
        assert!((back.angular_radius / d.angular_radius - 1.0).abs() < 1e-14);
        (0..3).for_each(|c| assert!((back.radiance[c] / d.radiance[c] - 1.0).abs() < 1e-13));
    }
}
