//! One-at-a-time runs: the effect of each parameter alone.

use super::StudyError;
use super::inputs::{check_count, check_end, real_parameter};
use jointplay_scene::Scene;

/// Plan of the one-at-a-time runs: each parameter at a lower and at an upper end, with all others at their values in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct OneAtATimePlan {
    nominal: Vec<f64>,
    ends: Vec<[f64; 2]>,
}

impl OneAtATimePlan {
    /// A plan for parameters of `scene`, given by key with lower and upper end, SI.
    ///
    /// # Errors
    /// With the key: no such real parameter, an end that the parameter does not accept, or a lower end above the upper one. More
    /// than 64 parameters.
    pub fn new(scene: &Scene, ranges: &[(String, [f64; 2])]) -> Result<Self, StudyError> {
        check_count(ranges.len())?;
        let nominal = ranges.iter().map(|(key, [low, high])| {
            let checked = || {
                let (parameter, nominal) = real_parameter(scene, key)?;
                check_end(parameter, *low)?;
                check_end(parameter, *high)?;
                if low > high { Err(StudyError::Order) } else { Ok(nominal) }
            };
            checked().map_err(|error: StudyError| error.at(key))
        });
        Ok(Self { nominal: nominal.collect::<Result<_, _>>()?, ends: ranges.iter().map(|(_, ends)| *ends).collect() })
    }

    /// Value of each parameter in the scene, SI.
    pub fn nominal(&self) -> &[f64] {
        &self.nominal
    }

    /// Values of all parameters in each run, SI. The first run has the values of the scene; two runs for each parameter follow,
    /// at its lower and at its upper end.
    pub fn rows(&self) -> Vec<Vec<f64>> {
        let mut rows = vec![self.nominal.clone()];
        for (i, ends) in self.ends.iter().enumerate() {
            for end in ends {
                let mut row = self.nominal.clone();
                row[i] = *end;
                rows.push(row);
            }
        }
        rows
    }
}
