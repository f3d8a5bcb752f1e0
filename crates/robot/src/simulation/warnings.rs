//! Warnings about collisions of a simulated robot. The simulation does not prevent them.

use super::observers::arm_clearance::{Collision, MinDistances};

/// A motion that a real robot cannot perform.
pub struct Warning {
    /// The first time, s of the robot's recording.
    pub time_s: f64,
    /// The kind of the warning.
    pub kind: &'static str,
    /// The link concerned.
    pub link: String,
    /// The message.
    pub message: String,
}

/// Returns the warnings about colliding arms and about collisions of links.
pub fn warnings(nearest: &MinDistances, collisions: &[Collision]) -> Vec<Warning> {
    let passed = nearest.arms.as_ref().filter(|nearest| nearest.passes_through()).map(|nearest| {
        let (deep, time_s, [one, other]) = (nearest.depth_m() * 1e3, nearest.time_s, &nearest.links);
        let what = "collisions do not stop simulated arms, and they go through each other";
        let message = format!("{what}: `{one}` and `{other}` by {deep:.1} mm, deepest after {time_s:.1} s");
        Warning { time_s, kind: "arms_meet", link: one.clone(), message }
    });
    let through = collisions.iter().map(|Collision { link, with, time_s, depth_m, lasts_s }| {
        let what = "collisions do not stop simulated links, and one goes through a shape";
        let how = format!("by {:.1} mm and for {lasts_s:.2} s, first after {time_s:.1} s", depth_m * 1e3);
        let message = format!("{what}: `{link}` through `{with}` {how}");
        Warning { time_s: *time_s, kind: "goes_through", link: link.clone(), message }
    });
    passed.into_iter().chain(through).collect()
}
