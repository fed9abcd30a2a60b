use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use onemesh::demo::{Sculptor, Settings};
use onemesh::formats::{obj_bytes, write_landmarks};

use crate::common::{QUICK, command, quick_register, write_collection};
use crate::proxy::Proxy;
use crate::server::Server;

/// The command that submits a collection quickly.
fn submit(server: &str, collection: &Path, output: &Path) -> Command {
    let mut command = command();
    command.arg("submit").arg(collection).arg("-o").arg(output).args(["--server", server]).args(QUICK);
    command
}

fn said(output: &Output) -> String {
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!said.contains("panicked"), "{said}");
    said
}

/// The lines of a summary but that of the seconds and folders.
fn verdicts(output: &Output) -> Vec<String> {
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    printed.lines().take_while(|line| !line.contains(" scans in ")).map(str::to_owned).collect()
}

/// Whether two folders have the same files of these names.
fn same(one: &Path, other: &Path, names: &[String]) {
    for name in names {
        assert!(fs::read(one.join(name)).unwrap() == fs::read(other.join(name)).unwrap(), "{name}");
    }
}

fn meshes(names: &[String]) -> Vec<String> {
    names.iter().map(|name| format!("{name}.glb")).chain(["template.frozen.glb".to_owned()]).collect()
}

#[test]
fn results_are_those_of_register() {
    let folder = tempfile::tempdir().unwrap();
    let [scans, own, sent] = ["scans", "own", "sent"].map(|name| folder.path().join(name));
    let names = write_collection(&scans, 2);
    let weighed = ["--landmark-weight", "30=5"];
    let registered = command().args(quick_register(&scans, &own)).args(weighed).output().unwrap();
    assert!(registered.status.success(), "{}", said(&registered));
    let server = Server::start(&folder.path().join("data"));
    let submitted = submit(&server.url, &scans, &sent).args(weighed).output().unwrap();
    assert!(submitted.status.success(), "{}", said(&submitted));
    same(&own, &sent, &meshes(&names));
    same(&own, &sent, &["sheet.png".to_owned()]);
    assert_eq!(verdicts(&registered), verdicts(&submitted));
    assert!(sent.join("landmarks.json").exists() && said(&submitted).contains("is asked for"));
    let left = fs::read_dir(&sent)
        .unwrap()
        .filter(|file| file.as_ref().unwrap().file_name().to_string_lossy().ends_with(".part"));
    assert_eq!(left.count(), 0);

    // The same again is found, and what is missing or spoiled here is downloaded again.
    let first = format!("{}.glb", names[0]);
    fs::write(sent.join(&first), "spoiled").unwrap();
    fs::remove_file(sent.join("sheet.png")).unwrap();
    fs::write(sent.join(".sheet.png.part"), "of another file").unwrap();
    let again = submit(&server.url, &scans, &sent).args(weighed).output().unwrap();
    assert!(
        again.status.success() && said(&again).contains("found as it was asked for before"),
        "{}",
        said(&again)
    );
    same(&own, &sent, &[first, "sheet.png".to_owned()]);

    // A further scan, from the frozen template that came back; beside it one that cannot be read.
    let more = folder.path().join("more");
    let head =
        &Sculptor::new(9).with(Settings { triangles: 3000, ..Settings::default() }).collection(1, &[1.0])[0];
    fs::create_dir_all(more.join("maps")).unwrap();
    let materials = "mtllib zoe.mtl\n".to_owned() + &String::from_utf8(obj_bytes(&head.mesh)).unwrap();
    fs::write(more.join("zoe.obj"), materials).unwrap();
    fs::write(more.join("zoe.mtl"), "newmtl skin\nmap_Kd maps/skin.png\n").unwrap();
    write_landmarks(more.join("zoe.landmarks.json"), &head.landmarks).unwrap();
    fs::write(more.join("bad.ply"), "ply\nbroken").unwrap();
    write_landmarks(more.join("bad.landmarks.json"), &head.landmarks).unwrap();
    let [own, sent] = ["own_more", "sent_more"].map(|name| folder.path().join(name));
    let from = |mut command: Command| {
        let template = folder.path().join("own/template.frozen.glb");
        let output = command.arg("--template").arg(template).output().unwrap();
        assert_eq!(output.status.code(), Some(3), "{}", said(&output));
        assert!(said(&output).contains("bad: left out: "), "{}", said(&output));
        output
    };
    let mut register = command();
    register.arg("register").arg(&more).arg("-o").arg(&own);
    let mut submit = command();
    submit.arg("submit").arg(&more).arg("-o").arg(&sent).args(["--server", &server.url]);
    let (registered, submitted) = (from(register), from(submit));
    assert_eq!(verdicts(&registered), verdicts(&submitted));
    same(&own, &sent, &["zoe.glb".to_owned()]);
}

