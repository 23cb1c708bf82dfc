//! Nodes and primitives.

use super::accessor::{indices, vectors};
use super::buffers::Buffers;
use super::json::{Accessor, Primitive, Root};
use super::transform::Affine;
use crate::FormatError;
use crate::mesh::{MaterialData, MeshData, Part, source::Source};

/// Adds every primitive that the default scene shows.
pub fn parts(
    root: &Root,
    buffers: &Buffers,
    sets: &[u32],
    data: &mut MeshData,
    source: &mut Source,
) -> Result<(), FormatError> {
    if root.nodes.iter().any(|n| n.mesh.is_some() && n.skin.is_some()) {
        source.note("skins were left out: their meshes stand in the pose they were bound in");
    }
    if !root.animations.is_empty() {
        source.note("animations were left out");
    }
    let placed = placed_meshes(root).map_err(|why| source.fault(why))?;
    announce(root, &placed, source)?;
    let mut default = None;
    for (mesh, transform) in placed {
        let m = &root.meshes[mesh];
        for (i, primitive) in m.primitives.iter().enumerate() {
            let mut loader = Loader { root, buffers, sets, source: &mut *source };
            let part = loader.primitive(primitive, &transform);
            let part = part.map_err(|why| source.fault(format_args!("mesh {mesh}, primitive {i}: {why}")))?;
            let Some(mut part) = part else { continue };
            part.name.clone_from(&m.name);
            place(&mut part, primitive.material, &mut default, data);
            data.parts.push(part);
        }
    }
    Ok(())
}

/// Announces the memory of everything that is shown, before any of it is decoded: a mesh is decoded once for
/// each node that shows it, and `n` nodes that show one mesh of `n` primitives are `n²` parts.
fn announce(root: &Root, placed: &[(usize, Affine)], source: &mut Source) -> Result<(), FormatError> {
    let cost = |p: &Primitive| {
        let vertices =
            p.attributes.get("POSITION").and_then(|&i| root.accessors.get(i)).map_or(0, |a| a.count);
        let corners = p.indices.and_then(|i| root.accessors.get(i)).map_or(vertices, |a| a.count);
        let known = ["POSITION", "NORMAL", "TANGENT", "TEXCOORD_", "COLOR_0"];
        let sizes = [12, 12, 16, 8, 12];
        let has = |name: &str| p.attributes.keys().any(|k| k.starts_with(name));
        let vertex: u64 = known.iter().zip(sizes).filter(|(name, _)| has(name)).map(|(_, size)| size).sum();
        // Its index, and the triangle with its material or, as a strip, a triangle for each corner.
        let corner = if p.mode.unwrap_or(4) == 4 { 4 + 6 } else { 4 + 16 };
        let own = size_of::<Part>() as u64;
        own.saturating_add(vertices.saturating_mul(vertex)).saturating_add(corners.saturating_mul(corner))
    };
    let meshes: Vec<u64> =
        root.meshes.iter().map(|m| m.primitives.iter().map(cost).fold(0, u64::saturating_add)).collect();
    let mut total = 0u64;
    for (mesh, _) in placed {
        let cost = meshes.get(*mesh).ok_or_else(|| source.fault(format_args!("there is no mesh {mesh}")))?;
        total = total.saturating_add(*cost);
    }
    source.spend(total, 1)
}

/// Gives the part its material; a default one is added where it has none and others have. `default` is its
/// number once it is known.
fn place(part: &mut Part, material: Option<usize>, default: &mut Option<usize>, data: &mut MeshData) {
    let slot = material.or(*default).unwrap_or_else(|| {
        let unnamed = data.materials.iter().position(|m| *m == MaterialData::default());
        unnamed.unwrap_or_else(|| {
            data.materials.push(MaterialData::default());
            data.materials.len() - 1
        })
    });
    if material.is_none() {
        *default = Some(slot);
    }
    part.materials = vec![slot as u32; part.triangles.len()];
}

/// The meshes of the default scene with their transforms, in the nodes' order.
fn placed_meshes(root: &Root) -> Result<Vec<(usize, Affine)>, String> {
    let roots: Vec<usize> = match (root.scene, root.scenes.first()) {
        (Some(s), _) => root.scenes.get(s).ok_or_else(|| format!("there is no scene {s}"))?.nodes.clone(),
        (None, Some(first)) => first.nodes.clone(),
        (None, None) if root.nodes.is_empty() => {
            return Ok((0..root.meshes.len()).map(|m| (m, Affine::IDENTITY)).collect());
        }
        (None, None) => {
            let children: std::collections::BTreeSet<usize> =
                root.nodes.iter().flat_map(|n| n.children.iter().copied()).collect();
            (0..root.nodes.len()).filter(|i| !children.contains(i)).collect()
        }
    };
    let mut seen = vec![false; root.nodes.len()];
    let mut stack: Vec<(usize, Affine)> = roots.into_iter().rev().map(|n| (n, Affine::IDENTITY)).collect();
    let mut out = Vec::new();
    while let Some((index, parent)) = stack.pop() {
        let node = root.nodes.get(index).ok_or_else(|| format!("there is no node {index}"))?;
        if std::mem::replace(&mut seen[index], true) {
            return Err(format!("node {index} has two parents or is its own ancestor"));
        }
        let transform = parent.after(&Affine::of(node));
        if !transform.is_finite() {
            return Err(format!("the transform of node {index} is not finite"));
        }
        out.extend(node.mesh.map(|mesh| (mesh, transform)));
        stack.extend(node.children.iter().rev().map(|&c| (c, transform)));
    }
    Ok(out)
}

