/// A smooth curve through keys: a natural cubic spline with `D` values, constant outside of its keys.
#[derive(Debug, Clone)]
pub(super) struct Spline<const D: usize> {
    at: Vec<f64>,
    values: Vec<[f64; D]>,
    /// Second derivatives at the keys.
    bends: Vec<[f64; D]>,
}

impl<const D: usize> Spline<D> {
    /// The curve through `keys`, in rising order of their first number.
    pub fn through(keys: &[(f64, [f64; D])]) -> Self {
        assert!(keys.is_sorted_by(|a, b| a.0 < b.0), "keys rise");
        let (at, values): (Vec<_>, Vec<_>) = keys.iter().copied().unzip();
        let bends = bends(&at, &values);
        Self { at, values, bends }
    }

    /// The values at `x`.
    pub fn value(&self, x: f64) -> [f64; D] {
        let x = x.clamp(self.at[0], self.at[self.at.len() - 1]);
        let right = self.at.partition_point(|&key| key < x).clamp(1, self.at.len() - 1);
        let left = right - 1;
        let step = self.at[right] - self.at[left];
        let [a, b] = [(self.at[right] - x) / step, (x - self.at[left]) / step];
        let [bend_a, bend_b] = [a, b].map(|w| (w * w * w - w) * step * step / 6.0);
        std::array::from_fn(|d| {
            a * self.values[left][d]
                + b * self.values[right][d]
                + bend_a * self.bends[left][d]
                + bend_b * self.bends[right][d]
        })
    }
}

/// Second derivatives of a natural cubic spline, by elimination of its tridiagonal system.
fn bends<const D: usize>(at: &[f64], values: &[[f64; D]]) -> Vec<[f64; D]> {
    let last = at.len() - 1;
    let mut bends = vec![[0.0; D]; at.len()];
    let mut upper = vec![0.0; at.len()];
    for i in 1..last {
        let [before, after] = [at[i] - at[i - 1], at[i + 1] - at[i]];
        let pivot = 2.0 * (before + after) - before * upper[i - 1];
        upper[i] = after / pivot;
        bends[i] = std::array::from_fn(|d| {
            let turn = (values[i + 1][d] - values[i][d]) / after - (values[i][d] - values[i - 1][d]) / before;
            (6.0 * turn - before * bends[i - 1][d]) / pivot
        });
    }
    for i in (1..last).rev() {
        bends[i] = std::array::from_fn(|d| bends[i][d] - upper[i] * bends[i + 1][d]);
    }
    bends
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goes_through_its_keys_smoothly() {
        let keys = [(0.0, [1.0]), (1.0, [3.0]), (1.5, [-2.0]), (4.0, [0.5])];
        let spline = Spline::through(&keys);
        for (at, [value]) in keys {
            assert!((spline.value(at)[0] - value).abs() < 1e-12);
        }
        let slope = |x: f64| (spline.value(x + 1e-6)[0] - spline.value(x)[0]) / 1e-6;
        assert!((slope(1.5) - slope(1.5 - 1e-6)).abs() < 1e-3);
    }

    #[test]
    fn keeps_a_straight_line_straight() {
        let spline = Spline::through(&[(0.0, [0.0]), (1.0, [2.0]), (3.0, [6.0])]);
        assert!((spline.value(2.2)[0] - 4.4).abs() < 1e-12);
    }
}
