use super::{LandmarkFile, Mark};
use crate::formats::error::Fault;
use crate::formats::text::{Lines, integer, shown};

/// Landmarks are few: a longer list is another file, and would take many times its bytes in memory.
const MOST: usize = 10_000;

/// One vertex index a line.
pub(super) fn read(text: &[u8]) -> Result<LandmarkFile, Fault> {
    let mut file = LandmarkFile { listed: true, ..LandmarkFile::default() };
    for line in Lines::new(text) {
        let entry = line.text.split(|&b| b == b'#').next().unwrap_or_default().trim_ascii();
        let mark = match entry {
            b"" => continue,
            b"null" => None,
            entry => Some(vertex(entry, line.number)?),
        };
        if file.names.len() == MOST {
            let problem = format!("is entry {}: a list of landmarks has at most {MOST}", MOST + 1);
            return Err(Fault::at(format_args!("line {}", line.number), problem));
        }
        file.push(file.names.len().to_string(), mark);
    }
    Ok(file)
}

fn vertex(entry: &[u8], line: usize) -> Result<Mark, Fault> {
    let index = integer(entry).and_then(|index| u64::try_from(index).ok());
    let index = index.ok_or_else(|| {
        let problem = format!(
            "holds `{}`: text has one vertex index a line, counted from 0, or `null`; points are given as JSON, \
             LJSON or .pp",
            shown(entry)
        );
        Fault::at(format_args!("line {line}"), problem)
    })?;
    Ok(Mark::Vertex { index, line })
}
