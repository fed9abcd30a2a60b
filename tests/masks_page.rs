//! The examples of `docs/masks.md`, each read as the page says.

use std::fs;
use std::path::Path;

use onemesh::formats::Collection;

/// A folder with the page's named fenced blocks as files.
fn folder() -> tempfile::TempDir {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/masks.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let Some(info) = line.strip_prefix("```") else { continue };
        let (_, name) = info.split_once(' ').expect("every example of the page has a name");
        let content: String =
            lines.by_ref().take_while(|line| *line != "```").map(|line| line.to_owned() + "\n").collect();
        fs::write(folder.path().join(name), content).unwrap();
    }
    folder
}

#[test]
fn every_mask_says_what_the_page_says() {
    let folder = folder();
    let collection = Collection::open(folder.path().join("collection.json")).unwrap();
    let masks = collection.members().iter().map(|member| member.read().unwrap().mask.unwrap());
    let expected = [[1.0, 1.0, 0.5, 0.0], [0.25, 1.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0]];
    assert_eq!(masks.collect::<Vec<_>>(), expected.map(Vec::from));
}

#[test]
fn a_painted_mask_lies_as_a_texture_does() {
    let folder = folder();
    let mut encoder =
        png::Encoder::new(fs::File::create(folder.path().join("square.mask.png")).unwrap(), 2, 2);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&[255, 0, 0, 51]).unwrap();
    fs::rename(folder.path().join("tips.json"), folder.path().join("square.landmarks.json")).unwrap();
    let scan = Collection::open(folder.path()).unwrap().members()[0].read().unwrap();
    assert_eq!(scan.mask, Some(vec![0.0, 0.2, 0.0, 1.0]));
}
