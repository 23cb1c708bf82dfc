//! What is refused before any work: options that would be ignored, outputs that cannot be written, maps too large.

use super::beside::{DIFFUSE, has_diffuse, has_sheen};
use super::plan::{Plan, has_roughness};
use super::{BRDF, Options};
use crate::context::Context;
use crate::destinations::Destinations;
use crate::failure::{Failure, Outcome};
use crate::textures;
use steradian_formats::TexelFormat;
use steradian_sphere::Layout;
use steradian_verify::engines::Files;

/// A part of files' names: it names no folder.
pub fn file_name(text: &str) -> Result<String, String> {
    let odd = |c: char| matches!(c, '/' | '\\') || c.is_control();
    if text.is_empty() || text == "." || text == ".." || text.contains(odd) {
        return Err(format!("'{text}' is no name of a file: give one without / and \\"));
    }
    Ok(text.into())
}

/// Refuses options that nothing would come of.
pub fn options(o: &Options) -> Outcome {
    let chain = o.profile.is_some() || o.levels.is_some();
    let (takes, by): (&[&str], _) = match o.kernel.as_str() {
        _ if o.profile.is_some() => (&[], "--profile: its levels go over the roughness by themselves".into()),
        _ if chain => (&[], "--levels: they go over the roughness by themselves".into()),
        k if has_roughness(k) => (&["perceptual-roughness", "alpha"], format!("--kernel {k}")),
        k @ ("phong" | "blinn-phong") => (&["exponent"], format!("--kernel {k}")),
        k @ ("gaussian" | "spherical-gaussian") => (&["sigma"], format!("--kernel {k}")),
        k => (&[], format!("--kernel {k}")),
    };
    let given = [
        ("perceptual-roughness", o.perceptual_roughness.is_some()),
        ("alpha", o.alpha.is_some()),
        ("exponent", o.exponent.is_some()),
        ("sigma", o.sigma.is_some()),
    ];
    if let Some((option, _)) = given.into_iter().find(|(name, given)| *given && !takes.contains(name)) {
        return Err(Failure::usage(format!("--{option} has no part in {by}; leave it out")));
    }
    if o.name.is_some() && o.profile.is_none() && o.dump_levels.is_none() {
        let why = "names the files of --profile and --dump-levels; --output names this one";
        return Err(Failure::usage(format!("--name {why}")));
    }
    format(o)
}

fn format(o: &Options) -> Outcome {
    let Some(engine) = o.profile else { return textures::check_format(o.format, &o.output) };
    if o.kernel.starts_with(BRDF) || o.kernel != "ggx" {
        return Err(Failure::usage(format!("--kernel {}: the files of a profile are of ggx", o.kernel)));
    }
    let refused = |f: TexelFormat, why: &str| {
        Err(Failure::usage(format!("--profile {}: --format {}: {why}", engine.name, f.name())))
    };
    match (engine.files, o.format) {
        (Files::Gltf, Some(f)) => refused(f, "its texels are RGBD in .png"),
        (Files::LatLong { cube: None, .. }, Some(f))
            if !matches!(f, TexelFormat::Rgba16f | TexelFormat::Rgba32f) =>
        {
            refused(f, "its file is an .exr: rgba16f or rgba32f")
        }
        _ => Ok(()),
    }
}

/// What three.js takes.
pub fn three(size: usize, levels: usize) -> Outcome {
    if size < 256 {
        let why = "its first level has 256 texels a side or more";
        return Err(Failure::usage(format!("--profile three: --size {size}: {why}")));
    }
    if size >> (levels - 1) != 8 {
        let why = "its last level has 8 texels a side; leave --levels out";
        return Err(Failure::usage(format!("--profile three: --levels {levels}: {why}")));
    }
    Ok(())
}

/// Refuses outputs that cannot be written, or of which one would replace another.
pub fn destinations(o: &Options) -> Outcome {
    let mut places = Destinations::default();
    if o.profile.is_none() {
        places.file("--output", &o.output)?;
    } else {
        places.folder(&o.output, false)?;
    }
    if let Some(folder) = &o.dump_levels {
        places.folder(folder, true)?;
    }
    o.extract_sun.as_ref().map_or(Ok(()), |path| places.file("--extract-sun", path))
}

/// Bytes of a texel of the output: three floats filtered, four on the way to the file.
const TEXEL: u128 = 28;
/// Of a lat-long image that is written as it was filtered: three floats, and halves or codes of them in the file.
const DUMPED: u128 = 24;

/// Refuses maps beyond the limit of memory; a size that is not known yet passes.
pub fn memory(o: &Options, plan: &Plan, context: &Context) -> Outcome {
    let most = context.common.max_memory;
    let bytes = bytes(o.profile.is_some(), o.dump_levels.is_some(), plan);
    if plan.size.0 > 0 && bytes > u128::from(most) {
        let (w, h) = plan.size;
        return Err(Failure::failed(format!(
            "--size {w}x{h}: the levels need {} MiB, beyond the limit of {} MiB (--max-memory raises it)",
            bytes >> 20,
            most >> 20
        )));
    }
    Ok(())
}

/// What the maps of a plan take: all that are filtered, and the largest that is dumped.
fn bytes(profile: bool, dump: bool, plan: &Plan) -> u128 {
    let faces = if plan.layout == Layout::Cube { 6 } else { 1 };
    let side = |n: usize, m: usize| n.checked_shr(m as u32).unwrap_or(0).max(1) as u128;
    let texels = |m: usize| side(plan.size.0, m) * side(plan.size.1, m) * faces;
    let levels = (0..plan.filters.len()).map(texels).sum::<u128>();
    let beside = match profile {
        true if has_sheen(plan.engine) => levels + 6 * (DIFFUSE * DIFFUSE) as u128,
        true if has_diffuse(plan.engine) => 6 * (DIFFUSE * DIFFUSE) as u128,
        _ => 0,
    };
    // Level 0 as lat-long: 4n × 2n for a cube of side n.
    let (w, h) = (plan.size.0 as u128, plan.size.1 as u128);
    let dumped = if plan.layout == Layout::Cube { 8 * w * w } else { w * h };
    (levels + beside) * TEXEL + if dump { dumped * DUMPED } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_their_folder() {
        for bad in ["", ".", "..", "../evil", "a/b", "a\\b", "a\nb"] {
            assert!(file_name(bad).is_err(), "{bad}");
        }
        assert_eq!(file_name("a..b"), Ok("a..b".into()));
    }

    #[test]
    fn three_s_faults_name_the_option() {
        assert!(three(64, 4).unwrap_err().message.contains("--size 64"));
        assert!(three(256, 3).unwrap_err().message.contains("--levels 3"));
        assert!(three(256, 6).is_ok());
    }
}
