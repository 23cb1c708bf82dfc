//! Distant normal maps, filtered in three ways, against 16 × 16 samples a pixel of the finest map.

use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_render::{
    Background, BakeShader, Film, NormalFiltering, NormalMap, Settings, Shader, Stage, Surface, SurfaceMaps,
    render,
};
use steradian_scene::{Bvh, Camera, Mesh, shapes};
use steradian_techniques::shared::trials::lights;
use steradian_techniques::{Material, find};

const SIDE: usize = 24;
const TEXELS: usize = 256;

/// A tileable sum of waves of pseudo-random phases; `ridged` ones run along u only, as brushed metal's.
fn bumps(ridged: bool) -> NormalMap {
    let mut heights = vec![0.0f32; TEXELS * TEXELS];
    let mut phase = 0.1f32;
    for k in 0..24 {
        phase = (phase * 7.31 + 0.37).fract();
        let (a, b) = (3 + 5 * k % 23, if ridged { 0 } else { (7 * k) % 19 - 9 });
        let length = ((a * a + b * b) as f32).sqrt();
        for (i, h) in heights.iter_mut().enumerate() {
            let (u, v) = ((i % TEXELS) as f32 / TEXELS as f32, (i / TEXELS) as f32 / TEXELS as f32);
            let turns = a as f32 * u + b as f32 * v + phase;
            *h += (std::f32::consts::TAU * turns).sin() / length;
        }
    }
    NormalMap::from_heights(TEXELS, TEXELS, &heights, if ridged { 1.2 } else { 1.8 })
        .expect("a square of heights")
}

struct Scene {
    mesh: Mesh,
    bvh: Bvh,
    camera: Camera,
}

/// A floor or a ball, at a distance where a pixel in the middle covers `texels` texels a side.
fn scene(shape: &str, texels: f32) -> Scene {
    let fov_y = 0.7f32;
    let (mut mesh, distance, elevation) = match shape {
        "plane" => (shapes::plane(6.0, 0.0, 1), 4.0f32, 0.6f32),
        _ => (shapes::sphere(96), 3.2, 0.2),
    };
    let away = Vec3::new(0.0, elevation.sin(), elevation.cos());
    let camera = Camera::Pinhole { from: away * distance, at: Vec3::ZERO, up: Vec3::Y, fov_y };
    let metres = 2.0 * (0.5 * fov_y).tan() * distance / SIDE as f32;
    // Texture coordinates per metre: 1/6 on the plane, 1/2π by 1/π on the sphere.
    let per_metre =
        if shape == "plane" { Vec2::splat(1.0 / 6.0) } else { Vec2::new(FRAC_1_PI / 2.0, FRAC_1_PI) };
    let scale = Vec2::splat(texels / (metres * TEXELS as f32)) / per_metre;
    // Whole copies around the sphere.
    let scale = if shape == "plane" { scale } else { scale.round().max(Vec2::ONE) };
    mesh.uvs.iter_mut().for_each(|uv| *uv *= scale);
    let bvh = Bvh::build(&mesh);
    Scene { mesh, bvh, camera }
}

fn picture(
    s: &Scene,
    shader: &Arc<dyn Shader>,
    map: &Arc<NormalMap>,
    filtering: NormalFiltering,
    samples: usize,
) -> Film {
    let maps = SurfaceMaps { normal: Some(map.clone()), filtering, ..SurfaceMaps::default() };
    let surfaces = [Surface { shader: shader.clone(), base_colour: None, maps }];
    let background = Background::Colour([0.0; 3]);
    let stage =
        Stage { mesh: &s.mesh, bvh: &s.bvh, surfaces: &surfaces, background: &background, camera: s.camera };
    let settings = Settings { inner: samples, edge: samples.max(4), ..Settings::new(SIDE, SIDE) };
    render(&stage, &settings, &Task::quiet()).expect("nobody cancels")
}

/// Relative RMS difference where the shape is.
fn error(got: &Film, truth: &Film) -> f64 {
    let (mut off, mut all) = (0.0, 0.0);
    for i in (0..SIDE * SIDE).filter(|i| truth.alpha[*i] > 0.999) {
        for c in 0..3 {
            off += f64::from(got.rgb[c][i] - truth.rgb[c][i]).powi(2);
            all += f64::from(truth.rgb[c][i]).powi(2);
        }
    }
    (off / all).sqrt()
}

