use crate::server::Server;

#[tokio::test]
async fn limits_are_told() {
    let server = Server::with(|config| config.limits.scan.vertices = 123).await;
    let told = server.get("/v1/capabilities").await.json();
    assert_eq!(told["limits"]["vertices"], 123);
    assert!(told["mesh_media_types"].as_array().unwrap().contains(&"model/ply".into()));
    assert_eq!(told["keys_required"], false);
}
