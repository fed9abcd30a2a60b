use std::path::Path;

use glam::DVec3;

use super::Inversion;
use super::pictures::contact_sheet;
use crate::formats::FormatError;
use crate::mesh::{Topology, sphere_layout};
use crate::picture::Image;
use crate::pipeline::output::{OutputFormat, ResultMesh};

impl Inversion {
    /// The mesh's file, with texture coordinates of the sphere and, where they were estimated, the vertices' colours as
    /// the figures `red`, `green`, `blue`.
    ///
    /// # Errors
    /// [`FormatError`] where the mesh does not fit the format.
    pub fn bytes(&self, name: &str, format: OutputFormat) -> Result<Vec<u8>, FormatError> {
        let layout = sphere_layout(&Topology::of(&self.mesh), &self.sphere, DVec3::Z, DVec3::Y);
        let channel = |c: usize| -> Vec<f64> {
            self.albedo.iter().flatten().map(|colour| f64::from(colour[c])).collect()
        };
        let channels = [0, 1, 2].map(channel);
        let named = ["red", "green", "blue"].into_iter().zip(channels.iter().map(Vec::as_slice));
        let result = ResultMesh {
            name,
            mesh: &self.mesh,
            texture_coordinates: Some(&layout),
            figures: if self.albedo.is_some() { named.collect() } else { Vec::new() },
            extras: serde_json::Value::Null,
        };
        result.bytes(format, None)
    }

    /// The report as JSON.
    pub fn report_json(&self) -> String {
        let report = serde_json::to_value(&self.report).expect("a report is plain numbers and names");
        format!("{report:#}\n")
    }

    /// Some views as given, as the result looks, and their difference.
    pub fn sheet(&self) -> Image {
        let report = &self.report;
        let overlap = 100.0 * report.overlap;
        contact_sheet(&format!("overlap {overlap:.2} %, mean difference {:.4}", report.mae), &self.pictures)
    }

    /// A picture of each view's difference, with the name of its file.
    pub fn residuals(&self) -> impl Iterator<Item = (String, &Image)> {
        self.pictures.iter().enumerate().map(|(at, view)| {
            // A view's name may have folders in it.
            let stem = Path::new(&view.name).file_stem().map_or("".into(), |stem| stem.to_string_lossy());
            (format!("{at:03}-{stem}.png"), &view.difference)
        })
    }
}
