//! What a file of transfer is.

use super::bake::{tensor_lines, tensors_json};
use super::{Report, file_name};
use crate::context::Context;
use crate::failure::Failure;
use serde_json::json;
use std::path::Path;

/// The report on a file of transfer; `None` where `what` is something else.
pub fn report(what: &str, context: &mut Context) -> Result<Option<Report>, Failure> {
    let Some(f) = context.inspect_transfer(Path::new(what))? else { return Ok(None) };
    let (saved, x, [t, v]) = (&f.saved, &f.saved.transfer, f.worst);
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
        "mean_ao": f.mean_ao,
        "error_t": t,
        "error_t_rms": f.rms,
        "error_v": v,
        "tensors": tensors_json(&f.tensors),
        "metadata": f.metadata,
    });
    let reflections = match x.bounces {
        1 => "none: direct light".into(),
        n => format!("{n} scattering events, albedo {:?}", saved.albedo),
    };
    let error = format!("t: at most {t:.1e}, RMS {:.1e}; v: at most {v:.1e} (estimated)", f.rms);
    let mut lines = vec![
        ("name", file_name(what)),
        ("transfer", format!("{} {}, {} bands, {} channels", x.len(), saved.sites, x.bands, x.channels)),
        ("visibility", format!("{} bands", x.wide)),
        ("reflections", reflections),
        ("ambient occlusion", format!("mean {:.5}", f.mean_ao)),
        ("error", error),
        ("mesh", format!("digest {}", saved.mesh)),
    ];
    lines.extend(tensor_lines(&f.tensors));
    Ok(Some(Report { json, lines }))
}
