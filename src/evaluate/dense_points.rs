use glam::DVec3;

/// Why bytes are not a list of points.
#[derive(Debug, thiserror::Error)]
pub enum DensePointsError {
    /// Not numpy's format.
    #[error("this is no .npy file: it does not start with its magic string and a whole header")]
    NotNpy,
    /// An array of something else.
    #[error("the .npy header says `{0}`; needed are descr '<f4' or '<f8', fortran_order False, shape (P, 3)")]
    Layout(String),
    /// Fewer or more numbers than the header says.
    #[error("the .npy header promises {expected} bytes of numbers, but {found} follow")]
    Length {
        /// Bytes that the shape asks for.
        expected: usize,
        /// Bytes there are.
        found: usize,
    },
    /// Not a JSON list of triples.
    #[error("expected a JSON list of [x, y, z]: {0}")]
    Json(#[from] serde_json::Error),
    /// A coordinate is NaN or infinite.
    #[error("point {0} has a coordinate that is not a finite number")]
    NotFinite(usize),
}

/// Reads points `[P, 3]` from a JSON list of `[x, y, z]`.
///
/// # Errors
/// [`DensePointsError::Json`].
pub fn dense_points_from_json(bytes: &[u8]) -> Result<Vec<DVec3>, DensePointsError> {
    let points: Vec<[f64; 3]> = serde_json::from_slice(bytes)?;
    finite(points.into_iter().map(DVec3::from_array).collect())
}

/// Reads points from a numpy file, little-endian float32 or float64 `[P, 3]`.
///
/// # Errors
/// [`DensePointsError`] says what the file has instead.
pub fn dense_points_from_npy(bytes: &[u8]) -> Result<Vec<DVec3>, DensePointsError> {
    let (header, numbers) = split_npy(bytes).ok_or(DensePointsError::NotNpy)?;
    let (width, count) = layout(header).ok_or_else(|| DensePointsError::Layout(header.trim().to_owned()))?;
    let expected = count.saturating_mul(3 * width);
    if numbers.len() != expected {
        return Err(DensePointsError::Length { expected, found: numbers.len() });
    }
    let coordinates: Vec<f64> = match width {
        4 => numbers.as_chunks().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect(),
        _ => numbers.as_chunks().0.iter().map(|&b| f64::from_le_bytes(b)).collect(),
    };
    finite(coordinates.as_chunks().0.iter().map(|&p| DVec3::from_array(p)).collect())
}

fn finite(points: Vec<DVec3>) -> Result<Vec<DVec3>, DensePointsError> {
    match points.iter().position(|p| !p.is_finite()) {
        Some(at) => Err(DensePointsError::NotFinite(at)),
        None => Ok(points),
    }
}

/// The header's text and what follows it.
fn split_npy(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let rest = bytes.strip_prefix(b"\x93NUMPY")?;
    let (&[major, _minor], rest) = rest.split_first_chunk()?;
    let (length, rest) = if major == 1 {
        let (length, rest) = rest.split_first_chunk()?;
        (u16::from_le_bytes(*length) as usize, rest)
    } else {
        let (length, rest) = rest.split_first_chunk()?;
        (u32::from_le_bytes(*length) as usize, rest)
    };
    let (header, numbers) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(header).ok()?, numbers))
}

/// Bytes to a number and number of points, if the header describes points.
fn layout(header: &str) -> Option<(usize, usize)> {
    let packed: String = header.chars().filter(|c| !c.is_whitespace()).collect();
    let after = |key: &str| packed.split_once(key).map(|(_, value)| value);
    let width = match after("'descr':'")?.split_once('\'')?.0 {
        "<f4" => 4,
        "<f8" => 8,
        _ => return None,
    };
    if !after("'fortran_order':")?.starts_with("False") {
        return None;
    }
    let (count, columns) = after("'shape':(")?.split_once(')')?.0.split_once(',')?;
    (columns.trim_end_matches(',') == "3").then_some((width, count.parse().ok()?))
}
