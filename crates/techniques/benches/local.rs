//! Measures techniques for local light: millions of points shaded a second on one core, one point light.
//! `cargo bench -p steradian-techniques --bench local [-- SLUG]`
//!
//! The baseline is exact shading of the same light (`vertex_analytic` with rate=pixel). Techniques with data
//! per texel have textures of 48 × 48 texels for every parameter that may vary, and those of photographs a
//! function of 24 × 24 texels under 21 × 21 directions. Those that need a mesh have a sphere, at whose
//! corners and between which the points lie. Least of nine runs of 65536 points by the clock, in batches of
//! 1024.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use glam::{Affine3A, DVec3, Vec2, Vec3};
use std::sync::Arc;
use std::time::Instant;
use steradian_base::{ParamValues, Task};
use steradian_prefilter::probe;
use steradian_scene::{Mesh, shapes};
use steradian_sphere::Frame;
use steradian_techniques::local::{LocalFrame, LocalLights};
use steradian_techniques::shared::trials::{lights, specimens};
use steradian_techniques::{Geometry, PointChart, PointsBuf, Radiance, Sites, View, find_local};

const POINTS: usize = 1 << 16;
const BATCH: usize = 1024;
const CASES: &[(&str, &str, &str)] = &[
    ("vertex_analytic", "rate=pixel", "banks:n=60"),
    ("banks_table", "", "banks:n=60"),
    ("vertex_analytic", "rate=pixel", "ggx:alpha=0.2,f0=0.9"),
    ("analytic_decomposition", "", "ggx:alpha=0.2,f0=0.9"),
    ("vertex_analytic", "rate=pixel", "cook-torrance:m=0.3,g=smith"),
    ("analytic_decomposition", "", "cook-torrance:m=0.3,g=smith"),
    ("vertex_analytic", "rate=pixel", "ashikhmin-shirley:nu=20,nv=200,rd=0.5"),
    ("analytic_decomposition", "", "ashikhmin-shirley:nu=20,nv=200,rd=0.5"),
    ("separable_svd", "", "lambert"),
    ("separable_svd", "terms=1", "ggx:alpha=0.2,f0=0.9"),
    ("separable_svd", "", "ggx:alpha=0.2,f0=0.9"),
    ("separable_svd", "", "ggx:alpha=0.2,f0=0.9/0.6/0.3"),
    ("separable_svd", "terms=8", "ggx:alpha=0.2,f0=0.9/0.6/0.3"),
    ("vertex_analytic", "rate=pixel", "ward:ax=0.15,ay=0.4,variant=1992"),
    ("separable_svd", "", "ward:ax=0.15,ay=0.4,variant=1992"),
    ("homomorphic", "", "cook-torrance:m=0.3,g=smith"),
    ("homomorphic", "", "ggx:alpha=0.2,f0=0.9/0.6/0.3"),
    ("homomorphic", "", "ward:ax=0.15,ay=0.4,variant=1992"),
    ("homomorphic", "samples=3125", "cook-torrance:m=0.3,g=smith"),
    ("separable_svd", "parametrisation=vl,terms=8", "ward:ax=0.15,ay=0.4,variant=1992"),
    ("bump_blinn_phong", "", "blinn-phong-gl:n=20"),
    ("bump_horizon", "", "lambert"),
    ("polynomial_texture_map", "", "lambert"),
    ("lafortune_svbrdf", "", "lambert"),
    ("shift_variant", "", "ward:ax=0.15,ay=0.4,rs=0.3,rd=0.4"),
    ("shift_variant", "", "ggx:ax=0.2,ay=0.4,f0=0.9"),
    ("btf_pca", "method=local", "lambert"),
    ("btf_pca", "method=view", "lambert"),
    ("btf_pca", "method=chained", "lambert"),
    ("precomputed_visibility", "bounces=0", "lambert"),
    ("precomputed_visibility", "bounces=1", "lambert"),
];

/// Points of a sphere of radius ½: at places of its own, or in the triangles of a mesh of it.
fn points(mesh: Option<&Mesh>) -> PointsBuf {
    let mut q = PointsBuf::with_capacity(POINTS);
    for k in 0..POINTS {
        let (mut n, mut corners, mut weights) = (probe::direction(k, POINTS), [0; 3], [0.0; 2]);
        if let Some(mesh) = mesh {
            corners = mesh.triangles[k * 7919 % mesh.triangles.len()];
            weights = [0.4, 0.35];
            let [a, b, c] = corners.map(|i| mesh.normals[i as usize]);
            n = (0.4 * a + 0.35 * b + 0.25 * c).normalize().as_dvec3();
        }
        let f = Frame::from_normal(n);
        let phi = k as f64 * 2.4;
        let wo = f.to_world(DVec3::new(0.6 * phi.cos(), 0.6 * phi.sin(), 0.8));
        q.push(f.n.as_vec3(), f.t.as_vec3(), wo.as_vec3(), f.n.as_vec3() * 0.5);
        let uv = Vec2::new(0.754_878, 0.569_84) * k as f32;
        q.locate(uv.fract(), corners, weights);
        let (n, t) = (f.n.as_vec3().to_array(), f.t.as_vec3().to_array());
        q.chart(PointChart { n, t, side: 1.0, footprint: 0.01 });
    }
    q
}

fn main() {
    let ball =
        shapes::by_name("sphere").expect("a shape").transformed(&Affine3A::from_scale(Vec3::splat(0.5)));
    let sphere = Geometry::new(Arc::new(ball), Sites::Vertices);
    let (q, sited) = (points(None), points(Some(&*sphere.mesh)));
    let points = vec![lights::near_point().points[0]];
    let lamps = LocalLights { points, ..LocalLights::default() };
    let frame = LocalFrame { lights: &lamps, view: &View::default(), mesh: None, shadowed: false };
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; BATCH]);
    let only = std::env::args().skip(1).find(|a| !a.starts_with('-'));
    for &(slug, body, spec) in CASES.iter().filter(|c| only.as_ref().is_none_or(|o| o == c.0)) {
        let t = find_local(slug).expect("a technique");
        let params = ParamValues::parse(body, t.params()).expect("parameters");
        let brdf = steradian_brdf::parse(spec).expect("a spec");
        let material = specimens::material(brdf, t.planes());
        let geometry = t.needs_sites(&params).then_some(&sphere);
        let q = if geometry.is_some() { &sited } else { &q };
        let start = Instant::now();
        let b = t.bake(&material, geometry, &params, &Task::quiet()).expect("bakes");
        let baked = start.elapsed().as_secs_f64();
        let mesh = geometry.map(|g| &*g.mesh);
        let shading = b.lit(&LocalFrame { mesh, ..frame }).expect("the mesh that is needed");
        let mut run = || {
            let start = Instant::now();
            for k in 0..POINTS / BATCH {
                shading.add(None, &q.slice(k * BATCH..(k + 1) * BATCH), &mut Radiance::of(&mut rgb));
            }
            start.elapsed().as_secs_f64()
        };
        let best = (0..9).map(|_| run()).fold(f64::INFINITY, f64::min);
        let speed = POINTS as f64 / best / 1e6;
        println!(
            "{slug:23} {body:27} {spec:40} {speed:7.1} Mpoint/s, baked in {baked:.3} s, {} bytes, error {:.1e}",
            b.bytes(),
            b.certificate().error
        );
    }
}
