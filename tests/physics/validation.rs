//! Validation cases with known reference results, and their page.

use jointplay::cli::validate::page;

/// All cases together take about a second.
#[test]
fn every_case_is_within_its_bound_and_the_page_is_current() {
    let (page, missed) = page().unwrap();
    assert!(missed.is_empty(), "not within their bounds: {missed:#?}");
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/validation.md");
    let stored = std::fs::read_to_string(path).unwrap_or_default();
    assert!(stored == page, "docs/validation.md is out of date: jointplay validate --out docs/validation.md --force");
}
