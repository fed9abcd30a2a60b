//! Sculpted heads, whole and with faults planted.

use std::collections::BTreeSet;
use std::path::Path;

use glam::DVec3;

use super::*;
use crate::demo::{SculptedHead, Sculptor, Settings};
use crate::formats::Scheme;
use crate::mesh::{LandmarkSet, TriangleMesh};
use crate::numeric::Random;

fn heads(count: usize) -> Vec<SculptedHead> {
    let settings = Settings { triangles: 6000, ..Settings::default() };
    Sculptor::new(5).with(settings).collection(count, &[1.0, 1.8])
}

fn codes(findings: &[Finding]) -> Vec<Code> {
    findings.iter().map(|finding| finding.code).collect()
}

fn inspected(mesh: &TriangleMesh, landmarks: &LandmarkSet) -> Vec<Code> {
    codes(&Inspection::new(mesh, Some(landmarks)).findings)
}

fn audited(heads: &[SculptedHead], surfaces: bool) -> LandmarkAudit {
    let distances: Vec<_> =
        heads.iter().map(|head| landmark_distances(&head.mesh, &head.landmarks)).collect();
    let cases = heads.iter().zip(&distances).map(|(head, distances)| AuditCase {
        name: &head.name,
        landmarks: &head.landmarks,
        distances: surfaces.then_some(distances),
    });
    audit(&cases.collect::<Vec<_>>())
}

/// Exchanges the names of left and right.
fn sides_exchanged(set: &LandmarkSet) -> LandmarkSet {
    let scheme = Scheme::named("multipie68").unwrap();
    let points = set.names.iter().map(|name| set.get(&scheme.mirrored(name).unwrap())).collect();
    LandmarkSet { points, ..set.clone() }
}

#[test]
fn a_sculpted_head_is_understood() {
    for head in heads(4) {
        let inspection = Inspection::new(&head.mesh, Some(&head.landmarks));
        assert_eq!(codes(&inspection.findings), [Code::OpenBoundary], "{:?}", inspection.findings);
        assert_eq!(inspection.axes.basis, Basis::Landmarks);
        assert_eq!((inspection.unit.unit, inspection.unit.clear), (Unit::Centimetre, true));
        assert_eq!((inspection.component_count, inspection.boundary_loop_count), (1, 1));
        assert_eq!(inspection.outward, Some(true));
        let angle =
            |a: [f64; 3], b: DVec3| DVec3::from_array(a).angle_between(head.pose.turn * b).to_degrees();
        let angles = [angle(inspection.axes.up, DVec3::Y), angle(inspection.axes.facing, DVec3::Z)];
        assert!(angles.iter().all(|&angle| angle < 6.0), "{angles:?}");
        let guessed = Inspection::new(&head.mesh, None);
        assert_eq!(codes(&guessed.findings), [Code::AxesGuessed, Code::OpenBoundary]);
        assert_eq!((guessed.axes.up, guessed.axes.facing), ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]));
        assert_eq!((guessed.unit.unit, guessed.unit.basis), (Unit::Centimetre, Basis::Extent));
    }
}

#[test]
fn a_head_inside_out_is_found_closed_or_open() {
    for open_neck in [true, false] {
        let settings = Settings { triangles: 3000, open_neck, ..Settings::default() };
        let head = Sculptor::new(2).with(settings).head(0, 1.0);
        let turned = head.mesh.triangles().iter().map(|&[a, b, c]| [a, c, b]).collect();
        let mesh = TriangleMesh::new(head.mesh.positions().to_vec(), turned).unwrap();
        assert_eq!(codes(&Inspection::new(&mesh, None).findings)[0], Code::InsideOut);
    }
}

#[test]
fn one_scan_s_landmarks_are_checked() {
    let head = heads(1).remove(0);
    let whole = |change: &dyn Fn(&mut LandmarkSet)| {
        let mut set = head.landmarks.clone();
        change(&mut set);
        let mut codes = inspected(&head.mesh, &set);
        codes.retain(|&code| code != Code::OpenBoundary);
        codes
    };
    assert_eq!(whole(&|_| ()), []);
    assert_eq!(whole(&|set| *set = sides_exchanged(set)), [Code::LeftRightSwapped]);
    assert_eq!(
        whole(&|set| set.points.iter_mut().flatten().for_each(|p| p.y = 40.0 - p.y)),
        [Code::LandmarksMirrored]
    );
    assert_eq!(whole(&|set| set.points.swap(36, 45)), [Code::LandmarksSwapped]);
    assert_eq!(whole(&|set| set.points.reverse()), [Code::LandmarksDisordered, Code::AxesGuessed]);
    assert_eq!(
        whole(&|set| set.points.iter_mut().flatten().for_each(|p| *p *= 10.0)),
        [Code::LandmarksElsewhere]
    );
    assert_eq!(
        whole(&|set| set.points[30] = Some(set.points[30].unwrap() * 1.06)),
        [Code::LandmarksOffSurface]
    );
    assert_eq!(whole(&|set| set.points[3] = None), [Code::LandmarksMissing]);
    assert_eq!(whole(&|set| set.scheme = None), [Code::AxesGuessed, Code::SchemeUnknown]);
    assert_eq!(whole(&|set| set.points[2..].fill(None))[0], Code::TooFewLandmarks);
}

/// Landmarks alone of sculpted heads, half of them caricatures.
fn faces(count: usize) -> Vec<LandmarkSet> {
    let set = |points: Vec<DVec3>| LandmarkSet {
        scheme: Some("multipie68".into()),
        names: (0..points.len()).map(|index| index.to_string()).collect(),
        points: points.into_iter().map(Some).collect(),
    };
    Sculptor::landmarks_of_heads(8, count, &[1.0, 1.8]).into_iter().map(set).collect()
}

