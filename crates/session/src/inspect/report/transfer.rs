//! Report of a file of transfer.

use super::Report;
use super::bake::{tensor_lines, tensors_json};
use crate::inspect::TransferFacts;
use serde_json::json;

/// The report on a file of transfer.
pub fn report(f: &TransferFacts, name: &str) -> Report {
    let (saved, x, [t, v]) = (&f.saved, &f.saved.transfer, f.worst);
    let json = json!({
        "kind": "transfer",
        "name": name,
        "sites": x.len(),
        "places": saved.sites,
        "bands": x.bands,
        "visibility_bands": x.wide,
        "channels": x.channels,
        "bounces": x.bounces,
        "albedo": saved.albedo,
        "tolerance": saved.rays.is_none().then_some(saved.tolerance),
        "rays": saved.rays,
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
    let asked = match saved.rays {
        Some(rays) => format!("{rays} rays a site"),
        None => format!("tolerance {}", saved.tolerance),
    };
    let mut lines = vec![
        ("name", name.into()),
        ("transfer", format!("{} {}, {} bands, {} channels", x.len(), saved.sites, x.bands, x.channels)),
        ("visibility", format!("{} bands", x.wide)),
        ("reflections", reflections),
        ("ambient occlusion", format!("mean {:.5}", f.mean_ao)),
        ("asked for", asked),
        ("error", error),
        ("mesh", format!("digest {}", saved.mesh)),
    ];
    lines.extend(tensor_lines(&f.tensors));
    Report { json, lines }
}
