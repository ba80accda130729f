//! The page that the window's links open.

use super::Failure;

/// Environment variable with the address that links are appended to.
const PAGE: &str = "JOINTPLAY_PAGE";

/// The address that links are appended to, from `--page` or else from [`PAGE`]; "" for none.
///
/// # Errors
/// Usage: it is not the address of a page.
pub fn address(option: Option<&str>) -> Result<String, Failure> {
    choose(option, std::env::var(PAGE).ok())
}

fn choose(option: Option<&str>, variable: Option<String>) -> Result<String, Failure> {
    let (name, page) = match (option, variable) {
        (Some(page), _) => ("--page", page.to_owned()),
        (None, Some(page)) => (PAGE, page),
        (None, None) => return Ok(String::new()),
    };
    let page = page.trim();
    let is_address = ["https://", "http://"].iter().any(|scheme| {
        page.strip_prefix(scheme)
            .is_some_and(|rest| !rest.is_empty() && !rest.contains(|c: char| c == '#' || c.is_whitespace()))
    });
    if page.is_empty() || is_address {
        return Ok(page.to_owned());
    }
    Err(Failure::usage(format!(
        "{name} {page}: not an address of a page; expected one that begins with https:// or http:// and has no `#`, e.g. \
         https://example.org/lab/"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_option_beats_the_variable_and_what_is_no_address_is_refused() {
        let (lab, other) = ("https://example.org/lab/", "http://localhost:8000");
        let of = |option, variable: Option<&str>| choose(option, variable.map(str::to_owned));
        assert_eq!(of(None, None).expect("none"), "");
        assert_eq!(of(None, Some(other)).expect("an address"), other);
        assert_eq!(of(Some(lab), Some("nonsense")).expect("an address"), lab);
        for bad in ["example.org/lab", "https://", "https://a.b/#x", "https://a b/"] {
            let error = of(None, Some(bad)).expect_err("no address");
            assert_eq!(error.code, Failure::USAGE);
            assert!(error.to_string().contains(&format!("{PAGE} {bad}: ")), "{error}");
        }
    }
}
