//! The built program, as people meet it.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use common::{QUICK, command, quick_register, write_collection};
use onemesh::formats::{MeshFile, Sha256, obj_bytes, read_landmarks, read_mesh, write_landmarks};
use serde_json::Value;

/// Runs the program.
fn onemesh<S: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = S>) -> Output {
    command().args(arguments).output().unwrap()
}

fn succeeded(output: &Output) -> String {
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// What the program complains of; it must not panic.
fn complaint(output: &Output) -> String {
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "succeeded: {said}");
    assert!(!said.contains("panicked"), "{said}");
    assert!(said.contains("error: "), "{said}");
    said
}

fn json(path: impl AsRef<Path>) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// The JSON of a GLB.
fn glb_json(path: &Path) -> Value {
    let bytes = fs::read(path).unwrap();
    let length = u32::from_le_bytes(*bytes[12..].first_chunk().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

#[test]
fn the_doctor_says_what_draws() {
    for adapter in ["reference", "fastest"] {
        let said = succeeded(&onemesh(["doctor", "--adapter", adapter]));
        assert!(said.contains("processors: ") && said.ends_with("it draws as it should\n"), "{said}");
    }
    let output = onemesh(["doctor", "--adapter", "no such card"]);
    assert!(String::from_utf8_lossy(&output.stdout).contains("graphics adapters:"));
    let said = complaint(&output);
    assert!(said.contains("no such card") || said.contains("mesa-vulkan-drivers"), "{said}");
}

#[test]
fn a_reader_that_stops_before_the_end_is_no_error() {
    let mut running = command().arg("openapi").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // The document is longer than what a pipe holds: some of it is yet to be written.
    drop(running.stdout.take());
    assert_eq!(succeeded(&running.wait_with_output().unwrap()), "");
}

#[test]
fn a_full_disk_at_standard_output_is_an_error() {
    let Ok(full) = fs::OpenOptions::new().write(true).open("/dev/full") else {
        return println!("skipped: there is no /dev/full");
    };
    let output = command().arg("openapi").stdout(full).stderr(Stdio::piped()).spawn().unwrap();
    assert!(complaint(&output.wait_with_output().unwrap()).contains("standard output"));
}

#[test]
fn a_collection_is_registered() {
    let folder = tempfile::tempdir().unwrap();
    let (scans, out) = (folder.path().join("scans"), folder.path().join("out"));
    let names = write_collection(&scans, 3);
    let said = succeeded(&onemesh(quick_register(&scans, &out)));
    assert!(said.contains("sheet.png") && names.iter().all(|name| said.contains(name)), "{said}");

    let (manifest, report) = (json(out.join("manifest.json")), json(out.join("report.json")));
    let shared = read_mesh(out.join(format!("{}.glb", names[0]))).unwrap();
    for (at, name) in names.iter().enumerate() {
        let path = out.join(format!("{name}.glb"));
        assert_eq!(read_mesh(&path).unwrap().triangles(), shared.triangles(), "{name}");
        holds_to_its_scan(&glb_json(&path));
        let entry = &manifest["scans"][at];
        assert_eq!(entry["name"], **name);
        assert_eq!(entry["inputs"][0]["file"], format!("{name}/scan.ply"));
        let digest = |path: &Path| Sha256::of(&fs::read(path).unwrap()).to_string();
        assert_eq!(entry["inputs"][0]["sha256"], digest(&scans.join(name).join("scan.ply")));
        assert_eq!(
            entry["outputs"],
            serde_json::json!([{ "file": format!("{name}.glb"), "sha256": digest(&path) }])
        );
        let scan = &report["scans"][at];
        assert!(scan["scan_to_mesh"]["p50"].as_f64().unwrap() < 2.0, "{scan}");
        assert_eq!(scan["landmarks"].as_object().unwrap().len(), 68);
        assert!(scan["flipped"].is_number() && scan["sliver"].is_number() && scan["normal"].is_number());
    }
    assert_eq!(manifest["settings"]["groupwise"]["rounds"], 1);
    assert_eq!(manifest["template"]["vertices"], 642);
    assert!(report["seconds"]["groupwise"].is_number() && report["seconds"]["write"].is_number());
    assert!(fs::read(out.join("sheet.png")).unwrap().starts_with(b"\x89PNG"));
    let unfinished = fs::read_dir(&out)
        .unwrap()
        .filter(|file| file.as_ref().unwrap().file_name().to_string_lossy().ends_with(".part"));
    assert_eq!(unfinished.count(), 0);
    validate(&out.join(format!("{}.glb", names[0])));

    // The manifest's settings make the same again, and its triangles can be measured.
    let again = folder.path().join("again");
    let manifest_file = out.join("manifest.json");
    let arguments =
        [Path::new("register"), &scans, Path::new("-o"), &again, Path::new("--settings"), &manifest_file];
    succeeded(&onemesh(arguments));
    assert_eq!(fs::read(&manifest_file).unwrap(), fs::read(again.join("manifest.json")).unwrap());
}

fn holds_to_its_scan(document: &Value) {
    let attributes = document["meshes"][0]["primitives"][0]["attributes"].as_object().unwrap();
    let mut names: Vec<&str> = attributes.keys().map(String::as_str).collect();
    names.sort_unstable();
    assert_eq!(names, ["NORMAL", "POSITION", "TEXCOORD_0", "_CONFIDENCE", "_RESIDUAL"]);
    let extras = &document["scenes"][0]["extras"];
    assert_eq!(extras["scheme"], "multipie68");
    assert_eq!(extras["landmarks"].as_array().unwrap().len(), 68);
}

fn validate(path: &Path) {
    let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/gltf_validator");
    if !scripts.join("node_modules/gltf-validator").exists() {
        assert!(std::env::var_os("ONEMESH_REQUIRE_GLTF_VALIDATOR").is_none(), "gltf-validator is not there");
        return;
    }
    if let Ok(output) = Command::new("node").arg(scripts.join("validate.mjs")).arg(path).output() {
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    }
}

#[test]
fn one_scan_is_fitted_and_measured() {
    let folder = tempfile::tempdir().unwrap();
    let name = write_collection(folder.path(), 1).remove(0);
    let (scan, mesh) = (folder.path().join(name).join("scan.ply"), folder.path().join("fit.glb"));
    let quick = ["--vertices", "642", "--set", "fit.levels.0.iterations=30"].map(Path::new);
    let arguments = [Path::new("fit"), &scan, Path::new("-o"), &mesh];
    let printed: Value = serde_json::from_str(&succeeded(&onemesh(arguments.iter().chain(&quick)))).unwrap();
    assert_eq!(printed["vertices"], 642);
    validate(&mesh);
    let known = fs::read(&mesh).unwrap();
    assert!(known.windows(13).any(|window| window == b"\"_CONFIDENCE\""));
    let formats = ["--format", "obj,ply"].map(Path::new);
    succeeded(&onemesh(arguments.iter().chain(&quick).chain(&formats)));
    let others = ["obj", "ply"].map(|extension| read_mesh(mesh.with_extension(extension)).unwrap());
    assert_eq!(others[0], others[1]);
    assert_eq!(others[0].triangles(), read_mesh(&mesh).unwrap().triangles());
    let said = succeeded(&onemesh([Path::new("evaluate"), &scan, &mesh]));
    let measured: Value = serde_json::from_str(&said).unwrap();
    let chamfer = measured["meshes"][mesh.to_str().unwrap()]["chamfer"].as_f64().unwrap();
    // The file holds single precision.
    assert!((chamfer / printed["chamfer"].as_f64().unwrap() - 1.0).abs() < 1e-3);
    assert_eq!(measured["mean_chamfer"].as_f64().unwrap(), chamfer);
    let odd = complaint(&onemesh([Path::new("evaluate"), &scan]));
    assert!(odd.contains("scan.ply") && odd.contains("without a mesh"), "{odd}");
}

#[test]
fn what_pictures_are_taken_of_is_made_again_and_registered() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    let names = write_collection(&scans, 2);
    for name in &names {
        let own = scans.join(name);
        let (scan, pictures, mesh) = (own.join("scan.ply"), folder.path().join(name), own.join("made.glb"));
        let taken =
            ["--views", "8", "--size", "64", "--samples", "2", "--adapter", "reference"].map(Path::new);
        let capture = [Path::new("capture"), &scan, Path::new("-o"), &pictures];
        succeeded(&onemesh(capture.iter().chain(&taken)));
        assert!(pictures.join("transforms.json").exists());
        let quick =
            ["--vertices", "642", "--set", "levels.0.iterations=40", "--set", "levels.1.iterations=20"];
        let quick = quick.into_iter().chain(["--adapter", "reference"]).map(Path::new).collect::<Vec<_>>();
        let invert = [Path::new("invert"), &pictures, Path::new("-o"), &mesh];
        succeeded(&onemesh(invert.iter().chain(&quick)));
        validate(&mesh);
        let said = succeeded(&onemesh([Path::new("evaluate"), &scan, &mesh]));
        let measured: Value = serde_json::from_str(&said).unwrap();
        assert!(measured["mean_chamfer"].as_f64().unwrap() < 2e-3, "{said}");
    }
    let entry = |name: &String| {
        let path = |file: &str| scans.join(name).join(file).display().to_string();
        serde_json::json!({ "name": name, "mesh": path("made.glb"), "landmarks": path("landmarks.json") })
    };
    let list = folder.path().join("collection.json");
    let scans: Vec<Value> = names.iter().map(entry).collect();
    fs::write(&list, serde_json::json!({ "scans": scans }).to_string()).unwrap();
    let out = folder.path().join("out");
    onemesh(quick_register(&list, &out));
    let [a, b] = [0, 1].map(|k: usize| read_mesh(out.join(format!("{}.glb", names[k]))).unwrap());
    assert_eq!(a.triangles(), b.triangles());
}

#[test]
fn scans_and_collections_are_looked_at_first() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    let names = write_collection(&scans, 6);
    let own = scans.join(&names[2]);
    let (scan, landmarks) = (own.join("scan.ply"), own.join("landmarks.json"));
    let inspect = [Path::new("inspect"), &scans.join(&names[2]).join("scan.ply"), Path::new("--landmarks")];
    let inspect =
        |more: &[&Path]| succeeded(&onemesh(inspect.iter().chain([&landmarks.as_path()]).chain(more)));
    let said = inspect(&[]);
    assert!(said.contains("cm (") && said.contains("facing +Z") && !said.contains("warning"), "{said}");
    let audit = |more: &[&Path]| succeeded(&onemesh([Path::new("audit"), &scans].iter().chain(more)));
    let said = audit(&[]);
    assert!(said.contains("0 of 6 scans need a look"), "{said}");

    let mut set = read_landmarks(&landmarks).unwrap();
    set.points.swap(8, 27);
    write_landmarks(&landmarks, &set).unwrap();
    let said = inspect(&[]);
    assert!(said.contains("[landmarks_swapped]") && said.contains("`8` and `27`"), "{said}");
    let inspection: Value = serde_json::from_str(&inspect(&[Path::new("--json")])).unwrap();
    assert_eq!(inspection["findings"][0]["code"], "landmarks_swapped");
    assert_eq!(inspection["unit"]["unit"], "cm");
    let said = audit(&[]);
    assert!(said.contains("1 of 6 scans need a look") && said.contains(&names[2]), "{said}");
    let audit: Value = serde_json::from_str(&audit(&[Path::new("--json")])).unwrap();
    assert_eq!(audit["scans"][2]["findings"][0]["landmarks"], serde_json::json!(["8", "27"]));
    assert_eq!(audit["scans"][2]["weights"]["8"], 0.0);
    assert_eq!(read_mesh(scan).unwrap().positions().len() as u64, inspection["vertices"]);
}

