//! Irradiance by nine coefficients: as numbers for engines' files, and as source text for shaders.

use std::f64::consts::PI;
use steradian_brdf::dfg::text::Language;
use steradian_sphere::sh::ShRgb;

/// Factors A_l of the clamped cosine's bands 0 to 2.
pub(crate) const COSINE: [f64; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];

/// Coefficients of radiance, bands 0 to 2, times A_l: irradiance.
pub fn irradiance(sh: &ShRgb) -> Vec<[f64; 3]> {
    (0..9).map(|i: usize| std::array::from_fn(|c| sh.c[c][i] * COSINE[i.isqrt()])).collect()
}

/// Irradiance of coefficients of radiance, bands 0 to 2, as a polynomial of the normal: E(n) = c0 + c1 y + c2
/// z + c3 x + c4 xy + c5 yz + c6 (3z² − 1) + c7 zx + c8 (x² − y²) (Ramamoorthi & Hanrahan 2001, *An efficient
/// representation for irradiance environment maps*, eq. 13, in our order). W m⁻², no 1/π.
pub fn polynomial(sh: &ShRgb) -> [[f64; 3]; 9] {
    let k = |factor: f64| (factor / PI).sqrt() / 2.0;
    let basis = [k(1.0), k(3.0), k(3.0), k(3.0), k(15.0), k(15.0), k(5.0) / 2.0, k(15.0), k(15.0) / 2.0];
    let e = irradiance(sh);
    std::array::from_fn(|i| e[i].map(|v| v * basis[i]))
}

/// Nine coefficients of diffuse light as an engine's files hold them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CoefficientForm {
    /// Spherical harmonics of irradiance, as [`irradiance`] gives them.
    Harmonics,
    /// [`polynomial`] over π, so that the value at a normal n is E(n)/π: s0 + s1 y + s2 z + s3 x + s4 yx + s5
    /// yz + s6 (3z² − 1) + s7 zx + s8 (x² − y²).
    Polynomial,
}

impl CoefficientForm {
    /// The coefficients of a light of these coefficients of radiance, bands 0 to 2.
    pub fn of(self, sh: &ShRgb) -> Vec<[f64; 3]> {
        match self {
            Self::Harmonics => irradiance(sh),
            Self::Polynomial => polynomial(sh).map(|e| e.map(|v| v / PI)).into(),
        }
    }
}

/// A function `irradiance` of the unit normal over world x, y, z (right-handed, y up) for a shader; `None`
/// for languages that are no shader's. `notes` go into the comment above it, one line each.
pub fn irradiance_source(sh: &ShRgb, language: Language, notes: &[String]) -> Option<String> {
    let c = polynomial(sh);
    let (vec3, head, constant) = match language {
        Language::Wgsl => ("vec3<f32>", "fn irradiance(n: vec3<f32>) -> vec3<f32> {", "let"),
        Language::Glsl => ("vec3", "vec3 irradiance(vec3 n) {", "const vec3"),
        Language::Rust => return None,
    };
    let mut out = String::from(
        "// Irradiance E(n), W m^-2, of 9 spherical harmonic coefficients; n is the unit normal, world axes, y up.\n\
         // Outgoing radiance of a diffuse surface is albedo / pi times this. Below 0 where the light is sharp.\n",
    );
    notes.iter().for_each(|n| out.push_str(&format!("// {}\n", n.replace(['\n', '\r'], " "))));
    out.push_str(head);
    out.push('\n');
    for (i, v) in c.iter().enumerate() {
        // A decimal point in every number, as GLSL wants it.
        let [r, g, b] = v.map(|x| format!("{:?}", x as f32));
        out.push_str(&format!("    {constant} c{i} = {vec3}({r}, {g}, {b});\n"));
    }
    out.push_str(
        "    return c0 + c1 * n.y + c2 * n.z + c3 * n.x\n        \
         + c4 * (n.x * n.y) + c5 * (n.y * n.z) + c6 * (3.0 * n.z * n.z - 1.0)\n        \
         + c7 * (n.z * n.x) + c8 * (n.x * n.x - n.y * n.y);\n}\n",
    );
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn light() -> ShRgb {
        let mut sh = ShRgb::zero(2);
        sh.c.iter_mut().flatten().enumerate().for_each(|(i, c)| *c = (1.7 * i as f64).sin() * 1e-3 + 0.3);
        sh
    }

    /// The value of the polynomial at a normal, written as the text has it.
    fn at(c: &[[f64; 3]], n: DVec3) -> [f64; 3] {
        let (x, y, z) = (n.x, n.y, n.z);
        let basis = [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, z * x, x * x - y * y];
        std::array::from_fn(|k| basis.iter().zip(c).map(|(b, c)| b * c[k]).sum())
    }

    #[test]
    fn the_polynomial_is_the_light_under_a_cosine() {
        let sh = light();
        let mut e = sh.clone();
        e.convolve(&COSINE);
        for n in [DVec3::new(0.48, 0.6, 0.64), DVec3::X, DVec3::NEG_Z, DVec3::new(-0.6, 0.0, 0.8)] {
            let (got, want) = (at(&polynomial(&sh), n), e.value(n));
            (0..3).for_each(|c| assert!((got[c] - want[c]).abs() < 1e-12, "{got:?} {want:?}"));
        }
    }

    #[test]
    fn shaders_parse_and_hold_the_coefficients() {
        let sh = light();
        let notes = ["a\nb".to_string()];
        let wgsl = irradiance_source(&sh, Language::Wgsl, &notes).expect("a shader's language");
        let glsl = irradiance_source(&sh, Language::Glsl, &notes).expect("a shader's language");
        let whole = format!(
            "#version 450\n{glsl}layout(location=0) out vec4 o;\nvoid main() {{ o = vec4(irradiance(vec3(0.0, 1.0, 0.0)), 1.0); }}\n"
        );
        let options = naga::front::glsl::Options::from(naga::ShaderStage::Fragment);
        let modules = [
            naga::front::wgsl::parse_str(&wgsl).map_err(|e| e.emit_to_string(&wgsl)),
            naga::front::glsl::Frontend::default()
                .parse(&options, &whole)
                .map_err(|e| e.emit_to_string(&whole)),
        ];
        for module in modules {
            let module = module.unwrap_or_else(|e| panic!("{e}"));
            let flags = naga::valid::ValidationFlags::all();
            let valid =
                naga::valid::Validator::new(flags, naga::valid::Capabilities::empty()).validate(&module);
            valid.unwrap_or_else(|e| panic!("{e:?}"));
            assert!(module.functions.iter().any(|(_, f)| f.name.as_deref() == Some("irradiance")));
        }
        for text in [&wgsl, &glsl] {
            let rows: Vec<[f64; 3]> = text
                .lines()
                .filter_map(|l| {
                    l.trim()
                        .strip_suffix(");")?
                        .split_once("3<f32>(")
                        .or(l.trim().strip_suffix(");")?.split_once("= vec3("))
                })
                .map(|(_, numbers)| {
                    let v: Vec<f64> =
                        numbers.split(',').map(|x| x.trim().parse().expect("a number")).collect();
                    [v[0], v[1], v[2]]
                })
                .collect();
            assert_eq!(rows.len(), 9, "{text}");
            let n = DVec3::new(0.48, -0.6, 0.64);
            let (got, want) = (at(&rows, n), at(&polynomial(&sh), n));
            (0..3).for_each(|c| assert!((got[c] - want[c]).abs() < 1e-6, "{got:?} {want:?}"));
        }
        assert_eq!(irradiance_source(&sh, Language::Rust, &[]), None);
    }
}
