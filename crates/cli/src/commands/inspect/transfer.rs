//! What a file of transfer is.

use super::{Report, file_name};
use crate::context::Context;
use crate::failure::Failure;
use serde_json::{Value, json};
use std::path::Path;

/// The report on a file of transfer; `None` where `what` is something else.
pub fn report(what: &str, context: &mut Context) -> Result<Option<Report>, Failure> {
    let path = Path::new(what);
    if !what.to_lowercase().ends_with(".safetensors") || !path.is_file() {
        return Ok(None);
    }
    let Some((saved, file)) = context.saved_transfer(path)? else { return Ok(None) };
    let x = &saved.transfer;
    let [t, v] = x.worst_error();
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / x.len().max(1) as f64;
    let ao = mean(&mut x.ao.iter().map(|a| f64::from(*a)));
    let rms = mean(&mut x.error.iter().map(|e| f64::from(e[0]).powi(2))).sqrt();
    let tensors: Vec<Value> = file
        .tensors
        .iter()
        .map(|(name, t)| json!({"name": name, "shape": t.shape, "bytes": t.data.bytes()}))
        .collect();
    let json = json!({
        "kind": "transfer",
        "name": file_name(what),
        "sites": x.len(),
        "places": saved.sites,
        "bands": x.bands,
        "visibility_bands": x.wide,
        "channels": x.channels,
        "bounces": x.bounces,
        "albedo": saved.albedo,
        "tolerance": saved.tolerance,
        "offset": saved.offset,
        "mesh_digest": saved.mesh,
        "mean_ao": ao,
        "error_t": t,
        "error_t_rms": rms,
        "error_v": v,
        "tensors": tensors,
        "metadata": file.metadata,
    });
    let mut lines = vec![
        ("name", file_name(what)),
        ("transfer", format!("{} {}, {} bands, {} channels", x.len(), saved.sites, x.bands, x.channels)),
        ("visibility", format!("{} bands", x.wide)),
        (
            "reflections",
            match x.bounces {
                1 => "none: direct light".into(),
                n => format!("{} scattering events, albedo {:?}", n, saved.albedo),
            },
        ),
        ("ambient occlusion", format!("mean {ao:.5}")),
        ("error", format!("t: at most {t:.1e}, RMS {rms:.1e}; v: at most {v:.1e} (estimated)")),
        ("mesh", format!("digest {}", saved.mesh)),
    ];
    lines.extend(
        file.tensors
            .iter()
            .map(|(name, t)| ("tensor", format!("{name} {:?}, {} bytes", t.shape, t.data.bytes()))),
    );
    Ok(Some(Report { json, lines }))
}
