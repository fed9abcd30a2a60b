use super::fault::{Part, ScanFault};

/// Holds a picture's stated size against the limit; nothing of it is decoded.
pub(super) fn check_picture(bytes: &[u8], part: Part, most_pixels: u64) -> Result<(), ScanFault> {
    let size = imagesize::blob_size(bytes).map_err(|error| ScanFault::Unfit {
        part,
        problem: format!("is no picture that is known ({error}): send PNG or JPEG"),
    })?;
    let found = (size.width as u64).saturating_mul(size.height as u64);
    if found > most_pixels {
        let remedy = "send a smaller picture";
        return Err(ScanFault::TooLarge { part, what: "pixels", found, limit: most_pixels, remedy });
    }
    Ok(())
}
