use crate::local::{Content, LocalBake, Place, Plane};
use crate::shared::trials::specimens::{self, direction, single};
use std::f64::consts::PI;
use steradian_relight::polynomial::evaluate;
use steradian_scene::surface::Planes;

fn bake(spec: &str, planes: Planes) -> Box<dyn LocalBake> {
    specimens::bake("polynomial_texture_map", spec, planes)
}

/// Without a map: the closed form of Lambert's law, off by an eighth of its RMS over lights uniform on the hemisphere.
#[test]
fn lambert_has_its_closed_form() {
    let b = bake("lambert:albedo=0.8", Planes::default());
    let (mut squares, mut energy) = (0.0, 0.0);
    for k in 1..4000 {
        let wi = direction(k, 0.0);
        let want = 0.8 / PI * (9.0 / 8.0 - 15.0 / 16.0 * (1.0 - wi.z * wi.z));
        let got = f64::from(b.f_cos(single(wi), [0.0, 0.6, 0.8])[1]);
        assert!((got - want).abs() < 2e-3, "{k}: {got} {want}");
        squares += (got - 0.8 / PI * wi.z).powi(2);
        energy += (0.8 / PI * wi.z).powi(2);
    }
    assert!(((squares / energy).sqrt() - 0.125).abs() < 2e-3);
    assert!((b.certificate().error - 0.125).abs() < 0.01, "{}", b.certificate().error);
}

/// A map's polynomials are what is shaded, clamped at 0, whatever the view; the mean of a footprint is that of the coefficients.
#[test]
fn maps_are_evaluated_as_they_are() {
    let planes = specimens::planes(&[Plane::new("map", Content::Polynomials)]);
    let b = bake("lambert", planes);
    assert!(b.certificate().error < 1e-5, "{}", b.certificate().error);
    let side = specimens::SIDE as f64;
    for k in 0..300u32 {
        let (i, j) = ((7 * k % 48) as usize, (11 * k % 48) as usize);
        let uv = [(i as f64 + 0.5) / side, (j as f64 + 0.5) / side].map(|x| x as f32);
        let wi = direction(k, 0.01);
        let got = b.f_cos_at(Place { uv, footprint: 0.0 }, single(wi), single(direction(3 * k, 0.1)));
        for c in 0..3 {
            let a = specimens::polynomial(i, j).map(|a| a[c]);
            assert!((f64::from(got[c]) - evaluate(&a, wi).max(0.0) / PI).abs() < 1e-6, "{k}");
        }
        assert_eq!(b.f_cos_at(Place { uv, footprint: 0.0 }, single(-wi), [0.0, 0.0, 1.0]), [0.0; 3]);
    }
    let mean = b.f_cos_at(Place { uv: [0.5; 2], footprint: 1.0 }, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
    let all = (0..48 * 48).map(|k| specimens::polynomial(k % 48, k / 48)[5][0]).sum::<f64>() / (48.0 * 48.0);
    assert!((f64::from(mean[0]) - all / PI).abs() < 1e-5);
}
