use std::collections::BTreeMap;

use serde::Serialize;

use super::cameras::Agreement;
use super::settings::InvertSettings;
use super::shown::Shown;
use super::unit_space::UnitSpace;
use super::views::Views;
use crate::render::{Adapter, Rendering, Target};

/// How much lower than the median a view's overlap is where it disagrees with the rest: by this, and by several times the
/// median deviation.
const DISAGREES: f64 = 0.02;
const DEVIATIONS: f64 = 6.0;

/// What an inversion leaves behind beside its mesh.
#[derive(Debug, Clone, Serialize)]
pub struct InversionReport {
    /// The program's version.
    pub version: &'static str,
    /// Every parameter.
    pub settings: InvertSettings,
    /// What drew.
    pub adapter: AdapterEntry,
    /// What the pictures show.
    pub shown: Shown,
    /// Mean absolute error of a pixel's channel over all views, from 0 to 1, at the last level's size.
    pub mae: f64,
    /// Mean overlap of rendered and given silhouettes: what both hold over what either does.
    pub overlap: f64,
    /// Each view's own figures.
    pub views: Vec<ViewReport>,
    /// Where the object is, by the silhouettes.
    pub hull: HullReport,
    /// The estimated light `[9, 3]`, of shaded pictures.
    pub light: Option<[[f32; 3]; 9]>,
    /// What whoever took the pictures should know.
    pub warnings: Vec<String>,
    /// How long each part took.
    pub seconds: BTreeMap<&'static str, f64>,
}

/// The device that drew.
#[derive(Debug, Clone, Serialize)]
pub struct AdapterEntry {
    /// As its driver calls it.
    pub name: String,
    /// Discrete, integrated, virtual, software or reference.
    pub kind: String,
    /// The driver with its version.
    pub driver: String,
}

impl From<&Adapter> for AdapterEntry {
    fn from(adapter: &Adapter) -> Self {
        Self { name: adapter.name.clone(), kind: adapter.kind.to_string(), driver: adapter.driver.clone() }
    }
}

/// How well the result looks like one picture.
#[derive(Debug, Clone, Serialize)]
pub struct ViewReport {
    /// The picture.
    pub name: String,
    /// Width and height at which it was compared.
    pub size: [usize; 2],
    /// Mean absolute error of a pixel's channel, from 0 to 1.
    pub mae: f64,
    /// Overlap of the silhouettes.
    pub overlap: f64,
    /// Whether it took part; a view that the silhouettes of the others contradict does not.
    pub used: bool,
    /// Whether it disagrees with the rest.
    pub disagrees: bool,
}

/// The visual hull of the silhouettes, in the world.
#[derive(Debug, Clone, Serialize)]
pub struct HullReport {
    /// Share of the silhouettes' area that the volume common to all covers; cameras that are right have nearly 1.
    pub agreement: f64,
    /// Its middle.
    pub centre: [f64; 3],
    /// The distance of its farthest point from there.
    pub radius: f64,
    /// The side of a cell.
    pub cell: f64,
}

impl HullReport {
    pub(super) fn of(agreement: &Agreement, space: &UnitSpace) -> Self {
        Self {
            agreement: agreement.hull.agreement(),
            centre: space.centre.to_array(),
            radius: space.radius,
            cell: 2.0 * agreement.hull.half,
        }
    }
}

impl ViewReport {
    pub(super) fn of(
        name: &str,
        used: bool,
        target: &Target,
        object: &[bool],
        rendering: &Rendering,
    ) -> Self {
        let weight = |at: usize| target.weights.as_ref().map_or(1.0, |weights| f64::from(weights[at]));
        let (mut error, mut total, mut both, mut either) = (0.0, 0.0, 0.0, 0.0);
        for (at, (&drawn, &given)) in rendering.covered.iter().zip(object).enumerate() {
            let off = rendering.colours[at].iter().zip(&target.colours[at]);
            error += weight(at) * off.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / 3.0;
            total += weight(at);
            both += weight(at) * f64::from(u8::from(drawn && given));
            either += weight(at) * f64::from(u8::from(drawn || given));
        }
        Self {
            name: name.to_owned(),
            size: rendering.size,
            mae: error / f64::max(total, 1.0),
            overlap: both / f64::max(either, 1.0),
            used,
            disagrees: false,
        }
    }
}

/// Marks the views that disagree with the rest and says which; returns the warnings.
pub(super) fn disagreements(reports: &mut [ViewReport]) -> Vec<String> {
    let overlaps: Vec<f64> = reports.iter().filter(|view| view.used).map(|view| view.overlap).collect();
    let middle = median(overlaps.clone());
    let deviation = median(overlaps.iter().map(|overlap| (overlap - middle).abs()).collect());
    let least = middle - DISAGREES.max(DEVIATIONS * deviation);
    let mut warnings = Vec::new();
    for view in reports.iter_mut() {
        view.disagrees = !view.used || view.overlap < least;
        if view.disagrees {
            warnings.push(format!(
                "view `{}` disagrees with the rest: its silhouette overlaps by {:.1} %, the others' by {:.1} %{}; check \
                 its camera and mask, or leave it out",
                view.name,
                100.0 * view.overlap,
                100.0 * middle,
                if view.used { "" } else { ", and it was not used" }
            ));
        }
    }
    warnings
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// What the cameras alone give reason to warn of.
pub(super) fn camera_warnings(agreement: &Agreement, views: &Views) -> Vec<String> {
    let mut warnings = views.warnings.clone();
    let covered = agreement.hull.agreement();
    match &agreement.suspicion {
        Some(suspicion) => warnings.push(format!(
            "cameras and silhouettes agree on {:.0} % of the silhouettes' area only: {suspicion}",
            100.0 * covered
        )),
        None if covered < 0.95 => warnings.push(format!(
            "cameras and silhouettes agree on {:.0} % of the silhouettes' area only: poses, focal lengths or masks are not \
             exact",
            100.0 * covered
        )),
        None => {}
    }
    warnings
}
