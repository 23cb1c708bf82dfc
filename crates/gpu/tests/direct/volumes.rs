//! Shadow volumes.

use super::{Direct, case, film, flip, gpu, lit};
use glam::{Affine3A, DVec3, Vec3};
use libtest_mimic::Failed;
use std::sync::Arc;
use steradian_base::Task;
use steradian_gpu::Renderer;
use steradian_gpu::scene::{Path, Picture, Rate, Settings};
use steradian_light::{DirectionalLight, Environment, PointLight};
use steradian_scene::shadow::{Blocker, Flat, LightAt, ShadowVolumes};
use steradian_scene::{Bvh, Camera, Mesh, Ray};
use steradian_techniques::local::{LocalFrame, LocalLights};
use steradian_techniques::{Material, View, find_local};

/// Techniques for directional and point lights that are put behind volumes: one with one reflectance, and one
/// with data per texel, which share the loops over lights with all others.
pub const LOCALS: [(&str, &str); 2] = [
    ("analytic_decomposition", "ggx:alpha=0.6,f0=0.8"),
    ("lafortune_svbrdf", "lafortune:cx=-1,cy=-1,cz=1,n=3,ks=0.3,kd=0.5"),
];

/// Shadow volumes against rays, of a light a channel: a distant one, one above and one inside a knot over a
/// floor, under a lid whose edges are open. Seen from the distant light, by parallel rays too, from inside
/// the shadows of all three, and from the side. The lights are shaded exactly, or by a technique.
#[allow(clippy::print_stdout, reason = "what the documentation states")]
pub fn against_rays(local: Option<(&str, &str)>) -> Result<(), Failed> {
    const SIDE: usize = 96;
    let gpu = gpu()?;
    let lift = |x, y, z| Affine3A::from_translation(Vec3::new(x, y, z));
    let mut mesh = Mesh::merged(&[
        steradian_scene::shapes::by_name("plane:size=6")?,
        steradian_scene::shapes::knot(2, 3, 0.6, 0.3, 0.1, 4).transformed(&lift(0.0, 1.0, 0.0)),
        steradian_scene::shapes::by_name("plane:size=0.5")?
            .transformed(&(lift(-0.7, 2.2, -0.6) * Affine3A::from_rotation_x(0.4))),
    ]);
    mesh.normals.clear();
    let sun = DVec3::new(0.36, 0.8, 0.48);
    let lamps = [Vec3::new(1.3, 2.9, 0.4), Vec3::new(0.05, 1.02, 0.1)];
    let mut case = case(1, SIDE);
    case.mesh = (mesh.clone(), Bvh::build(&mesh));
    // Almost all light is that of the lamps.
    case.lights.environment = steradian_light::sky::by_name("furnace", 64, 32)
        .map(|s| Arc::new(Environment { image: s.image }))
        .ok();
    let mut lit = lit(case, "sh_irradiance", "lambert:albedo=0.8")?;
    let lamp = |position, intensity| PointLight { position, intensity };
    lit.direct = Direct {
        directionals: vec![DirectionalLight { direction: sun, irradiance: [30.0, 0.0, 0.0] }],
        points: vec![lamp(lamps[0], [0.0, 120.0, 0.0]), lamp(lamps[1], [0.0, 0.0, 12.0])],
        ..Direct::default()
    };
    if let Some((slug, spec)) = local {
        let t = find_local(slug).ok_or("no such technique")?;
        let material = Material::new(steradian_brdf::parse(spec)?);
        let bake = t.bake(&material, None, &Default::default(), &Task::quiet())?;
        let Direct { directionals, points, .. } = std::mem::take(&mut lit.direct);
        let lights = &LocalLights { directionals, points };
        let frame = LocalFrame { lights, view: &View::default(), mesh: None, shadowed: true };
        lit.local = Some(bake.lit(&frame)?.gpu().ok_or("no text for GPUs")?);
    }
    let sun = sun.as_vec3();
    let bvh = lit.case.mesh.1.clone();
    let rays = bvh.flat().ok_or("no form for GPUs")?;
    // Eight more lights before them, of no power, so that bits of lights fill more than a word.
    let others = (0..8).map(|k| LightAt::Near(Vec3::new(k as f32 - 3.5, 4.0, 0.0)));
    let places = [LightAt::Far(sun), LightAt::Near(lamps[0]), LightAt::Near(lamps[1])];
    let few = ShadowVolumes::new(&mesh, &places).flat().ok_or("no form for GPUs")?;
    let places: Vec<LightAt> = others.chain(places).collect();
    let many = ShadowVolumes::new(&mesh, &places).flat().ok_or("no form for GPUs")?;
    let unseen = |p: &Vec3| {
        let blocked = |to: Vec3, reach| bvh.occluded(&Ray { origin: *p, direction: to.normalize() }, reach);
        blocked(sun, f32::INFINITY) && lamps.iter().all(|l| blocked(l - p, (l - p).length()))
    };
    let mut below =
        (0..400).map(|k| Vec3::new(0.1 * (k % 20) as f32 - 1.0, 0.4, 0.1 * (k / 20) as f32 - 1.0));
    let inside = below.find(unseen).ok_or("no place without light")?;
    let at = Vec3::new(0.0, 0.9, 0.0);
    let pinhole = |from, at| Camera::Pinhole { from, at, up: Vec3::Y, fov_y: 0.9 };
    let views = [
        ("from the light", pinhole(at + 3.0 * sun, at)),
        ("from the dark", pinhole(inside, Vec3::new(-inside.x, 0.6, -inside.z))),
        ("from aside", pinhole(Vec3::new(2.5, 0.8, -2.0), at)),
        ("parallel", Camera::Orthographic { from: at + 3.0 * sun, at, up: Vec3::Y, height: 4.0 }),
    ];
    for path in [Path::Raster, Path::Compute] {
        let renderer = |by: Option<&Flat>, rate| {
            let settings = Settings { path, rate, ..Settings::new(SIDE, SIDE) };
            Renderer::new(gpu, lit.scene_behind(by), &settings)
        };
        let mut all = [
            renderer(Some(&rays), Rate::Sample)?,
            renderer(Some(&few), Rate::Sample)?,
            // Where a triangle is shaded once a pixel, it gets the mean of its samples' shadows.
            renderer(Some(&many), Rate::Pixel)?,
            renderer(None, Rate::Sample)?,
        ];
        for (view, camera) in views {
            let mut pictures = Vec::new();
            for r in &mut all {
                r.set_camera(gpu, camera);
                pictures.push(r.render(gpu)?.0);
            }
            let differ = |p: &Picture| {
                let each = [0, 1, 2].map(|c| beside_silhouettes(&pictures[0].rgb[c], &p.rgb[c], SIDE));
                each.into_iter().fold((0, 0), |(a, b), (c, d)| (a + c, b + d))
            };
            flip(&format!("volumes-{view}-{path:?}"), &film(&pictures[0]), &film(&pictures[1]));
            let [sample, pixel, open] = [1, 2, 3].map(|k| differ(&pictures[k]));
            let line = format!(
                "{view}, {path:?}: of three times {} pixels so many differ beside silhouettes and elsewhere: {sample:?} with volumes at every \
                 sample, {pixel:?} once a pixel, {open:?} without shadows",
                SIDE * SIDE
            );
            println!("{line}");
            if sample.0 > 60 || sample.1 > 4 || pixel.1 > 60 || open.1 < 800 {
                return Err(line.into());
            }
        }
    }
    Ok(())
}

/// Pixels that differ by more than a hundredth of the brightest: those whose values lie within those of
/// `truth` at most a pixel away, and all others.
fn beside_silhouettes(truth: &[f32], picture: &[f32], side: usize) -> (usize, usize) {
    let margin = 0.01 * truth.iter().fold(0.0f32, |m, x| m.max(*x));
    let (mut beside, mut elsewhere) = (0, 0);
    for (i, (a, b)) in truth.iter().zip(picture).enumerate() {
        if (a - b).abs() <= margin {
            continue;
        }
        let (x, y) = (i % side, i / side);
        let columns = x.saturating_sub(1)..(x + 2).min(side);
        let rows = y.saturating_sub(1)..(y + 2).min(side);
        let around = rows.flat_map(|y| columns.clone().map(move |x| truth[y * side + x]));
        let (low, high) = around.fold((*a, *a), |(low, high), v| (low.min(v), high.max(v)));
        *if (low - margin..=high + margin).contains(b) { &mut beside } else { &mut elsewhere } += 1;
    }
    (beside, elsewhere)
}
