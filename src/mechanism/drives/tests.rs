//! Laws of drives against finite differences and closed solutions.
