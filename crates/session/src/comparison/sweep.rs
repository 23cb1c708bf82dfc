//! Sweeps: a parameter of the reflectance or of the techniques over a range of values.

use std::path::Path;
use steradian_base::split_spec;

/// Quantity that is varied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Swept {
    /// A parameter of the reflectance.
    Brdf,
    /// A parameter of the techniques that have it.
    Param,
}

/// A parameter and its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Whose it is.
    pub of: Swept,
    /// Name of the parameter.
    pub key: String,
    /// Its values, ascending.
    pub values: Vec<f64>,
    /// Are they spaced by equal factors?
    pub log: bool,
}

/// Values of a sweep at most.
const MOST: usize = 256;

impl Sweep {
    /// `brdf:KEY=A..B:N` or `param:NAME=A..B:N`: N values from A to B by equal steps, with `:log` by equal
    /// factors.
    pub fn parse(text: &str) -> Result<Self, String> {
        let bad = || {
            let form =
                "brdf:KEY=A..B:N or param:NAME=A..B:N, such as brdf:alpha=0.05..0.5:8, with :log at the end";
            format!("'{text}' is not {form} for equal factors")
        };
        let (of, rest) = text.split_once(':').ok_or_else(bad)?;
        let of = match of {
            "brdf" => Swept::Brdf,
            "param" => Swept::Param,
            _ => return Err(bad()),
        };
        let (rest, log) = rest.strip_suffix(":log").map_or((rest, false), |r| (r, true));
        let (key, rest) = rest.split_once('=').ok_or_else(bad)?;
        let (range, n) = rest.rsplit_once(':').ok_or_else(bad)?;
        let (a, b) = range.split_once("..").ok_or_else(bad)?;
        let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(bad);
        let (a, b) = (number(a)?, number(b)?);
        let n: usize = n.trim().parse().map_err(|_| bad())?;
        if key.trim().is_empty() || !(2..=MOST).contains(&n) || (log && (a <= 0.0 || b <= 0.0)) {
            return Err(format!("{}; 2 to {MOST} values, positive ones for equal factors", bad()));
        }
        let value = |k: usize| {
            let t = k as f64 / (n - 1) as f64;
            let v = if log { a * (b / a).powf(t) } else { a + (b - a) * t };
            // Six digits, as they are shown.
            format!("{v:.5e}").parse().unwrap_or(v)
        };
        Ok(Self { of, key: key.trim().into(), values: (0..n).map(value).collect(), log })
    }

    /// A spec with the parameter at a value.
    pub fn spec(&self, spec: &str, value: f64) -> String {
        let (name, body) = split_spec(spec);
        let same = |part: &str| {
            part.split_once('=')
                .is_some_and(|(k, _)| k.trim().replace('_', "-") == self.key.replace('_', "-"))
        };
        let kept = body.split(',').filter(|p| !p.is_empty() && !same(p)).map(String::from);
        let parts: Vec<String> = kept.chain([format!("{}={value}", self.key)]).collect();
        format!("{name}:{}", parts.join(","))
    }
}

/// Identifies a name in the key of a result: a file by its contents, so that other contents give another key.
pub fn mark(text: &str) -> String {
    if Path::new(text).is_file() {
        return crate::light_mark(text);
    }
    text.split_inclusive([':', ',', '='])
        .map(|part| {
            let end = part.trim_end_matches([':', ',', '=']).len();
            let (name, separator) = part.split_at(end);
            let file = Path::new(name).is_file();
            if file { crate::light_mark(name) + separator } else { part.into() }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_are_ranges_of_one_parameter() {
        let s = Sweep::parse("brdf:alpha=0.1..0.4:4").expect("a sweep");
        assert_eq!((s.of, s.key.as_str(), &s.values[..]), (Swept::Brdf, "alpha", &[0.1, 0.2, 0.3, 0.4][..]));
        assert_eq!(s.spec("ggx:alpha=0.7,f0=1/0.8/0.3", 0.2), "ggx:f0=1/0.8/0.3,alpha=0.2");
        assert_eq!(s.spec("ggx", 0.2), "ggx:alpha=0.2");
        let s = Sweep::parse("param:order=1..100:3:log").expect("a sweep");
        assert_eq!((s.of, &s.values[..], s.log), (Swept::Param, &[1.0, 10.0, 100.0][..], true));
        for bad in [
            "alpha=1..2:3",
            "brdf:alpha=1:3",
            "brdf:alpha=1..2",
            "brdf:=1..2:3",
            "brdf:a=0..2:3:log",
            "brdf:a=1..2:1",
        ] {
            assert!(Sweep::parse(bad).is_err_and(|e| e.contains("brdf:KEY=A..B:N")), "{bad}");
        }
    }
}
