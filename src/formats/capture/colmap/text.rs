use super::model::lens;
use super::{Lenses, PlacedImage};
use crate::formats::error::Fault;
use crate::formats::text::{Line, Lines, finite, integer, shown, words};

/// `cameras.txt`: CAMERA_ID MODEL WIDTH HEIGHT PARAMS, a line for each.
pub(super) fn cameras(text: &[u8]) -> Result<Lenses, Fault> {
    let mut lenses = Lenses::new();
    for line in Lines::new(text).filter(|line| !is_comment(line)) {
        let place = format!("line {}", line.number);
        let fields: Vec<&[u8]> = words(line.text).collect();
        let [id, model, width, height, parameters @ ..] = fields.as_slice() else {
            return Err(Fault::at(place, "must have CAMERA_ID MODEL WIDTH HEIGHT and parameters"));
        };
        let size = [count(width, &place)?, count(height, &place)?];
        let parameters: Vec<f64> =
            parameters.iter().map(|word| number(word, &place)).collect::<Result<_, _>>()?;
        let lens = lens(&String::from_utf8_lossy(model), size, &parameters, &place)?;
        lenses.insert(identity(id, &place)?, lens);
    }
    Ok(lenses)
}

/// `images.txt`: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, each followed by a line of its points, which may be empty.
pub(super) fn images(text: &[u8]) -> Result<Vec<PlacedImage>, Fault> {
    let mut images = Vec::new();
    let mut lines = Lines::new(text);
    while let Some(line) = lines.next() {
        if is_comment(&line) {
            continue;
        }
        images.push(image(&line)?);
        lines.next();
    }
    Ok(images)
}

fn image(line: &Line) -> Result<PlacedImage, Fault> {
    let place = format!("line {}", line.number);
    let fields: Vec<&[u8]> = words(line.text).collect();
    let [_, numbers @ .., camera, name] = fields.as_slice() else {
        return Err(Fault::at(place, "must have IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"));
    };
    let numbers: Vec<f64> = numbers.iter().map(|word| number(word, &place)).collect::<Result<_, _>>()?;
    let &[w, x, y, z, tx, ty, tz] = numbers.as_slice() else {
        return Err(Fault::at(
            place,
            "must have IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, the name without blanks",
        ));
    };
    Ok(PlacedImage {
        name: String::from_utf8_lossy(name).into_owned(),
        camera: identity(camera, &place)?,
        rotation: [w, x, y, z],
        translation: [tx, ty, tz],
    })
}

fn is_comment(line: &Line) -> bool {
    words(line.text).next().is_none_or(|word| word.starts_with(b"#"))
}

fn number(word: &[u8], place: &str) -> Result<f64, Fault> {
    finite(word).ok_or_else(|| Fault::at(place, format!("has `{}`, which is no finite number", shown(word))))
}

fn count(word: &[u8], place: &str) -> Result<u64, Fault> {
    let count = integer(word).and_then(|count| u64::try_from(count).ok());
    count.ok_or_else(|| Fault::at(place, format!("has `{}` for a count of pixels", shown(word))))
}

fn identity(word: &[u8], place: &str) -> Result<u32, Fault> {
    let id = integer(word).and_then(|id| u32::try_from(id).ok());
    id.ok_or_else(|| Fault::at(place, format!("has `{}` for a camera's number", shown(word))))
}
