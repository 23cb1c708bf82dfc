//! A header's attributes as text.

use crate::color::Primaries;
use exr::meta::attribute::{AttributeValue, EnvironmentMap, SampleType, Text};
use exr::meta::header::Header;

/// What is worth keeping of a part's header, sorted by name: the library keeps no order.
pub(super) fn metadata(header: &Header) -> Vec<(String, String)> {
    let own = &header.own_attributes;
    let mut pairs: Vec<(String, String)> = own
        .other
        .iter()
        .chain(&header.shared_attributes.other)
        .filter_map(|(name, value)| Some((utf8(name), text(value)?)))
        .collect();
    let mut put = |name: &str, value: Option<String>| pairs.extend(value.map(|v| (name.to_string(), v)));
    put("owner", own.owner.as_ref().map(utf8));
    put("comments", own.comments.as_ref().map(utf8));
    put("capDate", own.capture_date.as_ref().map(utf8));
    put("software", own.software_name.as_ref().map(utf8));
    put("whiteLuminance", own.white_luminance.map(|v| v.to_string()));
    put("exposure", own.exposure.map(|v| v.to_string()));
    put("wrapmodes", own.wrap_mode_name.as_ref().map(utf8));
    put(
        "envmap",
        own.environment_map.map(|e| match e {
            EnvironmentMap::LatitudeLongitude => "latlong".into(),
            EnvironmentMap::Cube => "cube".into(),
        }),
    );
    put("name", own.layer_name.as_ref().map(utf8));
    put("compression", Some(header.compression.to_string()));
    put("channels", Some(channels(header)));
    pairs.sort();
    pairs
}

/// "R half, G half, B half".
fn channels(header: &Header) -> String {
    let describe = |c: &exr::meta::attribute::ChannelDescription| {
        let kind = match c.sample_type {
            SampleType::F16 => "half",
            SampleType::F32 => "float",
            SampleType::U32 => "uint",
        };
        format!("{} {kind}", utf8(&c.name))
    };
    header.channels.list.iter().map(describe).collect::<Vec<_>>().join(", ")
}

/// The library shows bytes as Latin-1; files hold UTF-8.
pub(super) fn utf8(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

fn text(value: &AttributeValue) -> Option<String> {
    Some(match value {
        AttributeValue::Text(t) => utf8(t),
        AttributeValue::F64(v) => v.to_string(),
        AttributeValue::F32(v) => v.to_string(),
        AttributeValue::I32(v) => v.to_string(),
        AttributeValue::FloatVec2(v) => format!("{} {}", v.0, v.1),
        AttributeValue::FloatVec3(v) => format!("{} {} {}", v.0, v.1, v.2),
        AttributeValue::IntVec2(v) => format!("{} {}", v.0, v.1),
        AttributeValue::IntVec3(v) => format!("{} {} {}", v.0, v.1, v.2),
        AttributeValue::Rational((n, d)) => format!("{n}/{d}"),
        _ => return None,
    })
}

/// The part's primaries, where it names any.
pub(super) fn primaries(header: &Header) -> Option<Primaries> {
    let c = header.shared_attributes.chromaticities?;
    Some(Primaries([c.red, c.green, c.blue, c.white].map(|v| [f64::from(v.0), f64::from(v.1)])))
}
