//! The physics of Jointplay: machines, their equations of motion, and running simulations. No screen, clock, thread or file.
//!
//! Modules from the bottom up; each uses only those before it (`ARCHITECTURE.md`): [`words`], [`suggest`], [`units`] and [`jet`],
//! [`expression`], [`contact`], [`integrate`] and [`interpolate`], [`machine`], [`mechanism`], [`simulate`].
//!
//! A machine is plain data, read from a scene file (`jointplay-scene`) or built in code. This example drops a ball that hangs in
//! its socket with 0.2 mm of play:
//!
//! ```
//! use jointplay_physics::machine::{
//!     Attachment, LooseJoint, Body, Joint, JointKind, JointStart, Machine, Mat3, Vec3,
//! };
//! use jointplay_physics::simulate::{Frame, Simulation};
//!
//! let mut machine = Machine { gravity: Vec3::new(0.0, 0.0, -9.81), ..Machine::default() };
//! let bob = machine.add_body(Body::new("bob", 0.4, Mat3::identity() * 1e-3), Joint::free(0));
//! let joint = LooseJoint::ball("S1", Attachment::world(Vec3::zeros()), Attachment::on(bob, Vec3::zeros()));
//! machine.loose_joints.push(joint.with_clearance(0.2e-3));
//!
//! let mut simulation = Simulation::new(&machine)?;
//! simulation.advance_to(0.1)?;
//! let mut frame = Frame::default();
//! simulation.sample_now(&mut frame);
//! // It has fallen through the play, struck the wall, and bounces there.
//! assert!(frame.bodies[0].position.norm() < 0.21e-3);
//! assert!(simulation.statistics().joints[0].impacts > 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`Simulation`](simulate::Simulation) is a constant [`Model`](simulate::Model), a [`State`](simulate::State) with all that
//! changes, and a [`Workspace`](simulate::Workspace); several states of one model can be stepped side by side.
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::disallowed_types))]

pub mod contact;
pub mod expression;
pub mod integrate;
pub mod interpolate;
pub mod jet;
pub mod machine;
pub mod mechanism;
pub mod simulate;
pub mod suggest;
pub mod units;
pub mod words;
