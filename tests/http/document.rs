//! The OpenAPI document.

use std::path::Path;

use onemesh::http::openapi_json;
use serde_json::Value;

use crate::server::Server;

fn document() -> Value {
    serde_json::from_str(&openapi_json()).unwrap()
}

/// The operations of the document, by method and path.
fn operations(document: &Value) -> Vec<(String, &Value)> {
    let paths = document["paths"].as_object().unwrap().iter();
    let of_path = |(path, item): (&String, &'_ Value)| -> Vec<String> {
        item.as_object().unwrap().keys().map(|method| format!("{method} {path}")).collect()
    };
    let names: Vec<String> = paths.flat_map(of_path).collect();
    names
        .into_iter()
        .map(|name| {
            let (method, path) = name.split_once(' ').unwrap();
            let operation = &document["paths"][path][method];
            (name, operation)
        })
        .collect()
}

#[test]
fn the_committed_document_is_that_of_the_code() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi/onemesh.v1.json");
    let committed = std::fs::read_to_string(path).unwrap_or_default();
    assert!(committed == openapi_json(), "run: cargo run -- openapi > openapi/onemesh.v1.json");
}

#[tokio::test]
async fn it_is_served_with_a_page_that_loads_nothing_from_elsewhere() {
    let server = Server::start().await;
    assert_eq!(server.get("/openapi.json").await.json(), document());
    let page = server.get("/docs/").await;
    assert!(page.status == 200 && page.text().contains("swagger-ui"), "{}", page.text());
    assert!(!page.text().contains("http://") && !page.text().contains("https://"), "{}", page.text());
}

#[test]
fn every_operation_has_examples() {
    let document = document();
    for (name, operation) in operations(&document) {
        let mut seen = Vec::new();
        assert!(
            has_example(&document, operation, &mut seen) || answers_nothing(operation),
            "{name} has no example"
        );
    }
}

/// Whether an example stands somewhere in a part of the document, or in what it refers to.
fn has_example<'a>(document: &'a Value, part: &'a Value, seen: &mut Vec<&'a str>) -> bool {
    match part {
        Value::Object(fields) => fields.iter().any(|(name, value)| match (name.as_str(), value) {
            ("example" | "examples", _) => true,
            ("$ref", Value::String(reference)) if reference.ends_with("/Problem") => false,
            ("$ref", Value::String(reference)) if !seen.contains(&reference.as_str()) => {
                seen.push(reference);
                has_example(document, document.pointer(&reference[1..]).unwrap(), seen)
            }
            _ => has_example(document, value, seen),
        }),
        Value::Array(items) => items.iter().any(|item| has_example(document, item, seen)),
        _ => false,
    }
}

/// An operation that takes an id alone and answers with bytes or nothing has nothing to show.
fn answers_nothing(operation: &Value) -> bool {
    let binary =
        |content: &Value| content.as_object().is_none_or(|types| !types.contains_key("application/json"));
    operation["requestBody"].is_null()
        && ["200", "204"].iter().all(|status| binary(&operation["responses"][status]["content"]))
}

#[test]
fn ids_of_operations_are_unique() {
    let document = document();
    let mut ids: Vec<&str> = operations(&document)
        .iter()
        .map(|(_, operation)| operation["operationId"].as_str().unwrap())
        .collect();
    let all = ids.len();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), all);
}
