//! The report in words and as JSON.

use super::Verified;
use super::words::factor;
use glam::DMat3;
use serde_json::{Value, json};
use steradian_verify::orientation::{FACES, Orientation, TURNS, map_name};
use steradian_verify::{Error, Fault, Kernel, Level, Reading};

fn error_json(e: &Error) -> Value {
    json!({"rms": e.rms, "bias": e.bias, "worst": e.worst})
}

fn kernel_json(k: Kernel) -> Value {
    json!({
        "kernel": k.family.name(),
        "perceptual_roughness": k.roughness(),
        "alpha": k.roughness().map(|r| r * r),
        "exponent": k.exponent(),
    })
}

/// The map from world directions (x, y, z) to the file's directions, as JSON.
fn turn_json(turn: &Orientation) -> Value {
    match turn {
        Orientation::Axes(g) => {
            json!({"name": turn.name(), "map": map_name(*g), "matrix": g.transpose().to_cols_array()})
        }
        Orientation::Faces(from) => {
            let face = |(f, (world, q)): (usize, &(usize, usize))| json!({"face": FACES[f], "holds": FACES[*world], "turned": TURNS[*q]});
            let faces: Vec<Value> = from.iter().enumerate().map(face).collect();
            json!({"name": turn.name(), "faces": faces})
        }
    }
}

fn gain(l: &Level) -> f64 {
    l.scale.iter().sum::<f64>() / 3.0
}

fn level_json(m: usize, l: &Level, turn: &Orientation) -> Value {
    json!({
        "level": m,
        "width": l.width,
        "height": l.height,
        "layout": l.layout.name(),
        "expected": kernel_json(l.expected),
        "found": kernel_json(l.found),
        "kernel_as_expected": l.found == l.expected,
        "residual": l.residual,
        "expected_residual": l.expected_residual,
        "orientation": turn_json(turn),
        "scale": gain(l),
        "scale_rgb": l.scale,
        "scale_name": factor(gain(l)),
        "error": error_json(&l.error),
        "error_as_found": error_json(&l.error_as_found),
    })
}

/// One word for scripts.
fn kind(f: &Fault) -> &'static str {
    match f {
        Fault::Turned(..) => "turned",
        Fault::Channels(_) => "channels",
        Fault::Curve(_) => "curve",
        Fault::Kernels(_) => "kernels",
        Fault::Light(_) => "light",
        Fault::Scale(..) => "scale",
        Fault::Encoded(_) => "encoding",
        Fault::Damaged { .. } => "damaged",
        Fault::Limited { .. } => "limited",
        Fault::Seams(_) => "seams",
        Fault::Noise(_) => "noise",
        Fault::Coarse(..) => "coarse",
        Fault::OtherLight => "other-light",
        Fault::Unexplained(..) => "unexplained",
        Fault::Remains(_) => "remains",
    }
}

impl Verified {
    /// Faults, in sentences.
    pub fn faults(&self) -> Vec<String> {
        self.findings().iter().map(ToString::to_string).collect()
    }

    /// Report as JSON.
    pub fn document(&self) -> Value {
        let r = &self.report;
        let worst = r.worst();
        json!({
            "file": self.file,
            "profile": self.profile,
            "levels": r.levels.iter().enumerate().map(|(m, l)| level_json(m, l, &r.orientation)).collect::<Vec<_>>(),
            "irradiance_coefficients": self.irradiance.map(|s| json!({
                "scale": s.scale, "scale_name": factor(s.scale), "rms": s.rms, "rms_as_found": s.fitted_rms,
            })),
            "light_texels": r.reading.map(Reading::name),
            "kinds": r.faults.iter().map(kind).collect::<Vec<_>>(),
            "faults": self.faults(),
            "error": worst,
            "tolerance": self.tolerance,
            "within_tolerance": self.tolerance.map(|t| worst <= t),
        })
    }

    /// Report in words.
    pub fn text(&self) -> String {
        let mut out = format!(
            "profile {}; per level: what it holds (what is expected), factor, relative RMS error against what is\n\
             expected (bias, worst texel), and against what it holds\n",
            self.profile
        );
        for (m, l) in self.report.levels.iter().enumerate() {
            let name = |k: Kernel| format!("{} {}", k.family.name(), k.describe());
            let (kernel, e, f) =
                (format!("{} ({})", name(l.found), name(l.expected)), l.error, l.error_as_found);
            out.push_str(&format!(
                "{m:2}  {:>4} x {:<4} {kernel:<36} x {:.4}  {:.2e} ({:+.1e}, {:.1e})  {:.2e}\n",
                l.width,
                l.height,
                gain(l),
                e.rms,
                e.bias,
                e.worst,
                f.rms
            ));
        }
        if self.report.orientation != Orientation::Axes(DMat3::IDENTITY) {
            out.push_str(&format!("orientation: {}\n", self.report.orientation.name()));
        }
        if let Some(sh) = self.irradiance {
            out.push_str(&format!("irradiance coefficients: x {:.4}, {:.2e} off\n", sh.scale, sh.rms));
        }
        let faults = self.faults();
        if faults.is_empty() {
            out.push_str("as expected\n");
        }
        faults.iter().for_each(|f| out.push_str(&format!("fault: {f}\n")));
        out
    }
}
