use super::settings::{InvertLevel, InvertSettings};
use crate::mesh::Icosphere;
use crate::pipeline::setting_name::{FINEST, check_numbers, document, with_parameter};
use crate::pipeline::settings::SettingError;

/// Most pixels along a picture's side, and iterations of a level.
const LIMITS: [(&str, u64); 2] = [("size", 8192), ("iterations", 100_000)];

/// The largest product of fairing and rate: eigenvalues of L^2 are 144 at most where no vertex has more than six neighbours,
/// and beyond 2 / 144 a step makes the steepest bends larger.
pub(super) const MOST_FAIRING: f32 = 2.0 / 144.0;

impl InvertSettings {
    /// Sets the parameter of a dotted name, as [`crate::pipeline::Settings::set`] does.
    ///
    /// # Errors
    /// As there.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), SettingError> {
        *self = with_parameter(self, name, value, Self::check)?;
        Ok(())
    }

    /// Settings from a JSON file's bytes: those that [`InvertSettings`] serialize to, or a report with such `settings`.
    ///
    /// # Errors
    /// [`SettingError::File`] with the field and what is wrong with it.
    pub fn from_json(bytes: &[u8]) -> Result<Self, SettingError> {
        let malformed = |error: serde_json::Error| SettingError::File(error.to_string());
        let mut document: serde_json::Value = serde_json::from_slice(bytes).map_err(malformed)?;
        let inner = document.get_mut("settings").map(serde_json::Value::take);
        let settings: Self = serde_json::from_value(inner.unwrap_or(document)).map_err(malformed)?;
        settings.check()?;
        Ok(settings)
    }

    /// Whether the parameters can be worked with.
    ///
    /// # Errors
    /// [`SettingError`] names the first that cannot.
    pub fn check(&self) -> Result<(), SettingError> {
        // A light's factors alone may be negative.
        check_numbers(&document(&Self { light: Vec::new(), ..self.clone() }), "")?;
        let wrong = |name: &str, value: String, reason: &str| {
            Err(SettingError::Value { name: name.to_owned(), value, reason: reason.to_owned() })
        };
        let finite = self.light.as_flattened().iter().all(|factor| factor.is_finite());
        if !(self.light.is_empty() || self.light.len() == 9) || !finite {
            return wrong(
                "light",
                format!("{:?}", self.light),
                "it must be empty or nine rows of three numbers",
            );
        }
        if self.most_views < 2 {
            return wrong("most_views", self.most_views.to_string(), "an inversion takes two views at least");
        }
        if !(8..=256).contains(&self.hull_cells) {
            return wrong("hull_cells", self.hull_cells.to_string(), "it must be between 8 and 256");
        }
        if self.start_radius <= 0.0 {
            return wrong("start_radius", self.start_radius.to_string(), "it must be positive");
        }
        self.check_levels()
    }

    fn check_levels(&self) -> Result<(), SettingError> {
        let levels: Vec<u32> = self.levels.iter().map(|level| level.level).collect();
        let nested = levels.array_windows().all(|[a, b]| b == a || *b == a + 1);
        if levels.is_empty() || !nested || levels.iter().any(|&level| level > FINEST) {
            let problem =
                format!("are {levels:?}; each must be as fine as the one before or one finer, to {FINEST}");
            return Err(SettingError::Levels { stage: "invert", problem });
        }
        if levels.last().copied() != Icosphere::level_of(self.vertices) {
            let problem = format!("must end at the level of {} vertices", self.vertices);
            return Err(SettingError::Levels { stage: "invert", problem });
        }
        self.levels.iter().enumerate().try_for_each(|(at, level)| level.check(at))
    }
}

impl InvertLevel {
    fn check(&self, at: usize) -> Result<(), SettingError> {
        let wrong = |field: &str, value: String, reason: String| {
            Err(SettingError::Value { name: format!("levels.{at}.{field}"), value, reason })
        };
        let found = [u64::from(self.size), self.iterations as u64];
        for ((field, most), found) in LIMITS.iter().zip(found) {
            if found == 0 || found > *most {
                return wrong(field, found.to_string(), format!("it must be between 1 and {most}"));
            }
        }
        if self.fairing * self.rate * self.rate_end.max(1.0) > MOST_FAIRING {
            let reason = format!("times the level's rate it must be {MOST_FAIRING} at most");
            return wrong("fairing", self.fairing.to_string(), reason);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::settings::{InvertPreset, Smooth, What};
    use super::*;

    fn settings() -> InvertSettings {
        InvertSettings::preset(InvertPreset::Default, 10242).unwrap()
    }

    #[test]
    fn parameters_are_set_by_name() {
        let mut settings = settings();
        settings.set("levels.0.size", "300").unwrap();
        settings.set("what", "world-normal").unwrap();
        settings.set("levels.0.smooth", r#"{"laplacian": {"weight": 2}}"#).unwrap();
        settings
            .set("light", "[[1,1,1],[0,0,0],[0,-1,0],[0,0,0],[0,0,0],[0,0,0],[0,0,0],[0,0,0],[0,0,0]]")
            .unwrap();
        assert_eq!((settings.levels[0].size, settings.what), (300, What::WorldNormal));
        assert_eq!(settings.levels[0].smooth, Smooth::Laplacian { weight: 2.0 });
        let file = serde_json::json!({ "settings": settings }).to_string();
        assert_eq!(InvertSettings::from_json(file.as_bytes()).unwrap(), settings);
    }

    #[test]
    fn what_cannot_be_is_told() {
        let complaint = |name: &str, value: &str| settings().set(name, value).unwrap_err().to_string();
        assert!(complaint("levels.0.siz", "3").contains("iterations"));
        assert!(complaint("levels.0.size", "0").contains("between 1 and 8192"));
        assert!(complaint("levels.0.iterations", "9999999").contains("100000"));
        assert!(complaint("levels.1.fairing", "2").contains("times the level's rate"));
        assert!(complaint("light", "[[1,2,3]]").contains("nine rows"));
        assert!(complaint("most_views", "1").contains("two views"));
        assert!(complaint("levels.1.level", "6").contains("one finer"));
        assert!(complaint("vertices", "642").contains("preset"));
        assert!(complaint("what", "colour").contains("silhouette"));
    }

    #[test]
    fn every_preset_can_be_worked_with() {
        for preset in [InvertPreset::Default, InvertPreset::Paper, InvertPreset::Bunny] {
            for vertices in [642, 2562, 10242, 40962] {
                InvertSettings::preset(preset, vertices).unwrap().check().unwrap();
            }
        }
        assert!(InvertSettings::preset(InvertPreset::Paper, 1000).is_err());
    }
}
