//! Commands of demonstrations.

#[path = "../../../../measure/examples/recognition/ruleset.rs"]
#[allow(dead_code, reason = "the example uses all of it")]
mod ruleset;

use self::ruleset::RuleSet;
use teachtree_base::scene::Scene;
use teachtree_command::{Commands, TouchForces, commands};
use teachtree_frames as stream;
use teachtree_world as world;
use teachtree_world::Operator;

/// The commands of an operator's demonstration in a shipped scene, before a robot's hand is on them.
pub fn commanded(scene: &str, seed: u64) -> Commands {
    performed(&world::scene(scene).unwrap(), &world::operator(scene).unwrap(), seed)
}

/// The commands of an operator's demonstration in a scene.
pub fn performed(scene: &Scene, operator: &Operator, seed: u64) -> Commands {
    let recording = world::teach(scene, operator, seed).unwrap();
    let file = if recording.scene.hands.len() > 1 { "bimanual.rules" } else { "contact.rules" };
    let analysis = RuleSet::load(file, vec![]).unwrap().over(&recording).unwrap().analysis;
    commands(&stream::trusted(&recording, &[]).unwrap(), &analysis, TouchForces::default(), &scene.name).unwrap()
}
