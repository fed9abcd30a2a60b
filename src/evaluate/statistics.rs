/// The mean; not a number if there are no values.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The largest of values that are not negative; zero if there are none.
pub(super) fn maximum(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// The quantile, interpolated between the two values next to it; 0 gives the smallest, 1 the largest.
///
/// # Panics
/// Without values.
pub(super) fn quantile(values: &[f64], at: f64) -> f64 {
    let place = at * (values.len() - 1) as f64;
    let mut values = values.to_vec();
    let (_, &mut below, later) = values.select_nth_unstable_by(place.floor() as usize, f64::total_cmp);
    let between = place.fract();
    match later.iter().copied().min_by(f64::total_cmp) {
        Some(above) if between > 0.0 => below + (above - below) * between,
        _ => below,
    }
}
