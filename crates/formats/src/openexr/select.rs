//! Which channels of a file make the image.

use super::attributes::utf8;
use exr::meta::header::Header;

/// A part of the file and the channels to take from it.
#[derive(Debug, PartialEq)]
pub(super) struct Selection {
    /// Index of the part.
    pub part: usize,
    /// Index in the part's channel list, and the name in the raster.
    pub channels: Vec<(usize, String)>,
    /// The layer's name, where it has one.
    pub layer: Option<String>,
}

/// One layer: a part, and what stands before the last dot of its channels' names.
struct Layer {
    part: usize,
    name: Option<String>,
    /// Index in the part's channel list, and what stands after the last dot.
    channels: Vec<(usize, String)>,
}

/// Chooses the layer called `wanted`, else the first with R, G and B, else the first with Y, else the first.
/// With `all`, every channel of that layer's part under its full name, and the layer's colour under plain
/// names.
pub(super) fn select(headers: &[Header], wanted: Option<&str>, all: bool) -> Result<Selection, String> {
    let layers = layers(headers);
    let chosen = match wanted {
        Some(name) => layers.iter().find(|l| l.name.as_deref() == Some(name)).ok_or_else(|| {
            let names: Vec<_> = layers.iter().filter_map(|l| l.name.as_deref()).collect();
            let there = if names.is_empty() { "no named layer".into() } else { names.join(", ") };
            format!("no layer is called '{name}'; there is {there}")
        })?,
        None => {
            let first = |has: &[&str]| layers.iter().find(|l| has.iter().all(|c| l.has(c)));
            first(&["R", "G", "B"]).or_else(|| first(&["Y"])).or(layers.first()).ok_or("no channels")?
        }
    };
    let mut channels = chosen.color();
    if all || channels.is_empty() {
        for (i, c) in headers[chosen.part].channels.list.iter().enumerate() {
            if !channels.iter().any(|(j, _)| *j == i) {
                channels.push((i, utf8(&c.name)));
            }
        }
    }
    Ok(Selection { part: chosen.part, channels, layer: chosen.name.clone() })
}

impl Layer {
    fn has(&self, channel: &str) -> bool {
        self.channels.iter().any(|(_, n)| n == channel)
    }

    /// R, G, B (else Y) and A, in this order.
    fn color(&self) -> Vec<(usize, String)> {
        let names: &[&str] = if ["R", "G", "B"].iter().all(|c| self.has(c)) {
            &["R", "G", "B", "A"]
        } else if self.has("Y") {
            &["Y", "A"]
        } else {
            &[]
        };
        names.iter().filter_map(|n| self.channels.iter().find(|(_, c)| c == n).cloned()).collect()
    }
}

fn layers(headers: &[Header]) -> Vec<Layer> {
    let mut layers: Vec<Layer> = Vec::new();
    for (part, header) in headers.iter().enumerate() {
        let part_name = header.own_attributes.layer_name.as_ref().map(utf8);
        // Channels without a dot come first: they are what a viewer shows.
        let from = layers.len();
        for (index, channel) in header.channels.list.iter().enumerate() {
            let full = utf8(&channel.name);
            let (prefix, short) = match full.rsplit_once('.') {
                Some((p, s)) => (Some(p.to_string()), s.to_string()),
                None => (None, full),
            };
            let name = prefix.clone().or_else(|| part_name.clone());
            let position = layers[from..].iter().position(|l| l.name == name);
            let at = position.map_or_else(
                || {
                    let at = if prefix.is_none() { from } else { layers.len() };
                    layers.insert(at, Layer { part, name, channels: Vec::new() });
                    at
                },
                |p| from + p,
            );
            layers[at].channels.push((index, short));
        }
    }
    layers
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::meta::attribute::{ChannelDescription, SampleType, Text};

    fn part(name: &str, channels: &[&str]) -> Header {
        let list = channels.iter().map(|c| ChannelDescription::named(*c, SampleType::F16)).collect();
        Header::new(Text::from(name), (4, 4), list)
    }

    fn names(s: &Selection) -> Vec<&str> {
        s.channels.iter().map(|(_, n)| n.as_str()).collect()
    }

    #[test]
    fn the_first_colour_wins() {
        let h = [
            part("depth", &["Z"]),
            part("main", &["A", "B", "G", "R", "diffuse.B", "diffuse.G", "diffuse.R"]),
        ];
        let s = select(&h, None, false).unwrap();
        assert_eq!((s.part, names(&s)), (1, vec!["R", "G", "B", "A"]));
        let s = select(&h, Some("diffuse"), false).unwrap();
        assert_eq!(s.channels, [(6, "R".into()), (5, "G".into()), (4, "B".into())]);
        let s = select(&h, Some("depth"), false).unwrap();
        assert_eq!((s.part, names(&s)), (0, vec!["Z"]));
        let s = select(&h, None, true).unwrap();
        assert_eq!(names(&s), ["R", "G", "B", "A", "diffuse.B", "diffuse.G", "diffuse.R"]);
        assert!(select(&h, Some("x"), false).unwrap_err().contains("depth, main, diffuse"));
        assert_eq!(names(&select(&[part("", &["Y"])], None, false).unwrap()), ["Y"]);
    }
}
