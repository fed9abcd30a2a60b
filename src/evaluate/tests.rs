use glam::DVec3;

use super::curvature::curvature;
use super::statistics::quantile;
use super::*;
use crate::mesh::TriangleMesh;

/// A flat square of `cells` x `cells` quads cut in two, facing +z, `side` wide around (0, 0, `height`).
fn square(cells: u32, side: f64, height: f64) -> TriangleMesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..=cells {
        for j in 0..=cells {
            let at = |k: u32| side * (f64::from(k) / f64::from(cells) - 0.5);
            positions.push(DVec3::new(at(i), at(j), height));
        }
    }
    for i in 0..cells {
        for j in 0..cells {
            let a = i * (cells + 1) + j;
            let (b, c, d) = (a + cells + 1, a + cells + 2, a + 1);
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriangleMesh::new(positions, triangles).unwrap()
}

/// An octahedron of radius `radius`, each face cut into `cells`^2 and pushed out; corners of faces are not shared.
fn ball(cells: u32, radius: f64) -> TriangleMesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for octant in 0..8 {
        let sign = |k: u32| if octant >> k & 1 == 0 { 1.0 } else { -1.0 };
        let mirrored = sign(0) * sign(1) * sign(2) < 0.0;
        let start = positions.len() as u32;
        let at = |i: u32, j: u32| start + i * (2 * cells + 3 - i) / 2 + j;
        for i in 0..=cells {
            for j in 0..=cells - i {
                let k = cells - i - j;
                let p = DVec3::new(f64::from(i) * sign(0), f64::from(j) * sign(1), f64::from(k) * sign(2));
                positions.push(radius * p.normalize());
                let mut add = |[a, b, c]: [u32; 3]| {
                    triangles.push(if mirrored { [a, c, b] } else { [a, b, c] });
                };
                if k > 0 {
                    add([at(i, j), at(i + 1, j), at(i, j + 1)]);
                }
                if k > 1 {
                    add([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
    welded(positions, triangles)
}

/// Merges vertices in the same place.
fn welded(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> TriangleMesh {
    let key = |p: DVec3| (p * 1e9).round().to_array().map(|x| x as i64);
    let mut places = std::collections::HashMap::new();
    let mut kept = Vec::new();
    let merged: Vec<u32> = positions
        .into_iter()
        .map(|p| {
            *places.entry(key(p)).or_insert_with(|| {
                kept.push(p);
                kept.len() as u32 - 1
            })
        })
        .collect();
    let triangles = triangles.into_iter().map(|t| t.map(|v| merged[v as usize])).collect();
    TriangleMesh::new(kept, triangles).unwrap()
}

fn moved(mesh: &TriangleMesh, by: DVec3) -> TriangleMesh {
    mesh.with_positions(mesh.positions().iter().map(|&p| p + by).collect()).unwrap()
}

fn assert_close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-4 * expected.abs() + 1e-12, "{found} is not {expected}");
}

#[test]
fn a_mesh_lies_on_itself() {
    let ball = moved(&ball(20, 80.0), DVec3::new(3.0, -400.0, 90.0));
    let figures = surface_figures(&ball, &ball, false);
    assert!(figures.chamfer < 1e-13 && figures.hausdorff < 1e-6, "{figures:?}");
    assert_eq!((figures.flipped, figures.sliver), (0.0, 0.0));
    assert_eq!((figures.vertices, figures.triangles), (ball.positions().len(), ball.triangles().len()));
}

#[test]
fn a_lifted_plane_lies_at_its_height() {
    let (scan, mesh) = (square(12, 2.0, 0.0), square(7, 2.0, 0.1));
    let radius = 2_f64.sqrt();
    let figures = surface_figures(&scan, &mesh, false);
    assert_close(figures.chamfer, 2.0 * (0.1 / radius).powi(2));
    assert_close(figures.hausdorff, 0.1 / radius);
    assert_close(figures.top20[0], (0.1 / radius).powi(2));
    assert_close(figures.top5[0], (0.1 / radius).powi(2));
    assert_close(figures.normal, 0.0);
    assert_close(surface_figures(&scan, &mesh, true).chamfer, (0.1 / radius).powi(2));
}

#[test]
fn what_lies_beyond_the_rim_does_not_count() {
    let (scan, mesh) = (square(12, 2.0, 0.0), square(9, 6.0, 0.1));
    let figures = surface_figures(&scan, &mesh, false);
    assert_close(figures.chamfer, 2.0 * 0.1_f64.powi(2) / 2.0);
    assert_close(figures.hausdorff, 0.1 / 2_f64.sqrt());
    let below = TriangleMesh::new(
        mesh.positions().to_vec(),
        mesh.triangles().iter().map(|&[a, b, c]| [a, c, b]).collect(),
    );
    // Of 9 x 9 cells, those with their centres over the scan: 3 x 3.
    assert_close(surface_figures(&scan, &below.unwrap(), false).flipped, 9.0 / 81.0);
}

#[test]
fn opposed_triangles_are_flipped() {
    let scan = square(10, 2.0, 0.0);
    let mut triangles = scan.triangles().to_vec();
    triangles[..50].iter_mut().for_each(|t| t.swap(0, 1));
    let mesh = TriangleMesh::new(scan.positions().to_vec(), triangles).unwrap();
    let figures = surface_figures(&scan, &mesh, false);
    assert_eq!(figures.flipped, 0.25);
    assert_close(figures.normal, 1.0);
}

#[test]
fn thin_triangles_are_slivers() {
    let corners =
        [(0.0, 0.0), (1.0, 0.0), (0.5, 0.75_f64.sqrt()), (0.5, -0.04)].map(|(x, y)| DVec3::new(x, y, 0.0));
    let mesh = TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2], [1, 0, 3], [0, 1, 1]]).unwrap();
    assert_close(surface_figures(&mesh, &mesh, false).sliver, 2.0 / 3.0);
}

#[test]
fn errors_at_bends_show_at_the_top() {
    let scan = ball(24, 1.0);
    let dent = |&p: &DVec3| if p.z > 0.9 { p * (1.0 - 6.0 * (p.z - 0.9)) } else { p };
    let dented = scan.with_positions(scan.positions().iter().map(dent).collect()).unwrap();
    let figures = surface_figures(&dented, &scan, false);
    assert!(figures.top20[0] > 2.0 * figures.chamfer, "{figures:?}");
    assert!(figures.top5[0] > figures.top20[0], "{figures:?}");
}

#[test]
fn curvature_of_a_ball_is_twice_its_inverse_radius() {
    for radius in [0.5, 1.0] {
        let ball = ball(40, radius);
        let felt = curvature(ball.positions(), ball.triangles(), 1e-4);
        let (least, most) = (quantile(&felt, 0.02), quantile(&felt, 0.98));
        assert!(least > 1.97 / radius && most < 2.03 / radius, "{least} {most} at {radius}");
    }
}

#[test]
fn curvature_bears_vertices_without_area() {
    let mut positions = square(6, 1.0, 0.0).positions().to_vec();
    positions.extend([DVec3::ONE, DVec3::ONE]);
    let mut triangles = square(6, 1.0, 0.0).triangles().to_vec();
    triangles.push([49, 50, 49]);
    let felt = curvature(&positions, &triangles, 1e-5);
    assert!(felt.iter().all(|h| h.is_finite()));
    assert!(felt[24] < 1e-3 && felt[49] < 1e-6, "{felt:?}");
}

#[test]
fn figures_do_not_depend_on_threads() {
    let (scan, mesh) = (ball(24, 1.0), ball(9, 0.98));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| surface_figures(&scan, &mesh, false))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn figures_come_back_from_json() {
    let figures = surface_figures(&ball(6, 1.0), &ball(5, 1.0), false);
    let text = serde_json::to_string(&figures).unwrap();
    let read: SurfaceFigures = serde_json::from_str(&text).unwrap();
    assert_close(read.top5[1], figures.top5[1]);
    assert_eq!((read.vertices, read.triangles), (figures.vertices, figures.triangles));
}

#[test]
fn quantiles_interpolate() {
    let values = [4.0, 1.0, 3.0, 2.0];
    assert_eq!([0.0, 0.5, 0.9, 1.0].map(|at| quantile(&values, at)), [1.0, 2.5, 3.7, 4.0]);
}

/// Two cases: a ball in centimetres and the same one moved, the second mesh moved off its truth by `shift`.
fn carried(shift: DVec3) -> CorrespondenceFigures {
    let scan = ball(12, 9.0);
    let truth: Vec<DVec3> = scan.positions().iter().copied().chain([DVec3::ZERO]).collect();
    let there = moved(&scan, DVec3::new(50.0, 0.0, 0.0));
    let mesh = moved(&there, shift);
    let truth_there: Vec<DVec3> = truth.iter().map(|&p| p + DVec3::new(50.0, 0.0, 0.0)).collect();
    let cases = [
        CorrespondenceCase { mesh: &scan, scan: &scan, truth: &truth },
        CorrespondenceCase { mesh: &mesh, scan: &there, truth: &truth_there },
    ];
    correspondence_figures(&cases, CorrespondenceOptions::default()).unwrap()
}

#[test]
fn perfect_correspondence_is_exact() {
    let figures = carried(DVec3::ZERO);
    let distances = figures.distances.unwrap();
    // The truth at the centre of the ball is on no scan.
    assert_eq!((figures.points, distances.pairs), (ball(12, 9.0).positions().len(), 2));
    assert!(distances.p95_mm < 1e-4 && distances.face_mm < 1e-4, "{distances:?}");
}

#[test]
fn shifted_correspondence_is_off_by_the_shift() {
    let distances = carried(DVec3::new(0.0, 0.0, 0.05)).distances.unwrap();
    // Carried from the first case, points are 0.5 mm off; from the second, by the part of it along the surface.
    assert!((0.3..0.5).contains(&distances.mean_mm), "{distances:?}");
    assert_close(distances.p95_mm, 0.5);
    assert!((0.05..0.5).contains(&distances.face_mm), "{distances:?}");
}

#[test]
fn different_triangles_stop_correspondence() {
    let (a, b) = (ball(6, 1.0), ball(7, 1.0));
    let truth = [DVec3::Z];
    let cases = [&a, &b].map(|mesh| CorrespondenceCase { mesh, scan: mesh, truth: &truth });
    let figures = correspondence_figures(&cases, CorrespondenceOptions::default()).unwrap();
    assert_eq!(figures, CorrespondenceFigures { identical_triangles: false, points: 1, distances: None });
    assert_eq!(serde_json::to_string(&figures).unwrap(), r#"{"identical_triangles":false,"points":1}"#);
    let refused = |cases: &[CorrespondenceCase]| {
        correspondence_figures(cases, CorrespondenceOptions::default()).unwrap_err()
    };
    assert_eq!(refused(&cases[..1]), CorrespondenceError::TooFewCases(1));
    let short = CorrespondenceCase { truth: &[], ..cases[1] };
    assert_eq!(
        refused(&[cases[0], short]),
        CorrespondenceError::PointCount { case: 1, found: 0, expected: 1 }
    );
    let far = [DVec3::new(0.0, 0.0, 4.0)];
    let far = cases.map(|case| CorrespondenceCase { truth: &far, ..case });
    assert_eq!(refused(&far), CorrespondenceError::NothingSeen { reach_mm: 1.5 });
}

/// A version 1 numpy file with this header text.
fn npy(header: &str, numbers: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(numbers);
    bytes
}

#[test]
fn reads_dense_points() {
    let single: Vec<u8> = [1.5_f32, 2.0, 3.0, -4.0, 5.0, 6.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let double: Vec<u8> = [1.5_f64, 2.0, 3.0, -4.0, 5.0, 6.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let expected = vec![DVec3::new(1.5, 2.0, 3.0), DVec3::new(-4.0, 5.0, 6.0)];
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }   \n";
    assert_eq!(dense_points_from_npy(&npy(header, &single)).unwrap(), expected);
    let wide = header.replace("f4", "f8");
    assert_eq!(dense_points_from_npy(&npy(&wide, &double)).unwrap(), expected);
    assert_eq!(dense_points_from_json(b"[[1.5, 2, 3], [-4, 5, 6]]").unwrap(), expected);
}

#[test]
fn refuses_other_points() {
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";
    let refused = |header: &str, length: usize| {
        dense_points_from_npy(&npy(header, &vec![0; length])).unwrap_err().to_string()
    };
    assert!(refused(header, 20).contains("24 bytes"));
    for (good, bad) in [("<f4", ">f4"), ("False", "True"), ("(2, 3)", "(2, 4)"), ("(2, 3)", "(6,)")] {
        assert!(refused(&header.replace(good, bad), 24).contains("header says"), "{bad}");
    }
    assert!(matches!(dense_points_from_npy(b"ply\n"), Err(DensePointsError::NotNpy)));
    assert!(matches!(dense_points_from_npy(b"\x93NUMPY\x01\x00\xff"), Err(DensePointsError::NotNpy)));
    let not_a_number = npy(&header.replace("2,", "1,"), &[255; 12]);
    assert!(matches!(dense_points_from_npy(&not_a_number), Err(DensePointsError::NotFinite(0))));
    assert!(matches!(dense_points_from_json(b"[[1, 2]]"), Err(DensePointsError::Json(_))));
}
