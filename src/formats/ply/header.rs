//! The header at the beginning of every PLY file.

/// The encoding of the elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlyEncoding {
    /// Decimal numbers.
    Ascii,
    /// Binary, little-endian.
    LittleEndian,
    /// Binary, big-endian.
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// `char`.
    I8,
    /// `uchar`.
    U8,
    /// `short`.
    I16,
    /// `ushort`.
    U16,
    /// `int`.
    I32,
    /// `uint`.
    U32,
    /// `float`.
    F32,
    /// `double`.
    F64,
}

impl Scalar {
    /// Returns the type with one of its two names.
    fn by_name(name: &str) -> Result<Scalar, String> {
        Ok(match &name.to_ascii_lowercase()[..] {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => {
                return Err(format!(
                    "unknown type {name:?}; there are char, uchar, short, ushort, int, uint, float and double"
                ));
            }
        })
    }

    /// Its size in bytes in a binary file.
    pub fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// True for floating-point types.
    pub fn is_float(self) -> bool {
        matches!(self, Scalar::F32 | Scalar::F64)
    }

    /// The smallest and the largest value of an integer type.
    pub fn range(self) -> (i64, i64) {
        match self {
            Scalar::I8 => (i8::MIN.into(), i8::MAX.into()),
            Scalar::U8 => (0, u8::MAX.into()),
            Scalar::I16 => (i16::MIN.into(), i16::MAX.into()),
            Scalar::U16 => (0, u16::MAX.into()),
            Scalar::I32 => (i32::MIN.into(), i32::MAX.into()),
            Scalar::U32 => (0, u32::MAX.into()),
            Scalar::F32 | Scalar::F64 => (i64::MIN, i64::MAX),
        }
    }
}

/// The type of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PropertyKind {
    /// One number.
    Scalar(Scalar),
    /// A count and that many items.
    List {
        /// The count's type, an integer.
        count: Scalar,
        /// Each item's type.
        item: Scalar,
    },
}

/// A property of an element: a column of its table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Property {
    /// The name in the file.
    pub name: String,
    /// The type.
    pub kind: PropertyKind,
}

/// An element of a file: a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Element {
    /// The name in the file.
    pub name: String,
    /// The number of rows that the header declares.
    pub count: u64,
    /// The columns, in order.
    pub properties: Vec<Property>,
}

impl Element {
    /// True if elements of that name are used.
    pub fn is_wanted(name: &str) -> bool {
        matches!(name, "vertex" | "face" | "tristrips")
    }

    /// The smallest number of bytes of a row in binary.
    pub fn least_size(&self) -> u64 {
        let size = |p: &Property| match p.kind {
            PropertyKind::Scalar(scalar) | PropertyKind::List { count: scalar, .. } => scalar.size() as u64,
        };
        self.properties.iter().map(size).sum()
    }

    /// True if every row takes [`Self::least_size`].
    pub fn has_fixed_size(&self) -> bool {
        self.properties.iter().all(|p| matches!(p.kind, PropertyKind::Scalar(_)))
    }
}

/// The header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlyHeader {
    /// The encoding of the elements.
    pub encoding: PlyEncoding,
    /// The elements, in the file's order.
    pub elements: Vec<Element>,
    /// The images that the comments `TextureFile` name, and their lines.
    pub textures: Vec<(String, usize)>,
}

/// An invalid line of a header.
#[derive(Debug)]
pub struct HeaderFault {
    /// The line number, from 1.
    pub line: usize,
    /// The reason.
    pub reason: String,
}

impl PlyHeader {
    /// Parses the header; also returns the bytes that follow it.
    pub fn parse(bytes: &[u8]) -> Result<(PlyHeader, &[u8]), HeaderFault> {
        let mut rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let mut line = 1;
        let fault = |line, reason: String| HeaderFault { line, reason };
        let (first, ending) = split_first_line(&mut rest);
        if !first.trim_ascii().eq_ignore_ascii_case(b"ply") {
            return Err(fault(1, "not a PLY file: its first line is not \"ply\"".into()));
        }
        let mut encoding = None;
        let (mut elements, mut textures) = (Vec::new(), Vec::new());
        while let Some(text) = split_line(&mut rest, ending) {
            line += 1;
            let text = String::from_utf8_lossy(text);
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            if words == ["end_header"] {
                let encoding = encoding.ok_or_else(|| fault(line, "no \"format\" line before it".into()))?;
                return Ok((PlyHeader { encoding, elements, textures }, rest));
            }
            if let ["comment", "TextureFile", first, ..] = words[..] {
                // The name may contain blanks. `first` is a slice of the line.
                let name = text.get(first.as_ptr() as usize - text.as_ptr() as usize..).unwrap_or(first);
                textures.push((name.trim_ascii().to_owned(), line));
            }
            read_line(&words, &mut encoding, &mut elements).map_err(|reason| fault(line, reason))?;
        }
        Err(fault(line, "the file ends before \"end_header\"".into()))
    }
}

