use crate::formats::error::Fault;
use crate::formats::stream::Stream;
use crate::formats::text::{integer, shown, words};

/// How the rows after the header are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// What a property holds in each row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    One(Scalar),
    /// A count, which is an integer, and so many items.
    List {
        count: Scalar,
        item: Scalar,
    },
}

#[derive(Debug, PartialEq)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

/// A table: `count` rows with these properties.
#[derive(Debug, PartialEq)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

#[derive(Debug, PartialEq)]
pub(super) struct Header {
    pub encoding: Encoding,
    /// In the order of their rows.
    pub elements: Vec<Element>,
    /// The pictures that comments name, as MeshLab writes them.
    pub pictures: Vec<String>,
}

impl Scalar {
    /// Bytes that a number takes in the binary encodings.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }
}

impl Header {
    /// Reads up to and including the line `end_header`; the rows follow.
    pub fn read(stream: &mut Stream) -> Result<Self, Fault> {
        let first = stream.line().map_or(&b""[..], |line| line.text);
        if first.trim_ascii() != b"ply" {
            let problem = format!("a PLY file begins with `ply`, not with `{}`", shown(first));
            return Err(Fault::at("line 1", problem));
        }
        let mut encoding = None;
        let mut elements = Vec::new();
        let mut pictures = Vec::new();
        while let Some(line) = stream.line() {
            let statement: Vec<_> = words(line.text).collect();
            let outcome = match statement[..] {
                [b"comment", b"TextureFile", ..] => {
                    pictures.push(picture(line.text));
                    Ok(())
                }
                [] | [b"comment" | b"obj_info", ..] => Ok(()),
                [b"end_header"] => {
                    let encoding = encoding.ok_or_else(|| Fault::at("the header", "has no line `format`"))?;
                    return Ok(Self { encoding, elements, pictures });
                }
                [b"format", name, ..] => read_encoding(name).map(|read| encoding = Some(read)),
                [b"element", name, count] => read_element(name, count).map(|element| elements.push(element)),
                [b"property", ref property @ ..] => read_property(property, elements.last_mut()),
                _ => Err("is no statement of a PLY header".to_owned()),
            };
            outcome.map_err(|problem| {
                Fault::at(format_args!("line {}", line.number), format!("`{}` {problem}", shown(line.text)))
            })?;
        }
        Err(Fault::at("the header", "has no line `end_header`: the file is cut short or damaged"))
    }

    /// The element called `name`, which must be there once.
    pub fn element(&self, name: &str) -> Result<&Element, Fault> {
        let mut found = self.elements.iter().filter(|element| element.name == name);
        match (found.next(), found.next()) {
            (Some(element), None) => Ok(element),
            (Some(_), Some(_)) => {
                Err(Fault::at("the header", format!("declares the element `{name}` twice")))
            }
            (None, _) => {
                let others: Vec<_> = self.elements.iter().map(|element| element.name.as_str()).collect();
                let problem = format!(
                    "declares no element `{name}` (only: {}): a mesh has `vertex` and `face`",
                    shown(others.join(", ").as_bytes())
                );
                Err(Fault::at("the header", problem))
            }
        }
    }
}

/// What stands behind `comment TextureFile`, blanks in it included.
fn picture(comment: &[u8]) -> String {
    const KEYWORD: &str = "TextureFile";
    let comment = String::from_utf8_lossy(comment);
    let name = comment.split_once(KEYWORD).map_or("", |(_, name)| name);
    name.trim().replace('\\', "/")
}

fn read_encoding(name: &[u8]) -> Result<Encoding, String> {
    match name {
        b"ascii" => Ok(Encoding::Ascii),
        b"binary_little_endian" => Ok(Encoding::LittleEndian),
        b"binary_big_endian" => Ok(Encoding::BigEndian),
        _ => Err("is none of ascii, binary_little_endian and binary_big_endian".to_owned()),
    }
}

fn read_element(name: &[u8], count: &[u8]) -> Result<Element, String> {
    let count = integer(count).and_then(|count| u64::try_from(count).ok());
    let count = count.ok_or("has no count of rows")?;
    Ok(Element { name: String::from_utf8_lossy(name).into_owned(), count, properties: Vec::new() })
}

fn read_property(words: &[&[u8]], element: Option<&mut Element>) -> Result<(), String> {
    let scalar = |name: &[u8]| {
        Scalar::named(name).ok_or_else(|| {
            let known = "char, uchar, short, ushort, int, uint, float and double";
            format!("has the type `{}`: the types are {known}", shown(name))
        })
    };
    let (kind, name) = match words {
        [b"list", count, item, name] => (Kind::List { count: scalar(count)?, item: scalar(item)? }, name),
        [one, name] => (Kind::One(scalar(one)?), name),
        _ => return Err("is no `property TYPE NAME` or `property list TYPE TYPE NAME`".to_owned()),
    };
    if matches!(kind, Kind::List { count, .. } if !count.is_integer()) {
        return Err("counts its items in a type that is no integer".to_owned());
    }
    let element = element.ok_or("comes before the first element")?;
    element.properties.push(Property { name: String::from_utf8_lossy(name).into_owned(), kind });
    Ok(())
}

impl Element {
    /// Where the property called by one of `names` stands.
    pub fn position(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|property| names.contains(&property.name.as_str()))
    }
}