#[test]
fn a_demo_is_sculpted_registered_and_measured() {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = vec!["demo", "--count", "2", "-o", folder.path().to_str().unwrap()];
    arguments.extend(QUICK);
    let said = succeeded(&onemesh(arguments));
    assert!(said.contains(" mm on average"), "{said}");
    let [scans, results] = ["scans", "result"].map(|name| folder.path().join(name));
    let pair = |name: &str| format!("{name}={}", results.join(format!("{name}.glb")).display());
    let (first, second) = (pair("head-00"), pair("head-01"));
    let arguments = ["evaluate", "correspondence", scans.to_str().unwrap(), &first, &second];
    let figures: Value = serde_json::from_str(&succeeded(&onemesh(arguments))).unwrap();
    assert_eq!(figures["identical_triangles"], true);
    assert!(said.contains(&format!("{:.2} mm on average", figures["mean_mm"].as_f64().unwrap())), "{said}");
}

#[test]
fn what_cannot_be_registered_is_said_clearly() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let scans = folder.path().join("scans");
    let register = || complaint(&onemesh(quick_register(&scans, &out)));

    assert!(register().contains("scans"), "a folder that is not there");
    fs::create_dir(&scans).unwrap();
    assert!(register().contains("holds no scan"));

    let names = write_collection(&scans, 2);
    let landmarks = scans.join(&names[1]).join("landmarks.json");
    let mut few = read_landmarks(&landmarks).unwrap();
    (3..68).for_each(|at| few.points[at] = None);
    few.points[2] = None;
    write_landmarks(&landmarks, &few).unwrap();
    // One fails alone, both for its own reason.
    fs::remove_file(scans.join(&names[0]).join("landmarks.json")).unwrap();
    let said = register();
    assert!(said.contains("has 2 landmarks") && said.contains("no scan is left"), "{said}");
    assert!(said.contains("has no landmarks") && said.contains(&names[0]), "{said}");
    fs::write(&landmarks, "[[1, 2]]").unwrap();
    let said = register();
    assert!(said.contains("landmarks.json") && said.contains(&names[1]), "{said}");
    write_landmarks(scans.join(&names[0]).join("landmarks.json"), &few).unwrap();

    fs::remove_dir_all(scans.join(&names[1])).unwrap();
    fs::write(scans.join(&names[0]).join("scan.ply"), "ply\nformat ascii 1.0\nelement vertex 9").unwrap();
    let said = register();
    assert!(said.contains("scan.ply") && said.contains(&names[0]), "{said}");
    assert!(!out.exists(), "nothing is written");
}

