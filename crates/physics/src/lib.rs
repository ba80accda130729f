//! The physics of Jointplay: what a scene is, its equations of motion, and a running simulation of it. No screen, clock or thread.
//!
//! Modules from the bottom up; each uses only those before it (`ARCHITECTURE.md`): [`words`], [`jet`] and [`mesh`], [`contact`] and
//! [`integrate`], [`scene`], [`mechanism`], [`simulate`].

pub mod contact;
pub mod expression;
pub mod integrate;
pub mod jet;
pub mod machine;
pub mod mechanism;
pub mod mesh;
pub mod scene;
pub mod simulate;
pub mod suggest;
pub mod units;
pub mod words;
