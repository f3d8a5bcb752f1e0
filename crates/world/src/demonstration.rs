//! Demonstrations: an operator acts in the world, and its measurements are recorded at 1 kHz.
//!
//! INVARIANT (same seed, same bytes): everything is drawn from the seed in a fixed order. Labels and events come from the world without noise.

use super::operator::{Operator, PartnerHand, Performer, cuts, obstacles};
use super::recorder::Recorder;
use super::simulation::{Fingertips, HandTarget, World};
use super::truth::TruthOptions;
use nalgebra::Vector3;
use teachtree_base::error::InputError;
use teachtree_base::recording::{Event, Recording};
use teachtree_base::scene::Scene;

/// The scene comes to rest for this many steps before the recording begins.
pub(super) const SETTLING: usize = 300;
/// Maximum duration of a demonstration, in steps of 1 ms.
const MAX_STEPS: usize = 600_000;

/// Lets an operator demonstrate in a scene; the same seed gives the same recording.
///
/// # Errors
/// A scene that cannot be simulated, or a script that names what the scene does not have.
pub fn teach(scene: &Scene, operator: &Operator, seed: u64) -> Result<Recording, InputError> {
    teach_with_progress(scene, operator, seed, &mut |_| ())
}

/// Like [`teach`]; `progress` periodically receives the finished share of the script, 0 to 1.
///
/// # Errors
/// As [`teach`].
pub fn teach_with_progress(
    scene: &Scene,
    operator: &Operator,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<Recording, InputError> {
    let mut world = World::new(scene, Fingertips::default().scaled(operator.force_scale))?;
    let mut performers = Vec::new();
    for (&side, script) in &operator.hands {
        performers.push(Performer::new(scene, operator, side, script, &world, seed)?);
    }
    if let Some(side) = scene.hands.keys().find(|side| !operator.hands.contains_key(*side)) {
        return Err(InputError::new(
            format!("operator `{}`", operator.name),
            format!("has no script for the {side} hand of the scene"),
        ));
    }
    performers.sort_by_key(Performer::index);
    let targets = |performers: &[Performer<'_>]| performers.iter().map(Performer::target).collect::<Vec<HandTarget>>();
    let all: usize = performers.iter().map(Performer::remaining).sum();

    let still = targets(&performers);
    for _ in 0..SETTLING {
        world.step(&still);
    }
    let mut recorder =
        Recorder::new(scene, world.observation(), &operator.measured, &operator.variation.force_noise, seed);
    let mut events = Vec::new();
    let mut phases = Vec::new();
    let stand = |performers: &[Performer<'_>]| performers.iter().map(Performer::stands_at).collect::<Vec<_>>();
    let mut were = stand(&performers);
    loop {
        recorder.record(world.observation());
        let mut over = true;
        let are = stand(&performers);
        let shifts: Vec<Vector3<f64>> = are.iter().zip(&were).map(|(is, was)| is - was).collect();
        were = are;
        for (hand, performer) in performers.iter_mut().enumerate() {
            let shift = shifts.iter().enumerate().find(|(other, _)| *other != hand);
            let other = PartnerHand { begun: &phases, shift: shift.map_or_else(Vector3::zeros, |(_, shift)| *shift) };
            if let Some(begun) = performer.advance(&world, &other)? {
                over = false;
                let mut happened = |kind: &str, what: Vec<String>| {
                    let subjects = std::iter::once(performer.side().to_string()).chain(what).collect();
                    events.push(Event { time_s: recorder.time(), kind: kind.into(), subjects });
                };
                if begun.lost {
                    happened("object_lost", Vec::new());
                }
                if let Some(step) = begun.left_undone {
                    happened("step_left_undone", vec![format!("steps.{step}")]);
                }
                if let Some((step, body)) = begun.unmet {
                    happened("contact_not_met", vec![format!("steps.{step}"), body]);
                }
                if let Some(failure) = begun.failure {
                    happened("failure_started", vec![failure.name().to_string()]);
                }
                if let Some(perturbation) = begun.perturbation {
                    happened("perturbation_started", vec![perturbation.name().to_string()]);
                }
                if let Some(phase) = begun.phase {
                    phases.push((performer.side(), phase.clone()));
                    happened("phase_started", vec![phase]);
                }
            }
        }
        if over {
            break;
        }
        if recorder.moments.len() >= MAX_STEPS {
            let place = format!("operator `{}`", operator.name);
            return Err(InputError::new(
                place,
                format!("is not done after {} s, the longest demonstration", MAX_STEPS / 1000),
            ));
        }
        if recorder.moments.len().is_multiple_of(500) {
            let left: usize = performers.iter().map(Performer::remaining).sum();
            progress(1.0 - left as f64 / all.max(1) as f64);
        }
        world.step(&targets(&performers));
    }
    progress(1.0);
    let obstacles = operator.failures.as_ref().map(|_| obstacles(scene, operator));
    let options = TruthOptions { force_scale: operator.force_scale, obstacles };
    Ok(recorder.finish(scene, events, cuts(operator, seed), &options))
}
