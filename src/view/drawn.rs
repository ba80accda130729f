//! Where each drawn thing stands.
