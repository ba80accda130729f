//! The rows of a run: which columns a scene has, and one row for each sampled instant. SI units, world axes.

use std::io;

use super::rows::Rows;
use crate::files::Target;
use crate::scene::{JointKind, Scene, Vec3};
use crate::simulate::{ContactState, Frame};

/// Rows of one run, row after row.
#[derive(Debug)]
pub struct Table {
    names: Vec<String>,
    rows: Rows,
    /// The row that is being made.
    values: Vec<f64>,
    probe: bool,
    ledger: bool,
}

/// Why a row is not in the table.
#[derive(Debug, thiserror::Error)]
pub enum NoRow {
    /// A value that is not a number.
    #[error("{column} is {value} at t = {time:.6e} s")]
    NotFinite {
        /// Column.
        column: String,
        /// Value.
        value: f64,
        /// Time of the row, s.
        time: f64,
    },
    /// The disk.
    #[error(transparent)]
    Disk(#[from] io::Error),
}

const POSE: [&str; 10] = [
    "t_s",
    "x_m",
    "y_m",
    "z_m",
    "alpha_rad",
    "beta_rad",
    "gamma_rad",
    "vx_m_s",
    "vy_m_s",
    "vz_m_s",
];
const POSE_RATES: [&str; 6] = [
    "ax_m_s2",
    "ay_m_s2",
    "az_m_s2",
    "alpha_rate_rad_s",
    "beta_rate_rad_s",
    "gamma_rate_rad_s",
];
const JOINT: [&str; 12] = [
    "ex_m",
    "ey_m",
    "ez_m",
    "penetration_m",
    "penetration_rate_m_s",
    "force_x_N",
    "force_y_N",
    "force_z_N",
    "friction_x_N",
    "friction_y_N",
    "friction_z_N",
    "state",
];
const ENERGY: [&str; 3] = ["kinetic_J", "potential_J", "elastic_J"];
const POSE_ANGLE_ACCELERATIONS: [&str; 3] = [
    "alpha_accel_rad_s2",
    "beta_accel_rad_s2",
    "gamma_accel_rad_s2",
];
const LEDGER: [&str; 6] = [
    "drive_work_J",
    "gravity_work_J",
    "restitution_loss_J",
    "friction_loss_J",
    "clearance_work_J",
    "energy_residual_J",
];
/// Added to the ledger where a scene has force elements.
const LEDGER_OF_ELEMENTS: [&str; 2] = ["damping_loss_J", "external_work_J"];
const PROBE: [&str; 3] = ["probe_error_x_m", "probe_error_y_m", "probe_error_z_m"];

impl Table {
    /// An empty table with the columns of `scene`; `first` tells whether it has a probe error and a ledger.
    pub fn new(scene: &Scene, first: &Frame) -> Self {
        let joints = || scene.ball_joints.iter().map(|joint| joint.name.as_str());
        let fixed = |list: &[&str]| list.iter().map(ToString::to_string).collect::<Vec<_>>();
        let mut names = fixed(&POSE);
        names.extend(joints().map(|joint| format!("{joint}_eccentricity_m")));
        names.extend(joints().map(|joint| format!("{joint}_normal_N")));
        names.extend(fixed(&POSE_RATES));
        for joint in joints() {
            names.extend(JOINT.iter().map(|quantity| format!("{joint}_{quantity}")));
        }
        for joint in scene.joints.iter().filter(|joint| joint.drive.is_some()) {
            let unit = if joint.kind == JointKind::Revolute {
                "Nm"
            } else {
                "N"
            };
            names.push(format!("{}_actuator_{unit}", joint.name));
        }
        names.extend(fixed(&ENERGY));
        names.extend(fixed(&POSE_ANGLE_ACCELERATIONS));
        let probe = first.probe_error.is_some();
        if probe {
            names.extend(fixed(&PROBE));
        }
        let ledger = first.ledger.is_some();
        if ledger {
            names.extend(fixed(&LEDGER));
        }
        for (element, report) in scene.elements.iter().zip(&first.elements) {
            let mut column = |quantity: &str, unit: &str| {
                let name = |axis| format!("{}_{quantity}_{axis}_{unit}", element.name);
                names.extend(["x", "y", "z"].map(name));
            };
            column("force", "N");
            if report.torque.is_some() {
                column("torque", "Nm");
            }
        }
        if ledger && !scene.elements.is_empty() {
            names.extend(fixed(&LEDGER_OF_ELEMENTS));
        }
        Self {
            rows: Rows::new(names.len()),
            names,
            values: Vec::new(),
            probe,
            ledger,
        }
    }

