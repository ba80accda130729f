//! A run as a person handles it: played, taken back, recorded, changed, with companions beside it. Nothing of a window.

pub mod clock;
pub mod embedded;
pub mod ideal;
pub mod link;
pub mod load;
pub mod log;
pub mod paths;
pub mod player;
pub mod replay;
mod settled;
pub mod twin;
pub mod value;
pub mod watch;
