//! Figures 3, 7 and 8 of Kautz, Sloan & Snyder 2002: brushed metal under several lights, shadows with
//! anisotropic reflectance, and reflectance models beside each other, on meshes.

use super::mesh::{self, brushed};
use super::{Options, light, save, say};
use anyhow::{Context, Result, anyhow};
use glam::{Affine3A, Vec3};
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_brdf::{SharedBrdf, parse};
use steradian_light::Lights;
use steradian_render::tone::auto_exposure;
use steradian_render::{
    Background, BakeShader, Cell, Develop, Display, Row, Settings, Sheet, Stage, Surface, SurfaceMaps,
    ToneMapper, render,
};
use steradian_scene::{Bvh, Camera, Framing, Mesh, shapes};
use steradian_techniques::{AnyBake, Geometry, Material, Sites, View, find};

/// Brushed metal.
const BRUSHED: &str = "ashikhmin-shirley:nu=24,nv=2,rs=0.9/0.8/0.6";
/// Where the window over the light's bands ends: five bands of lamps ring.
const WINDOW: f64 = 6.0;
/// All light in the coefficients, as in the paper.
const OPEN: [(&str, f64); 2] = [("lights", 0.0), ("window", WINDOW)];
/// Lights of figure 3, of the data folder; the built-in studio stands in where they are missing.
const LIGHTS: [&str; 4] =
    ["probulator_grace.hdr", "probulator_uffizi.hdr", "probulator_ennis.hdr", "probulator_pisa.hdr"];

fn baked(
    slug: &str,
    mesh: &Mesh,
    brdf: &SharedBrdf,
    lights: &Lights,
    params: &[(&str, f64)],
) -> Result<Box<dyn AnyBake>> {
    let technique = find(slug).with_context(|| format!("no technique {slug}"))?;
    let values: ParamValues = params.iter().copied().collect();
    let geometry =
        technique.needs_sites(&values).then(|| Geometry::new(Arc::new(mesh.clone()), Sites::Vertices));
    technique
        .bake(lights, &Material::new(brdf.clone()), geometry.as_ref(), &values, &Task::quiet())
        .map_err(|e| anyhow!("{e}"))
}

/// A picture of a mesh, developed at its own exposure.
fn picture(mesh: &Mesh, mut bake: Box<dyn AnyBake>, side: usize) -> Result<Display> {
    let framing = Framing { share: 0.85, ..Framing::default() };
    let camera = framing.camera(&mesh.positions).context("an empty mesh")?;
    let (Camera::Pinhole { from, .. } | Camera::Orthographic { from, .. }) = camera;
    bake.frame(&View { eye: from, forward: camera.axes()[2], ..View::default() });
    let surfaces =
        [Surface { shader: Arc::new(BakeShader(bake)), base_colour: None, maps: SurfaceMaps::default() }];
    let stage = Stage {
        mesh,
        bvh: &Bvh::build(mesh),
        surfaces: &surfaces,
        background: &Background::Colour([0.0; 3]),
        camera,
    };
    let film = render(&stage, &Settings::new(side, side), &Task::quiet())?;
    let ev = auto_exposure(&film, |i| film.alpha[i]);
    Ok(Develop { ev, mapper: ToneMapper::Aces }.film(&film))
}

fn cell(picture: Display, caption: String) -> Option<Cell> {
    Some(Cell { picture, caption: vec![caption] })
}

/// Figure 3: a brushed head under several lights.
pub fn lights(o: &Options) -> Result<()> {
    let brdf = parse(o.brdfs.first().map_or(BRUSHED, String::as_str))?;
    let head = brushed(mesh::bust()?, Vec3::Y);
    let mut cells = Vec::new();
    for file in LIGHTS {
        let (name, lights) = light::of(o, &format!("environments/latlong/{file}"))?;
        let bake = baked("sh_brdf", &head, &brdf, &lights, &OPEN)?;
        say(&format!(
            "KSS02 figure 3: {} under {name}: {}",
            brdf.spec(),
            super::picture::certified(bake.certificate())
        ));
        cells.push(cell(picture(&head, bake, o.side.unwrap_or(256))?, name));
        if o.light.is_some() {
            break;
        }
    }
    let sheet = Sheet {
        title: "Brushed metal".into(),
        subtitle: format!(
            "{}, brushed along +Y, 25 coefficients under a window, all light in them",
            brdf.spec()
        ),
        columns: vec![String::new(); cells.len()],
        rows: vec![Row { label: Vec::new(), cells }],
        text_size: 12.5,
    };
    save(o, "kss02-3.png", &sheet.draw())
}

