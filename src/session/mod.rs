//! An interactive run: played, rewound, recorded and changed, with companion runs. Independent of any window.

pub mod advice;
pub mod clock;
mod companion;
pub mod embedded;
pub mod expected;
pub mod friction;
pub mod goal;
pub mod history;
pub mod ideal;
pub mod link;
pub mod load;
pub mod log;
pub mod pace;
pub mod paths;
pub mod player;
pub mod replay;
mod settled;
pub mod twin;
pub mod value;
pub mod watch;
mod worn;
