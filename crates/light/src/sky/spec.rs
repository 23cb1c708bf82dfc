//! Names of skies: `name:key=value,…`.

use steradian_base::brief;

/// Why a sky could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SkyError {
    /// No sky has this name.
    #[error("there is no environment called {:?}: use sky, studio, overcast or furnace", brief(.0))]
    UnknownName(String),
    /// The sky has no such parameter.
    #[error("{name} takes no parameter {:?}: it has {known}", brief(.key))]
    UnknownKey {
        /// The sky.
        name: &'static str,
        /// What was given.
        key: String,
        /// What there is.
        known: String,
    },
    /// A parameter's value is not a number, or out of range.
    #[error("{name}: {key}={} must be {expected}", brief(.value))]
    BadValue {
        /// The sky.
        name: &'static str,
        /// The parameter.
        key: &'static str,
        /// What was given.
        value: String,
        /// What it must be.
        expected: String,
    },
    /// An image of no texels, or too many.
    #[error("an environment of {0}×{1} texels cannot be made: use 1 to 32768 texels per side")]
    Size(usize, usize),
}

/// A numeric parameter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Key {
    pub(super) key: &'static str,
    pub(super) default: f64,
    pub(super) range: [f64; 2],
    /// Takes `r/g/b` as well as one number.
    pub(super) colour: bool,
}

/// Parses the part after the colon; one value per key, a scalar three times.
pub(super) fn parse(name: &'static str, keys: &[Key], text: &str) -> Result<Vec<[f64; 3]>, SkyError> {
    let mut values: Vec<[f64; 3]> = keys.iter().map(|k| [k.default; 3]).collect();
    for item in text.split(',').map(str::trim).filter(|s| !s.is_empty()) {
        let (key, value) = item.split_once('=').map_or((item, ""), |(k, v)| (k.trim(), v.trim()));
        let Some(at) = keys.iter().position(|k| k.key == key) else {
            let known = keys.iter().map(|k| k.key).collect::<Vec<_>>().join(", ");
            return Err(SkyError::UnknownKey { name, key: key.to_owned(), known });
        };
        values[at] = number(&keys[at], value).ok_or_else(|| SkyError::BadValue {
            name,
            key: keys[at].key,
            value: value.to_owned(),
            expected: format!(
                "{} from {} to {}",
                if keys[at].colour { "a number or r/g/b" } else { "a number" },
                keys[at].range[0],
                keys[at].range[1]
            ),
        })?;
    }
    Ok(values)
}

fn number(key: &Key, text: &str) -> Option<[f64; 3]> {
    let parts: Vec<f64> = text.split('/').map(|t| t.trim().parse().ok()).collect::<Option<_>>()?;
    let in_range = |v: &f64| (key.range[0]..=key.range[1]).contains(v);
    if !parts.iter().all(in_range) {
        return None;
    }
    match parts[..] {
        [v] => Some([v; 3]),
        [r, g, b] if key.colour => Some([r, g, b]),
        _ => None,
    }
}