#[test]
fn a_collection_of_which_nothing_can_be_used_ends_in_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let (scans, out) = (folder.path().join("scans"), folder.path().join("out"));
    let names = write_collection(&scans, 2);
    let change = |name: &String, how: fn(&mut Vec<Option<glam::DVec3>>)| {
        let file = scans.join(name).join("landmarks.json");
        let mut set = read_landmarks(&file).unwrap();
        how(&mut set.points);
        write_landmarks(&file, &set).unwrap();
    };
    change(&names[0], |points| points.swap(8, 27));
    let output = onemesh(quick_register(&scans, &out));
    assert!(succeeded(&output).contains("review: landmarks_swapped: `8` and `27`"));
    assert!(String::from_utf8_lossy(&output.stderr).contains("landmarks_swapped"), "said before, too");
    let scan = &json(out.join("report.json"))["scans"][0];
    assert_ne!(scan["verdict"], "pass");
    assert_eq!(scan["findings"][0]["code"], "landmarks_swapped");

    let mirror = |points: &mut Vec<Option<glam::DVec3>>| points.iter_mut().flatten().for_each(|p| p.x = -p.x);
    names.iter().for_each(|name| change(name, mirror));
    let output = onemesh(quick_register(&scans, &out));
    assert!(complaint(&output).contains("no result can be used: all 2 failed"));
    assert!(String::from_utf8_lossy(&output.stdout).contains("0 pass, 0 to review, 2 failed"));
    let report = json(out.join("report.json"));
    assert_eq!(report["scans"][1]["verdict"], "fail");
    assert_eq!(report["scans"][1]["reasons"][0]["verdict"], "fail");
}

