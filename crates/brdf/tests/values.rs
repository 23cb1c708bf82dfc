//! f of every model against values of a separate implementation of the contract's formulas.

use glam::DVec3;

#[test]
fn values_of_another_implementation() {
    let mut worst = Vec::new();
    for line in include_str!("values.csv").lines().filter(|l| !l.starts_with('#')) {
        let (spec, numbers) = line.split_once(';').expect("spec; numbers");
        let v: Vec<f64> = numbers.split(';').map(|x| x.parse().expect("number")).collect();
        let brdf = steradian_brdf::parse(spec).expect(spec);
        let (wi, wo) = (DVec3::new(v[0], v[1], v[2]), DVec3::new(v[3], v[4], v[5]));
        let f = brdf.eval(wi, wo);
        let f_cos = brdf.f_cos(wi, wo);
        // Its visibility is a search on a fine grid.
        let tolerance = if spec.starts_with("poulin") { 1e-3 } else { 1e-9 };
        for c in 0..3 {
            let scale = v[6 + c].abs().max(1e-12);
            assert!((f_cos[c] - f[c] * wi.z).abs() <= 1e-12 * (f[c] * wi.z).abs(), "{spec}: f_cos");
            if (f[c] - v[6 + c]).abs() > tolerance * scale {
                worst.push(format!("{spec} wi {wi} wo {wo}: {} instead of {}", f[c], v[6 + c]));
            }
        }
    }
    assert!(worst.is_empty(), "{}", worst.join("\n"));
}