struct Loader<'a, 'b> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    sets: &'a [u32],
    source: &'a mut Source<'b>,
}

impl<'a> Loader<'a, '_> {
    fn primitive(&mut self, p: &Primitive, transform: &Affine) -> Result<Option<Part>, String> {
        let mode = p.mode.unwrap_or(4);
        if mode > 6 {
            return Err(format!("unknown mode {mode}"));
        }
        if mode < 4 {
            self.source.note("points or lines were left out");
            return Ok(None);
        }
        if !p.targets.is_empty() {
            self.source.note("morph targets were left out");
        }
        let set = match p.material {
            Some(m) => *self.sets.get(m).ok_or_else(|| format!("there is no material {m}"))?,
            None => 0,
        };
        let positions: Vec<[f32; 3]> = self
            .attribute(p, "POSITION", u64::from(u32::MAX))?
            .ok_or_else(|| "there are no positions".to_string())?;
        let n = positions.len();
        let mut part = Part { positions, ..Part::default() };
        part.normals = self.optional(p, "NORMAL", n)?;
        part.tangents = self.optional(p, "TANGENT", n)?;
        part.uvs = self.optional(p, &format!("TEXCOORD_{set}"), n)?;
        part.colors = self.optional(p, "COLOR_0", n)?;
        if part.colors.iter().flatten().any(|c| !c.is_finite() || *c < 0.0) {
            return Err("COLOR_0 holds a number that is negative or none".to_string());
        }
        part.flat = part.normals.is_empty();
        let list = match p.indices {
            Some(i) => {
                let a = self.accessor(i, u64::from(u32::MAX))?;
                indices(a, self.buffers)?
            }
            None => (0..n as u32).collect(),
        };
        if let Some(bad) = list.iter().find(|&&i| i as usize >= n) {
            return Err(format!("vertex index {bad} in a primitive of {n} vertices"));
        }
        part.triangles = triangles(&list, mode);
        apply(&mut part, transform);
        if part.positions.iter().flatten().any(|v| !v.is_finite()) {
            return Err("a position is not finite".to_string());
        }
        Ok(Some(part))
    }

    /// An accessor of at most `most` elements: as many as were announced.
    fn accessor(&self, index: usize, most: u64) -> Result<&'a Accessor, String> {
        let a = self.root.accessors.get(index).ok_or_else(|| format!("there is no accessor {index}"))?;
        if a.count > most {
            return Err(format!("accessor {index} has {} elements instead of {most}", a.count));
        }
        Ok(a)
    }

    fn attribute<const N: usize>(
        &self,
        p: &Primitive,
        name: &str,
        most: u64,
    ) -> Result<Option<Vec<[f32; N]>>, String> {
        let Some(&index) = p.attributes.get(name) else { return Ok(None) };
        let found = self.accessor(index, most).and_then(|a| vectors(a, self.buffers));
        found.map(Some).map_err(|why| format!("{name}: {why}"))
    }

    /// An attribute of `n` vertices, empty where there is none; what is not finite becomes zero, that is
    /// missing.
    fn optional<const N: usize>(&self, p: &Primitive, name: &str, n: usize) -> Result<Vec<[f32; N]>, String> {
        let mut values: Vec<[f32; N]> = self.attribute(p, name, n as u64)?.unwrap_or_default();
        if !values.is_empty() && values.len() != n {
            return Err(format!("{name} has {} elements for {n} vertices", values.len()));
        }
        values.iter_mut().filter(|v| v.iter().any(|x| !x.is_finite())).for_each(|v| *v = [0.0; N]);
        Ok(values)
    }
}

/// Triangles of a list (4), a strip (5) or a fan (6) (glTF 2.0, section 3.7.2.1).
fn triangles(list: &[u32], mode: u32) -> Vec<[u32; 3]> {
    match mode {
        4 => list.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        5 => (0..list.len().saturating_sub(2))
            .map(|i| [list[i], list[i + 1 + i % 2], list[i + 2 - i % 2]])
            .collect(),
        _ => (1..list.len().saturating_sub(1)).map(|i| [list[i], list[i + 1], list[0]]).collect(),
    }
}

/// Applies a node's transform; one that mirrors turns the winding over.
fn apply(part: &mut Part, m: &Affine) {
    if *m == Affine::IDENTITY {
        return;
    }
    part.positions.iter_mut().for_each(|p| *p = m.point(*p));
    part.normals.iter_mut().for_each(|n| *n = m.normal(*n));
    let sign = if m.mirrors() { -1.0 } else { 1.0 };
    for t in &mut part.tangents {
        let [x, y, z, w] = *t;
        let [x, y, z] = m.direction([x, y, z]);
        *t = [x, y, z, w * sign];
    }
    if m.mirrors() {
        part.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}
