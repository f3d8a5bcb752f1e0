//! Converts messages to hand inputs and button events.

use super::protocol::{Message, palm_input, tips_input};
use super::shared_state::{Action, Teaching};
use super::take_jobs::perform;
use nalgebra::Vector3;
use std::sync::Arc;
use teachtree_world::{FARTHEST_M, HandInput};

/// Applies a message to the hands and buttons; the error says why it is refused.
pub(super) fn handle_message(teaching: &Arc<Teaching>, message: Message) -> Result<(), String> {
    let (hand, epoch, input) = match message {
        Message::Start => {
            teaching.act(Action::Start);
            return Ok(());
        }
        Message::Stop => {
            teaching.act(Action::Stop);
            return Ok(());
        }
        Message::Undo => {
            teaching.act(Action::Undo);
            return Ok(());
        }
        Message::Reset => {
            teaching.act(Action::Reset);
            return Ok(());
        }
        Message::Robot { take } => return perform(teaching, take),
        // Each connection has its own period.
        Message::Forces { .. } => return Ok(()),
        Message::Palm { hand, epoch, palm, closes, squeeze, presses } => {
            (hand, epoch, palm_input(&palm, closes, squeeze, presses))
        }
        Message::Tips { hand, epoch, tips, palm } => (hand, epoch, tips_input(&tips, palm.as_ref())),
    };
    let side = hand.side();
    let Some((at, _, of_scene)) = teaching.options.scene.hands.get_full(&side) else {
        return Err(format!("the scene has no {side} hand"));
    };
    let Some(input) = input else { return Err("expected finite numbers, and a quaternion w x y z".into()) };
    let fingers = of_scene.fingers.len();
    if let HandInput::Tips { tips, .. } = &input
        && tips.len() != fingers
    {
        return Err(format!("expected {fingers} fingertips, found {}", tips.len()));
    }
    let is_far = |place: &Vector3<f64>| place.iter().any(|part| part.abs() > FARTHEST_M);
    let (palm, tips) = match &input {
        HandInput::Palm { palm, .. } => (Some(palm), [].as_slice()),
        HandInput::Tips { palm, tips } => (palm.as_ref(), tips.as_slice()),
    };
    if palm.is_some_and(|palm| is_far(&palm.translation.vector)) || tips.iter().any(|tip| is_far(&tip.coords)) {
        return Err(format!("expected places within {FARTHEST_M} m of the origin, in meters"));
    }
    teaching.set_input(at, epoch, input);
    Ok(())
}
