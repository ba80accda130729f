//! Equations of motion of a scene.
