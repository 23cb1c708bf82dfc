//! A sunless map and its disks light surfaces as the original does, by the reference.

use glam::DVec3;
use steradian_base::Task;
use steradian_light::suns::{SunOptions, extract};
use steradian_light::{Environment, Lights};
use steradian_reference::{Lookup, Reference, ReferencePoint};
use steradian_sphere::Frame;

/// Points that see the sun's highlight at its centre, next to it, and far from it.
fn points(sun: DVec3) -> Vec<ReferencePoint> {
    let mut out = Vec::new();
    for k in 0..12 {
        let y = 1.0 - (2.0 * f64::from(k) + 1.0) / 12.0;
        let phi = f64::from(k) * 2.399_963_229_728_653;
        let wo = DVec3::new((1.0 - y * y).sqrt() * phi.cos(), y, (1.0 - y * y).sqrt() * phi.sin());
        // The half vector of sun and view, and normals turned from it by up to a radian.
        let across = wo.any_orthonormal_vector();
        let n = ((sun + wo).normalize_or(across) + across * (0.08 * f64::from(k % 6))).normalize();
        if n.dot(wo) > 0.05 {
            out.push(ReferencePoint { frame: Frame::from_normal(n), wo, position: None });
        }
    }
    out
}

/// Relative RMS difference over points of the radiance under both lights, at most `bound` for every width of
/// the lobe.
#[test]
fn sunless_and_disks_light_as_the_original() {
    let task = Task::quiet();
    for (name, bound) in
        [("rooitou_park_1k", 5e-3), ("spiaggia_di_mondello_1k", 5e-3), ("immenstadter_horn_1k", 2e-2)]
    {
        let Some(path) = steradian_testkit::data(&format!("environments/latlong/{name}.hdr")) else { return };
        let loaded = steradian_light::load::load(&path, &Default::default()).expect("readable");
        let environment = loaded.into_environment();
        let e = extract(&environment.image, &SunOptions::default());
        let sun = e.suns[0].direction;
        let split = Lights { disks: e.suns, ..Lights::from(Environment { image: e.sunless }) };
        let reference = |l: &Lights| Reference::new(l, Lookup::Constant, &task).expect("sound");
        let (original, split) = (reference(&environment.into()), reference(&split));
        let points = points(sun);
        assert!(points.len() > 6);
        for alpha in [0.1, 0.2, 0.4, 0.7, 1.0] {
            let brdf = steradian_brdf::parse(&format!("ggx:alpha={alpha}")).expect("spec");
            let run = |j: &Reference| j.radiance_batch(&*brdf, &points, 1e-4, &task).expect("nobody cancels");
            let (mut off, mut whole) = (0.0, 0.0);
            for (a, b) in run(&original).into_iter().zip(run(&split)) {
                for c in 0..3 {
                    off += (a.rgb[c] - b.rgb[c]).powi(2);
                    whole += a.rgb[c].powi(2);
                }
            }
            let error = f64::sqrt(off / whole);
            println!("{name} alpha {alpha}: {error:.2e}");
            assert!(error < bound, "{name} alpha {alpha}: {error:e}");
        }
    }
}
