use glam::DVec3;

use super::{LandmarkFile, landmarks_json, parse_landmarks};
use crate::formats::{MeshFile, MeshFormat};
use crate::mesh::LandmarkSet;

fn read(text: &str) -> LandmarkSet {
    parse_landmarks(text.as_bytes()).unwrap()
}

fn complaint(text: &str) -> String {
    parse_landmarks(text.as_bytes()).unwrap_err().to_string()
}

fn two(first: &str, second: &str) -> LandmarkSet {
    let points = vec![Some(DVec3::new(1.0, 2.0, 3.5)), None];
    LandmarkSet { scheme: None, names: vec![first.to_owned(), second.to_owned()], points }
}

#[test]
fn every_shape_is_read() {
    let plain = two("0", "1");
    assert_eq!(read("\u{feff}[[1, 2, 3.5], null]"), plain);
    assert_eq!(read(r#"{"points": [[1, 2, 3.5], null]}"#), plain);
    assert_eq!(read(r#"{"version": 2, "landmarks": {"points": [[1, 2, 3.5], [null, null, null]]}}"#), plain);
    assert_eq!(
        read(r#"{"groups": {"LJSON": {"labels": [], "landmarks": {"points": [[1, 2, 3.5], null]}}}}"#),
        plain
    );
    let named = two("tip", "chin");
    assert_eq!(read(r#"{"tip": [1, 2, 3.5], "chin": null}"#), named);
    assert_eq!(read(r#"{"landmarks": {"tip": [1, 2, 3.5], "chin": null}}"#), named);
    let listed = r#"[{"name": "tip", "position": [1, 2, 3.5]}, {"name": "chin", "position": null}]"#;
    assert_eq!(read(&format!(r#"{{"landmarks": {listed}}}"#)), named);
    let own = LandmarkSet { scheme: Some("own".to_owned()), ..named };
    assert_eq!(read(r#"{"scheme": "own", "tip": [1, 2, 3.5], "chin": null}"#), own);
}

#[test]
fn complaints_name_the_landmark() {
    assert!(complaint("[[1, 2, 3], [1, 2]]").contains("landmark `1`: is `[1, 2]`"));
    assert!(complaint(r#"{"tip": [1, 2, "3"]}"#).contains("landmark `tip`"));
    assert!(complaint("[[1, 2, 1e999]]").contains("landmark `0`: is `[1, 2, 1e999]`"));
    assert!(complaint("[[1, 2, null]]").contains("landmark `0`"));
    assert!(complaint(r#"{"a": [1, 2, 3], "a": [1, 2, 3]}"#).contains("landmark `a`: is given twice"));
    assert!(complaint(r#"{"landmarks": [{"position": [1, 2, 3]}]}"#).contains("landmark 0"));
    assert!(complaint("[[1, 2, 3],\n [4, NaN, 5]]").contains("line 2"));
    assert!(complaint("[[1, 2, 3],\n [4, NaN, 5]]").contains("NaN"));
}

#[test]
fn what_holds_no_landmarks_is_refused() {
    for text in ["", "3", "\"a\"", "[]", "{}", "[null]", "[1]", r#"{"points": 3}"#, r#"{"groups": {}}"#] {
        assert!(parse_landmarks(text.as_bytes()).is_err(), "{text}");
    }
    let deep = "[".repeat(100_000);
    assert!(parse_landmarks(deep.as_bytes()).is_err());
    let nested = r#"{"points":"#.repeat(10_000) + "[[1, 2, 3]]" + &"}".repeat(10_000);
    assert!(complaint(&nested).contains("too many objects"));
}

#[test]
fn a_known_scheme_is_held_to() {
    assert!(complaint(r#"{"scheme": "ibug68", "points": [[1, 2, 3]]}"#).contains("are 1, but"));
    assert!(complaint(r#"{"scheme": "ibug68", "tip": [1, 2, 3]}"#).contains("include `tip`"));
    assert_eq!(read(r#"{"scheme": "ibug68", "30": [1, 2, 3]}"#).get("30"), Some(DVec3::new(1.0, 2.0, 3.0)));
}

#[test]
fn what_is_written_is_read_back() {
    for mut set in [two("0", "1"), two("tip", "chin"), two("1", "0")] {
        set.scheme = Some("own".to_owned());
        set.points[0] = Some(DVec3::new(0.1, -1.0 / 3.0, 1e-17));
        assert_eq!(read(&landmarks_json(&set).to_string()), set);
    }
}

/// The parts of iBUG's 68 landmarks as another program orders and calls them, and their numbers in the scheme.
const PARTS: [(&str, std::ops::Range<usize>); 7] = [
    ("chin", 0..17),
    ("leye", 36..42),
    ("reye", 42..48),
    ("leyebrow", 17..22),
    ("nose", 27..36),
    ("reyebrow", 22..27),
    ("mouth", 48..68),
];

/// A landmark of the scheme, at its number.
fn numbered(number: usize) -> serde_json::Value {
    if number == 30 { serde_json::json!([null, null, null]) } else { serde_json::json!([number, 0, 0]) }
}

fn has_each_number_at_its_place(text: &str) {
    let set = read(text);
    assert_eq!(set.scheme.as_deref(), Some("multipie68"), "{text}");
    assert_eq!(set.names.len(), 68);
    for number in 0..68 {
        let at = (number != 30).then(|| DVec3::X * number as f64);
        assert_eq!(set.get(&number.to_string()), at, "{number}");
    }
}

#[test]
fn ljson_with_ibug_s_parts_is_multipie_in_whatever_order() {
    use serde_json::json;
    let points: Vec<_> = PARTS.iter().flat_map(|(_, numbers)| numbers.clone()).map(numbered).collect();
    let mut passed = 0;
    let mut labels = vec![json!({ "label": "all", "mask": (0..68).collect::<Vec<_>>() })];
    for (label, numbers) in PARTS {
        labels.push(json!({ "label": label, "mask": (passed..passed + numbers.len()).collect::<Vec<_>>() }));
        passed += numbers.len();
    }
    let body = json!({ "labels": labels, "landmarks": { "connectivity": [], "points": points } });
    has_each_number_at_its_place(&json!({ "version": 3, "groups": { "LJSON": body } }).to_string());
    let mut two = body.clone();
    two["version"] = json!(2);
    has_each_number_at_its_place(&two.to_string());
    let group = |(label, numbers): (&str, std::ops::Range<usize>)| {
        let landmarks: Vec<_> = numbers.map(|number| json!({ "point": numbered(number) })).collect();
        json!({ "label": label, "connectivity": [], "landmarks": landmarks })
    };
    let one = json!({ "version": 1, "groups": PARTS.map(group) });
    has_each_number_at_its_place(&one.to_string());

    // A part that is not whole, one that is told twice and a place that is not there leave the list as it is.
    for (part, mask) in
        [(4, json!([23, 24])), (4, json!([24, 25, 26, 27, 28])), (1, json!((983..1000).collect::<Vec<_>>()))]
    {
        let mut other = two.clone();
        other["labels"][part]["mask"] = mask;
        let set = read(&other.to_string());
        assert_eq!((set.scheme, set.names[17].as_str()), (None, "17"));
    }
}

/// A unit square of two triangles, and a vertex that none of them names.
const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\nf 1 2 3 4\n";

fn square() -> MeshFile {
    MeshFile::parse(SQUARE.as_bytes(), MeshFormat::Obj).unwrap()
}

fn on(text: &str, mesh: &MeshFile) -> Result<Vec<Option<DVec3>>, String> {
    let file = LandmarkFile::parse(text.as_bytes()).map_err(|error| error.to_string())?;
    file.on(mesh).map(|set| set.points).map_err(|error| error.to_string())
}

#[test]
fn vertices_are_found_on_their_mesh() {
    let text = "2 # tip\n\nnull\r\n4\n";
    assert_eq!(
        on(text, &square()).unwrap(),
        [Some(DVec3::new(1.0, 1.0, 0.0)), None, Some(DVec3::splat(9.0))]
    );
    let beyond = on("2\n\n5", &square()).unwrap_err();
    assert!(beyond.contains("line 3: names vertex 5, but the mesh has 5, counted from 0"), "{beyond}");
    assert!(on("99999999999999999999", &square()).unwrap_err().contains("line 1: holds"));
    assert!(on("1\n1.0 2.0 3.0", &square()).unwrap_err().contains("line 2: holds `1.0 2.0 3.0`"));
    assert!(complaint("3").contains("need the mesh"));
    assert!(complaint(&"0\n".repeat(20_000)).contains("line 10001: is entry 10001"));
    let names = LandmarkFile::parse(text.as_bytes()).unwrap();
    assert_eq!(names.present().collect::<Vec<_>>(), ["0", "2"]);
}

#[test]
fn vertices_of_welded_files_have_the_file_s_numbers() {
    use crate::formats::glb::{Glb, glb_bytes};
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [5.0, 5.0]];
    let positions = corners.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec();
    let torn = crate::mesh::TriangleMesh::new(positions, vec![[0, 1, 2], [3, 3, 4], [3, 4, 5]]).unwrap();
    let mut bytes = glb_bytes(&Glb::new(&torn)).unwrap();
    let own = bytes.windows(7).position(|window| window == b"onemesh").unwrap();
    bytes[own..own + 7].copy_from_slice(b"another");
    let mesh = MeshFile::parse(&bytes, MeshFormat::Gltf).unwrap();
    assert_eq!(mesh.mesh.positions().len(), 4);
    assert_eq!(
        on("5\n3\n4", &mesh).unwrap(),
        [Some(DVec3::Y), Some(DVec3::ZERO), Some(DVec3::new(1.0, 1.0, 0.0))]
    );
    assert!(on("6", &mesh).unwrap_err().contains("which is of no triangle"));
    assert!(on("7", &mesh).unwrap_err().contains("has 7, counted from 0"));
    // The third triangle of the file is the second of the mesh; the one between is gone.
    assert_eq!(on("[[2, 0, 0]]", &mesh).unwrap(), [Some(DVec3::Y)]);
    let stl = "solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\nendsolid";
    let mesh = MeshFile::parse(stl.as_bytes(), MeshFormat::Stl).unwrap();
    assert!(on("1", &mesh).unwrap_err().contains("STL has no numbered vertices"));
}

#[test]
fn points_on_triangles_are_told_from_points() {
    // Far outside the square as a point, on its second triangle as Wrap writes it.
    let grid: String = (0..200).map(|_| "f 1 3 4\n").collect();
    let mesh =
        MeshFile::parse(format!("{SQUARE}{grid}").replace("9 9 9", "1 1 1").as_bytes(), MeshFormat::Obj)
            .unwrap();
    let expected = DVec3::new(0.25, 0.75, 0.0);
    assert_eq!(
        on("[[0, 0.5, 0.25], [150, 0.5, 0.25], null]", &mesh).unwrap()[1],
        Some(DVec3::new(0.25, 0.5, 0.0))
    );
    assert_eq!(on(r#"{"tip": [199, 0.25, 0.25]}"#, &mesh).unwrap(), [Some(expected)]);
    // Within the bounds, in a wrapper, or with a fraction: points.
    assert_eq!(on("[[1, 0.5, 0.25], [0, 0.5, 0.25]]", &mesh).unwrap()[0], Some(DVec3::new(1.0, 0.5, 0.25)));
    for points in [
        r#"{"points": [[150, 0.5, 0.25]]}"#,
        "[[150.0, 0.5, 0.25]]",
        "[[150, 0.5, 0.75]]",
        "[[150, -0.1, 0]]",
    ] {
        assert_eq!(on(points, &mesh).unwrap()[0].unwrap().x, 150.0, "{points}");
    }
    let other = on("[[777, 0.5, 0.25]]", &mesh).unwrap_err();
    assert!(other.contains("[777, 0.5, 0.25]") && other.contains("has 202 triangles"), "{other}");
}

#[test]
fn every_version_of_ljson_is_read() {
    let plain = two("0", "1");
    for text in [
        r#"{"version": 1, "groups": [
            {"label": "a", "connectivity": [[0, 1]], "landmarks": [{"point": [1, 2, 3.5]}]},
            {"label": "b", "landmarks": [{"point": [null, null, null]}]}]}"#,
        r#"{"version": 2, "labels": [{"label": "a", "mask": [0]}],
            "landmarks": {"connectivity": [], "points": [[1, 2, 3.5], [null, null, null]]}}"#,
        r#"{"version": 3, "groups": {"LJSON": {"labels": [], "landmarks": {"points": [[1, 2, 3.5], null]}}}}"#,
    ] {
        assert_eq!(read(text), plain);
    }
    assert!(
        complaint(r#"{"groups": [{"landmarks": [{"point": [1, 2]}]}]}"#)
            .contains("landmark `0`: is `[1, 2]`")
    );
    assert!(complaint(r#"{"groups": [{"label": "a"}]}"#).contains("groups[0]"));
}

#[test]
fn picked_points_of_meshlab_are_read() {
    let text = r#"<!DOCTYPE PickedPoints>
<PickedPoints>
 <DocumentData><User name="me"/><templateName name=""/></DocumentData>
 <point name="nose &amp; tip" x="1" active="1" y="2" z="3.5"/>
 <point y="0" z="0" x="0" active="0" name="chin"></point>
</PickedPoints>
"#;
    assert_eq!(read(text), two("nose & tip", "chin"));
    let with = |from: &str, to: &str| complaint(&text.replacen(from, to, 1));
    assert!(with(r#"z="3.5""#, "").contains("point 0: has not all of x, y and z"));
    assert!(with(r#"x="1""#, r#"x="inf""#).contains("point 0: has the x `inf`"));
    assert!(with("chin", "nose &amp; tip").contains("landmark `nose & tip`: is given twice"));
    assert!(with("</PickedPoints>", "").contains("cut short"));
    assert!(with("</point>", "</pint>").contains("its XML"));
    assert!(with("&amp;", "&lol;").contains("point 0"));
    assert!(complaint("<html></html>").contains("none has a position"));
    // Attributes without end, and elements within one another, take no time of note.
    let many: String = (0..200_000).map(|i| format!(" a{i}=\"\"")).collect();
    assert_eq!(read(&text.replacen("<point ", &format!("<point {many} "), 1)), two("nose & tip", "chin"));
    assert!(complaint(&"<a>".repeat(200_000)).contains("cut short"));
}

#[test]
fn markups_of_slicer_come_in_the_axes_of_the_mesh() {
    let text = |system: &str| {
        format!(
            r#"{{"@schema": "https://raw.githubusercontent.com/markups-schema-v1.0.3.json#", "markups": [{{
                "type": "Fiducial", {system} "controlPoints": [
                {{"id": "1", "label": "tip", "position": [1, 2, 3.5], "positionStatus": "defined"}},
                {{"id": "2", "label": "chin", "position": [0, 0, 0], "positionStatus": "undefined"}}]}}]}}"#
        )
    };
    let (lps, ras) = (text(r#""coordinateSystem": "LPS","#), text(r#""coordinateSystem": "RAS","#));
    assert_eq!(read(&lps), two("tip", "chin"));
    assert_eq!(read(&text("")), two("tip", "chin"));
    let (there, turned) = (DVec3::new(1.0, 2.0, 3.5), DVec3::new(-1.0, -2.0, 3.5));
    assert_eq!(read(&ras).points[0], Some(turned));
    let with_comment =
        |comment: &str| MeshFile::parse(format!("{comment}\n{SQUARE}").as_bytes(), MeshFormat::Obj).unwrap();
    let (plain, stated) = (with_comment("# SPACE=LPS"), with_comment("# Slicer. SPACE=RAS"));
    assert_eq!(on(&lps, &plain).unwrap()[0], Some(there));
    assert_eq!(on(&ras, &plain).unwrap()[0], Some(turned));
    assert_eq!(on(&lps, &stated).unwrap()[0], Some(turned));
    assert_eq!(on(&ras, &stated).unwrap()[0], Some(there));
    assert!(
        complaint(&text(r#""coordinateSystem": "IJK","#))
            .contains("markups[0]: has the coordinateSystem `IJK`")
    );
    assert!(
        complaint(&lps.replace("3.5", "null"))
            .contains("markups[0], control point 0: has not all of x, y and z")
    );
    assert!(complaint(r#"{"markups": 3}"#).contains("markups: must be a list"));
    let unlabelled = lps.replace(r#""label": "tip","#, "");
    assert_eq!(read(&unlabelled).names, ["0", "chin"]);
}

#[test]
fn subsets_share_the_names_of_their_scheme() {
    let list = |count: usize, scheme: &str| {
        let points: Vec<_> = (0..count).map(|i| format!("[{i}, 0.5, -1]")).collect();
        format!(r#"{{"scheme": "{scheme}", "points": [{}]}}"#, points.join(","))
    };
    let set = read(&list(51, "ibug51"));
    assert_eq!(set.scheme.as_deref(), Some("multipie68"));
    assert_eq!(set.get("30"), Some(DVec3::new(13.0, 0.5, -1.0)));
    assert_eq!(read(&landmarks_json(&set).to_string()), set);
    assert_eq!(read(&list(49, "ibug49")).get("61"), Some(DVec3::new(43.0, 0.5, -1.0)));
    let caricature = read(&list(38, "caricshop38"));
    assert_eq!(caricature.names[0], "caricshop38/0");
    assert_eq!(read(&landmarks_json(&caricature).to_string()), caricature);
    assert!(complaint(&list(68, "ibug51")).contains("are 68, but multipie51 has 51"));
    let vertices = LandmarkFile::parse("0\n".repeat(49).as_bytes()).unwrap().or_scheme("multipie49").unwrap();
    assert_eq!(vertices.present().next(), Some("17"));
    assert!(LandmarkFile::parse(b"0\n1").unwrap().or_scheme("multipie49").is_err());
    let own = LandmarkFile::parse(br#"{"scheme": "own", "a": [1, 2, 3]}"#).unwrap();
    assert_eq!(own.or_scheme("multipie68").unwrap().scheme(), Some("own"));
}
