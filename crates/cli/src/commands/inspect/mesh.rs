//! What a mesh is.

use super::{Report, file_name};
use crate::context::Context;
use crate::failure::Failure;
use serde_json::json;
use std::collections::HashMap;
use std::path::Path;
use steradian_scene::Mesh;
use steradian_session::is_shape;

/// Is this the name of a mesh file or of a built-in shape?
pub fn is_mesh(what: &str) -> bool {
    let lower = what.to_lowercase();
    let file = lower.strip_suffix(".gz").unwrap_or(&lower);
    let mesh = [".obj", ".ply", ".glb", ".gltf"].iter().any(|e| file.ends_with(e));
    mesh || is_shape(what)
}

/// The report on a mesh.
pub fn report(what: &str, context: &mut Context) -> Result<Report, Failure> {
    if is_shape(what) {
        let mesh = context.mesh(what)?;
        return Ok(describe(what, &mesh, &[], &[], 1));
    }
    let loaded = steradian_scene::load(Path::new(what), &context.limits())?;
    context.note_input(Path::new(what));
    let materials: Vec<String> = loaded.materials.iter().map(|m| m.name.clone()).collect();
    Ok(describe(what, &loaded.merged(), &loaded.notes, &materials, loaded.meshes.len()))
}

fn describe(what: &str, mesh: &Mesh, notes: &[String], materials: &[String], parts: usize) -> Report {
    let bounds = mesh.bounds();
    let (open, shared) = edges(mesh);
    let normals_made = mesh.normals.len();
    let json = json!({
        "kind": "mesh",
        "name": file_name(what),
        "parts": parts,
        "vertices": mesh.positions.len(),
        "triangles": mesh.triangles.len(),
        "normals": normals_made,
        "has_uvs": !mesh.uvs.is_empty(),
        "has_tangents": !mesh.tangents.is_empty(),
        "bounds": bounds.map(|(a, b)| json!({"min": a.to_array(), "max": b.to_array()})),
        "diagonal": mesh.diagonal(),
        "area": mesh.area(),
        "open_edges": open,
        "edges_of_more_than_two_triangles": shared,
        "materials": materials,
        "notes": notes,
    });
    let yes = |b: bool| if b { "yes" } else { "no" };
    let mut lines = vec![
        ("name", file_name(what)),
        (
            "triangles",
            format!("{} over {} vertices in {parts} parts", mesh.triangles.len(), mesh.positions.len()),
        ),
        ("area", format!("{:.6} m²", mesh.area())),
        ("uv", format!("{}, tangents {}", yes(!mesh.uvs.is_empty()), yes(!mesh.tangents.is_empty()))),
        ("edges", format!("{open} open, {shared} with more than two triangles")),
    ];
    if let Some((a, b)) = bounds {
        let v = |v: glam::Vec3| format!("({:.4}, {:.4}, {:.4})", v.x, v.y, v.z);
        lines.insert(2, ("bounds", format!("{} to {}, diagonal {:.4} m", v(a), v(b), mesh.diagonal())));
    }
    lines.extend(notes.iter().map(|n| ("note", n.clone())));
    Report { json, lines }
}

/// Edges of one triangle only, and of more than two; vertices are the same where their positions are.
fn edges(mesh: &Mesh) -> (usize, usize) {
    let mut of_position = HashMap::new();
    let same: Vec<u32> = mesh
        .positions
        .iter()
        .enumerate()
        // −0 and 0 are one place.
        .map(|(i, p)| {
            *of_position.entry((*p + glam::Vec3::ZERO).to_array().map(f32::to_bits)).or_insert(i as u32)
        })
        .collect();
    let mut count: HashMap<(u32, u32), u32> = HashMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (same[t[k] as usize], same[t[(k + 1) % 3] as usize]);
            *count.entry((a.min(b), a.max(b))).or_default() += 1;
        }
    }
    let open = count.values().filter(|n| **n == 1).count();
    (open, count.values().filter(|n| **n > 2).count())
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_scene::shapes;

    #[test]
    fn closed_and_open_shapes() {
        assert_eq!(edges(&shapes::by_name("torus").unwrap()), (0, 0));
        assert_eq!(edges(&shapes::by_name("plane").unwrap()).0, 4);
        assert!(is_mesh("a/b.PLY.gz") && is_mesh("teapot") && !is_mesh("a.hdr"));
    }
}