#[test]
fn one_bad_scan_fails_alone_and_the_rest_has_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let (scans, out) = (folder.path().join("scans"), folder.path().join("out"));
    let names = write_collection(&scans, 4);
    fs::write(scans.join(&names[0]).join("scan.ply"), "ply\nformat ascii 1.0\nelement vertex 9").unwrap();
    let landmarks = scans.join(&names[2]).join("landmarks.json");
    let mut strange = read_landmarks(&landmarks).unwrap();
    strange.scheme = None;
    strange.names.iter_mut().for_each(|name| name.insert_str(0, "own "));
    write_landmarks(&landmarks, &strange).unwrap();
    let mut arguments = quick_register(&scans, &out);
    arguments.extend(["--format", "ply,glb,obj,glb"].map(Into::into));
    let output = onemesh(arguments);
    let said = complaint(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("2 of 4 scans are left out"), "{said}");
    assert!(said.contains(&format!("{}: left out: ", names[0])), "{said}");
    let (manifest, report) = (json(out.join("manifest.json")), json(out.join("report.json")));
    let failed: Vec<&Value> =
        report["failed"].as_array().unwrap().iter().map(|failed| &failed["name"]).collect();
    assert_eq!(failed, [&names[0], &names[2]]);
    assert!(report["failed"][0]["problem"].as_str().unwrap().contains("scan.ply"), "{report}");
    assert!(!out.join(format!("{}.glb", names[0])).exists());
    for (at, name) in [&names[1], &names[3]].into_iter().enumerate() {
        let entry = &manifest["scans"][at];
        assert_eq!(entry["name"], **name);
        let outputs = entry["outputs"].as_array().unwrap();
        let files: Vec<&Value> = outputs.iter().map(|output| &output["file"]).collect();
        assert_eq!(files, [&format!("{name}.ply"), &format!("{name}.glb"), &format!("{name}.obj")]);
        let [ply, glb, obj] = [0, 1, 2].map(|k| out.join(outputs[k]["file"].as_str().unwrap()));
        for (path, output) in [&ply, &glb, &obj].into_iter().zip(outputs) {
            assert_eq!(output["sha256"], Sha256::of(&fs::read(path).unwrap()).to_string());
        }
        let [ply, glb, obj] = [ply, glb, obj].map(|path| MeshFile::read(path).unwrap());
        assert_eq!(
            (ply.mesh.triangles(), obj.mesh.triangles()),
            (glb.mesh.triangles(), glb.mesh.triangles())
        );
        assert_eq!(ply.mesh.positions(), obj.mesh.positions());
        for (double, single) in ply.mesh.positions().iter().zip(glb.mesh.positions()) {
            assert!(double.distance(*single) < 1e-5, "{double} {single}");
        }
        let uv = |file: &MeshFile| file.vertex_texture_coordinates().unwrap();
        assert!(uv(&obj).iter().zip(uv(&glb)).all(|(a, b)| a.distance(b) < 1e-6));
    }
}