/// Figure 7: isotropic, anisotropic, brushed otherwise; without and with shadows.
pub fn shadows(o: &Options) -> Result<()> {
    let (name, lights) = light::of(o, "environments/latlong/probulator_grace.hdr")?;
    let columns = [
        ("isotropic", "ashikhmin-shirley:nu=16,nv=16", Vec3::Y),
        ("anisotropic", "ashikhmin-shirley:nu=64,nv=4", Vec3::Y),
        ("brushed otherwise", "ashikhmin-shirley:nu=64,nv=4", Vec3::X),
    ];
    let mut rows = [Vec::new(), Vec::new()];
    for (_, spec, along) in columns {
        let (brdf, shape) = (parse(spec)?, brushed(mesh::knot(), along));
        for (row, slug) in rows.iter_mut().zip(["sh_brdf", "prt_brdf"]) {
            let params: &[(&str, f64)] =
                if slug == "sh_brdf" { &OPEN } else { &[("precision", 0.01), ("window", WINDOW)] };
            let bake = baked(slug, &shape, &brdf, &lights, params)?;
            let error = super::picture::certified(bake.certificate());
            say(&format!("KSS02 figure 7: {spec} along {along}: {slug} {error}"));
            row.push(cell(picture(&shape, bake, o.side.unwrap_or(256))?, error));
        }
    }
    let [open, shadowed] = rows;
    let row = |label: &str, cells| Row { label: vec![label.into()], cells };
    let sheet = Sheet {
        title: "Anisotropic reflectance with transfer".into(),
        subtitle: format!(
            "under {name}, 25 coefficients under a window; errors as certified, with transfer against paths"
        ),
        columns: columns.map(|c| c.0.to_string()).into(),
        rows: vec![row("no shadows", open), row("shadows", shadowed)],
        text_size: 12.5,
    };
    save(o, "kss02-7.png", &sheet.draw())
}

/// Figure 8: models by columns, shapes by rows. The paper's foil and vinyl are measurements that are not
/// public; materials fitted to measurements stand in, and `--brdf` adds others.
pub fn models(o: &Options) -> Result<()> {
    let (name, lights) = light::of(o, "environments/latlong/probulator_grace.hdr")?;
    let mut specs: Vec<String> = [
        "ashikhmin-shirley:nu=48,nv=4",
        "poulin-fournier:n=20,d=3,h=0.3",
        "sgd:alum-bronze",
        "sgd:black-phenolic",
    ]
    .map(String::from)
    .into();
    specs.extend(o.brdfs.iter().cloned());
    let about = Affine3A::from_rotation_y(std::f32::consts::PI);
    let shapes = [
        ("ball", brushed(shapes::sphere(128), Vec3::Y)),
        (
            "teapot",
            brushed(mesh::of("teapot.obj", || shapes::teapot(16, true))?.transformed(&about), Vec3::Y),
        ),
        ("head", brushed(mesh::bust()?, Vec3::Y)),
    ];
    let mut rows: Vec<Row> =
        shapes.iter().map(|s| Row { label: vec![s.0.into()], cells: Vec::new() }).collect();
    for spec in &specs {
        let brdf = parse(spec)?;
        for (row, (shape, mesh)) in rows.iter_mut().zip(&shapes) {
            let bake = baked("sh_brdf", mesh, &brdf, &lights, &OPEN)?;
            let error = super::picture::certified(bake.certificate());
            if *shape == "ball" {
                say(&format!("KSS02 figure 8: {spec}: {error}"));
            }
            row.cells.push(cell(picture(mesh, bake, o.side.unwrap_or(200))?, String::new()));
        }
    }
    let sheet = Sheet {
        title: "Models on shapes".into(),
        subtitle: format!("under {name}, 25 coefficients under a window, brushed along +Y"),
        columns: specs,
        rows,
        text_size: 11.0,
    };
    save(o, "kss02-8.png", &sheet.draw())
}