    /// A table of other rows than those of a run.
    pub fn of_rows<const N: usize>(names: [&str; N], rows: impl Iterator<Item = [f64; N]>) -> Self {
        let mut table = Self {
            names: names.map(str::to_owned).to_vec(),
            rows: Rows::new(N),
            values: Vec::new(),
            probe: false,
            ledger: false,
        };
        for row in rows {
            // In memory nothing can fail.
            let _ = table.rows.push(&row);
        }
        table
    }

    /// Keeps in memory but the latest rows, and the others beside `target`.
    ///
    /// # Errors
    /// Input/output.
    pub fn spool_beside(&mut self, target: &Target) -> Result<(), crate::files::FileError> {
        self.rows.spool_to(target.spool()?);
        Ok(())
    }

    /// Column names, in order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no row yet.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Calls `each` with every row in order, each as long as [`Self::names`].
    ///
    /// # Errors
    /// The disk; that of `each`.
    pub fn rows(&self, each: impl FnMut(&[f64]) -> io::Result<()>) -> io::Result<()> {
        self.rows.each(each)
    }

    /// Calls `each` with every value of one column, in order of time.
    ///
    /// # Errors
    /// The disk; that of `each`.
    pub fn column(&self, column: usize, each: impl FnMut(f64) -> io::Result<()>) -> io::Result<()> {
        self.rows.column(column, each)
    }

    /// Appends the row of `frame`.
    ///
    /// # Errors
    /// A value that is not finite, but for those of a probe error that is not known; a full disk. The table is then unchanged.
    pub fn push(&mut self, frame: &Frame) -> Result<(), NoRow> {
        self.values.clear();
        self.append(frame);
        let known = frame.probe_error.is_some();
        if let Some(column) = self
            .values
            .iter()
            .zip(&self.names)
            .position(|(value, name)| {
                !value.is_finite() && (known || !PROBE.contains(&name.as_str()))
            })
        {
            return Err(NoRow::NotFinite {
                column: self.names[column].clone(),
                value: self.values[column],
                time: frame.time,
            });
        }
        Ok(self.rows.push(&self.values)?)
    }

    /// In the order of the names made in [`Self::new`].
    fn append(&mut self, frame: &Frame) {
        let values = &mut self.values;
        let pose = &frame.pose;
        values.push(frame.time);
        values.extend(pose.position.iter());
        values.extend(pose.angles.iter());
        values.extend(pose.velocity.iter());
        values.extend(frame.joints.iter().map(|joint| joint.eccentricity.norm()));
        values.extend(frame.joints.iter().map(|joint| joint.normal_force.norm()));
        values.extend(pose.acceleration.iter());
        values.extend(pose.angle_rates.iter());
        for joint in &frame.joints {
            values.extend(joint.eccentricity.iter());
            values.extend([joint.penetration, joint.penetration_rate]);
            values.extend((joint.normal_force + joint.friction_force).iter());
            values.extend(joint.friction_force.iter());
            values.push(state_code(joint.state));
        }
        values.extend(&frame.actuators);
        values.extend([frame.kinetic, frame.potential, frame.elastic]);
        values.extend(pose.angle_accelerations.iter());
        if self.probe {
            // Where the ideal mechanism came to its end there is nothing to compare with.
            let unknown = Vec3::repeat(f64::NAN);
            values.extend(frame.probe_error.unwrap_or(unknown).iter());
        }
        if self.ledger {
            let ledger = frame.ledger.unwrap_or_default();
            values.extend([
                ledger.drive_work,
                ledger.gravity_work,
                ledger.restitution_loss,
                ledger.friction_loss,
                ledger.clearance_work,
                ledger.residual(),
            ]);
        }
        for element in &frame.elements {
            values.extend(element.force.iter());
            values.extend(element.torque.iter().flat_map(|torque| torque.iter()));
        }
        if let Some(ledger) = frame
            .ledger
            .filter(|_| self.ledger && !frame.elements.is_empty())
        {
            values.extend([ledger.damping_loss, ledger.external_work]);
        }
    }
}

/// Number that stands for a contact state in the `…_state` columns.
fn state_code(state: ContactState) -> f64 {
    match state {
        ContactState::Free => 0.0,
        ContactState::Stick => 1.0,
        ContactState::Slip => 2.0,
        ContactState::Ideal => 3.0,
    }
}