#[test]
fn results_are_in_the_template_s_own_file() {
    let folder = tempfile::tempdir().unwrap();
    let (scans, out) = (folder.path().join("scans"), folder.path().join("out"));
    let names = write_collection(&scans, 2);
    let template = folder.path().join("own.obj");
    let head = read_mesh(scans.join(&names[0]).join("scan.ply")).unwrap();
    let text =
        String::from_utf8(obj_bytes(&head)).unwrap().replacen("f ", "# by hand\ng face\nusemtl skin\nf ", 1);
    let face = text.lines().find(|line| line.starts_with("f ")).unwrap();
    let textured = face.replace(' ', "/1 ").replacen("f/1", "f", 1) + "/1";
    let text = format!("mtllib own.mtl\nvt 0 0\n{}", text.replacen(face, &textured, 1));
    fs::write(&template, &text).unwrap();
    fs::write(folder.path().join("own.mtl"), "newmtl skin\nmap_Kd skin.png\n").unwrap();
    fs::copy(scans.join(&names[0]).join("landmarks.json"), folder.path().join("own.landmarks.json")).unwrap();
    let register = |more: &[&str]| {
        let fixed =
            [Path::new("register"), &scans, Path::new("-o"), &out, Path::new("--template"), &template];
        let quick = ["--set", "transfer.iterations=2", "--set", "transfer.rounds=1"];
        onemesh(fixed.into_iter().chain(quick.iter().chain(more).map(Path::new)))
    };
    succeeded(&register(&[]));
    for name in &names {
        let written = fs::read_to_string(out.join(format!("{name}.obj"))).unwrap();
        let glb = read_mesh(out.join(format!("{name}.glb"))).unwrap();
        let own = read_mesh(out.join(format!("{name}.obj"))).unwrap();
        assert_eq!(own.triangles(), glb.triangles());
        assert!(own.positions().iter().zip(glb.positions()).all(|(a, b)| a.distance(*b) < 1e-5));
        let rest = |text: &str| -> Vec<String> {
            text.lines().filter(|line| !line.starts_with("v ")).map(str::to_owned).collect()
        };
        assert_eq!(rest(&written), rest(&text));
        assert_ne!(written, text);
    }
    let materials = [&out, folder.path()].map(|folder| fs::read(folder.join("own.mtl")).unwrap());
    assert_eq!(materials[0], materials[1]);
    let manifest = json(out.join("manifest.json"));
    assert_eq!(manifest["scans"][0]["outputs"][1]["file"], format!("{}.obj", names[0]));

    fs::remove_dir_all(&out).unwrap();
    succeeded(&register(&["--format", "obj,template"]));
    assert!(
        out.join(format!("{}.template.obj", names[1])).exists()
            && out.join(format!("{}.obj", names[1])).exists()
    );
    assert!(!out.join(format!("{}.glb", names[1])).exists());
    let without = complaint(&onemesh(["register", "nowhere", "-o", "nowhere", "--format", "template"]));
    assert!(without.contains("--format template"), "{without}");
}