/// Parses a line of the header.
fn read_line(
    words: &[&str],
    encoding: &mut Option<PlyEncoding>,
    elements: &mut Vec<Element>,
) -> Result<(), String> {
    match *words {
        [] | ["comment" | "obj_info", ..] => {}
        ["format", name, version] => {
            if encoding.is_some() || !elements.is_empty() {
                return Err("\"format\" belongs on the second line, once".into());
            }
            if version != "1.0" {
                return Err(format!("unknown format version {version:?}; there is 1.0"));
            }
            *encoding = Some(match name {
                "ascii" => PlyEncoding::Ascii,
                "binary_little_endian" => PlyEncoding::LittleEndian,
                "binary_big_endian" => PlyEncoding::BigEndian,
                _ => {
                    return Err(format!(
                        "unknown format {name:?}; there are ascii, binary_little_endian and binary_big_endian"
                    ));
                }
            });
        }
        ["element", name, count] => {
            let count = count.parse().map_err(|_| format!("{count:?} is not a number of elements"))?;
            if Element::is_wanted(name) && elements.iter().any(|e| e.name == name) {
                return Err(format!("element {name} is declared twice"));
            }
            elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
        }
        ["property", ref rest @ ..] => {
            let element = elements.last_mut().ok_or("a property before any element")?;
            element.properties.push(read_property(rest)?);
        }
        [keyword, ..] => return Err(unknown_line(keyword, words.len())),
    }
    Ok(())
}

fn read_property(words: &[&str]) -> Result<Property, String> {
    let (name, kind) = match *words {
        ["list", count, item, ref name @ ..] if !name.is_empty() => {
            let (count, item) = (Scalar::by_name(count)?, Scalar::by_name(item)?);
            if count.is_float() {
                return Err("a list's length must be of an integer type".into());
            }
            (name, PropertyKind::List { count, item })
        }
        [scalar, ref name @ ..] if !name.is_empty() => (name, PropertyKind::Scalar(Scalar::by_name(scalar)?)),
        _ => {
            return Err(
                "a property is \"property TYPE NAME\" or \"property list COUNT_TYPE ITEM_TYPE NAME\"".into(),
            );
        }
    };
    // Blender names properties by its vertex groups, with blanks.
    Ok(Property { name: name.join(" "), kind })
}

fn unknown_line(keyword: &str, words: usize) -> String {
    match keyword {
        "format" | "element" => format!("\"{keyword}\" takes two words, not {}", words - 1),
        "end_header" => "\"end_header\" stands alone".into(),
        _ => {
            let keyword: String = keyword.chars().take(40).collect();
            format!(
                "unknown keyword {keyword:?}; there are format, comment, obj_info, element, property and end_header"
            )
        }
    }
}

/// The line ending. The first line decides, so that a body that begins with a line feed keeps it.
#[derive(Clone, Copy)]
enum Ending {
    LineFeed,
    CarriageReturn,
}

fn split_first_line<'a>(rest: &mut &'a [u8]) -> (&'a [u8], Ending) {
    let ending = match rest.iter().position(|b| matches!(b, b'\n' | b'\r')) {
        Some(at) if rest[at] == b'\r' && rest.get(at + 1) != Some(&b'\n') => Ending::CarriageReturn,
        _ => Ending::LineFeed,
    };
    (split_line(rest, ending).unwrap_or_default(), ending)
}

/// Takes the next line, without its ending, from `rest`; none at the end of the file.
fn split_line<'a>(rest: &mut &'a [u8], ending: Ending) -> Option<&'a [u8]> {
    let byte = match ending {
        Ending::LineFeed => b'\n',
        Ending::CarriageReturn => b'\r',
    };
    if rest.is_empty() {
        return None;
    }
    let end = rest.iter().position(|&b| b == byte).unwrap_or(rest.len());
    let (line, after) = rest.split_at(end);
    *rest = after.get(1..).unwrap_or_default();
    Some(line)
}
