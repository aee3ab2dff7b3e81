//! What the documents claim is true as far as a machine can check it.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The sources in which the tests of `crate/file` stand: one file, a folder of them, or a module with its own tests.
fn sources(name: &str, file: &str) -> String {
    let single = root().join(format!("{name}/tests/{file}.rs"));
    if let Ok(text) = fs::read_to_string(single) {
        return text;
    }
    let module = [format!("{name}/src/{file}.rs"), format!("{name}/src/{file}/tests.rs")];
    let module: String =
        module.iter().filter_map(|path| fs::read_to_string(root().join(path)).ok()).collect();
    if !module.is_empty() {
        return module;
    }
    let folder = root().join(format!("{name}/tests/{file}"));
    let files = fs::read_dir(&folder).unwrap_or_else(|_| panic!("there are no tests {name}/{file}"));
    files.filter_map(|f| fs::read_to_string(f.ok()?.path()).ok()).collect()
}

/// The tests that `document` names as `crate/file::test`, all of which have to exist.
fn named_tests(document: &str) -> Vec<String> {
    let text = read(document);
    let mut named = Vec::new();
    for reference in text.split('`').skip(1).step_by(2) {
        let Some((place, test)) = reference.split_once("::") else { continue };
        let (name, file) =
            place.split_once('/').unwrap_or_else(|| panic!("`{reference}` is not crate/file::test"));
        let found = sources(name, file).contains(&format!("fn {test}("));
        assert!(found, "{document} names `{reference}`, which does not exist");
        named.push(test.to_owned());
    }
    named
}

#[test]
fn every_test_that_the_conformance_matrix_names_exists() {
    let named = named_tests("docs/conformance.md").len();
    assert!(named > 50, "the matrix names only {named} tests");
}

#[test]
fn every_case_of_the_conformance_tool_has_its_test_or_a_reason() {
    const DOCUMENT: &str = "docs/conformance-tool.md";
    let text = read(DOCUMENT);
    let rows = text.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| No "));
    let (mut numbers, mut passed) = (Vec::new(), 0);
    for row in rows {
        let [_, number, _, _, status, reason, _] = row.split('|').map(str::trim).collect::<Vec<_>>()[..]
        else {
            panic!("not five columns: {row}");
        };
        let (group, case): (u16, u16) = number
            .split_once('.')
            .map(|(group, case)| (group.parse().unwrap(), case.parse().unwrap()))
            .unwrap();
        let is_proven = reason.starts_with('`') && reason.ends_with('`') && reason.contains("::");
        // A test of several cases names them all; the EDS is judged by a peer.
        let is_its_own = reason.contains(&format!("{group}_{case:02}_")) || group == 1;
        match status {
            "passed" => assert!(is_proven && is_its_own, "{row}"),
            "not applicable" => assert!(!is_proven && !reason.is_empty(), "{row}"),
            _ => panic!("unknown status: {row}"),
        }
        numbers.push((group, case));
        passed += usize::from(status == "passed");
    }
    assert!(numbers.is_sorted(), "the cases are in order");
    numbers.dedup();
    assert_eq!(numbers.len(), 127);
    let others = numbers.len() - passed;
    let claim = format!("Of the 127 cases {passed} are passed and {others} is not applicable.");
    assert!(text.contains(&claim), "{DOCUMENT} does not say: {claim}");

    let named = named_tests(DOCUMENT);
    let all = sources("daemon", "conformance");
    let tests = all.split("fn cct_").skip(1).filter_map(|rest| rest.split_once('(')).map(|(name, _)| name);
    for test in tests {
        assert!(named.contains(&format!("cct_{test}")), "{DOCUMENT} does not name cct_{test}");
    }
}

/// The headings of a document as links name them.
fn headings(text: &str) -> impl Iterator<Item = String> {
    let words =
        text.lines().filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    let keep = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    let all: Vec<_> =
        words.map(|line| line.to_lowercase().chars().filter(keep).collect::<String>()).collect();
    all.into_iter().map(|line| line.replace(' ', "-"))
}

#[test]
fn every_link_between_the_documents_leads_somewhere() {
    let documents =
        fs::read_dir(root().join("docs")).unwrap().filter_map(Result::ok).map(|entry| entry.path());
    let top = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root().join(name));
    for path in documents.chain(top).filter(|path| path.extension().is_some_and(|e| e == "md")) {
        let text = fs::read_to_string(&path).unwrap();
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if target.starts_with("http") {
                continue;
            }
            let (file, heading) = target.split_once('#').unwrap_or((target, ""));
            let goal = if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            assert!(goal.exists(), "{} links to {target}, which does not exist", path.display());
            let is_there = || headings(&fs::read_to_string(&goal).unwrap()).any(|found| found == heading);
            assert!(
                heading.is_empty() || is_there(),
                "{} links to {target}, which has no such heading",
                path.display()
            );
        }
    }
}
