//! `steradian transfer`: a mesh in, what its sites see and are lit by out.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs;
use clap::Args;
use std::path::{Path, PathBuf};
use steradian_engines::transfer_source;
use steradian_session::has_extension;
use steradian_session::transfer::{Places, Request};
use steradian_transfer::Settings;

/// Options of `steradian transfer`.
#[derive(Debug, Args)]
pub struct Options {
    /// Mesh: a file (.obj, .ply, .glb, .gltf) or a built-in shape such as torus
    #[arg(value_name = "FILE|SHAPE")]
    mesh: String,
    /// Bands of spherical harmonics
    #[arg(long, value_name = "B", default_value_t = 5)]
    bands: usize,
    /// Scattering events at surfaces: 1 is direct light alone, 2 adds what the mesh reflects once
    #[arg(long, value_name = "N", default_value_t = 1)]
    bounces: u32,
    /// Albedo of the surfaces that reflect, a number or R/G/B; the mean of a base-colour texture multiplies
    /// it [default: the file's base colours]
    #[arg(long, value_name = "A", value_parser = albedo)]
    albedo: Option<[f64; 3]>,
    /// Absolute error of the coefficients of t, and a fifth of that of v [default: 0.001]; a miss exits 4
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Rays of each site in place of a tolerance; the largest power of 4 that is not above is cast
    #[arg(long, value_name = "N", conflicts_with = "tolerance", value_parser = clap::value_parser!(u32).range(1..=262_144))]
    rays: Option<u32>,
    /// How far off the surface rays start, along the normal, in the mesh's units
    #[arg(long, value_name = "D", default_value_t = 1e-4, allow_negative_numbers = true)]
    offset: f32,
    /// CSV of points with columns px,py,pz,nx,ny,nz in place of the vertices; - is standard input
    #[arg(short, long, value_name = "FILE.csv", conflicts_with = "atlas")]
    points: Option<PathBuf>,
    /// Texels of an atlas over the mesh's texture coordinates in place of the vertices
    #[arg(long, value_name = "WxH", value_parser = size)]
    atlas: Option<(usize, usize)>,
    /// Visibility by direction too: the coefficients of what is nearest to it over the hemisphere, by least
    /// squares
    #[arg(long)]
    hemisphere: bool,
    /// Matrices of glossy transfer too, bands² x bands² a site
    #[arg(long)]
    matrices: bool,
    /// Bits of the numbers written: 32, 16 (halves in .safetensors), or 8 (whole numbers with scales)
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = bits)]
    bits: u32,
    /// WGSL that shades a vertex with such transfer, to this file
    #[arg(long, value_name = "OUT.wgsl")]
    wgsl: Option<PathBuf>,
    /// Output: .safetensors, .glb (the mesh with transfer as attributes of its vertices), or with --points
    /// .csv [default with --points: standard output]
    #[arg(short, long, value_name = "OUT", required_unless_present = "points")]
    output: Option<PathBuf>,
}

fn albedo(text: &str) -> Result<[f64; 3], String> {
    let bad = || format!("'{text}' is no albedo from 0 to 1, nor three such as 0.7/0.5/0.3");
    let v: Vec<f64> = text.split('/').map(|x| x.parse().map_err(|_| bad())).collect::<Result<_, _>>()?;
    let v: [f64; 3] = match v[..] {
        [a] => [a; 3],
        [r, g, b] => [r, g, b],
        _ => return Err(bad()),
    };
    if v.iter().all(|x| (0.0..=1.0).contains(x)) { Ok(v) } else { Err(bad()) }
}

fn size(text: &str) -> Result<(usize, usize), String> {
    let pair = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    pair.filter(|(w, h)| (1..=16384).contains(w) && (1..=16384).contains(h))
        .ok_or_else(|| format!("'{text}' is no size such as 512x512"))
}

fn bits(text: &str) -> Result<u32, String> {
    let bits = text.parse().ok().filter(|b| [8, 16, 32].contains(b));
    bits.ok_or_else(|| format!("numbers have 8, 16 or 32 bits, not {text}"))
}

/// Is the result a table?
fn is_csv(o: &Options) -> bool {
    o.output.as_ref().is_none_or(|p| p == Path::new("-") || has_extension(p, &["csv"]))
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let table = match &o.points {
        Some(path) => {
            if is_csv(&o) {
                inputs::check_text(o.output.as_deref(), context)?;
            }
            Some(context.read_table(path)?)
        }
        None => None,
    };
    let file = o.output.as_deref().filter(|_| table.is_none() || !is_csv(&o));
    if let Some(path) = file {
        context.check_output(path, &["safetensors", "glb"])?;
        let vertices = has_extension(path, &["glb"]);
        if vertices && (o.points.is_some() || o.atlas.is_some() || o.hemisphere || o.matrices) {
            return Err(Failure::usage(
                "a .glb carries vectors of its vertices: for points, an atlas, hemispheres or matrices write .safetensors",
            ));
        }
    }
    inputs::check_text(o.wgsl.as_deref(), context)?;
    let places = match (&table, o.atlas) {
        (Some(table), _) => Places::of_table(table)?,
        (None, Some((w, h))) => Places::Texels(w, h),
        (None, None) => Places::Vertices,
    };
    let defaults = Settings::default();
    let settings = Settings {
        bands: o.bands,
        tolerance: o.tolerance.unwrap_or(defaults.tolerance),
        rays: o.rays,
        offset: o.offset,
        matrices: o.matrices,
        bounces: o.bounces,
        ..defaults
    };
    let request = Request {
        mesh: o.mesh.clone(),
        places,
        settings,
        albedo: o.albedo,
        hemisphere: o.hemisphere,
        asked: o.tolerance.is_some(),
        output: file.map(Path::to_path_buf),
    };
    let (done, missed) = context.transfer(&request)?.even_if_missed();
    let document = done.document();
    if let Some(path) = &o.wgsl {
        let t = &done.saved.transfer;
        context.write_text(Some(path), &transfer_source(t.bands, t.channels))?;
    }
    match (file, table) {
        (Some(path), _) => context.write_transfer(done, o.bits, path)?,
        (None, Some(mut table)) => {
            done.add_columns(&mut table);
            context.finish_transfer(done)?;
            if context.common.json && o.output.is_none() {
                return context.print_json(document);
            }
            context.write_text(o.output.as_deref(), &table.text())?;
        }
        (None, None) => return Err(Failure::usage("say where the result goes: -o FILE.safetensors")),
    }
    if context.common.json {
        context.print_json(document)?;
    }
    missed.map_or(Ok(()), |m| Err(Failure::missed(format!("{m} (the largest of all sites)"))))
}
