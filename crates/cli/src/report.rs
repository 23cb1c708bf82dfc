//! Parts of reports: errors as JSON, and one web page that needs no other file: every name is escaped, pictures are inside.

use crate::failure::Failure;
use serde_json::{Value, json};
use steradian_base::{Certificate, Elevation, ParamValues, Value as Param};
use steradian_render::{Cell, Display};
use steradian_session::compare::Answer;

/// Parameters as JSON: numbers as numbers, everything else in words.
pub fn params_json(params: &ParamValues) -> Value {
    let one = |v: &Param| if let Param::Number(x) = v { json!(x) } else { json!(v.to_string()) };
    params.0.iter().map(|(name, value)| (name.clone(), one(value))).collect()
}

/// Errors by angle of view, degrees.
pub fn elevations_json(c: &Certificate) -> Value {
    let degrees = |theta: f64| (theta.to_degrees() * 1e6).round() / 1e6;
    let one = |e: &Elevation| {
        json!({
            "degrees": degrees(e.theta_o),
            "range": e.range.map(degrees),
            "error": e.error,
            "error_beside_suns": e.beside_suns,
            "known": e.known.word(),
        })
    };
    c.elevations.iter().map(one).collect()
}

/// What single points err by; null where that was not measured.
pub fn points_json(c: &Certificate) -> Value {
    c.spread.map_or(Value::Null, |s| {
        json!({
            "median": s.median,
            "ninetieth": s.ninetieth,
            "stops": s.stops,
            "top_hundredth": s.top_hundredth,
        })
    })
}

/// The cell of a contact sheet; nothing for a refusal. `named` puts the technique's name into the caption.
pub fn cell(answer: &Answer, named: bool) -> Option<Cell> {
    let r = answer.rendering()?;
    let error = r.errors.as_ref().map(|(e, flip)| format!("FLIP {flip:.3}, {:.2} stops", e.stops));
    let name = match (named, &error) {
        (false, _) => None,
        (true, Some(_)) => Some(answer.name().replace('_', " ")),
        (true, None) => Some("reference".into()),
    };
    Some(Cell { picture: r.picture.clone(), caption: name.into_iter().chain(error).collect() })
}

/// An answer as JSON.
pub fn answer_json(answer: &Answer) -> Value {
    match answer {
        Answer::Refused { label, backend, why } => {
            json!({"technique": label, "backend": backend, "refused": why})
        }
        Answer::Rendered(r) => json!({
            "technique": r.label,
            "backend": r.backend,
            "relative_rms": r.errors.as_ref().map(|e| e.0.relative_rms),
            "rmse": r.errors.as_ref().map(|e| e.0.rmse),
            "median": r.errors.as_ref().map(|e| e.0.median),
            "ninetieth": r.errors.as_ref().map(|e| e.0.ninetieth),
            "stops": r.errors.as_ref().map(|e| e.0.stops),
            "rel_mse": r.errors.as_ref().map(|e| e.0.rel_mse),
            "flip": r.errors.as_ref().map(|e| e.1),
            "flip_to_cpu": r.flip_to_cpu,
            "certificate": r.certificate.as_ref().map(|c| json!({"error": c.error, "known": c.known.word()})),
            "bake_seconds": r.bake_seconds,
            "shade_seconds": r.shade_seconds,
            "bytes": r.bytes,
        }),
    }
}

/// A page in the making.
pub struct Page(String);

const STYLE: &str = "body{font:15px/1.5 sans-serif;margin:2em;max-width:75em}table{border-collapse:collapse}\
    td,th{padding:.3em .8em;border-bottom:1px solid #ddd;text-align:left}\
    figure{display:inline-block;margin:0 1em 1em 0;vertical-align:top}figcaption{font-size:13px}";

impl Page {
    /// A page with a title and what it is about.
    pub fn new(title: &str, about: &str) -> Self {
        let (title, about) = (escaped(title), escaped(about));
        Self(format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Steradian: {title}</title>\n\
             <style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n<p>{about}</p>\n"
        ))
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) {
        self.0.push_str(&format!("<h2>{}</h2>\n", escaped(text)));
    }

    /// A table with a head.
    pub fn table(&mut self, head: &[String], rows: impl Iterator<Item = Vec<String>>) {
        self.0.push_str("<table>\n");
        self.row(head, "th");
        rows.for_each(|r| self.row(&r, "td"));
        self.0.push_str("</table>\n");
    }

    fn row(&mut self, cells: &[String], tag: &str) {
        let cells: String = cells.iter().map(|c| format!("<{tag}>{}</{tag}>", escaped(c))).collect();
        self.0.push_str(&format!("<tr>{cells}</tr>\n"));
    }

    /// A picture with its caption.
    pub fn figure(&mut self, picture: &Display, caption: &str) -> Result<(), Failure> {
        let data = base64(&encoded(picture)?);
        let (w, h, caption) = (picture.width, picture.height, escaped(caption));
        self.0.push_str(&format!(
            "<figure><img width=\"{w}\" height=\"{h}\" alt=\"{caption}\" src=\"data:image/png;base64,{data}\">\
             <figcaption>{caption}</figcaption></figure>\n"
        ));
        Ok(())
    }

    /// The page as text.
    pub fn finish(mut self) -> String {
        self.0.push_str("</body></html>\n");
        self.0
    }
}

/// Text in which nothing is markup.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;").replace('\'', "&#39;")
}

/// The picture as PNG.
fn encoded(picture: &Display) -> Result<Vec<u8>, Failure> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, picture.width as u32, picture.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let written = encoder.write_header().and_then(|mut w| {
        w.write_image_data(&picture.rgb)?;
        w.finish()
    });
    written.map_err(|e| Failure::failed(format!("cannot encode a picture: {e}")))?;
    Ok(out)
}

/// RFC 4648 section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let word = group.iter().enumerate().fold(0u32, |w, (i, b)| w | u32::from(*b) << (16 - 8 * i));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= group.len() { char::from(digit) } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_standard() {
        for (text, want) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(text.as_bytes()), want);
        }
    }

    #[test]
    fn nothing_that_a_user_names_is_markup() {
        let mut page = Page::new("<b>", "\"'&");
        page.table(&["<i>".into()], [vec!["</td>".to_string()]].into_iter());
        page.figure(&Display::filled(2, 2, [1, 2, 3]), "a\"><script>").expect("encodes");
        let text = page.finish();
        assert!(
            text.contains("&lt;b&gt;") && text.contains("&quot;&#39;&amp;") && text.contains("&lt;/td&gt;")
        );
        assert!(!text.contains("<script>") && text.contains("base64,iVBORw0KGgo"));
    }
}
