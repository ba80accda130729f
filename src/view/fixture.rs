//! Hand-built scenes for tests of view and render.
