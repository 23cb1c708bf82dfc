//! Faults in words.

use super::Finding;
use std::f64::consts::PI;
use std::fmt;
use steradian_engines::Curve;
use steradian_verify::laws::{Rule, Slip};
use steradian_verify::{Alteration, Encoding, Fault, Kernel, Scale};

/// Factors that have a name.
const FACTORS: [(f64, &str); 8] = [
    (PI, "pi: irradiance E where E/pi is expected, or 1/pi missing"),
    (1.0 / PI, "1/pi: divided by pi once too often"),
    (2.0 * PI, "2 pi"),
    (0.5 / PI, "1/(2 pi)"),
    (4.0 * PI, "4 pi"),
    (0.25 / PI, "1/(4 pi)"),
    (0.04, "0.04: F0 of a dielectric baked in"),
    (179.0, "179 lm/W: luminance for radiance"),
];

/// A factor in words; `None` where it is 1 within a part in a hundred.
pub fn factor(s: f64) -> Option<String> {
    let near = |a: f64, b: f64, t: f64| (a / b - 1.0).abs() < t;
    if near(s, 1.0, 0.01) {
        return None;
    }
    if let Some((_, name)) = FACTORS.iter().find(|(f, _)| near(s, *f, 0.01)) {
        return Some((*name).into());
    }
    let ev = if s > 0.0 { s.log2() } else { f64::NAN };
    if ev.is_finite() && (ev - ev.round()).abs() < 0.01 {
        return Some(format!("{s:.4}: an exposure of {:+.0} EV", ev.round()));
    }
    Some(format!("{s:.4}"))
}

fn scale(s: &Scale, gains: &[f64]) -> String {
    match s {
        Scale::One => "no factor".into(),
        Scale::Gain(g) => format!("every level: factor {}", factor(*g).unwrap_or_else(|| format!("{g:.4}"))),
        Scale::Colour([r, g, b]) => {
            format!(
                "every level: a coloured factor {r:.3}/{g:.3}/{b:.3}: a surface's colour or a white balance baked in"
            )
        }
        Scale::Reflectance([r, g, b]) => {
            format!(
                "the reflectance of a surface of F0 = {r:.3}/{g:.3}/{b:.3} at normal incidence is baked in"
            )
        }
        Scale::PerLevel => {
            let text: Vec<String> = gains.iter().map(|g| format!("{g:.4}")).collect();
            format!("factors that differ by level: {}", text.join(", "))
        }
    }
}

fn percent(v: f64) -> String {
    format!("{:.1} %", 100.0 * v)
}

fn alteration(a: &Alteration) -> String {
    match a {
        Alteration::None => "the light is as it is".into(),
        Alteration::Reduced { factor, means } => {
            let how = if *means { "means of blocks" } else { "single texels" };
            format!("the light was made {factor} times smaller before it was filtered ({how})")
        }
        Alteration::Clipped(c) => format!("the light was clipped at about {c:.3} before it was filtered"),
    }
}

fn curve(c: Curve) -> String {
    let engines = c.engines().collect::<Vec<_>>().join(", ");
    let whose = if engines.is_empty() { String::new() } else { format!(": {engines}") };
    format!("{} ({}{whose})", c.name(), c.formula())
}

fn rule(r: Rule) -> String {
    let formula = |c: Curve| c.formula().trim_start_matches("r = ");
    match r {
        Rule::Curve(c) => curve(c),
        Rule::RoughnessAsAlpha(c) => {
            format!("alpha = {}: the perceptual roughness of {} taken for alpha", formula(c), c.name())
        }
        Rule::AlphaAsRoughness(c) => {
            format!("r = ({})^2: alpha of {} taken for the perceptual roughness", formula(c), c.name())
        }
        Rule::Counted(slip) => match slip {
            Slip::OneMoreWithoutLast => "the list of one more level without its last one",
            Slip::OneMoreWithoutFirst => "the list of one more level without its first one",
            Slip::TwoMoreWithoutLast => "the list of two more levels without the last two",
            Slip::AsNext => "each level holds what the next one should (off by one)",
            Slip::AsBefore => "each level holds what the one before should (off by one)",
            Slip::TwoMoreWithoutEnds => "the list of two more levels without first and last",
        }
        .into(),
    }
}

