//! Irradiance by spherical harmonics: nine coefficients as numbers for engines' files, and any number of
//! bands as source text for shaders.

use std::f64::consts::{PI, SQRT_2};
use steradian_brdf::dfg::text::Language;
use steradian_sphere::sh::{ShRgb, epsilon, index, legendre, zonal};

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

/// A function `irradiance` of the unit normal over world x, y, z (right-handed, y up) for a shader, from
/// coefficients of radiance with any number of bands; `None` for languages that are no shader's. `notes` go
/// into the comment above it, one line each.
///
/// In Y_lm = κ_lm p_lm(z) {x_m, y_m} the factors x_m + i y_m = (x + i y)^m and the monic polynomials
/// p_lm = z p_{l−1,m} − ε²_{l−1,m} p_{l−2,m} are computed step by step, as by
/// [`steradian_sphere::sh::eval`]; κ_lm is in the constants. Bands that the cosine cancels (3, 5, 7, …)
/// have none.
pub fn irradiance_source(radiance: &ShRgb, language: Language, notes: &[String]) -> Option<String> {
    let (vec3, head, scalar, constant) = match language {
        Language::Wgsl => ("vec3<f32>", "fn irradiance(n: vec3<f32>) -> vec3<f32> {", "let", "let"),
        Language::Glsl => ("vec3", "vec3 irradiance(vec3 n) {", "float", "const vec3"),
        Language::Hlsl => ("float3", "float3 irradiance(float3 n) {", "float", "const float3"),
        Language::Rust => return None,
    };
    let cosine = zonal::cosine(radiance.order);
    let bands: Vec<usize> = (0..=radiance.order).filter(|l| cosine[*l] != 0.0).collect();
    let last = bands.last().copied().unwrap_or(0);
    let mut out = format!(
        "// Irradiance E(n), W m^-2, of {} spherical harmonic coefficients; n is the unit normal, world axes, y up.\n\
         // Outgoing radiance of a diffuse surface is albedo / pi times this. Below 0 where the light is sharp.\n",
        radiance.c[0].len()
    );
    notes.iter().for_each(|n| out.push_str(&format!("// {}\n", n.replace(['\n', '\r'], " "))));
    out.push_str(head);
    out.push('\n');
    let orders = |l: usize| -(l as isize)..=l as isize;
    for &l in &bands {
        for m in orders(l) {
            let (i, k) = (index(l, m), cosine[l] * leading(l, m.unsigned_abs()));
            // A decimal point in every number, as GLSL wants it.
            let [r, g, b] = [0, 1, 2].map(|c| format!("{:?}", (k * radiance.c[c][i]) as f32));
            out.push_str(&format!("    {constant} c{i} = {vec3}({r}, {g}, {b});\n"));
        }
    }
    for m in 2..=last {
        let [x, y] =
            if m == 2 { ["n.x".into(), "n.y".into()] } else { ["x", "y"].map(|v| format!("{v}{}", m - 1)) };
        out.push_str(&format!("    {scalar} x{m} = n.x * {x} - n.y * {y};\n"));
        out.push_str(&format!("    {scalar} y{m} = n.x * {y} + n.y * {x};\n"));
    }
    for m in 0..=last {
        for l in m + 2..=last {
            let before = format!("{:?}", epsilon(l - 1, m).powi(2) as f32);
            let before = polynomial_of_z(l - 2, m).map_or(before.clone(), |p| format!("{before} * {p}"));
            let p = polynomial_of_z(l - 1, m).unwrap_or_default();
            out.push_str(&format!("    {scalar} p{l}_{m} = n.z * {p} - {before};\n"));
        }
    }
    let term = |l: usize, m: isize| {
        let around = match m {
            0 => None,
            1 => Some("n.x".to_string()),
            -1 => Some("n.y".to_string()),
            m => Some(format!("{}{}", if m > 0 { "x" } else { "y" }, m.unsigned_abs())),
        };
        let c = format!("c{}", index(l, m));
        match (polynomial_of_z(l, m.unsigned_abs()), around) {
            (None, None) => c,
            (Some(one), None) | (None, Some(one)) => format!("{c} * {one}"),
            (Some(p), Some(around)) => format!("{c} * ({p} * {around})"),
        }
    };
    let band = |l: &usize| orders(*l).map(|m| term(*l, m)).collect::<Vec<_>>().join(" + ");
    let sum = bands.iter().map(band).collect::<Vec<_>>().join("\n        + ");
    out.push_str(&format!("    return {sum};\n}}\n"));
    Some(out)
}

/// κ_lm: the factor of Y_lm before monic p_lm(z) and the real or imaginary part of (x + i y)^m.
fn leading(l: usize, m: usize) -> f64 {
    let sectoral = legendre(m, m, 0.0, 1.0)[0];
    let both = if m == 0 { 1.0 } else { SQRT_2 };
    (m + 1..=l).fold(sectoral * both, |k, l| k / epsilon(l, m))
}

