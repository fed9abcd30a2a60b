use crate::common::command;
use crate::server::Server;

#[test]
fn a_server_says_whether_it_takes_work() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path());
    let health = || command().args(["health", &server.url]).output().unwrap();
    let output = health();
    assert!(output.status.success() && String::from_utf8_lossy(&output.stdout).ends_with(": ok\n"));
    let url = server.url.clone();
    drop(server);
    let output = command().args(["health", &url]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
}
