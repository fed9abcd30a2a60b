//! `/v1/templates`

use serde_json::json;

use crate::server::{OBJ, Server};
use crate::study::{ended, quick, register, upload};

const LANDMARKS: &str = r#"{"a": [0, 0, 0], "b": [20, 0, 0], "c": [0, 20, 0]}"#;

fn form(landmarks: Option<&str>) -> String {
    let mesh =
        format!("--b\r\nContent-Disposition: form-data; name=\"mesh\"; filename=\"x.obj\"\r\n\r\n{OBJ}\r\n");
    let landmarks = landmarks.map_or(String::new(), |landmarks| {
        format!("--b\r\nContent-Disposition: form-data; name=\"landmarks\"\r\n\r\n{landmarks}\r\n")
    });
    format!("{mesh}{landmarks}--b--\r\n")
}

const FORM: &str = "multipart/form-data; boundary=b";

#[tokio::test]
async fn a_mesh_with_landmarks_is_a_template() {
    let server = Server::start().await;
    let made = server.post("/v1/templates?name=mine", FORM, form(Some(LANDMARKS))).await;
    assert_eq!(made.status, 201, "{}", made.text());
    let template = made.json();
    assert_eq!((&template["vertices"], &template["landmarks"]), (&4.into(), &json!(["a", "b", "c"])));
    assert_eq!(server.post("/v1/templates?name=mine", FORM, form(Some(LANDMARKS))).await.status, 200);
    let listed = server.get("/v1/templates").await.json();
    assert_eq!((&listed["items"][0]["id"], &listed["items"][1]), (&"default".into(), &template));
    let path = &made.headers["location"];
    assert_eq!(server.get(path).await.json(), template);
    assert_eq!(server.delete(path).await.status, 204);
    assert_eq!(server.get(path).await.problem(), (404, "not-found".into()));
}

#[tokio::test]
async fn a_mask_comes_with_it() {
    let server = Server::start().await;
    let masked = |mask: &str| {
        let part = format!("--b\r\nContent-Disposition: form-data; name=\"mask\"\r\n\r\n{mask}\r\n");
        part + &form(Some(LANDMARKS))
    };
    let made = server.post("/v1/templates", FORM, masked("[1, 1, 1, 0]")).await;
    assert_eq!((made.status.as_u16(), &made.json()["masked"]), (201, &true.into()), "{}", made.text());
    let other = server.post("/v1/templates", FORM, form(Some(LANDMARKS))).await.json();
    assert!(other["masked"] == false && other["id"] != made.json()["id"], "{other}");
    for mask in ["[1, 1]", "[0, 0, 0, 0]", "[1, 1, 1, 2]", "nothing"] {
        let refused = server.post("/v1/templates", FORM, masked(mask)).await;
        assert_eq!(refused.problem(), (422, "unreadable-file".into()), "{mask}");
        assert_eq!(refused.json()["field"], "mask");
    }
}

#[tokio::test]
async fn the_built_in_one_is_there_and_stays() {
    let server = Server::start().await;
    assert_eq!(server.get("/v1/templates/default").await.json()["built_in"], true);
    assert_eq!(server.delete("/v1/templates/default").await.problem(), (409, "conflict".into()));
    let first = server.get("/v1/templates?limit=1").await.json();
    assert_eq!(first["items"].as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn a_mesh_without_landmarks_is_none() {
    let server = Server::start().await;
    let refused = server.post("/v1/templates", FORM, form(None)).await;
    assert_eq!(refused.problem(), (422, "unreadable-file".into()));
    assert_eq!(refused.json()["field"], "landmarks");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_registration_left_is_a_template() {
    let server = Server::start().await;
    let scans = upload(&server, 3).await;
    let done = register(&server, &quick(&scans[..2])).await;
    let frozen = server.get(done["results"]["template"].as_str().unwrap()).await.body;
    let template = server.post("/v1/templates", "model/gltf-binary", frozen).await;
    assert_eq!(
        (template.status.as_u16(), &template.json()["frozen"]),
        (201, &true.into()),
        "{}",
        template.text()
    );
    let request = json!({ "scans": [{ "id": scans[2] }], "template": template.json()["id"] });
    let asked = server.post("/v1/registrations", "application/json", request.to_string()).await;
    assert_eq!(asked.status, 202, "{}", asked.text());
    assert_eq!(ended(&server, &asked.headers["location"]).await["status"], "succeeded");
}
