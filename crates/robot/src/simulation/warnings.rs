//! What a simulated robot went through, in words: nothing keeps it from that.

use super::observers::arm_clearance::{Collision, MinDistance};

/// Something that a real robot could not do.
pub struct Warning {
    /// When first, s of the robot's recording.
    pub time_s: f64,
    /// The kind.
    pub kind: &'static str,
    /// The link that it is about.
    pub link: String,
    /// What it was, in a sentence.
    pub message: String,
}

/// The warnings about arms that went through each other, and about what links went through.
pub fn warnings(nearest: Option<&MinDistance>, collisions: &[Collision]) -> Vec<Warning> {
    let passed = nearest.filter(|nearest| nearest.passes_through()).map(|nearest| {
        let (deep, time_s, [one, other]) = (nearest.depth_m() * 1e3, nearest.time_s, &nearest.links);
        let what = "nothing keeps the simulated arms apart, and they go through each other";
        let message = format!("{what}: `{one}` and `{other}` by {deep:.1} mm, deepest after {time_s:.1} s");
        Warning { time_s, kind: "arms_meet", link: one.clone(), message }
    });
    let through = collisions.iter().map(|Collision { link, with, time_s, depth_m, lasts_s }| {
        let what = "nothing stops simulated links, and one goes through something";
        let how = format!("by {:.1} mm and for {lasts_s:.2} s, first after {time_s:.1} s", depth_m * 1e3);
        let message = format!("{what}: `{link}` through `{with}` {how}");
        Warning { time_s: *time_s, kind: "goes_through", link: link.clone(), message }
    });
    passed.into_iter().chain(through).collect()
}
