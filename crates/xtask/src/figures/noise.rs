//! Figures 4 and 5 of Kautz, Sloan & Snyder 2002: a teapot whose exponent, and whose anisotropy, varies by a
//! noise, and shadows by precomputed transfer; each beside the truth.
//!
//! Figure 4 is held against the integral with each pixel's own reflectance, twice: under the light of 25
//! coefficients that is shaded, which leaves what the tables err by, and under the whole light. Figure 5 is
//! held against the integral, and against paths of one reflection.

use super::survey::{Shading, film, row, sheet};
use super::{Options, kautz, light, mesh, picture, save, say};
use anyhow::{Context, Result};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use steradian_base::{Cancelled, ParamValues, Task};
use steradian_brdf::{SharedBrdf, parse, with_widths};
use steradian_light::Lights;
use steradian_parallel::prelude::*;
use steradian_reference::Reference;
use steradian_render::scenefile::SceneBackground;
use steradian_render::{Background, BakeShader, Film, Settings, Shader, Stage, Surface, SurfaceMaps, render};
use steradian_scene::surface::{Planes, Texture};
use steradian_scene::{Bvh, Camera, Framing, shapes};
use steradian_session::{Material, Scene};
use steradian_sphere::Frame;
use steradian_techniques::{Points, Radiance, View, find};

/// Light of both figures.
const LIGHT: &str = "environments/latlong/probulator_grace.hdr";
/// Where the window over the light's bands ends.
const WINDOW: f64 = 6.0;
/// Bands.
const BANDS: usize = 5;
/// Texels a side of the noise, and its coarsest cells.
const TEXELS: usize = 64;
const CELLS: usize = 3;
/// Relative error of the truth.
const TRUTH: f64 = 1e-3;

/// Smooth noise between 0 and 1 that repeats: random values at the corners of cells (Perlin's fade between
/// them), with half the height in cells half as wide.
fn noise(x: f64, y: f64) -> f64 {
    let octave = |cells: usize, seed: u64| {
        let corner = |i: usize, j: usize| {
            let k = ((i % cells) as u64 * 374_761_393 + (j % cells) as u64 * 668_265_263 + seed)
                .wrapping_mul(0x9e37_79b9_7f4a_7c15);
            (k ^ (k >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) as f64 / u64::MAX as f64
        };
        let (u, v) = (x * cells as f64, y * cells as f64);
        let (i, j) = (u as usize, v as usize);
        let fade = |t: f64| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
        let (s, t) = (fade(u.fract()), fade(v.fract()));
        let along = |j: usize| corner(i, j) + s * (corner(i + 1, j) - corner(i, j));
        along(j) + t * (along(j + 1) - along(j))
    };
    (2.0 * octave(CELLS, 1) + octave(2 * CELLS, 2)) / 3.0
}

/// Exponents along tangent and bitangent by the noise's value.
type Exponents = fn(f64) -> [f64; 2];

/// Logarithms of exponents by texel.
fn texture(of: Exponents) -> Result<Arc<Texture>> {
    let at = |k: usize| {
        let u = |i: usize| (i as f64 + 0.5) / TEXELS as f64;
        of(noise(u(k % TEXELS), u(k / TEXELS))).map(f64::ln)
    };
    let all: Vec<[f64; 2]> = (0..TEXELS * TEXELS).map(at).collect();
    let plane = |c: usize| all.iter().map(|t| t[c] as f32).collect::<Vec<f32>>();
    let zero = vec![0.0; all.len()];
    Ok(Arc::new(Texture::new(TEXELS, TEXELS, &[plane(0), plane(1), zero]).context("texels")?))
}

/// The integral with each point's own exponents, their logarithms averaged under its footprint.
struct Truth {
    reference: Reference,
    brdf: SharedBrdf,
    logarithms: Arc<Texture>,
}

impl Shader for Truth {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        let at = |v: [&[f32]; 3], i: usize| DVec3::from_array(v.map(|c| f64::from(c[i])));
        let one = |i: usize| {
            task.check()?;
            let [x, y, _] = self.logarithms.sample(q.uv[0][i], q.uv[1][i], q.chart[7][i]);
            let brdf =
                with_widths(&*self.brdf, [x, y].map(|l| f64::from(l).exp())).unwrap_or(self.brdf.clone());
            let frame = Frame::from_normal_tangent(at(q.n, i).normalize(), at(q.t, i));
            Ok(self.reference.radiance(&*brdf, &frame, at(q.wo, i).normalize(), None, TRUTH).rgb)
        };
        let all: Result<Vec<[f64; 3]>, Cancelled> = (0..q.len()).into_par_iter().map(one).collect();
        for (i, rgb) in all?.into_iter().enumerate() {
            (0..3).for_each(|c| out.rgb[c][i] = rgb[c] as f32);
        }
        Ok(())
    }

    fn is_textured(&self) -> bool {
        true
    }
}

