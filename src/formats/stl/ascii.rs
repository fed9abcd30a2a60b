use glam::DVec3;

use crate::formats::error::Fault;
use crate::formats::stream::Stream;
use crate::formats::text::{finite, shown, words};
use crate::mesh::{FilePoints, Points};

/// The corners of all triangles `[3 F]`.
pub(super) fn read(stream: &mut Stream) -> Result<FilePoints, Fault> {
    let mut corners = FilePoints::default();
    let mut ended = false;
    while let Some(line) = stream.line() {
        let mut words = words(line.text);
        let problem = match words.next() {
            Some(b"vertex") => corner(words).map(|point| corners.push(point)),
            Some(b"endfacet" | b"facet" | b"endsolid") if corners.count() % 3 != 0 => {
                Err("the triangle has not three corners (`vertex x y z`)".to_owned())
            }
            // Several solids may follow one another, and a name may be any words.
            Some(b"endsolid") => {
                ended = true;
                Ok(())
            }
            Some(b"solid") => {
                ended = false;
                Ok(())
            }
            Some(b"facet" | b"outer" | b"endloop" | b"endfacet") | None => Ok(()),
            Some(_) => Err(format!("`{}` is no statement of ascii STL", shown(line.text))),
        };
        problem.map_err(|problem| Fault::at(format_args!("line {}", line.number), problem))?;
    }
    if ended {
        return Ok(corners);
    }
    Err(Fault::at("the file", "has no line `endsolid`: it is cut short or damaged"))
}

fn corner<'a>(mut words: impl Iterator<Item = &'a [u8]>) -> Result<DVec3, String> {
    let mut point = [0.0; 3];
    for coordinate in &mut point {
        let word = words.next().unwrap_or_default();
        *coordinate = finite(word).ok_or_else(|| {
            format!("the vertex holds `{}`, where one of three finite numbers must be", shown(word))
        })?;
    }
    Ok(DVec3::from(point))
}