#[test]
fn a_collection_of_sculpted_heads_raises_hardly_an_alarm() {
    for scan in audited(&heads(6), true).scans {
        assert_eq!(scan.findings, [], "{}", scan.name);
        assert_eq!(scan.weights.len(), 68);
        assert!(scan.weights.values().all(|&weight| weight >= 0.5));
    }
    for (count, most) in [(1, 0), (3, 0), (5, 0), (12, 0), (100, 2)] {
        let faces = faces(count);
        let cases = faces.iter().map(|landmarks| AuditCase { name: "scan", landmarks, distances: None });
        let audit = audit(&cases.collect::<Vec<_>>());
        let alarms: Vec<&Finding> = audit.scans.iter().flat_map(|scan| &scan.findings).collect();
        assert!(alarms.len() <= most, "{count} scans: {alarms:?}");
    }
}

/// Landmarks moved by 10 to 25 mm on 12 heads, and pairs at least 10 mm apart that are exchanged.
/// Caricatures among them, whose noses stray farther than a dozen heads lead to expect.
#[test]
fn the_demo_s_own_collection_raises_no_alarm() {
    let small = Settings { triangles: 3000, ..Settings::default() };
    let heads = Sculptor::new(1).with(small).collection(12, &[1.0, 1.8, 2.6]);
    let found = audited(&heads, false).scans.into_iter().filter(|scan| !scan.findings.is_empty());
    assert_eq!(found.map(|scan| scan.name).collect::<Vec<_>>(), [""; 0]);
}

#[test]
fn faults_of_a_centimetre_are_found() {
    let heads = heads(12);
    let mut random = Random::new(3);
    let (mut planted, mut found, mut others) = (0, 0, 0);
    for round in 0..240 {
        let at = round % heads.len();
        let mut faulty = heads.clone();
        let points = &mut faulty[at].landmarks.points;
        let (one, other) = (random.below(68), random.below(68));
        let apart = points[one].unwrap().distance(points[other].unwrap());
        let touched: BTreeSet<String> = if round % 2 == 0 {
            let way = DVec3::from_array([0; 3].map(|_| random.signed())).normalize();
            points[one] = points[one].map(|p| p + way * (1.0 + 1.5 * random.unit()));
            BTreeSet::from([one.to_string()])
        } else if apart > 1.0 {
            points.swap(one, other);
            BTreeSet::from([one.to_string(), other.to_string()])
        } else {
            continue;
        };
        let audit = audited(&faulty, false);
        let named: BTreeSet<String> =
            audit.scans[at].findings.iter().flat_map(|finding| finding.landmarks.clone()).collect();
        planted += 1;
        found += usize::from(touched.is_subset(&named));
        others += usize::from(!named.is_subset(&touched));
        others +=
            audit.scans.iter().enumerate().filter(|(i, scan)| *i != at && !scan.findings.is_empty()).count();
        for landmark in &touched & &named {
            assert_eq!(audit.scans[at].weights[&landmark], 0.0);
        }
    }
    assert!(found * 100 >= planted * 95, "{found} of {planted}");
    assert!(others * 100 <= planted * 2, "{others} others");
}

#[test]
fn an_exchange_is_called_an_exchange() {
    let mut heads = heads(8);
    heads[3].landmarks.points.swap(17, 48);
    heads[5].landmarks = sides_exchanged(&heads[5].landmarks);
    let audit = audited(&heads, true);
    assert_eq!(codes(&audit.scans[3].findings), [Code::LandmarksSwapped]);
    assert_eq!(audit.scans[3].findings[0].landmarks, ["17", "48"]);
    assert_eq!(codes(&audit.scans[5].findings), [Code::LeftRightSwapped]);
    assert!(audit.scans[5].weights.values().all(|&weight| weight == 0.0));
}

#[test]
fn strange_sets_do_not_panic() {
    let empty = LandmarkSet::default();
    assert_eq!(audit(&[]).scans, []);
    let case = |landmarks| AuditCase { name: "scan", landmarks, distances: None };
    assert_eq!(audit(&[case(&empty)]).scans[0].findings, []);
    let at_one_place = LandmarkSet {
        scheme: Some("multipie68".into()),
        names: (0..20).map(|i| i.to_string()).collect(),
        points: vec![Some(DVec3::ONE); 20],
    };
    audit(&[case(&at_one_place)]);
    audit(&[case(&at_one_place); 7]);
    let huge = LandmarkSet {
        points: (0..20).map(|i| Some(DVec3::splat(1e200 * f64::from(i)))).collect(),
        ..at_one_place.clone()
    };
    audit(&[case(&huge), case(&at_one_place), case(&empty), case(&huge), case(&huge), case(&huge)]);
    let mesh = heads(1).remove(0).mesh;
    for set in [&at_one_place, &huge, &empty] {
        Inspection::new(&mesh, Some(set));
    }
}

/// The page on inspection has every code, and no other.
#[test]
fn the_page_lists_every_code() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/inspect.md");
    let page = std::fs::read_to_string(page).unwrap();
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `")?.split_once("` | "));
    let listed: Vec<(&str, &str)> =
        rows.filter_map(|(code, rest)| Some((code, rest.split_once(" | ")?.0))).collect();
    let known: Vec<(&str, &str)> =
        Code::ALL.iter().map(|code| (code.name(), code.severity().name())).collect();
    assert_eq!(listed, known);
    assert_eq!(serde_json::to_value(Code::InsideOut).unwrap(), "inside_out");
}