/// The name of p_lm in a shader; `None` where it is 1.
fn polynomial_of_z(l: usize, m: usize) -> Option<String> {
    match l - m {
        0 => None,
        1 => Some("n.z".into()),
        _ => Some(format!("p{l}_{m}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use std::collections::BTreeMap;

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

    /// Coefficients of any number of bands.
    fn bands(count: usize) -> ShRgb {
        let mut sh = ShRgb::zero(count - 1);
        for (c, channel) in sh.c.iter_mut().enumerate() {
            channel.iter_mut().enumerate().for_each(|(i, v)| *v = (1.7 * i as f64 + c as f64).sin() + 0.3);
        }
        sh
    }

    /// What an expression of a shader is, by its grammar: sums of products of names, numbers, components,
    /// vectors and brackets. Numbers are vectors of three equal ones.
    struct Reader<'a> {
        words: Vec<&'a str>,
        at: usize,
        names: BTreeMap<&'a str, [f64; 3]>,
    }

    impl<'a> Reader<'a> {
        /// The value of the function's `return` at a normal.
        fn run(text: &'a str, n: DVec3) -> [f64; 3] {
            let names = [("n.x", n.x), ("n.y", n.y), ("n.z", n.z)].map(|(name, v)| (name, [v; 3]));
            let mut reader = Self { words: Vec::new(), at: 0, names: names.into() };
            let body = text.split_once("{\n").and_then(|(_, b)| b.split_once('}')).expect("a body").0;
            for statement in body.split(';').map(str::trim).filter(|s| !s.is_empty()) {
                let (name, value) = match statement.strip_prefix("return ") {
                    Some(value) => ("", value),
                    None => {
                        let (left, right) = statement.split_once(" = ").expect("an assignment");
                        (left.rsplit(' ').next().expect("a name"), right)
                    }
                };
                reader.words = value
                    .split_inclusive(['(', ')', ',', ' ', '\n'])
                    .flat_map(|w| {
                        let end = w.len() - usize::from(w.ends_with(['(', ')', ',', ' ', '\n']));
                        [&w[..end], &w[end..]]
                    })
                    .filter(|w| !w.trim().is_empty())
                    .collect();
                reader.at = 0;
                let value = reader.sum();
                assert_eq!(reader.at, reader.words.len(), "{statement}");
                reader.names.insert(name, value);
            }
            reader.names[""]
        }

        fn next(&mut self) -> &'a str {
            self.at += 1;
            self.words[self.at - 1]
        }

        fn is(&mut self, word: &str) -> bool {
            let found = self.words.get(self.at) == Some(&word);
            self.at += usize::from(found);
            found
        }

        fn sum(&mut self) -> [f64; 3] {
            let mut out = self.product();
            loop {
                let sign = if self.is("+") {
                    1.0
                } else if self.is("-") {
                    -1.0
                } else {
                    return out;
                };
                let next = self.product();
                (0..3).for_each(|c| out[c] += sign * next[c]);
            }
        }

        fn product(&mut self) -> [f64; 3] {
            let mut out = self.factor();
            while self.is("*") {
                let next = self.factor();
                (0..3).for_each(|c| out[c] *= next[c]);
            }
            out
        }

        fn factor(&mut self) -> [f64; 3] {
            match self.next() {
                "(" => {
                    let v = self.sum();
                    assert!(self.is(")"), "a bracket closes");
                    v
                }
                "vec3<f32>" | "vec3" | "float3" => {
                    assert!(self.is("("), "a vector has three numbers");
                    [")", ",", ","].map(|_| {
                        let v = self.sum()[0];
                        self.next();
                        v
                    })
                }
                word => match self.names.get(word) {
                    Some(v) => *v,
                    None => [word.parse().unwrap_or_else(|_| panic!("'{word}' is no number")); 3],
                },
            }
        }
    }

    #[test]
    fn shaders_are_the_light_under_a_cosine_for_any_number_of_bands() {
        for count in (1..=9).chain([16]) {
            let sh = bands(count);
            let mut e = sh.clone();
            e.convolve(&zonal::cosine(sh.order));
            for language in [Language::Wgsl, Language::Glsl, Language::Hlsl] {
                let text = irradiance_source(&sh, language, &[]).expect("a shader's language");
                let poles = [DVec3::Z, DVec3::NEG_Z, DVec3::X, DVec3::NEG_Y];
                let between = [DVec3::new(0.48, -0.6, 0.64), DVec3::new(-0.6, 0.64, -0.48)];
                for n in poles.into_iter().chain(between) {
                    let (got, want) = (Reader::run(&text, n), e.value(n));
                    let near = |c: usize| (got[c] - want[c]).abs() < 1e-5;
                    assert!((0..3).all(near), "{count} bands, {language:?}, {n}: {got:?} {want:?}\n{text}");
                }
            }
        }
    }

    /// Three bands are the nine terms of Ramamoorthi & Hanrahan.
    #[test]
    fn nine_coefficients_are_the_published_polynomial() {
        let sh = light();
        let text = irradiance_source(&sh, Language::Wgsl, &[]).expect("a shader's language");
        let n = DVec3::new(0.48, -0.6, 0.64);
        let (got, want) = (Reader::run(&text, n), at(&polynomial(&sh), n));
        (0..3).for_each(|c| assert!((got[c] - want[c]).abs() < 1e-6, "{got:?} {want:?}"));
        let sum = "return c0\n        + c1 * n.y + c2 * n.z + c3 * n.x\n        \
                   + c4 * y2 + c5 * (n.z * n.y) + c6 * p2_0 + c7 * (n.z * n.x) + c8 * x2;";
        assert!(text.contains(sum), "{text}");
        assert_eq!(irradiance_source(&sh, Language::Rust, &[]), None);
    }

    /// naga reads WGSL and GLSL; HLSL differs from GLSL by a type's name alone.
    #[test]
    fn shaders_parse() {
        for count in [1, 2, 3, 6, 9] {
            let sh = bands(count);
            let notes = ["a\nb".to_string()];
            let text = |language| irradiance_source(&sh, language, &notes).expect("a shader's language");
            let (wgsl, glsl) = (text(Language::Wgsl), text(Language::Glsl));
            assert_eq!(text(Language::Hlsl).replace("float3", "vec3"), glsl);
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
        }
    }
}
