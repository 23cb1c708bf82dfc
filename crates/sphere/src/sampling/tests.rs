//! Inverses, densities that integrate to 1, moments, published values.

use super::*;
use crate::{Layout, SphereImage};

fn points() -> impl Iterator<Item = DVec2> {
    (0..4000).map(|k| R2::default().point(k))
}

#[test]
fn inverses_invert() {
    for u in points() {
        let versine = cone::versine(0.00465);
        let pairs = [
            sphere::invert(sphere::sample(u)),
            hemisphere::invert(hemisphere::sample(u)),
            cosine_hemisphere::invert(cosine_hemisphere::sample(u)),
            cone::invert(versine, cone::sample(versine, u)),
            disk::invert(disk::sample(u)),
        ];
        for (k, v) in pairs.into_iter().enumerate() {
            assert!((v - u).length() < 1e-9, "{k}: {u} {v}");
        }
        for d in [sphere::sample(u), hemisphere::sample(u), cosine_hemisphere::sample(u)] {
            assert!((d.length() - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn means_are_the_distributions() {
    let mean = |f: &dyn Fn(DVec2) -> f64| points().map(f).sum::<f64>() / 4000.0;
    assert!(mean(&|u| sphere::sample(u).z).abs() < 2e-3);
    assert!((mean(&|u| hemisphere::sample(u).z) - 0.5).abs() < 2e-3);
    assert!((mean(&|u| cosine_hemisphere::sample(u).z) - 2.0 / 3.0).abs() < 2e-3);
    assert!((mean(&|u| disk::sample(u).length_squared()) - 0.5).abs() < 2e-3);
    // ∫ cos⁴ over the hemisphere = 2π/5 by two densities.
    let by_cosine = mean(&|u| {
        let d = cosine_hemisphere::sample(u);
        d.z.powi(4) / cosine_hemisphere::pdf(d)
    });
    assert!((by_cosine / (TAU / 5.0) - 1.0).abs() < 5e-3);
}

#[test]
fn environments_are_sampled_by_their_light() {
    let image = SphereImage::from_fn(Layout::LatLong, 32, 16, |d| {
        if d.y > 0.9 { [50.0; 3] } else { [(1.0 + d.x) as f32, 1.0, 0.5] }
    });
    let dist = SphereDistribution::new(&image).expect("lat-long");
    let mut total = 0.0;
    let mut estimate = 0.0;
    for u in points() {
        let (d, pdf) = dist.sample(u);
        assert!((dist.invert(d) - u).length() < 1e-9);
        assert!((dist.pdf(d) / pdf - 1.0).abs() < 1e-9);
        let l = image.nearest(d);
        let (texel, same, _) = dist.sample_texel(u);
        assert!(same == d && [0, 1, 2].map(|c| image.planes[c][texel]) == l);
        // Density ∝ the sum of the channels: the estimate has no variance.
        estimate += f64::from(l[0] + l[1] + l[2]) / pdf / 4000.0;
    }
    for j in 0..16 {
        for i in 0..32 {
            let d = Layout::LatLong.texel_direction(32, 16, 0, i, j).expect("inside");
            total += dist.pdf(d) * Layout::LatLong.solid_angle(32, 16, 0, i, j);
        }
    }
    assert!((total - 1.0).abs() < 1e-12);
    let exact: f64 = image.integral().iter().sum();
    assert!((estimate / exact - 1.0).abs() < 1e-6, "{estimate} {exact}");
    assert!(SphereDistribution::new(&SphereImage::new(Layout::Cube, 4, 4)).is_none());
    let dark = SphereDistribution::new(&SphereImage::new(Layout::LatLong, 8, 4)).expect("lat-long");
    assert!((dark.pdf(DVec3::Z) - 0.25 / PI).abs() < 1e-12);
}

#[test]
fn pieces_without_weight_are_not_sampled() {
    let d = Distribution1d::new([0.0, 2.0, 0.0, 1.0, 0.0]);
    for k in 0..1000 {
        let (piece, f) = d.sample(f64::from(k) / 1000.0);
        assert!((piece == 1 || piece == 3) && (0.0..1.0).contains(&f));
    }
    assert_eq!(d.sample(1.0).0, 4usize.min(d.sample(1.0).0));
}

/// The piece is that of a search through all sums: of even weights, of one that outshines all others, and at
/// sums themselves.
#[test]
fn pieces_are_those_of_a_search() {
    for bright in [1.0, 1e3, 1e9] {
        let weights = (0..200).map(|k| if k == 77 { bright } else { f64::from(k % 7) });
        let d = Distribution1d::new(weights);
        let places = (0..=d.len()).flat_map(|k| {
            let at = d.invert(k.min(d.len() - 1), 0.0);
            [at, at.next_up(), at.next_down().max(0.0), k as f64 / d.len() as f64]
        });
        for u in places.filter(|u| *u < 1.0) {
            let (k, _) = d.sample(u);
            let ends = [d.invert(k, 0.0), d.invert(k, 1.0)];
            assert!(ends[0] <= u && d.probability(k) > 0.0, "{u}: {k} {ends:?}");
            assert!((k + 1..d.len()).all(|k| d.invert(k, 0.0) > u), "{u}: {k} {ends:?}");
        }
    }
}

/// The first outputs of the reference implementation's demo, seed 42, stream 54.
#[test]
fn pcg_gives_the_published_numbers() {
    let mut rng = Pcg32::new(42, 54);
    let first = [0xa15c02b7u32, 0x7b47f409, 0xba1d3330, 0x83d2f293, 0xbfa4784b, 0xcbed606e];
    assert!(first.iter().all(|&v| rng.next_u32() == v));
    let x = rng.next_f64();
    assert!((0.0..1.0).contains(&x));
}

#[test]
fn hammersley_is_a_net() {
    let cells: std::collections::BTreeSet<_> =
        (0..16).map(|k| hammersley(k, 16)).map(|p| ((p.x * 4.0) as u32, (p.y * 4.0) as u32)).collect();
    assert_eq!(cells.len(), 16);
}
