//! Good scans spoiled in the ways that inputs are spoiled.

use std::collections::HashMap;

use glam::{DMat3, DVec3};
use onemesh::formats::Scheme;
use onemesh::mesh::{Icosphere, LandmarkSet, TriangleMesh};
use onemesh::numeric::Random;
use onemesh::pipeline::Subject;

/// A way to spoil a scan; scans are in centimetres, +Y is up and faces look along +Z.
pub struct Fault {
    /// What was done.
    pub name: &'static str,
    /// The codes of which one at least must be among the reasons.
    pub reasons: &'static [&'static str],
    /// Scan number `at` of a collection, spoiled.
    pub spoil: fn(&[Subject], usize) -> Subject,
}

/// Landmarks away from the surface; how many decides which it is.
const PLACES: &[&str] = &["landmarks_elsewhere", "landmarks_off_surface"];

pub const FAULTS: &[Fault] = &[
    Fault {
        name: "landmarks in millimetres",
        reasons: PLACES,
        spoil: |all, at| with_landmarks(&all[at], |p| 10.0 * p),
    },
    Fault {
        name: "scan in millimetres",
        reasons: PLACES,
        spoil: |all, at| with_surface(&all[at], |p| 10.0 * p),
    },
    Fault {
        name: "landmarks mirrored",
        reasons: &["landmarks_mirrored", "left_right_swapped"],
        spoil: |all, at| with_landmarks(&all[at], mirrored),
    },
    Fault {
        name: "scan mirrored",
        reasons: &["inside_out"],
        spoil: |all, at| with_surface(&all[at], mirrored),
    },
    Fault {
        name: "scan and landmarks mirrored",
        reasons: &["left_right_swapped"],
        spoil: |all, at| turned_round(&with_landmarks(&with_surface(&all[at], mirrored), mirrored)),
    },
    Fault { name: "left and right swapped", reasons: &["left_right_swapped"], spoil: swapped_sides },
    Fault {
        name: "another person's landmarks",
        reasons: PLACES,
        spoil: |all, at| Subject {
            landmarks: all[(at + 4) % all.len()].landmarks.clone(),
            ..all[at].clone()
        },
    },
    Fault {
        name: "landmarks shuffled",
        reasons: &["landmarks_disordered"],
        spoil: |all, at| {
            let mut random = Random::new(23);
            permuted(&all[at], |points| (0..68).for_each(|i| points.swap(i, random.below(68))))
        },
    },
    Fault {
        name: "one landmark far off",
        reasons: &["landmark_misplaced", "landmarks_off_surface"],
        spoil: |all, at| permuted(&all[at], |points| points[48] = points[48].map(|p| p + 4.0 * DVec3::Z)),
    },
    Fault {
        name: "one landmark on another place",
        reasons: &["landmark_misplaced"],
        spoil: |all, at| permuted(&all[at], |points| points[36] = points[2]),
    },
    Fault {
        name: "two landmarks exchanged",
        reasons: &["landmarks_swapped"],
        spoil: |all, at| permuted(&all[at], |points| points.swap(8, 27)),
    },
    Fault {
        name: "landmarks upside down",
        reasons: PLACES,
        spoil: |all, at| with_landmarks(&all[at], |p| DVec3::new(-p.x, -p.y, p.z)),
    },
    Fault {
        name: "landmarks 30 mm away",
        reasons: PLACES,
        spoil: |all, at| with_landmarks(&all[at], |p| p + 3.0 * DVec3::Y),
    },
    Fault {
        name: "landmarks turned by 20 degrees",
        reasons: PLACES,
        spoil: |all, at| with_landmarks(&all[at], |p| DMat3::from_rotation_y(0.35) * p),
    },
    Fault {
        name: "landmarks 15 % too large",
        reasons: PLACES,
        spoil: |all, at| with_landmarks(&all[at], |p| 1.15 * p),
    },
    Fault { name: "half a face", reasons: PLACES, spoil: |all, at| kept(&all[at], |p, _| p.x > 0.0) },
    Fault {
        name: "lower half missing",
        reasons: PLACES,
        spoil: |all, at| kept(&all[at], |p, subject| p.y > landmark(subject, "30").y),
    },
    Fault {
        name: "back of the head alone",
        reasons: PLACES,
        spoil: |all, at| kept(&all[at], |p, subject| p.z < landmark(subject, "30").z - 12.0),
    },
    Fault {
        name: "hole over the nose",
        reasons: PLACES,
        spoil: |all, at| kept(&all[at], |p, subject| p.distance(landmark(subject, "30")) > 3.5),
    },
    Fault {
        name: "two heads",
        reasons: &["fragmented_scan", "scan_missed"],
        spoil: |all, at| {
            let other = all[(at + 1) % all.len()].mesh.clone();
            joined(&all[at], &moved(&other, |p| p + 30.0 * DVec3::X))
        },
    },
    Fault {
        name: "a ball on the cheek",
        reasons: &["fragmented_scan"],
        spoil: |all, at| {
            let cheek = landmark(&all[at], "2").midpoint(landmark(&all[at], "31"));
            joined(&all[at], &moved(&ball(), |p| 3.5 * p + cheek))
        },
    },
    Fault {
        name: "a sphere for a head",
        reasons: PLACES,
        spoil: |all, at| {
            let centre = all[at].mesh.centroid();
            Subject { mesh: moved(&ball(), |p| 10.0 * p + centre), ..all[at].clone() }
        },
    },
    Fault { name: "inside out", reasons: &["inside_out"], spoil: |all, at| turned_round(&all[at]) },
    Fault { name: "500 triangles", reasons: &["coarse_scan"], spoil: |all, at| clustered(&all[at], 500) },
    Fault {
        name: "noise of 2 mm",
        reasons: &["noisy_scan"],
        spoil: |all, at| {
            let mut random = Random::new(5);
            displaced(&all[at], |_| {
                DVec3::from_array([0; 3].map(|_| (0..12).map(|_| random.unit()).sum::<f64>() - 6.0)) * 0.2
            })
        },
    },
    Fault {
        name: "spikes on 1 % of the vertices",
        reasons: &["spiky_scan"],
        spoil: |all, at| {
            let mut random = Random::new(6);
            displaced(&all[at], |i| {
                let offset = DVec3::from_array([0; 3].map(|_| random.signed()));
                if i.is_multiple_of(100) { 3.0 * offset.normalize() } else { DVec3::ZERO }
            })
        },
    },
    Fault { name: "triangles torn apart", reasons: &["ragged_scan"], spoil: |all, at| torn(&all[at]) },
    Fault {
        name: "every triangle twice, both ways",
        reasons: &["damaged_scan"],
        spoil: |all, at| joined_at_vertices(&all[at]),
    },
    Fault {
        name: "half of the triangles missing",
        reasons: &["ragged_scan"],
        spoil: |all, at| moth_eaten(&all[at]),
    },
    Fault {
        name: "scan flattened",
        reasons: PLACES,
        spoil: |all, at| with_surface(&all[at], |p| DVec3::new(p.x, p.y, 0.5 * p.z)),
    },
];

