//! `docs/report.md` has every field, reason and limit.

mod common;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use common::{command, quick_register, write_collection};
use onemesh::evaluate::{NOISE_TOLERANCE, TOLERANCE};
use onemesh::pipeline::{CRITERIA, Verdict, Worse, verdict_of};
use onemesh::preflight::Code;
use serde_json::Value;

fn page() -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/report.md")).unwrap()
}

#[test]
fn every_criterion_is_on_the_page_with_its_limits() {
    let page = page();
    for criterion in CRITERIA {
        let side = match criterion.worse {
            Worse::Above => "above",
            Worse::Below => "below",
        };
        let fail = criterion.fail.map_or("–".to_owned(), |limit| format!("{side} {limit}"));
        let (code, figure, review) = (criterion.code, criterion.figure, criterion.review);
        let row = format!("| `{code}` | {figure} | {side} {review} | {fail} |");
        assert!(page.lines().any(|line| line == row), "the page lacks: {row}");
        let stricter = |limit: f64| (limit > review) == (criterion.worse == Worse::Above);
        assert!(criterion.fail.is_none_or(stricter), "{code} fails before it is reviewed");
    }
    let words = page.split_whitespace().collect::<Vec<_>>().join(" ");
    let tolerance = format!("is {} % of the radius", 100.0 * TOLERANCE);
    assert!(words.contains(&tolerance) && words.contains(&format!("or {NOISE_TOLERANCE} deviations")));
}

#[test]
fn every_finding_that_counts_is_on_the_page() {
    let page = page();
    for &code in Code::ALL {
        let row = format!("| `{}` | {} |", code.name(), verdict_of(code));
        let counts = verdict_of(code) > Verdict::Pass;
        assert_eq!(page.lines().any(|line| line == row), counts, "{row}");
    }
    let codes: BTreeSet<&str> = CRITERIA.iter().map(|criterion| criterion.code).collect();
    assert_eq!(codes.len(), CRITERIA.len(), "a code is there twice");
    assert!(Code::ALL.iter().all(|code| !codes.contains(code.name())), "a finding has a criterion's code");
}

/// The names of a record's fields at any depth, but for settings and for what has the names of landmarks and stages.
fn fields(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Array(items) => items.iter().for_each(|item| fields(item, found)),
        Value::Object(entries) => {
            for (name, entry) in entries {
                found.insert(name.clone());
                match (name.as_str(), entry) {
                    ("settings" | "seconds", _) => {}
                    ("landmarks", Value::Object(of_each)) => of_each.values().for_each(|e| fields(e, found)),
                    _ => fields(entry, found),
                }
            }
        }
        _ => {}
    }
}

#[test]
fn every_field_is_on_the_page() {
    let folder = tempfile::tempdir().unwrap();
    let (scans, out) = (folder.path().join("scans"), folder.path().join("out"));
    write_collection(&scans, 2);
    command().args(quick_register(&scans, &out)).output().unwrap();
    let page = page();
    for file in ["report.json", "manifest.json"] {
        let mut found = BTreeSet::new();
        fields(&serde_json::from_slice(&fs::read(out.join(file)).unwrap()).unwrap(), &mut found);
        assert!(found.len() > 15, "{found:?}");
        for field in found {
            assert!(page.contains(&format!("`{field}`")), "the page lacks `{field}` of {file}");
        }
    }
}