/// One sentence.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Levels(found) => f.write_str(&fault(found)),
            Self::IrradianceScale(s) => {
                let factor = factor(*s).unwrap_or_else(|| format!("{s:.4}"));
                write!(f, "irradiance coefficients: factor {factor}")
            }
            Self::Irradiance(off) => write!(f, "irradiance coefficients: {} off", percent(*off)),
        }
    }
}

fn fault(f: &Fault) -> String {
    match f {
        Fault::Turned(turn, conventions) => {
            let past = " (add this angle to `rotate` to measure past it)";
            let past = if turn.interpolates() { past } else { "" };
            let names = conventions.join(", ");
            let read = match names.as_str() {
                "" => String::new(),
                names => format!(" (as of a lat-long light that is read with `light-profile` {names})"),
            };
            format!("every level: {}{past}{read}", turn.name())
        }
        Fault::Channels(order) => {
            let [r, g, b] = order.map(|c| ["red", "green", "blue"][c]);
            format!("channels changed places: red holds {r}, green holds {g}, blue holds {b}")
        }
        Fault::Curve(r) => format!("levels follow another curve: {}", rule(*r)),
        Fault::Kernels(found) => {
            let one = |(m, k): &(usize, Kernel)| format!("{m} {} ({})", k.family.name(), k.describe());
            let text: Vec<String> = found.iter().map(one).collect();
            format!("levels hold other kernels than expected: {}", text.join(", "))
        }
        Fault::Light(a) => alteration(a),
        Fault::Scale(s, gains) => scale(s, gains),
        Fault::Encoded(Encoding::Decoded) => "linear values were decoded as if they were sRGB's".into(),
        Fault::Encoded(_) => "values are sRGB-encoded where linear ones are expected".into(),
        Fault::Damaged { level, invalid, black } => {
            let invalid = (*invalid > 0).then(|| match invalid {
                1 => "1 texel is no number".to_string(),
                n => format!("{n} texels are no numbers"),
            });
            let black = (*black > 0).then(|| match black {
                1 => "1 texel is black where light should be".to_string(),
                n => format!("{n} texels are black where light should be"),
            });
            let parts: Vec<String> = invalid.into_iter().chain(black).collect();
            format!("level {level}: {}", parts.join(", "))
        }
        Fault::Limited { level, limit, texels } => {
            let texels = if *texels == 1 { "1 texel is".into() } else { format!("{texels} texels are") };
            format!("level {level}: {texels} clipped at {limit}, the largest value of the format")
        }
        Fault::Seams(e) => format!("seams: the texels along the faces' borders are {} off", percent(*e)),
        Fault::Noise(e) => format!("noise of {}", percent(*e)),
        Fault::Coarse(e, off) => {
            let kind = if *e == Encoding::Linear { "linear" } else { "sRGB-encoded" };
            format!("values come in steps of 1/255 ({kind}): {} off", percent(*off))
        }
        Fault::OtherLight => {
            "not made from this light: nothing of its detail is there, whichever way round".into()
        }
        Fault::Remains(e) => format!("beside that {} remain unexplained", percent(*e)),
        Fault::Unexplained(e, near) => {
            let one = |n: &steradian_verify::Nearest| {
                let text: Vec<String> = n.faults.iter().map(fault).collect();
                format!("{} (leaves {})", text.join(" and "), percent(n.residual))
            };
            let near: Vec<String> = near.iter().map(one).collect();
            let near = if near.is_empty() {
                String::new()
            } else {
                format!("; nearest explanations: {}", near.join(" | "))
            };
            format!("unexplained: {} off{near}", percent(*e))
        }
    }
}
