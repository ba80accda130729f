//! Pulling a body: press and drag attach a spring from the pressed point to the pointer.

use glam::{Vec2, Vec3};

use super::player::Player;
use crate::machine::Vec3 as Exact;
use crate::simulate::Pull;
use crate::view::{Camera, Hit, ScenePart};

/// A grip of the pointer on a body.
#[derive(Clone, Copy, Debug)]
pub struct Grip {
    pull: Pull,
    /// Position of the pointer end of the spring, m.
    hand: Vec3,
}

impl Grip {
    /// Grips the body at `hit`; `None` if it cannot move.
    pub fn new(player: &Player, hit: Hit) -> Option<Self> {
        let scene = player.running();
        let body = match hit.what {
            ScenePart::Body(body) => body,
            ScenePart::Joint(joint) => scene.machine.loose_joints.get(joint)?.carried().body?,
            ScenePart::Fixed(_) => return None,
        };
        let motion = player.frame().bodies.get(body)?;
        let point = Exact::from(hit.point.to_array().map(f64::from));
        let inside = motion.rotation.tr_mul(&(point - motion.position));
        Some(Self { pull: Pull::with_soft_spring(&scene.machine, body, inside, point), hand: hit.point })
    }

    /// Moves the hand to `pixel`: parallel to the picture plane or, with `depth`, along the line of sight (up is away).
    pub fn drag(&mut self, camera: &Camera, pixel: Vec2, moved: Vec2, size: [u32; 2], depth: bool) {
        let (eye, ray) = camera.ray(pixel, size);
        let (_, _, back) = camera.axes();
        let distance = -(self.hand - eye).dot(back);
        if depth {
            self.hand += back * (moved.y / size[1] as f32 * 2.0 * distance);
        } else {
            let along = -ray.dot(back);
            if along > 0.0 {
                self.hand = eye + ray * (distance / along);
            }
        }
    }

    /// The pull as input to the run.
    pub fn pull(&self) -> Pull {
        Pull { hand: Exact::from(self.hand.to_array().map(f64::from)), ..self.pull }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::view::{SceneView, to_f32};

    #[test]
    fn a_gripped_body_follows_the_hand_and_only_bodies_can_be_gripped() {
        let scene = Scene::load("pendulum", &[]).expect("built in");
        let mut player = Player::new(&scene).expect("starts");
        let place = player.frame().bodies[0].position;
        let point = to_f32(&place);
        let hit = |what| Hit { what, point };
        assert!(Grip::new(&player, hit(ScenePart::Fixed(0))).is_none());
        let mut grip = Grip::new(&player, hit(ScenePart::Body(0))).expect("moves");
        // Length of the spring, m.
        let stretch = |grip: &Grip, player: &Player| {
            let motion = &player.frame().bodies[grip.pull.body];
            let point = motion.position + motion.rotation * grip.pull.point;
            grip.hand.distance(to_f32(&point))
        };
        assert!(stretch(&grip, &player) < 1e-6);
        let view = SceneView::new(player.running(), player.frame());
        let camera = view.camera();
        let size = [800, 600];
        let pixel = camera.project(grip.hand, size).expect("seen");
        let displaced = pixel + Vec2::new(120.0, 0.0);
        grip.drag(&camera, displaced, Vec2::ZERO, size, false);
        let projected = camera.project(grip.hand, size).expect("seen");
        assert!(projected.distance(displaced) < 0.1, "the hand is under the pointer");
        let (_, _, back) = camera.axes();
        assert!((grip.hand - to_f32(&place)).dot(back).abs() < 1e-5, "no depth");
        let before = grip.hand;
        grip.drag(&camera, displaced, Vec2::new(0.0, -30.0), size, true);
        let moved = grip.hand - before;
        assert!(moved.dot(back) < 0.0 && moved.cross(back).length() < 1e-6);

        // The spring force acts on the body, and its work appears in the energy balance.
        player.pull(Some(grip.pull())).expect("in reach");
        let pulled = player.frame().pull.expect("pulls");
        let expected = f64::from(stretch(&grip, &player)) * grip.pull.stiffness;
        let speed = player.frame().bodies[0].velocity.norm();
        assert!((pulled.force.norm() - expected).abs() <= 1e-5 * expected + grip.pull.damping * speed);
        player.run_to(0.4);
        let ledger = player.frame().ledger.expect("kept");
        assert!(ledger.external_work.abs() > 1e-3, "{ledger:?}");
        assert!(ledger.residual().abs() < 1e-3 * ledger.external_work.abs(), "{ledger:?}");
        player.pull(None).expect("lets go");
        let work = |player: &Player| player.frame().ledger.expect("kept").external_work;
        // The pull also acts in the rest of the displayed step.
        player.run_to(0.41);
        let pulled = work(&player);
        player.run_to(0.5);
        assert!(player.frame().pull.is_none());
        assert!((work(&player) - pulled).abs() < 1e-9 * pulled.abs());
    }
}
