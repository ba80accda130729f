//! Spring and damper on a slide or hinge. The force or torque on the child is -(elastic(s) + damping(ds/dt)), where s is the joint's
//! coordinate measured from `position`, each a line or a curve.

use super::Edges;
use super::characteristic::SpringDamper;
use super::coordinate::{CoordinateLaw, Slopes};
use crate::jet::Jet;
use crate::machine::{self, SpringSide};
use crate::mechanism::Powers;

pub(super) struct JointSpring {
    position: f64,
    law: SpringDamper,
}

impl JointSpring {
    pub fn new(spring: &machine::JointSpring) -> Self {
        let law = SpringDamper::new(&spring.elastic, &spring.damping, SpringSide::Both);
        Self { position: spring.position, law }
    }
}

impl CoordinateLaw for JointSpring {
    fn target(&self, _: f64) -> Jet {
        Jet::constant(self.position)
    }

    fn force(&self, deviation: [f64; 2]) -> f64 {
        let [elastic, damping] = self.law.at(deviation);
        -(elastic.value + damping.value)
    }

    fn slopes(&self, deviation: [f64; 2]) -> Option<Slopes> {
        let [by_position, by_rate] = self.law.at(deviation).map(|force| -force.rate);
        Some(Slopes { by_position, by_rate })
    }

    fn stored(&self, stretch: f64) -> f64 {
        self.law.stored(stretch)
    }

    fn add_powers(&self, deviation: [f64; 2], rate: f64, powers: &mut Powers) {
        powers.damping += self.law.at(deviation)[1].value * rate;
    }

    fn edges(&self, deviation: impl FnOnce() -> [f64; 2]) -> Edges {
        if !self.law.has_kinks() {
            return Edges::default();
        }
        let [of_elastic, of_damping] = self.law.edges(deviation());
        [None, None, of_elastic, of_damping]
    }

    fn freeze(&mut self, [_, _, of_elastic, of_damping]: Edges) {
        self.law.freeze([of_elastic, of_damping]);
    }
}