#[test]
fn wrong_parameters_are_said_clearly() {
    let said =
        |more: &[&str]| complaint(&onemesh(["register", "nowhere", "-o", "nowhere"].iter().chain(more)));
    assert!(said(&["--vertices", "1000"]).contains("10242"));
    assert!(said(&["--set", "groupwise.round=2"]).contains("rounds"));
    assert!(said(&["--set", "groupwise.rounds"]).contains("NAME=VALUE"));
    assert!(said(&["--threads", "0"]).contains("--threads 0"));
    assert!(said(&["--settings", "no-such-file.json"]).contains("no-such-file.json"));
}

#[test]
fn scans_are_not_overwritten_by_results() {
    let folder = tempfile::tempdir().unwrap();
    let name = write_collection(folder.path(), 1).remove(0);
    let own = folder.path().join(&name);
    let glb = folder.path().join(format!("{name}.glb"));
    let mesh = read_mesh(own.join("scan.ply")).unwrap();
    onemesh::formats::write_glb(&glb, &onemesh::formats::Glb::new(&mesh)).unwrap();
    fs::rename(own.join("landmarks.json"), folder.path().join(format!("{name}.landmarks.json"))).unwrap();
    fs::remove_dir_all(own).unwrap();
    let before = fs::read(&glb).unwrap();
    let said = complaint(&onemesh(quick_register(folder.path(), folder.path())));
    assert!(said.contains("would be overwritten"), "{said}");
    assert_eq!(fs::read(&glb).unwrap(), before);
}