/// Figure 4: a varying exponent, and a varying anisotropy.
pub fn varied(o: &Options) -> Result<()> {
    let (name, lights) = light::of(o, LIGHT)?;
    let few = kautz::projected(&lights, BANDS, WINDOW);
    // Tangents around the axis, as the brushing of the paper's figures; texture coordinates over each patch.
    let mut pot = shapes::teapot(20, true);
    let along = |n: &Vec3| (Vec3::Y - *n * n.y).try_normalize().unwrap_or(n.any_orthonormal_vector());
    pot.tangents = pot.normals.iter().map(|n| along(n).extend(1.0)).collect();
    let side = o.side.unwrap_or(256);
    let camera =
        Framing { share: 0.9, ..Framing::default() }.camera(&pot.positions).context("an empty mesh")?;
    let (Camera::Pinhole { from, .. } | Camera::Orthographic { from, .. }) = camera;
    let bvh = Bvh::build(&pot);
    let draw = |shader: Arc<dyn Shader>| -> Result<Film> {
        let surfaces = [Surface { shader, base_colour: None, maps: SurfaceMaps::default() }];
        let background = &Background::Colour([0.0; 3]);
        let stage = Stage { mesh: &pot, bvh: &bvh, surfaces: &surfaces, background, camera };
        let settings = Settings { inner: 1, share: true, ..Settings::new(side, side) };
        Ok(render(&stage, &settings, &Task::quiet())?)
    };
    say("KSS02 figure 4: Ashikhmin-Shirley varying by a noise, 25 coefficients, relative RMS error");
    let columns: [(&str, Exponents); 2] = [
        ("varying exponent", |x| [4.0 * 32f64.powf(x); 2]),
        ("varying anisotropy", |x| [12.0 * 12f64.powf(x - 0.5), 12.0 / 12f64.powf(x - 0.5)]),
    ];
    let technique = find("sh_brdf").context("no sh_brdf")?;
    let mut rows = Vec::new();
    for (label, of) in columns {
        let logarithms = texture(of)?;
        let numbers = logarithms.zip(&logarithms, |t, _| t.map(f32::exp));
        let brdf =
            parse(o.brdfs.first().map_or("ashikhmin-shirley:nu=12,nv=12,rs=0.9/0.8/0.6", String::as_str))?;
        let planes = Planes::default().with("widths", Arc::new(numbers));
        let material = steradian_techniques::Material::new(brdf.clone()).with_textures(planes);
        let values: ParamValues = [("window", WINDOW)].into_iter().collect();
        let mut bake = technique.bake(&lights, &material, None, &values, &Task::quiet())?;
        for (name, value) in &bake.certificate().details {
            say(&format!("{label:<28} {name:<34} {value:>8.4}"));
        }
        say(&format!("{label:<28} {:<34} {}", "certified", picture::certified(bake.certificate())));
        bake.frame(&View { eye: from, forward: camera.axes()[2], ..View::default() });
        let shaded = draw(Arc::new(BakeShader(bake)))?;
        let truth = |lights: &Lights| -> Result<Film> {
            let (reference, brdf) = (picture::reference(lights)?, brdf.clone());
            draw(Arc::new(Truth { reference, brdf, logarithms: logarithms.clone() }))
        };
        // The window's light is what is shaded: its texels are its values, its own bands no more.
        let films = [("sh_brdf".into(), shaded.clone()), ("integral, projected light".into(), truth(&few)?)];
        let first = row(label, &films, 0.7)?;
        let films = [("sh_brdf".into(), shaded), ("integral, whole light".into(), truth(&lights)?)];
        let mut second = row(&format!("{label}, whole light"), &films, 0.7)?;
        let mut both = first;
        both.cells.append(&mut second.cells);
        rows.push(both);
    }
    let subtitle = format!(
        "under {name}; 25 coefficients under a window, tables over one parameter; errors over the teapot"
    );
    save(o, "kss02-4.png", &sheet("A reflectance that varies by a noise", &subtitle, rows).draw())
}

/// Figure 5: without and with shadows.
pub fn shadowed(o: &Options) -> Result<()> {
    let (name, lights) = light::of(o, LIGHT)?;
    let few = kautz::projected(&lights, BANDS, WINDOW);
    let side = o.side.unwrap_or(256);
    let mut mesh = mesh::bunny()?;
    mesh.materials.clear();
    let spec = o.brdfs.first().map_or("ashikhmin-shirley:nu=12,nv=4,rs=0.6,rd=0.3", String::as_str);
    let scene = Scene {
        camera: Framing { share: 0.9, ..Framing::default() }.camera(&mesh.positions),
        settings: Settings { inner: 1, share: true, ..Settings::new(side, side) },
        background: SceneBackground::Colour([0.0; 3]),
        ..Scene::new(mesh, vec![Material::new(parse(spec)?)], few)
    };
    say(&format!("KSS02 figure 5: {spec} under {BANDS} bands of {name}, relative RMS error"));
    let mut rows = Vec::new();
    for (label, slug, params, truth) in [
        ("unshadowed", "sh_brdf", "lights=0", ("integral", Shading::Model)),
        ("shadowed", "prt_brdf", "precision=0.01", ("paths", Shading::Paths(1))),
    ] {
        let films = [
            (slug.into(), film(&scene, &Shading::Global(slug, params))?),
            (truth.0.into(), film(&scene, &truth.1)?),
        ];
        rows.push(row(label, &films, 0.7)?);
    }
    let subtitle = format!("{BANDS} bands of {name} under a window; errors over the picture");
    save(o, "kss02-5.png", &sheet("Precomputed transfer", &subtitle, rows).draw())
}
