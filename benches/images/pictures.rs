//! Makes the README's picture of what else goes in: an open noisy scan, a masked one, and a template of one's own.
//!
//! ```sh
//! cargo run --release --example pictures
//! ```

use std::path::Path;

use glam::DVec3;
use onemesh::demo::Sculptor;
use onemesh::formats::{MeshFile, MeshFormat, obj_bytes};
use onemesh::mesh::TriangleMesh;
use onemesh::numeric::Random;
use onemesh::picture::{Colour, Frame, Image, Sheet, Style, View, render};
use onemesh::pipeline::{Preset, Settings, Subject, Template, register, register_to};

const PICTURE: &str = "benches/images/inputs.png";

type Made<T> = Result<T, Box<dyn std::error::Error>>;

/// Pixels of a tile's sides.
const SIDE: usize = 300;

fn main() -> Made<()> {
    let heads = Sculptor::new(11).collection(3, &[1.0]);
    let whole: Vec<Subject> = heads
        .iter()
        .map(|head| Subject {
            name: head.name.clone(),
            mesh: head.mesh.clone(),
            landmarks: head.landmarks.clone(),
            mask: None,
        })
        .collect();
    let settings = Settings::preset(Preset::Default, 10242)?;
    let mut sheet = Sheet::new("scan and result");

    let mut subjects = whole.clone();
    subjects[0].mesh = noisy(&face(&whole[0])?)?;
    let open = register(&subjects, &settings, &())?;
    let result = TriangleMesh::new(open.members[0].clone(), open.template.triangles.clone())?;
    sheet.row(row("open and noisy", &subjects[0], &result));

    let mut subjects = whole.clone();
    (subjects[0].mesh, subjects[0].mask) = haired(&whole[0])?;
    let masked = register(&subjects, &settings, &())?;
    let result = TriangleMesh::new(masked.members[0].clone(), masked.template.triangles.clone())?;
    sheet.row(row("red is masked", &subjects[0], &result));

    let file = MeshFile::parse(&obj_bytes(&face(&whole[1])?), MeshFormat::Obj)?;
    let template = Template::of_file(&file, &whole[1].landmarks);
    let own = register_to(&template, &whole[..1], &settings, &())?;
    let result = TriangleMesh::new(own.members[0].clone(), own.template.triangles.clone())?;
    sheet.row(row("own template, open", &whole[0], &result));

    sheet.image().write_png(Path::new(PICTURE))?;
    println!("{PICTURE}");
    Ok(())
}

/// The scan and its result, from the front and from the side.
fn row(title: &str, subject: &Subject, result: &TriangleMesh) -> Vec<(String, Image)> {
    let frame = Frame::around(&subject.mesh);
    let colour = |weight: &f32| if *weight > 0.0 { Colour::srgb(0xd8d8d8) } else { Colour::srgb(0xd05040) };
    let scan = Style {
        vertex_colours: subject.mask.as_ref().map(|mask| mask.iter().map(colour).collect()),
        ..Style::smooth()
    };
    let views = [View::front(), View::new(60.0)].map(|view| view.sized(SIDE, SIDE).framed(frame));
    let pictures = |caption: &str, mesh: &TriangleMesh, style: &Style| {
        views.clone().map(|view| (caption.to_owned(), render(mesh, &view, style)))
    };
    let scans = pictures(title, &subject.mesh, &scan);
    scans.into_iter().chain(pictures("result", result, &Style::wireframe())).collect()
}

/// The triangles of a head around its face, with the vertices that these name: what is farther behind the tip of the
/// nose than its breadth at the jaw goes.
fn face(head: &Subject) -> Made<TriangleMesh> {
    let at = |name: &str| head.landmarks.get(name).ok_or("a demo head has all 68 landmarks");
    let (tip, breadth) = (at("30")?, at("0")?.distance(at("16")?));
    let forward = (tip - (at("0")? + at("16")?) / 2.0).normalize();
    let near = |p: DVec3| (tip - p).dot(forward) < 0.75 * breadth && tip.distance(p) < 1.1 * breadth;
    let places = head.mesh.positions();
    let mut number = vec![None; places.len()];
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for corners in head.mesh.triangles() {
        if corners.iter().all(|&i| near(places[i as usize])) {
            triangles.push(corners.map(|i| {
                *number[i as usize].get_or_insert_with(|| {
                    positions.push(places[i as usize]);
                    positions.len() as u32 - 1
                })
            }));
        }
    }
    Ok(TriangleMesh::new(positions, triangles)?)
}

/// A scan as a scanner sees it: each vertex off by about a three hundredth of its radius.
fn noisy(scan: &TriangleMesh) -> Made<TriangleMesh> {
    let mut random = Random::new(5);
    let size = 0.003 * scan.radius_about(scan.centroid());
    let positions = scan.positions().iter();
    let moved = positions.map(|p| *p + DVec3::from_array([(); 3].map(|()| size * random.signed())));
    Ok(scan.with_positions(moved.collect())?)
}

/// A head with a tuft of hair, and the mask without it.
fn haired(head: &Subject) -> Made<(TriangleMesh, Option<Vec<f32>>)> {
    let at = |name: &str| head.landmarks.get(name).ok_or("a demo head has all 68 landmarks");
    let (centre, radius) = (head.mesh.centroid(), head.mesh.radius_about(head.mesh.centroid()));
    let brows = (at("19")? + at("24")?) / 2.0;
    let up = (brows - at("8")?).normalize();
    let hair = |p: &DVec3| ((*p - brows).dot(up) / radius - 0.2).clamp(0.0, 0.3);
    let tuft = |p: &DVec3| {
        let waves = 1.0 + 0.5 * (9.0 * p.x / radius).sin() * (14.0 * p.z / radius).cos();
        *p + (*p - centre).normalize() * (0.8 * radius * hair(p) * waves)
    };
    let positions = head.mesh.positions();
    let mask = positions.iter().map(|p| if hair(p) > 0.0 { 0.0 } else { 1.0 }).collect();
    Ok((head.mesh.with_positions(positions.iter().map(tuft).collect())?, Some(mask)))
}
