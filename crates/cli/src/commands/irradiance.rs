//! `steradian irradiance`: SH coefficients of radiance and irradiance, or a diffuse map.

use crate::context::Context;
use crate::failure::Outcome;
use crate::inputs::{self, Adjust};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use steradian_sphere::sh::ShRgb;

/// Options of `steradian irradiance`.
#[derive(Debug, Args)]
pub struct Options {
    /// Image or sky spec
    #[arg(value_name = "ENV")]
    environment: String,
    #[command(flatten)]
    adjust: Adjust,
    /// Bands of spherical harmonics; 3 bands are orders 0 to 2, 9 coefficients
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=512))]
    bands: u16,
    /// Output file, as text or with --json as JSON [default: standard output]
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let order = usize::from(o.bands) - 1;
    let radiance = inputs::light_coefficients(&o.environment, &o.adjust, order, context)?;
    let mut irradiance = radiance.clone();
    irradiance.convolve(&inputs::cosine(usize::from(o.bands)));
    let text = if context.common.json {
        context.json_text(json!({
            "bands": o.bands,
            "order": o.bands - 1,
            "radiance": rows(&radiance),
            "irradiance": rows(&irradiance),
        }))
    } else {
        table(&radiance, &irradiance)
    };
    context.write_text(o.output.as_deref(), &text)
}

fn rows(sh: &ShRgb) -> Vec<[f64; 3]> {
    (0..sh.c[0].len()).map(|i| std::array::from_fn(|k| sh.c[k][i])).collect()
}

fn table(radiance: &ShRgb, irradiance: &ShRgb) -> String {
    let mut out =
        String::from("l,m,radiance_r,radiance_g,radiance_b,irradiance_r,irradiance_g,irradiance_b\n");
    let all = rows(radiance).into_iter().zip(rows(irradiance)).enumerate();
    for (i, (a, b)) in all {
        let l = i.isqrt();
        let m = i as i64 - (l * l + l) as i64;
        let numbers: Vec<String> = a.iter().chain(&b).map(|v| format!("{v:.9}")).collect();
        out.push_str(&format!("{l},{m},{}\n", numbers.join(",")));
    }
    out
}
