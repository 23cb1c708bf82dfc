//! Faults in words.

use crate::light::Alteration;
use crate::report::{Encoding, Fault};
use crate::scale::Scale;
use std::f64::consts::PI;
use std::fmt;

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

impl fmt::Display for Alteration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("the light is as it is"),
            Self::Reduced { factor, means } => {
                let how = if *means { "means of blocks" } else { "single texels" };
                write!(f, "the light was made {factor} times smaller before it was filtered ({how})")
            }
            Self::Clipped(c) => write!(f, "the light was clipped at about {c:.3} before it was filtered"),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Turned(turn, conventions) => {
                write!(f, "every level: {}", turn.name())?;
                if turn.interpolates() {
                    f.write_str(" (add this angle to --rotate to measure past it)")?;
                }
                if !conventions.is_empty() {
                    let names = conventions.join(", ");
                    write!(f, " (as of a lat-long light that is read with --light-profile {names})")?;
                }
                Ok(())
            }
            Self::Channels(order) => {
                let name = |c: &usize| ["red", "green", "blue"][*c];
                let [r, g, b] = order.each_ref().map(name);
                write!(f, "channels changed places: red holds {r}, green holds {g}, blue holds {b}")
            }
            Self::Curve(name) => write!(f, "levels follow another curve: {name}"),
            Self::Kernels(found) => {
                let one =
                    |(m, k): &(usize, crate::Kernel)| format!("{m} {} ({})", k.family.name(), k.describe());
                let text: Vec<String> = found.iter().map(one).collect();
                write!(f, "levels hold other kernels than expected: {}", text.join(", "))
            }
            Self::Light(a) => a.fmt(f),
            Self::Scale(s, gains) => f.write_str(&scale(s, gains)),
            Self::Encoded(Encoding::Decoded) => {
                f.write_str("linear values were decoded as if they were sRGB's")
            }
            Self::Encoded(_) => f.write_str("values are sRGB-encoded where linear ones are expected"),
            Self::Damaged { level, invalid, black } => {
                write!(
                    f,
                    "level {level}: {invalid} texels are no numbers, {black} are black where light should be"
                )
            }
            Self::Limited { level, limit, texels } => {
                write!(
                    f,
                    "level {level}: {texels} texels are clipped at {limit}, the largest value of the format"
                )
            }
            Self::Seams(e) => write!(f, "seams: the texels along the faces' borders are {} off", percent(*e)),
            Self::Noise(e) => write!(f, "noise of {}", percent(*e)),
            Self::Coarse(e, off) => {
                let kind = if *e == Encoding::Linear { "linear" } else { "sRGB-encoded" };
                write!(f, "values come in steps of 1/255 ({kind}): {} off", percent(*off))
            }
            Self::OtherLight => {
                f.write_str("not made from this light: nothing of its detail is there, whichever way round")
            }
            Self::Remains(e) => write!(f, "beside that {} remain unexplained", percent(*e)),
            Self::Unexplained(e, near) => {
                write!(f, "unexplained: {} off", percent(*e))?;
                for (k, n) in near.iter().enumerate() {
                    let text: Vec<String> = n.faults.iter().map(ToString::to_string).collect();
                    let begin = if k == 0 { "; nearest explanations: " } else { " | " };
                    write!(f, "{begin}{} (leaves {})", text.join(" and "), percent(n.residual))?;
                }
                Ok(())
            }
        }
    }
}
