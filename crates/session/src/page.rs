//! One web page that needs no other file: every name is escaped, pictures are inside.

use crate::Error;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use steradian_render::Display;
use steradian_render::plot::Drawing;

/// A page in the making.
pub struct Page(String);

/// Largest size, bytes, of a picture when it is read back.
const MAX_DECODED: usize = 256 << 20;

const STYLE: &str = "body{font:15px/1.5 sans-serif;margin:2em;max-width:75em}table{border-collapse:collapse}\
    td,th{padding:.3em .8em;border-bottom:1px solid #ddd;text-align:left}\
    figure{display:inline-block;margin:0 1em 1em 0;vertical-align:top}figcaption{font-size:13px}";

impl Page {
    /// A page with a title and a description.
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

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) {
        self.0.push_str(&format!("<p>{}</p>\n", escaped(text)));
    }

    /// Starts a new line.
    pub fn line_break(&mut self) {
        self.0.push_str("<br>\n");
    }

    /// A line drawing.
    pub fn drawing(&mut self, drawing: &Drawing) {
        self.0.push_str(&drawing.svg());
    }

    /// A table with a head.
    pub fn table(&mut self, head: &[String], rows: impl Iterator<Item = Vec<String>>) {
        self.0.push_str("<table>\n");
        self.row(head, "th");
        rows.for_each(|r| self.row(&r, "td"));
        self.0.push_str("</table>\n");
    }

    /// A table with a head, whose rows begin with a link to a file in the page's folder.
    pub fn links(&mut self, head: &[String], rows: impl Iterator<Item = (String, Vec<String>)>) {
        self.0.push_str("<table>\n");
        self.row(head, "th");
        for (file, cells) in rows {
            let mut cells = cells.iter().map(|c| escaped(c));
            let (file, first) = (escaped(&file), cells.next().unwrap_or_default());
            let rest: String = cells.map(|c| format!("<td>{c}</td>")).collect();
            self.0.push_str(&format!("<tr><td><a href=\"{file}\">{first}</a></td>{rest}</tr>\n"));
        }
        self.0.push_str("</table>\n");
    }

    fn row(&mut self, cells: &[String], tag: &str) {
        let cells: String = cells.iter().map(|c| format!("<{tag}>{}</{tag}>", escaped(c))).collect();
        self.0.push_str(&format!("<tr>{cells}</tr>\n"));
    }

    /// A picture with its caption.
    pub fn figure(&mut self, picture: &Display, caption: &str) -> Result<(), Error> {
        let data = STANDARD.encode(encoded(picture)?);
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
pub(crate) fn encoded(picture: &Display) -> Result<Vec<u8>, Error> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, picture.width as u32, picture.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let written = encoder.write_header().and_then(|mut w| {
        w.write_image_data(&picture.rgb)?;
        w.finish()
    });
    written.map_err(|e| Error::failed(format!("cannot encode a picture: {e}")))?;
    Ok(out)
}

/// Reads a picture that [`encoded`] wrote; `None` for anything else.
pub(crate) fn decoded(bytes: &[u8]) -> Option<Display> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_limits(png::Limits { bytes: MAX_DECODED });
    let mut reader = decoder.read_info().ok()?;
    let (kind, info) = (reader.output_color_type(), reader.info());
    let (width, height) = (info.width as usize, info.height as usize);
    let size = reader.output_buffer_size().filter(|n| *n <= MAX_DECODED && *n == 3 * width * height)?;
    let mut rgb = vec![0; size];
    reader.next_frame(&mut rgb).ok()?;
    (kind == (png::ColorType::Rgb, png::BitDepth::Eight)).then_some(Display { width, height, rgb })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_read_as_they_were_written() {
        let mut picture = Display::filled(3, 2, [7, 0, 255]);
        picture.blend(1, 1, [255, 9, 1], 1.0);
        let bytes = encoded(&picture).expect("it is small");
        let again = decoded(&bytes).expect("a picture");
        assert_eq!((again.width, again.height, again.rgb), (3, 2, picture.rgb));
        assert!(decoded(&bytes[..bytes.len() / 2]).is_none() && decoded(b"no picture").is_none());
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
