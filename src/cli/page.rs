//! Address of the page that share links open.

use super::Failure;
use crate::app::{NOT_A_PAGE_ADDRESS, is_page_address};

/// Environment variable with the address that links are appended to, read at start-up or else at build time.
const PAGE: &str = "JOINTPLAY_PAGE";
/// Its value at build time.
const BUILD_TIME_PAGE: Option<&str> = option_env!("JOINTPLAY_PAGE");

/// The address that links are appended to, from `--page` or else from [`PAGE`]; "" for none.
///
/// # Errors
/// Usage: it is not the address of a page.
pub fn address(option: Option<&str>) -> Result<String, Failure> {
    choose(option, std::env::var(PAGE).ok(), BUILD_TIME_PAGE)
}

fn choose(option: Option<&str>, variable: Option<String>, built: Option<&str>) -> Result<String, Failure> {
    let (name, page) = match (option, variable, built) {
        (Some(page), ..) => ("--page", page.to_owned()),
        (None, Some(page), _) => (PAGE, page),
        (None, None, Some(page)) => ("JOINTPLAY_PAGE of the build", page.to_owned()),
        (None, None, None) => return Ok(String::new()),
    };
    let page = page.trim();
    if page.is_empty() || is_page_address(page) {
        return Ok(page.to_owned());
    }
    Err(Failure::usage(format!("{name} {page}: {NOT_A_PAGE_ADDRESS}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_option_overrides_the_variable_and_invalid_addresses_are_refused() {
        let (lab, other) = ("https://example.org/lab/", "http://localhost:8000");
        let of = |option, variable: Option<&str>| choose(option, variable.map(str::to_owned), None);
        assert_eq!(of(None, None).expect("none"), "");
        assert_eq!(of(None, Some(other)).expect("an address"), other);
        assert_eq!(of(Some(lab), Some("nonsense")).expect("an address"), lab);
        let built = |option, variable: Option<&str>| choose(option, variable.map(str::to_owned), Some(lab));
        assert_eq!(built(None, None).expect("an address"), lab);
        assert_eq!(built(None, Some(other)).expect("an address"), other);
        assert_eq!(built(None, Some("")).expect("none"), "");
        let error = choose(None, None, Some("lab")).expect_err("no address").to_string();
        assert!(error.contains("JOINTPLAY_PAGE of the build lab: not an address"), "{error}");
        for bad in ["example.org/lab", "https://", "https://a.b/#x", "https://a b/"] {
            let error = of(None, Some(bad)).expect_err("no address");
            assert_eq!(error.code, Failure::USAGE);
            assert!(error.to_string().contains(&format!("{PAGE} {bad}: ")), "{error}");
        }
    }
}
