use super::model::{MODELS, lens};
use super::{Lenses, PlacedImage};
use crate::formats::error::Fault;

/// `cameras.bin`: a count, and for each its number, its model's, its size and its parameters, little endian.
pub(super) fn cameras(bytes: &[u8]) -> Result<Lenses, Fault> {
    let mut rest = Rest { bytes, at: "the count of cameras".to_owned() };
    let count = rest.u64()?;
    let mut lenses = Lenses::new();
    for number in 0..count {
        rest.at = format!("camera {number} of {count}");
        let (id, model) = (rest.u32()?, rest.u32()?);
        let size = [rest.u64()?, rest.u64()?];
        let Some(&(_, name, parameters)) = MODELS.iter().find(|(known, ..)| *known == i64::from(model))
        else {
            return Err(Fault::at(
                &rest.at,
                format!("has the model number {model}, which COLMAP does not list"),
            ));
        };
        let parameters: Vec<f64> = (0..parameters).map(|_| rest.f64()).collect::<Result<_, _>>()?;
        lenses.insert(id, lens(name, size, &parameters, &rest.at)?);
    }
    Ok(lenses)
}

/// `images.bin`: a count, and for each its number, rotation, translation, camera, name and points, little endian.
pub(super) fn images(bytes: &[u8]) -> Result<Vec<PlacedImage>, Fault> {
    let mut rest = Rest { bytes, at: "the count of images".to_owned() };
    let count = rest.u64()?;
    let mut images = Vec::new();
    for number in 0..count {
        rest.at = format!("image {number} of {count}");
        rest.u32()?;
        let mut numbers = [0.0; 7];
        for number in &mut numbers {
            *number = rest.f64()?;
        }
        let [w, x, y, z, tx, ty, tz] = numbers;
        let camera = rest.u32()?;
        let name = rest.name()?;
        let points = rest.u64()?;
        rest.skip(points.saturating_mul(24))?;
        images.push(PlacedImage { name, camera, rotation: [w, x, y, z], translation: [tx, ty, tz] });
    }
    Ok(images)
}

/// What has not been read yet, and what is being read.
struct Rest<'a> {
    bytes: &'a [u8],
    at: String,
}

impl<'a> Rest<'a> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let (taken, rest) = self.bytes.split_first_chunk().ok_or_else(|| self.cut_short())?;
        self.bytes = rest;
        Ok(*taken)
    }

    fn u32(&mut self) -> Result<u32, Fault> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, Fault> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, Fault> {
        self.take().map(f64::from_le_bytes)
    }

    fn skip(&mut self, count: u64) -> Result<(), Fault> {
        let count = usize::try_from(count).ok().filter(|count| *count <= self.bytes.len());
        self.bytes = &self.bytes[count.ok_or_else(|| self.cut_short())?..];
        Ok(())
    }

    fn name(&mut self) -> Result<String, Fault> {
        let end = self.bytes.iter().position(|b| *b == 0).ok_or_else(|| self.cut_short())?;
        let name = String::from_utf8_lossy(&self.bytes[..end]).into_owned();
        self.bytes = &self.bytes[end + 1..];
        Ok(name)
    }

    fn cut_short(&self) -> Fault {
        Fault::at(&self.at, "is cut short: export the model again")
    }
}