fn mirrored(p: DVec3) -> DVec3 {
    DVec3::new(-p.x, p.y, p.z)
}

fn landmark(subject: &Subject, name: &str) -> DVec3 {
    subject.landmarks.get(name).unwrap()
}

fn moved(mesh: &TriangleMesh, to: impl Fn(DVec3) -> DVec3) -> TriangleMesh {
    mesh.with_positions(mesh.positions().iter().map(|&p| to(p)).collect()).unwrap()
}

fn with_surface(subject: &Subject, to: impl Fn(DVec3) -> DVec3) -> Subject {
    Subject { mesh: moved(&subject.mesh, to), ..subject.clone() }
}

fn with_landmarks(subject: &Subject, to: impl Fn(DVec3) -> DVec3) -> Subject {
    permuted(subject, |points| points.iter_mut().flatten().for_each(|p| *p = to(*p)))
}

fn permuted(subject: &Subject, change: impl FnOnce(&mut Vec<Option<DVec3>>)) -> Subject {
    let mut spoiled = subject.clone();
    change(&mut spoiled.landmarks.points);
    spoiled
}

fn with_triangles(subject: &Subject, positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Subject {
    Subject { mesh: TriangleMesh::new(positions, triangles).unwrap(), ..subject.clone() }
}

fn turned_round(subject: &Subject) -> Subject {
    let triangles = subject.mesh.triangles().iter().map(|&[a, b, c]| [a, c, b]).collect();
    with_triangles(subject, subject.mesh.positions().to_vec(), triangles)
}

fn swapped_sides(all: &[Subject], at: usize) -> Subject {
    let scheme = Scheme::named("multipie68").unwrap();
    let own = &all[at].landmarks;
    let partner = |name: &String| own.get(&scheme.mirrored(name).unwrap());
    let points = own.names.iter().map(partner).collect();
    Subject { landmarks: LandmarkSet { points, ..own.clone() }, ..all[at].clone() }
}

/// The triangles whose first corner is kept.
fn kept(subject: &Subject, keep: impl Fn(DVec3, &Subject) -> bool) -> Subject {
    let positions = subject.mesh.positions();
    let stays = |corners: &&[u32; 3]| keep(positions[corners[0] as usize], subject);
    let triangles: Vec<_> = subject.mesh.triangles().iter().filter(stays).copied().collect();
    packed(subject, positions, &triangles)
}

/// Without the vertices that no triangle names.
fn packed(subject: &Subject, positions: &[DVec3], triangles: &[[u32; 3]]) -> Subject {
    let (mut places, mut packed) = (HashMap::new(), Vec::new());
    let mut place = |i: u32| {
        *places.entry(i).or_insert_with(|| {
            packed.push(positions[i as usize]);
            packed.len() as u32 - 1
        })
    };
    let triangles = triangles.iter().map(|corners| corners.map(&mut place)).collect();
    with_triangles(subject, packed, triangles)
}

fn ball() -> TriangleMesh {
    let Icosphere { positions, triangles } = Icosphere::new(5);
    TriangleMesh::new(positions, triangles).unwrap()
}

fn joined(subject: &Subject, other: &TriangleMesh) -> Subject {
    let first = subject.mesh.positions().len() as u32;
    let positions = [subject.mesh.positions(), other.positions()].concat();
    let others = other.triangles().iter().map(|corners| corners.map(|i| i + first));
    with_triangles(subject, positions, subject.mesh.triangles().iter().copied().chain(others).collect())
}

fn joined_at_vertices(subject: &Subject) -> Subject {
    let round = turned_round(subject);
    let triangles = [subject.mesh.triangles(), round.mesh.triangles()].concat();
    with_triangles(subject, subject.mesh.positions().to_vec(), triangles)
}

fn displaced(subject: &Subject, mut offset: impl FnMut(usize) -> DVec3) -> Subject {
    let moved = subject.mesh.positions().iter().enumerate().map(|(i, &p)| p + offset(i)).collect();
    with_triangles(subject, moved, subject.mesh.triangles().to_vec())
}

/// Every triangle by itself and a little away.
fn torn(subject: &Subject) -> Subject {
    let mut random = Random::new(8);
    let mut positions = Vec::new();
    for corners in subject.mesh.triangles() {
        let offset = 0.1 * DVec3::from_array([0; 3].map(|_| random.signed()));
        positions.extend(corners.map(|i| subject.mesh.positions()[i as usize] + offset));
    }
    let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    with_triangles(subject, positions, triangles)
}

fn moth_eaten(subject: &Subject) -> Subject {
    let mut random = Random::new(9);
    let some: Vec<_> = subject.mesh.triangles().iter().filter(|_| random.unit() < 0.5).copied().collect();
    packed(subject, subject.mesh.positions(), &some)
}

/// Vertices merged cell by cell of a grid, as coarse as is needed for at most so many triangles.
fn clustered(subject: &Subject, most: usize) -> Subject {
    let mut cell = 0.5;
    loop {
        let mut cells: HashMap<[i64; 3], u32> = HashMap::new();
        let mut sums: Vec<(DVec3, f64)> = Vec::new();
        let mut cluster = Vec::new();
        for &p in subject.mesh.positions() {
            let key = (p / cell).floor().to_array().map(|x| x as i64);
            let at = *cells.entry(key).or_insert_with(|| {
                sums.push((DVec3::ZERO, 0.0));
                sums.len() as u32 - 1
            });
            let (sum, count) = &mut sums[at as usize];
            (*sum, *count) = (*sum + p, *count + 1.0);
            cluster.push(at);
        }
        let corners = subject.mesh.triangles().iter().map(|corners| corners.map(|i| cluster[i as usize]));
        let triangles: Vec<_> = corners.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        if triangles.len() <= most {
            let positions = sums.iter().map(|(sum, count)| *sum / *count).collect();
            return with_triangles(subject, positions, triangles);
        }
        cell *= 1.1;
    }
}
