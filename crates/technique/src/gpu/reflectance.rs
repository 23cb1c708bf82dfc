//! The WGSL text of a reflectance, added to that of a technique.

use super::{Format, Level, ROW, Shape, Table};
use steradian_brdf::BrdfShader;
use steradian_brdf::wgsl::scoped;

/// Numbers of a measured reflectance as a table of [`Shape::Texels`].
pub fn cells(name: &'static str, cells: &[[f32; 3]]) -> Table {
    texels(name, &cells.iter().map(|c| [c[0], c[1], c[2], 0.0]).collect::<Vec<_>>())
}

/// A table of [`Shape::Texels`].
pub fn texels(name: &'static str, texels: &[[f32; 4]]) -> Table {
    let height = texels.len().div_ceil(ROW).max(1);
    let mut bytes: Vec<u8> = texels.as_flattened().iter().copied().flat_map(f32::to_le_bytes).collect();
    bytes.resize(Format::Rgba32Float.bytes() * ROW * height, 0);
    let level = Level { width: ROW, height, layers: 1, bytes };
    Table { name, shape: Shape::Texels, format: Format::Rgba32Float, level }
}

/// [`BrdfShader::closed`] followed by `beside`, functions that call it, all names under `prefix`, and the
/// table `name` that it reads where the reflectance is measured.
pub fn own_reflectance(
    shader: &BrdfShader,
    prefix: &str,
    name: &'static str,
    beside: &str,
) -> (String, Vec<Table>) {
    let mut text = shader.closed();
    let numbers = shader.cells();
    if numbers.is_some() {
        text += &format!("\nfn brdf_cell(i: u32) -> vec3<f32> {{\n    return fetch_{name}(i).rgb;\n}}\n");
    }
    (scoped(prefix, &(text + beside)), numbers.map(|n| cells(name, n)).into_iter().collect())
}
