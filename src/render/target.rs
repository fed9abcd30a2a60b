use super::{Light, RenderError, View};

/// A picture to match: what a camera saw, under which light, before which background.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// The camera.
    pub view: View,
    /// What lights the surface.
    pub light: Light,
    /// The colour where no surface is seen.
    pub background: [f32; 3],
    /// I, the colours `[H * W, 3]`, rows from the top.
    pub colours: Vec<[f32; 3]>,
    /// How much each pixel counts `[H * W]`; 0 is not compared. All count one where there are none.
    pub weights: Option<Vec<f32>>,
}

impl Target {
    /// Whether this target, `index` of its list, can be compared with at all.
    pub(super) fn check(&self, index: usize) -> Result<(), RenderError> {
        let refuse = |finding: String| Err(RenderError::Target { index, finding });
        let [width, height] = self.view.size();
        if width == 0 || height == 0 {
            return refuse(format!("its picture is {width} x {height} pixels"));
        }
        let pixels = self.view.pixels();
        if self.colours.len() != pixels {
            return refuse(format!("{} colours for {width} x {height} pixels", self.colours.len()));
        }
        if !self.view.projection().as_flattened().iter().all(|entry| entry.is_finite()) {
            return refuse("its camera holds a number that is not finite".into());
        }
        let numbers = [self.light.0.as_flattened(), &self.background, self.colours.as_flattened()];
        if !numbers.iter().all(|numbers| numbers.iter().all(|number| number.is_finite())) {
            return refuse("its colours, light or background hold a number that is not finite".into());
        }
        match &self.weights {
            Some(weights) if weights.len() != pixels => {
                refuse(format!("{} weights for {width} x {height} pixels", weights.len()))
            }
            Some(weights) if !weights.iter().all(|weight| weight.is_finite() && *weight >= 0.0) => {
                refuse("a weight is negative or not finite".into())
            }
            _ => Ok(()),
        }
    }

    /// The sum of its weights.
    pub(super) fn weight(&self) -> f64 {
        match &self.weights {
            Some(weights) => weights.iter().map(|&weight| f64::from(weight)).sum(),
            None => self.colours.len() as f64,
        }
    }
}
