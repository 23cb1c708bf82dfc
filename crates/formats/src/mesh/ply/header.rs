//! The header of a PLY file.

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Text, one element a line.
    Ascii,
    /// Little endian.
    Little,
    /// Big endian.
    Big,
}

/// A number type: signed and unsigned integers and floats, by bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    fn parse(name: &str) -> Result<Self, String> {
        Ok(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return Err(format!("unknown type {name:?}")),
        })
    }

    /// Bytes in a binary file.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Is it not an integer?
    pub fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// One property of an element.
#[derive(Debug, Clone, PartialEq)]
pub struct Property {
    /// Its name.
    pub name: String,
    /// The type of its value, or of its list's items.
    pub item: Type,
    /// The type of a list's length; `None` for a single value.
    pub length: Option<Type>,
    /// What it means to us.
    pub role: Role,
}

/// Where a property goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Slot of the vertex: 0–2 position, 3–5 normal, 6–7 texture coordinates, 8–10 colour.
    Slot(usize),
    /// The corners of a face.
    Polygon,
    /// A strip of triangles, −1 starts anew.
    Strip,
    /// Read over.
    Skip,
}

impl Property {
    /// The fewest bytes that one value takes.
    pub fn least_bytes(&self, encoding: Encoding) -> usize {
        match encoding {
            Encoding::Ascii => 2,
            _ => self.length.unwrap_or(self.item).size(),
        }
    }
}

/// A kind of element and how often it comes.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// "vertex", "face", …
    pub name: String,
    /// How many follow.
    pub count: u64,
    /// In file order.
    pub properties: Vec<Property>,
}

/// A parsed header.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// How numbers are written.
    pub encoding: Encoding,
    /// In file order.
    pub elements: Vec<Element>,
    /// Lines of the header, for line numbers.
    pub lines: usize,
}

/// Longest header that is read; real ones have a few hundred bytes.
const MAX_HEADER: usize = 1 << 16;

impl Header {
    /// The header and where the body starts.
    pub fn parse(bytes: &[u8]) -> Result<(Self, usize), String> {
        let mut header = Self { encoding: Encoding::Ascii, elements: Vec::new(), lines: 0 };
        let (mut at, mut format) = (0, false);
        loop {
            let window = &bytes[at..bytes.len().min(MAX_HEADER)];
            let Some(end) = window.iter().position(|&b| b == b'\n' || b == b'\r') else {
                return Err("the header has no end_header (truncated?)".into());
            };
            let line = std::str::from_utf8(&window[..end]).unwrap_or("comment").trim();
            at += end + 1;
            if window[end] == b'\r' && bytes.get(at) == Some(&b'\n') {
                at += 1;
            }
            header.lines += 1;
            match header.line(line, &mut format) {
                Ok(true) if format => return Ok((header, at)),
                Ok(true) => return Err("the header has no format line".into()),
                Ok(false) => {}
                Err(why) => return Err(format!("line {}: {why}", header.lines)),
            }
        }
    }

    /// One line; true at the end.
    fn line(&mut self, line: &str, format: &mut bool) -> Result<bool, String> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words.as_slice() {
            ["ply"] if self.lines == 1 => {}
            ["comment" | "obj_info", ..] | [] => {}
            ["format", name, "1.0"] => {
                *format = true;
                self.encoding = match *name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    _ => return Err(format!("unknown format {name:?}")),
                };
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| format!("bad element count {count:?}"))?;
                if self.elements.iter().any(|e| e.name == *name) {
                    return Err(format!("element {name} comes twice"));
                }
                self.elements.push(Element { name: (*name).into(), count, properties: Vec::new() });
            }
            ["property", "list", length, item, name] => {
                let length = Type::parse(length)?;
                if length.is_float() {
                    return Err("the length of a list must be an integer".into());
                }
                self.property(name, Type::parse(item)?, Some(length))?;
            }
            ["property", item, name] => self.property(name, Type::parse(item)?, None)?,
            ["end_header"] => return Ok(true),
            _ => return Err(format!("not a header line: {line:?}")),
        }
        Ok(false)
    }

    fn property(&mut self, name: &str, item: Type, length: Option<Type>) -> Result<(), String> {
        let element = self.elements.last_mut().ok_or("a property before any element")?;
        let role = role(&element.name, name, length.is_some());
        if role != Role::Skip && element.properties.iter().any(|p| p.role == role) {
            return Err(format!("property {name} comes twice"));
        }
        if matches!(role, Role::Polygon | Role::Strip) && item.is_float() {
            return Err(format!("{name} must hold integers"));
        }
        element.properties.push(Property { name: name.into(), item, length, role });
        Ok(())
    }
}

fn role(element: &str, name: &str, list: bool) -> Role {
    match (element, name, list) {
        ("vertex", _, false) => match name {
            "x" => Role::Slot(0),
            "y" => Role::Slot(1),
            "z" => Role::Slot(2),
            "nx" => Role::Slot(3),
            "ny" => Role::Slot(4),
            "nz" => Role::Slot(5),
            "s" | "u" | "texture_u" | "texture_s" => Role::Slot(6),
            "t" | "v" | "texture_v" | "texture_t" => Role::Slot(7),
            "red" | "r" | "diffuse_red" => Role::Slot(8),
            "green" | "g" | "diffuse_green" => Role::Slot(9),
            "blue" | "b" | "diffuse_blue" => Role::Slot(10),
            _ => Role::Skip,
        },
        ("face", "vertex_indices" | "vertex_index", true) => Role::Polygon,
        ("tristrips", "vertex_indices" | "vertex_index", true) => Role::Strip,
        _ => Role::Skip,
    }
}
