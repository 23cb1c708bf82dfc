//! Textures as outputs: provenance, and what a format could not hold.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use std::path::Path;
use steradian_formats::{Container, TexelFormat, TextureLevels, WriteReport};
use steradian_sphere::SphereImage;

/// Writes a cube map as a texture of one level, with provenance where the container has room.
pub fn write_cube(
    path: &Path,
    image: &SphereImage,
    format: TexelFormat,
    metadata: Vec<(String, String)>,
    context: &Context,
) -> Result<WriteReport, Failure> {
    let container = Container::of_name(path).unwrap_or(Container::Ktx2);
    let [r, g, b] = &image.planes;
    let texels = (0..r.len()).flat_map(|i| [r[i], g[i], b[i], 1.0]).collect();
    let mut pairs = context.provenance_pairs();
    pairs.push(("steradian.profile".into(), "steradian".into()));
    pairs.extend(metadata);
    let (width, height) = (image.width, image.height);
    let texture = TextureLevels { width, height, faces: 6, levels: vec![texels], metadata: pairs };
    let report = container.write(path, &texture, format)?;
    say_lost(path, report, context);
    Ok(report)
}

/// Warns of what a format could not hold.
pub fn say_lost(path: &Path, r: WriteReport, context: &Context) {
    if r.clipped > 0 || r.vanished > 0 {
        context.warn(format_args!(
            "{}: {} samples clipped, {} became 0, {:.4} lost in sum",
            path.display(),
            r.clipped,
            r.vanished,
            r.lost
        ));
    }
}

/// Refuses texel formats where the output is no texture.
pub fn check_format(format: Option<TexelFormat>, path: &Path) -> Outcome {
    match format {
        Some(f) if Container::of_name(path).is_none() => Err(Failure::usage(format!(
            "{}: --format {} is for .ktx2, .ktx and .dds",
            path.display(),
            f.name()
        ))),
        _ => Ok(()),
    }
}
