use std::collections::HashMap;

use glam::{DMat4, DVec2};
use roxmltree::{Document, Node};

use super::Frame;
use super::lens::{brown, checked, size};
use crate::camera::{Camera, Distortion, Intrinsics, Pose};
use crate::formats::error::Fault;
use crate::formats::text::{finite, shown, without_mark};

type Lenses<'a> = HashMap<&'a str, (Intrinsics, Distortion)>;

/// The aligned cameras of Metashape's exported XML, in the coordinates of its chunk, and a word on those left out.
pub(super) fn read(bytes: &[u8]) -> Result<(Vec<Frame>, Vec<String>), Fault> {
    let wrong = |problem: String| Fault::at("its XML", problem);
    let text =
        std::str::from_utf8(without_mark(bytes)).map_err(|error| wrong(format!("is not UTF-8: {error}")))?;
    let document = Document::parse(text).map_err(|error| wrong(error.to_string()))?;
    let chunk = document.descendants().find(|node| node.has_tag_name("chunk"));
    let chunk =
        chunk.ok_or_else(|| wrong("holds no chunk: export the cameras from Metashape as XML".to_owned()))?;
    let lenses = lenses(chunk)?;
    let components = components(chunk)?;
    let mut frames = Vec::new();
    let mut warnings = Vec::new();
    for camera in chunk.descendants().filter(|node| node.has_tag_name("camera")) {
        let label = camera.attribute("label").unwrap_or_default();
        let Some(transform) = child(camera, "transform") else {
            warnings.push(format!("camera `{label}` is not aligned and is left out"));
            continue;
        };
        if camera.attribute("enabled").is_some_and(|enabled| matches!(enabled, "false" | "0")) {
            warnings.push(format!("camera `{label}` is disabled and is left out"));
            continue;
        }
        let place = format!("camera `{label}`");
        let to_chunk = component_of(camera, &components) * matrix(transform, &place)?;
        let pose = Pose::of_camera_to_world(to_chunk)
            .map_err(|error| Fault::at(format_args!("{place}, its transform"), error.to_string()))?;
        let sensor = camera.attribute("sensor_id").unwrap_or_default();
        let Some(&(intrinsics, distortion)) = lenses.get(sensor) else {
            return Err(Fault::at(
                place,
                format!("was taken by sensor `{sensor}`, which has no calibration"),
            ));
        };
        let camera = Camera { pose, distortion, intrinsics };
        frames.push(Frame { name: label.to_owned(), mask: None, camera });
    }
    Ok((frames, warnings))
}

fn child<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|child| child.has_tag_name(name))
}

/// The lens of each sensor that has been calibrated, by its number.
fn lenses<'a>(chunk: Node<'a, '_>) -> Result<Lenses<'a>, Fault> {
    let mut lenses = Lenses::new();
    for sensor in chunk.descendants().filter(|node| node.has_tag_name("sensor")) {
        let Some(id) = sensor.attribute("id") else { continue };
        let calibrations = || sensor.children().filter(|node| node.has_tag_name("calibration"));
        let adjusted = calibrations().find(|node| node.attribute("class") != Some("initial"));
        if let Some(calibration) = adjusted.or_else(|| calibrations().next()) {
            lenses.insert(id, lens(sensor, calibration, &format!("sensor `{id}`"))?);
        }
    }
    Ok(lenses)
}

/// Metashape counts the principal point from the picture's centre, and its p_1 and p_2 are OpenCV's p_2 and p_1.
fn lens(sensor: Node, calibration: Node, place: &str) -> Result<(Intrinsics, Distortion), Fault> {
    let resolution = child(calibration, "resolution").or_else(|| child(sensor, "resolution"));
    let side = |name: &str| {
        let value = resolution.and_then(|node| node.attribute(name)?.parse::<u64>().ok());
        value.ok_or_else(|| Fault::at(place, format!("has no resolution with a {name}")))
    };
    let size = size(side("width")?, side("height")?, place)?;
    let [f, cx, cy, b1, b2, k1, k2, k3, k4, p1, p2] =
        ["f", "cx", "cy", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2"]
            .map(|name| number(calibration, name, place));
    let [width, height] = size.map(f64::from);
    let intrinsics = Intrinsics {
        size,
        focal: DVec2::new(f? + b1?, number(calibration, "f", place)?),
        centre: DVec2::new(0.5 * width + cx?, 0.5 * height + cy?),
        skew: b2?,
    };
    let distortion = match calibration.attribute("type") {
        None | Some("frame") => brown([k1?, k2?, k3?, k4?], [0.0; 3], [p2?, p1?]),
        Some("fisheye" | "equidistant_fisheye") => Distortion::Fisheye { radial: [k1?, k2?, k3?, k4?] },
        Some(other) => {
            let problem = format!("is of the type `{other}`: only frame and fisheye cameras are read");
            return Err(Fault::at(place, problem));
        }
    };
    checked(intrinsics, distortion, place)
}

/// A number of a calibration; one that is not there is zero.
fn number(calibration: Node, name: &str, place: &str) -> Result<f64, Fault> {
    let Some(text) = child(calibration, name).and_then(|node| node.text()) else { return Ok(0.0) };
    finite(text.trim().as_bytes()).ok_or_else(|| {
        Fault::at(place, format!("has the {name} `{}`: it must be a finite number", shown(text.as_bytes())))
    })
}

/// Where each component of the chunk lies in it.
fn components<'a>(chunk: Node<'a, '_>) -> Result<HashMap<&'a str, DMat4>, Fault> {
    let mut components = HashMap::new();
    for component in chunk.descendants().filter(|node| node.has_tag_name("component")) {
        let (Some(id), Some(transform)) = (component.attribute("id"), child(component, "transform")) else {
            continue;
        };
        components.insert(id, similarity(transform, &format!("component `{id}`"))?);
    }
    Ok(components)
}

fn component_of(camera: Node, components: &HashMap<&str, DMat4>) -> DMat4 {
    let id = camera.attribute("component_id");
    id.and_then(|id| components.get(id)).copied().unwrap_or(DMat4::IDENTITY)
}

/// A transform of rotation, translation and scale; without them it is the identity.
fn similarity(transform: Node, place: &str) -> Result<DMat4, Fault> {
    let part = |name: &str, count: usize| {
        let Some(node) = child(transform, name) else { return Ok(None) };
        numbers(node, count, &format!("{place}, its {name}")).map(Some)
    };
    let scale = part("scale", 1)?.map_or(1.0, |scale| scale[0]);
    let mut matrix = DMat4::from_scale(glam::DVec3::splat(scale));
    if let Some(rows) = part("rotation", 9)? {
        let rotation = glam::DMat3::from_cols_slice(&rows).transpose();
        matrix = DMat4::from_mat3(rotation * scale);
    }
    if let Some(at) = part("translation", 3)? {
        matrix.w_axis = glam::DVec3::from_slice(&at).extend(1.0);
    }
    Ok(matrix)
}

fn matrix(transform: Node, place: &str) -> Result<DMat4, Fault> {
    let rows = numbers(transform, 16, &format!("{place}, its transform"))?;
    Ok(DMat4::from_cols_slice(&rows).transpose())
}

fn numbers(node: Node, count: usize, place: &str) -> Result<Vec<f64>, Fault> {
    let words = node.text().unwrap_or_default().split_ascii_whitespace();
    let numbers: Vec<f64> = words.map_while(|word| finite(word.as_bytes())).take(count + 1).collect();
    if numbers.len() == count {
        return Ok(numbers);
    }
    Err(Fault::at(place, format!("must be {count} finite numbers")))
}