fn shader(slug: &str, spec: &str) -> Arc<dyn Shader> {
    let material = Material::new(steradian_brdf::parse(spec).expect("a spec"));
    let technique = find(slug).expect("a technique");
    let bake = technique.draft(&lights::studio(), &material, None, &ParamValues::default(), &Task::quiet());
    Arc::new(BakeShader(bake.expect("a bake")))
}

#[test]
fn filtered_normals_are_near_supersampling_and_their_mean_alone_is_not() {
    println!("relative RMS error against 16 x 16 samples: none, isotropic, covariance");
    let maps = [("bumps", Arc::new(bumps(false))), ("ridges", Arc::new(bumps(true)))];
    let full = std::env::var_os("STERADIAN_FULL").is_some();
    let (mut sums, mut count) = ([0.0; 3], 0.0);
    for (slug, spec) in [
        ("split_sum", "ggx:alpha=0.04,f0=0.9/0.6/0.3"),
        ("mirror_map", "ggx:alpha=0.002,f0=0.9/0.6/0.3"),
        ("phong_diffuse_maps", "phong-map:n=200"),
        ("gaussian_lobes", "ggx:alpha=0.04,f0=0.9/0.6/0.3"),
        ("gaussian_lobes", "sgd:nickel"),
    ] {
        let shader = shader(slug, spec);
        for shape in ["plane", "sphere"] {
            for (name, map) in &maps {
                for texels in [2.0, 6.0, 16.0] {
                    // Long runs measure all; others those that differ most.
                    if !full && (texels < 4.0 || shape == "sphere" && *name == "ridges") {
                        continue;
                    }
                    let s = scene(shape, texels);
                    let truth = picture(&s, &shader, map, NormalFiltering::None, 16);
                    let e =
                        NormalFiltering::ALL.map(|(_, f)| error(&picture(&s, &shader, map, f, 2), &truth));
                    println!(
                        "{slug:20} {shape:7} {name:7} {texels:4} texels a pixel: {:.3} {:.3} {:.3}",
                        e[0], e[1], e[2]
                    );
                    (0..3).for_each(|k| sums[k] += e[k]);
                    count += 1.0;
                    // A pixel of few texels is nearly its mean normal.
                    assert!(texels < 4.0 || e[2] < e[0], "{slug} {shape} {name} {texels}: {e:?}");
                }
            }
        }
    }
    println!("mean: {:.3} {:.3} {:.3}", sums[0] / count, sums[1] / count, sums[2] / count);
    assert!(sums[2] <= sums[1] && sums[1] < sums[0], "{sums:?}");
}

/// The normal that leans along the texture's u, and up in the texture, on surfaces that mirror it too.
#[test]
fn mapped_normals_follow_the_texture_on_mirrored_surfaces() {
    struct Normals;
    impl Shader for Normals {
        fn shade(
            &self,
            q: &steradian_techniques::Points<'_>,
            out: &mut steradian_techniques::Radiance<'_>,
            _: &Task,
        ) -> Result<(), steradian_base::Cancelled> {
            for c in 0..3 {
                (0..q.len()).for_each(|i| out.rgb[c][i] = q.n[c][i]);
            }
            Ok(())
        }
    }
    let shader: Arc<dyn Shader> = Arc::new(Normals);
    let lean = Vec3::new(0.36, 0.48, 0.8);
    let map = Arc::new(NormalMap::from_normals(1, 1, &[lean]).expect("one normal"));
    let camera = Camera::Orthographic { from: Vec3::Y * 5.0, at: Vec3::ZERO, up: Vec3::NEG_Z, height: 0.5 };
    for mirror in [1.0, -1.0] {
        let flip = glam::Affine3A::from_scale(Vec3::new(mirror, 1.0, 1.0));
        let mut made = shapes::plane(1.0, 0.0, 1);
        made.tangents.clear();
        made.make_tangents();
        for plane in [shapes::plane(1.0, 0.0, 1), made] {
            let mesh = plane.transformed(&flip);
            let s = Scene { bvh: Bvh::build(&mesh), mesh, camera };
            let film = picture(&s, &shader, &map, NormalFiltering::Covariance, 1);
            // u runs to +X (−X mirrored), v to +Z, so up in the texture is −Z.
            let want = Vec3::new(mirror * 0.36, 0.8, -0.48);
            let got = Vec3::from(film.pixel(SIDE * SIDE / 2 + SIDE / 2));
            assert!((got - want).length() < 1e-4, "{mirror}: {got} {want}");
        }
    }
}
