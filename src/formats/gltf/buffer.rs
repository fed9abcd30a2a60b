use std::borrow::Cow;
use std::cell::{Cell, OnceCell};

use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::document::Document;
use crate::formats::error::Fault;
use crate::formats::input::Siblings;
use crate::formats::text::shown;

/// The bytes that accessors look at, loaded when first asked for.
pub(super) struct Buffers<'a> {
    document: &'a Document<'a>,
    binary: Option<&'a [u8]>,
    siblings: &'a Siblings,
    loaded: Vec<OnceCell<Cow<'a, [u8]>>>,
    /// Bytes of the file and of those beside it that were read.
    held: Cell<usize>,
    /// Values that accessors have been unfolded to.
    unfolded: Cell<usize>,
}

/// Padding is asked for by the standard and left out by some writers.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Files of any size may unfold to so many vertices and indices.
const ALWAYS_ALLOWED: usize = 1 << 16;

impl<'a> Buffers<'a> {
    /// Of a file of `size` bytes, `binary` the second part of its container.
    pub fn new(
        document: &'a Document<'a>,
        binary: Option<&'a [u8]>,
        siblings: &'a Siblings,
        size: usize,
    ) -> Self {
        let loaded = (0..document.buffer_count()).map(|_| OnceCell::new()).collect();
        Self { document, binary, siblings, loaded, held: Cell::new(size), unfolded: Cell::new(0) }
    }

    pub fn document(&self) -> &'a Document<'a> {
        self.document
    }

    /// Bytes of the file and of those beside it that were read.
    pub fn held(&self) -> usize {
        self.held.get()
    }

    pub fn siblings(&self) -> &'a Siblings {
        self.siblings
    }

    /// Counts `values` towards what the file may unfold to. A file that has its own bytes for each vertex and index
    /// always stays within that; one that repeats a mesh without end, or has values without bytes, does not.
    pub fn unfold(&self, values: usize, place: &str) -> Result<(), Fault> {
        let total = self.unfolded.get().saturating_add(values);
        let allowed = self.held.get().saturating_add(ALWAYS_ALLOWED);
        if total > allowed {
            let problem = format!(
                "brings the scene to {total} vertices and indices, too many for {} bytes of data: \
                 save the scan as one mesh, without instances",
                self.held.get()
            );
            return Err(Fault::at(place, problem));
        }
        self.unfolded.set(total);
        Ok(())
    }

    /// The bytes of a view, and the distance of its entries where it states one.
    pub fn view(&self, index: usize) -> Result<(&[u8], Option<usize>), Fault> {
        let view = self.document.buffer_view(index)?;
        let place = || format!("bufferViews[{index}]");
        if view.extensions.is_some_and(|extensions| extensions.get().contains("meshopt_compression")) {
            return Err(Fault::at(place(), "is compressed with meshopt: save the file without compression"));
        }
        let buffer = self.bytes(view.buffer)?;
        let bytes = buffer.get(view.byte_offset..).and_then(|rest| rest.get(..view.byte_length));
        let bytes = bytes.ok_or_else(|| {
            let problem = format!(
                "takes {} bytes from byte {} on, but buffer {} has {}",
                view.byte_length,
                view.byte_offset,
                view.buffer,
                buffer.len()
            );
            Fault::at(place(), problem)
        })?;
        Ok((bytes, view.byte_stride))
    }

    /// The bytes of a buffer.
    pub fn bytes(&self, index: usize) -> Result<&[u8], Fault> {
        let cell = self.loaded.get(index);
        if let Some(bytes) = cell.and_then(OnceCell::get) {
            return Ok(bytes);
        }
        let bytes = self.load(index)?;
        Ok(cell.map_or(&[], |cell| cell.get_or_init(|| bytes)))
    }

    fn load(&self, index: usize) -> Result<Cow<'a, [u8]>, Fault> {
        let place = format!("buffers[{index}]");
        let buffer = self.document.buffer(index)?;
        let mut bytes = match (&buffer.uri, self.binary) {
            (Some(uri), _) => {
                self.resolve(uri).map(Cow::Owned).map_err(|problem| Fault::at(&place, problem))?
            }
            (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
            _ => return Err(Fault::at(&place, "has neither a uri nor a binary chunk to be in")),
        };
        if bytes.len() < buffer.byte_length {
            let (declared, there) = (buffer.byte_length, bytes.len());
            let problem =
                format!("is to have {declared} bytes, but {there} are there: the file is cut short");
            return Err(Fault::at(&place, problem));
        }
        match &mut bytes {
            Cow::Borrowed(slice) => *slice = &slice[..buffer.byte_length],
            Cow::Owned(vector) => vector.truncate(buffer.byte_length),
        }
        Ok(bytes)
    }

    fn resolve(&self, uri: &str) -> Result<Vec<u8>, String> {
        if let Some(data) = uri.strip_prefix("data:") {
            return embedded(data).map(|(_, bytes)| bytes);
        }
        let bytes = self.siblings.read(&percent_decoded(uri)?)?;
        self.held.set(self.held.get().saturating_add(bytes.len()));
        Ok(bytes)
    }
}

/// What a uri holds that begins with `data:`: the type it states, and the bytes.
pub(super) fn embedded(data: &str) -> Result<(&str, Vec<u8>), String> {
    let (media_type, encoded) = data
        .split_once(";base64,")
        .ok_or_else(|| format!("has the uri `data:{}`, which is not base64", shown(data.as_bytes())))?;
    let bytes = BASE64.decode(encoded).map_err(|error| format!("is no valid base64: {error}"))?;
    Ok((media_type, bytes))
}

/// A uri that holds bytes, of the media type that uri `like` states if it holds some.
pub(super) fn embedding(bytes: &[u8], like: &str) -> String {
    let stated =
        like.split_once(";base64,").map(|(start, _)| start).filter(|start| start.starts_with("data:"));
    let start = stated.unwrap_or("data:application/octet-stream");
    format!("{start};base64,{}", BASE64.encode(bytes))
}

/// A uri's file name, its `%20` and the like made plain.
pub(super) fn percent_decoded(uri: &str) -> Result<String, String> {
    let unreadable = || format!("has the uri `{}`, which cannot be read", shown(uri.as_bytes()));
    let mut name = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        rest = after;
        if *first != b'%' {
            name.push(*first);
            continue;
        }
        let (digits, after) = rest.split_first_chunk::<2>().ok_or_else(unreadable)?;
        let value = |digit: u8| char::from(digit).to_digit(16).ok_or_else(unreadable);
        name.push((value(digits[0])? * 16 + value(digits[1])?) as u8);
        rest = after;
    }
    String::from_utf8(name).map_err(|_| unreadable())
}
