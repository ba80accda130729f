//! Scenes as data: what a mechanism is, its file format, and the one table of its parameters.
//!
//! # The file format
//!
//! TOML. A quantity is a text with its unit (`"0.3 mm"`, [`parse_quantity`]); a bare 0 needs none. A vector is
//! `["1 mm", 0, "3 mm"]` or, with one unit for all, `"1 0 3 mm"`. A rotation is one of `{ axis, angle }`,
//! `{ sequence = "xzy", angles }` (R = Rx Rz Ry), `{ x, y }` (the body's x axis, and the side of its y axis) and
//! `{ quaternion = [w, x, y, z] }`.
//!
//! | section | keys |
//! |---|---|
//! | top | `name`, `title`, `description`, `start` (`"as-given"` or `"ideal"`, see [`StartRule`]), `formulation` |
//! | `[gravity]`, `[contact]`, `[solver]` | the rows of the parameter [`table`] |
//! | `[view]` | `down`; `floor`: where the floor lies along `down`; `yaw` and `pitch` of the isometric view |
//! | `[output]` | `body` whose pose is reported (the last one if left out); `probe`: a point in its frame |
//! | `[spcmm]` | rows of the table; `mean_x`, `gamma`, `hinge_radius`, `driving_rod`, `driven_rod` |
//! | `[chain]` | `links`; `hang`: the fixed socket; `rotation` of every link; `[chain.link]`: `ball`, `socket`, `opening`, and a body's keys |
//! | `[[body]]` | `name`, `mass`, `centre`, `inertia` (Ixx, Iyy, Izz about the centroid), `products` (integrals of xy, xz, yz over the mass), `shapes` |
//! | `[[joint]]` | `name`, `kind` (fixed, prismatic, revolute, free), `parent` (the world if left out), `child`, `parent_point`, `child_point`, `axis`, `rotation`, and `drive` or `start` |
//! | drive | `{ law = "constant", position, velocity }`, `{ law = "harmonic", mean, amplitude, frequency, phase }`, `{ law = "spcmm", slider = 1 }` (places the joint itself) |
//! | start | `{ position, velocity }`; of a free joint `{ position, rotation, velocity, angular_velocity }`, where position and velocity are those of `child_point` |
//! | `[[ball_joint]]` | `name`, `socket` and `ball` (`{ body, at }`, body `"world"` allowed), `opening`, and any key of `[contact]` for this joint alone |
//! | `[[fixed_shape]]` | a shape in world axes; `at_slider_plane = true` moves it by a1 along X |
//! | shape | `role`; `form`: capsule, cylinder, cone (`from`, `to`, `radius`), box (`centre`, `size`), sphere (`centre`, `radius`), plate (`corners`, `thickness`) |
//!
//! Bodies may stand in any order. Each is the child of exactly one joint; loops are closed by ball joints.

mod access;
mod chain;
mod check;
mod document;
mod error;
mod load;
mod model;
mod parameters;
mod read;
mod read_bodies;
mod read_joints;
mod table;
#[cfg(test)]
mod tests;
mod units;

pub use error::SceneError;
pub use load::*;
pub use model::*;
pub use parameters::*;
pub use table::table;
pub use units::*;

use table::find;
