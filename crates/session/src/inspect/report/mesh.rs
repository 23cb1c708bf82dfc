//! Report of a mesh.

use super::Report;
use crate::inspect::{MaterialFacts, MeshFacts};
use serde_json::{Value, json};

/// The report on a mesh.
pub fn report(m: &MeshFacts, name: &str) -> Report {
    let json = json!({
        "kind": "mesh",
        "name": name,
        "parts": m.parts,
        "vertices": m.vertices,
        "triangles": m.triangles,
        "normals": m.normals,
        "has_uvs": m.has_uvs,
        "has_tangents": m.has_tangents,
        "bounds": m.bounds.map(|(a, b)| json!({"min": a.to_array(), "max": b.to_array()})),
        "diagonal": m.diagonal,
        "area": m.area,
        "open_edges": m.open_edges,
        "edges_of_more_than_two_triangles": m.shared_edges,
        "transfer": m.transfer.map(|t| json!({
            "bands": t.bands, "channels": t.channels, "bounces": t.bounces, "bits": t.bits,
        })),
        "materials": m.materials.iter().map(material_json).collect::<Vec<_>>(),
        "notes": m.notes,
    });
    let yes = |b: bool| if b { "yes" } else { "no" };
    let mut lines = vec![
        ("name", name.into()),
        ("triangles", format!("{} over {} vertices in {} parts", m.triangles, m.vertices, m.parts)),
        ("area", format!("{:.6} m²", m.area)),
        ("uv", format!("{}, tangents {}", yes(m.has_uvs), yes(m.has_tangents))),
        ("edges", format!("{} open, {} with more than two triangles", m.open_edges, m.shared_edges)),
    ];
    if let Some((a, b)) = m.bounds {
        let v = |v: glam::Vec3| format!("({:.4}, {:.4}, {:.4})", v.x, v.y, v.z);
        lines.insert(2, ("bounds", format!("{} to {}, diagonal {:.4} m", v(a), v(b), m.diagonal)));
    }
    if let Some(t) = m.transfer {
        let light = match t.bounces {
            1 => "direct light".into(),
            n => format!("{n} scattering events"),
        };
        let vectors = if t.channels == 1 { "a vector" } else { "three vectors" };
        lines
            .push(("transfer", format!("{vectors} a vertex: {} bands of {} bits, {light}", t.bands, t.bits)));
    }
    for m in &m.materials {
        lines.push(("material", m.text.strip_prefix("material ").unwrap_or(&m.text).into()));
        let images: Vec<String> = m.textures.iter().map(|(what, name)| format!("{what} {name}")).collect();
        if !images.is_empty() {
            lines.push(("textures", images.join(", ")));
        }
    }
    lines.extend(m.notes.iter().map(|n| ("note", n.clone())));
    Report { json, lines }
}

fn material_json(m: &MaterialFacts) -> Value {
    let textures: serde_json::Map<String, Value> =
        m.textures.iter().map(|(what, name)| ((*what).into(), json!(name))).collect();
    json!({"name": m.name, "brdf": m.brdf, "textures": textures, "left_out": m.left_out})
}
