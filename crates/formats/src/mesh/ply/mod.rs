//! PLY (Turk 1994, The PLY Polygon File Format): ASCII and binary of both byte orders.
//!
//! Read are the element `vertex` (x y z; nx ny nz; s t or u v; red green blue), and `face` (vertex_indices)
//! or Stanford's `tristrips`; other elements and properties are skipped.

mod build;
mod header;
mod records;

use super::{MeshData, source::Source};
use crate::FormatError;
use build::Builder;
use header::{Element, Encoding, Header};
use records::{Ascii, Binary, Records};

/// What an item of a list may become: a number, an index, and the part of a triangle.
const BYTES_PER_CORNER: u64 = 32;

/// Reads a PLY file.
pub fn read(bytes: &[u8], source: &mut Source) -> Result<MeshData, FormatError> {
    let (header, body) = Header::parse(bytes).map_err(|why| source.fault(why))?;
    let rest = &bytes[body..];
    match header.encoding {
        Encoding::Ascii => elements(&header, Ascii::new(rest, header.lines), source),
        Encoding::Little => elements(&header, Binary::new(rest, false), source),
        Encoding::Big => elements(&header, Binary::new(rest, true), source),
    }
}

fn elements<R: Records>(
    header: &Header,
    mut records: R,
    source: &mut Source,
) -> Result<MeshData, FormatError> {
    let mut builder = Builder::default();
    // An element without properties takes no bytes, whatever its count.
    for element in header.elements.iter().filter(|e| !e.properties.is_empty()) {
        check_count(element, records.bytes_left(), header.encoding, source)?;
        builder.reserve(element, source)?;
        builder.scratch().allow(source.left() / BYTES_PER_CORNER);
        for i in 0..element.count {
            records.record(element, builder.scratch()).and_then(|()| builder.take(element)).map_err(
                |why| {
                    let place = records.place();
                    source.fault(format_args!(
                        "element {} {i} of {}{place}: {why}",
                        element.name, element.count
                    ))
                },
            )?;
        }
    }
    if let Some(note) = records.finish().map_err(|why| source.fault(why))? {
        source.note(note);
    }
    builder.finish(source)
}

/// A count that the rest of the file cannot hold is wrong: found before anything is allocated.
fn check_count(e: &Element, left: usize, encoding: Encoding, source: &Source) -> Result<(), FormatError> {
    let least: usize = e.properties.iter().map(|p| p.least_bytes(encoding)).sum();
    // The last line of an ASCII file may lack its end.
    if least as u128 * u128::from(e.count) > left as u128 + 1 {
        let (name, count) = (&e.name, e.count);
        return Err(source.fault(format_args!(
            "{count} elements {name} need more than the {left} bytes that are left (truncated?)"
        )));
    }
    Ok(())
}
