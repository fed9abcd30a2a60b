use crate::formats::error::Fault;
use crate::formats::text::without_mark;

/// The two parts of a GLB; a plain glTF is its JSON alone.
pub(super) struct Container<'a> {
    pub json: &'a [u8],
    pub binary: Option<&'a [u8]>,
}

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

impl<'a> Container<'a> {
    pub fn split(bytes: &'a [u8]) -> Result<Self, Fault> {
        if !bytes.starts_with(b"glTF") {
            return Ok(Self { json: without_mark(bytes), binary: None });
        }
        let (version, length) = (word(bytes, 4)?, word(bytes, 8)?);
        if version != 2 {
            return Err(fault(format!("is of version {version}: only glTF 2.0 is read")));
        }
        let content = bytes.get(HEADER..length as usize).ok_or_else(|| {
            fault(format!(
                "gives its length as {length} bytes, but {} are there: the file is cut short",
                bytes.len()
            ))
        })?;
        let mut chunks = Chunks { rest: content };
        let Some(Chunk { kind: b"JSON", data: json }) = chunks.next()? else {
            return Err(fault("does not begin with a JSON chunk".to_owned()));
        };
        let mut binary = None;
        while let (None, Some(chunk)) = (binary, chunks.next()?) {
            // Chunks of other kinds are for extensions.
            binary = (chunk.kind == b"BIN\0").then_some(chunk.data);
        }
        Ok(Self { json, binary })
    }
}

struct Chunk<'a> {
    kind: &'a [u8; 4],
    data: &'a [u8],
}

struct Chunks<'a> {
    rest: &'a [u8],
}

impl<'a> Chunks<'a> {
    fn next(&mut self) -> Result<Option<Chunk<'a>>, Fault> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let length = word(self.rest, 0)? as usize;
        let (kind, after) = self.rest[4..].split_first_chunk::<4>().ok_or_else(cut_short)?;
        let data = after.get(..length).ok_or_else(|| {
            fault(format!(
                "has a chunk of {length} bytes, but {} are left: the file is cut short",
                after.len()
            ))
        })?;
        self.rest = &self.rest[CHUNK_HEADER + length..];
        Ok(Some(Chunk { kind, data }))
    }
}

fn word(bytes: &[u8], at: usize) -> Result<u32, Fault> {
    let word = bytes.get(at..).and_then(|rest| rest.first_chunk()).ok_or_else(cut_short)?;
    Ok(u32::from_le_bytes(*word))
}

fn fault(problem: String) -> Fault {
    Fault::at("the GLB container", problem)
}

fn cut_short() -> Fault {
    fault("is cut short within a header".to_owned())
}
