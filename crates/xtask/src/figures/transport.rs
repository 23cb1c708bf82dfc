//! Transfer vectors as pictures: a head in the light of each spherical harmonic (the course notes of Kautz
//! 2006), and how many coefficients light needs, spherical harmonics beside Haar wavelets (Kautz 2004, 7.4;
//! Ng, Ramamoorthi & Hanrahan 2003).

use super::survey::{Shading, film as drawn, row, sheet};
use super::{Options, light, mesh, save, say};
use anyhow::{Context, Result, anyhow};
use glam::{Vec2, Vec3};
use std::sync::Arc;
use steradian_base::{Cancelled, Task};
use steradian_render::{
    Background, Cell, Develop, Film, Row, Settings, Shader, Sheet, Stage, Surface, SurfaceMaps, ToneMapper,
    render,
};
use steradian_scene::{Bvh, Camera, Framing, Mesh};
use steradian_session::{Material, Scene};
use steradian_sphere::sh;
use steradian_techniques::{AnyBake, Geometry, Points, PointsBuf, Radiance, Sites};
use steradian_transfer::{Refinement, Site, Transfer, refine, transfer};

/// Albedo of the bunny.
const ALBEDO: f64 = 0.8;

/// Radiance 1, which colours of vertices multiply.
struct White;

impl Shader for White {
    fn shade(&self, _: &Points<'_>, out: &mut Radiance<'_>, _: &Task) -> Result<(), Cancelled> {
        out.rgb.iter_mut().for_each(|plane| plane.fill(1.0));
        Ok(())
    }
}

/// A mesh that is as bright as its vertices are coloured.
fn coloured(mesh: &Mesh, camera: Camera, settings: &Settings, colours: Vec<Vec3>) -> Result<Film> {
    let mesh = Mesh { colors: colours, ..mesh.clone() };
    let surfaces = [Surface { shader: Arc::new(White), base_colour: None, maps: SurfaceMaps::default() }];
    let stage = Stage {
        mesh: &mesh,
        bvh: &Bvh::build(&mesh),
        surfaces: &surfaces,
        background: &Background::Colour([0.0; 3]),
        camera,
    };
    Ok(render(&stage, settings, &Task::quiet())?)
}

/// Transfer vectors of all vertices, to a tolerance or by so many rays each.
fn vectors(mesh: &Mesh, bands: usize, rays: Option<u32>) -> Result<Transfer> {
    let scene = steradian_transfer::Scene::new(mesh).map_err(|e| anyhow!("{e}"))?;
    let settings = steradian_transfer::Settings {
        bands,
        tolerance: 5e-3,
        rays,
        offset: 1e-4 * mesh.bounds().map_or(1.0, |(a, b)| (b - a).length()),
        ..steradian_transfer::Settings::default()
    };
    transfer(&scene, &Site::vertices(mesh), &settings, None, &Task::quiet()).map_err(|e| anyhow!("{e}"))
}

/// A head lit by each of the first 25 harmonics: red where the light that arrives is positive, blue where it
/// is negative.
pub fn basis(o: &Options) -> Result<()> {
    const BANDS: usize = 5;
    let head = mesh::bust()?;
    let t = vectors(&head, BANDS, None)?;
    let camera = Framing { share: 0.9, ..Framing::default() }.camera(&head.positions).context("a mesh")?;
    let side = o.side.unwrap_or(112);
    let settings = Settings::new(side, side);
    let develop = Develop { ev: 0.0, mapper: ToneMapper::Linear };
    let mut rows = Vec::new();
    say("K06: a head in the light of each spherical harmonic, largest |t| of a vertex by band");
    for l in 0..BANDS {
        let mut cells = Vec::new();
        let mut largest = 0.0f32;
        for k in l * l..(l + 1) * (l + 1) {
            let at = |site: usize| t.vector(site, 0)[k];
            largest = (0..t.len()).fold(largest, |m, s| m.max(at(s).abs()));
            let colour = |s: usize| Vec3::new(at(s).max(0.0), 0.12 * at(s).abs(), (-at(s)).max(0.0));
            let film = coloured(&head, camera, &settings, (0..t.len()).map(colour).collect())?;
            let m = k as isize - (l * l + l) as isize;
            cells.push(Some(Cell {
                picture: develop.film(&film),
                caption: vec![format!("l = {l}, m = {m}")],
            }));
        }
        say(&format!("l = {l}: {largest:.3}"));
        cells.resize_with(2 * BANDS - 1, || None);
        rows.push(Row { label: Vec::new(), cells });
    }
    let sheet = Sheet {
        title: "Images in the light of basis functions".into(),
        subtitle: "diffuse transfer with shadows: red positive, blue negative; a picture under any light is their weighted sum".into(),
        columns: vec![String::new(); 2 * BANDS - 1],
        rows,
        text_size: 11.0,
    };
    save(o, "k06-basis.png", &sheet.draw())
}

