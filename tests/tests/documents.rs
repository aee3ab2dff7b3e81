//! What the documents claim is true as far as a machine can check it.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The sources in which the tests of `crate/file` stand: one file, or a folder of them.
fn sources(name: &str, file: &str) -> String {
    let single = root().join(format!("{name}/tests/{file}.rs"));
    if let Ok(text) = fs::read_to_string(single) {
        return text;
    }
    let folder = root().join(format!("{name}/tests/{file}"));
    let files = fs::read_dir(&folder).unwrap_or_else(|_| panic!("there are no tests {name}/{file}"));
    files.filter_map(|f| fs::read_to_string(f.ok()?.path()).ok()).collect()
}

#[test]
fn every_test_that_the_conformance_matrix_names_exists() {
    let matrix = read("docs/conformance.md");
    let mut named = 0;
    for reference in matrix.split('`').skip(1).step_by(2) {
        let Some((place, test)) = reference.split_once("::") else { continue };
        let (name, file) =
            place.split_once('/').unwrap_or_else(|| panic!("`{reference}` is not crate/file::test"));
        let found = sources(name, file).contains(&format!("fn {test}("));
        assert!(found, "docs/conformance.md names `{reference}`, which does not exist");
        named += 1;
    }
    assert!(named > 50, "the matrix names only {named} tests");
}

#[test]
fn every_link_between_the_documents_leads_somewhere() {
    let documents =
        fs::read_dir(root().join("docs")).unwrap().filter_map(Result::ok).map(|entry| entry.path());
    let top = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root().join(name));
    for path in documents.chain(top).filter(|path| path.extension().is_some_and(|e| e == "md")) {
        let text = fs::read_to_string(&path).unwrap();
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let is_local = !target.starts_with("http") && !target.starts_with('#');
            let goal = path.parent().unwrap().join(target);
            assert!(!is_local || goal.exists(), "{} links to {target}, which does not exist", path.display());
        }
    }
}