#[test]
fn broken_connections_are_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let [scans, whole, pieces] = ["scans", "whole", "pieces"].map(|name| folder.path().join(name));
    let names = write_collection(&scans, 2);
    let server = Server::start(&folder.path().join("data"));
    // Fewer bytes than any mesh has: without resuming none would ever be whole.
    let proxy = Proxy::before(&server.url, 24 << 10);
    let output = submit(&proxy.url, &scans, &pieces).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    assert!(proxy.broken() > names.len(), "{} connections were broken", proxy.broken());
    let output = submit(&server.url, &scans, &whole).output().unwrap();
    assert!(output.status.success() && said(&output).contains("found as"), "{}", said(&output));
    same(&whole, &pieces, &meshes(&names));
}

#[test]
fn a_server_that_dies_and_comes_back_is_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let [scans, whole, waited] = ["scans", "whole", "waited"].map(|name| folder.path().join(name));
    let names = write_collection(&scans, 2);
    let server = Server::start(&folder.path().join("data"));
    let mut begun =
        submit(&server.url, &scans, &waited).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(begun.stderr.take().unwrap()).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains("is asked for")));
    let address = server.url.trim_start_matches("http://").to_owned();
    server.kill();
    let server = Server::with(&folder.path().join("data"), &address, &[]);
    let rest: Vec<String> = lines.collect();
    assert!(begun.wait().unwrap().success(), "{rest:?}");
    let output = submit(&server.url, &scans, &whole).output().unwrap();
    assert!(said(&output).contains("found as"), "{}", said(&output));
    same(&whole, &waited, &meshes(&names));
}

#[test]
fn what_is_wrong_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let (scans, out) = (folder.path().join("scans"), folder.path().join("out"));
    write_collection(&scans, 1);
    let complaint = |mut command: Command, code: i32| {
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{}", said(&output));
        said(&output)
    };
    let data = folder.path().join("data");
    let server = Server::with(&data, "127.0.0.1:0", &["--set", "server.keys=required"]);
    let found = complaint(submit(&server.url, &scans, &out), 1);
    assert!(found.contains("An API key is needed") && found.contains("onemesh key create"), "{found}");
    let mut wrong = submit(&server.url, &scans, &out);
    wrong.args(["--api-key", "wrong"]);
    let found = complaint(wrong, 1);
    assert!(found.contains("the key is not known"), "{found}");

    let url = server.url.clone();
    drop(server);
    let found = complaint(submit(&url, &scans, &out), 1);
    assert!(found.contains("no server can be reached there") && found.contains(&url), "{found}");
    let found = complaint(submit("localhost:8080", &scans, &out), 2);
    assert!(found.contains("write it as http://"), "{found}");
    let mut wrong = submit(&url, &scans, &out);
    wrong.args(["--set", "groupwise.round=3"]);
    let found = complaint(wrong, 1);
    assert!(found.contains("--set groupwise.round=3"), "{found}");
    assert!(!out.exists());
}