/// Radiance of all vertices.
fn at_vertices(b: &dyn AnyBake, mesh: &Mesh) -> Vec<Vec3> {
    let mut q = PointsBuf::with_capacity(mesh.positions.len());
    for ((k, n), p) in (0..).zip(&mesh.normals).zip(&mesh.positions) {
        q.push(*n, n.any_orthonormal_vector(), *n, *p);
        q.locate(Vec2::ZERO, [k; 3], [0.0; 2]);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    (0..q.len()).map(|i| Vec3::new(rgb[0][i], rgb[1][i], rgb[2][i])).collect()
}

/// Spherical harmonics beside Haar wavelets, by coefficients of the light.
pub fn wavelets(o: &Options) -> Result<()> {
    const BANDS: [usize; 4] = [3, 5, 10, 14];
    const WAVELETS: [usize; 4] = [9, 25, 100, 200];
    // Shadows on the plate vary between vertices that are close.
    let finer = Refinement { coarsest: 1.0 / 48.0, ..Refinement::default() };
    let bunny = refine(&mesh::bunny()?, None, None, &finer, &Task::quiet())?;
    let (name, lights) = light::of(o, "environments/latlong/probulator_grace.hdr")?;
    let side = o.side.unwrap_or(200);
    let camera = Framing { share: 0.95, elevation: 0.35, ..Framing::default() };
    let camera = camera.camera(&bunny.positions).context("a mesh")?;
    let brdf = steradian_brdf::parse(&format!("lambert:albedo={ALBEDO}"))?;
    let scene = Scene {
        camera: Some(camera),
        settings: Settings { inner: 1, share: true, ..Settings::new(side, side) },
        background: steradian_render::scenefile::SceneBackground::Colour([0.0; 3]),
        ..Scene::new(bunny, vec![Material::new(brdf.clone())], lights)
    };
    say(&format!(
        "STAR04 7.4: a bunny under {name} by coefficients of the light, relative RMS error beside paths"
    ));
    let truth = drawn(&scene, &Shading::Paths(1))?;
    let image = &scene.lights.environment.as_ref().context("a light without an image")?.image;
    let of_light = sh::project(image, BANDS[3] - 1);
    let t = vectors(&scene.mesh, BANDS[3], Some(4096))?;
    let mut harmonics = Vec::new();
    for bands in BANDS {
        let n = bands * bands;
        let colour = |s: usize| {
            let channel = |c: usize| {
                let own = of_light.c[c][..n].iter().zip(t.vector(s, 0));
                let sum: f64 = own.map(|(l, t)| l * f64::from(*t)).sum();
                (ALBEDO / std::f64::consts::PI * sum).max(0.0) as f32
            };
            Vec3::new(channel(0), channel(1), channel(2))
        };
        let film = coloured(&scene.mesh, camera, &scene.settings, (0..t.len()).map(colour).collect())?;
        harmonics.push((format!("{n} coefficients"), film));
    }
    let geometry = Geometry::new(Arc::new(scene.mesh.clone()), Sites::Vertices);
    let material = steradian_techniques::Material::new(brdf);
    let technique = steradian_techniques::find("haar_transport").context("a technique")?;
    let task = Task::quiet();
    let bake = technique.bake(&scene.lights, &material, Some(&geometry), &Default::default(), &task)?;
    // Transport is the same however many wavelets of the light a frame sums.
    let mut saved = bake.save();
    let mut haar = Vec::new();
    for count in WAVELETS {
        saved.metadata.insert("steradian.param.wavelets".into(), count.to_string());
        let colours = at_vertices(&*technique.load(&saved)?, &scene.mesh);
        let film = coloured(&scene.mesh, camera, &scene.settings, colours)?;
        haar.push((format!("{count} wavelets"), film));
    }
    for films in [&mut harmonics, &mut haar] {
        films.push(("paths, direct light".into(), truth.clone()));
    }
    let rows = vec![row("harmonics", &harmonics, 0.0)?, row("Haar", &haar, 0.0)?];
    let subtitle = format!("Lambert's reflectance under {name}, direct light");
    save(o, "star04-haar.png", &sheet("Harmonics and wavelets", &subtitle, rows).draw())
}
