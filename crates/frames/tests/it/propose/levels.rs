//! Proposed levels and signs of forces at wrists: what a hand without a gripper pushes shows them.

use super::{Column, binding, channel, placed, still};

/// The tool reaches a block at 0.3 of the log, pushes it until 0.7, and goes back.
fn tool(passed: f64) -> f64 {
    match passed {
        passed if passed < 0.3 => 0.1 + passed,
        passed if passed < 0.4 => 0.4,
        passed if passed < 0.7 => 0.4 + 0.5 * (passed - 0.4),
        _ => 0.55 - 1.5 * (passed - 0.7),
    }
}

fn block(passed: f64) -> f64 {
    0.46 + 0.5 * (passed.min(0.7) - 0.4).max(0.0)
}

/// What scatters by 0.1 N.
fn scatter(passed: f64) -> f64 {
    0.1 * (9e4 * passed).sin()
}

/// The force on a block that is pushed with 2.5 N.
fn pushes(passed: f64) -> f64 {
    scatter(passed) + if (0.32..0.72).contains(&passed) { 2.5 } else { 0.0 }
}

fn binding_with(force: fn(f64) -> f64, block: fn(f64) -> f64) -> String {
    let columns: [Column; 9] = [
        ("tcp_x", tool),
        ("tcp_y", still),
        ("tcp_z", |_| 0.03),
        ("ft_fx", force),
        ("ft_fy", scatter),
        ("ft_fz", scatter),
        ("block_x", block),
        ("block_y", still),
        ("block_z", |_| 0.03),
    ];
    placed(&columns).binding
}

fn level_n(binding: &str) -> Option<f64> {
    let line = binding.lines().find_map(|line| line.trim().strip_prefix("right.wrist.level: "))?;
    line.trim_start_matches('"').strip_prefix("= ")?.split(' ').next()?.parse().ok()
}

#[test]
fn a_pushed_object_shows_the_force_of_contact() {
    let binding = binding_with(pushes, block);
    assert!(level_n(&binding).is_some_and(|level| (0.2..2.0).contains(&level)), "{binding}");
    assert!(binding.contains("block moves only while the force is above it"), "{binding}");
}

#[test]
fn a_force_without_a_pushed_object_shows_no_level() {
    let binding = binding_with(pushes, |_| 0.46);
    assert_eq!(level_n(&binding), None, "{binding}");
}

#[test]
fn a_force_that_is_there_while_the_hand_moves_alone_shows_no_level() {
    // The load of a tool while the hand goes back.
    let binding = binding_with(|passed| scatter(passed) + if passed > 0.32 { 2.5 } else { 0.0 }, block);
    assert_eq!(level_n(&binding), None, "{binding}");
}

/// The hand comes from above, so that its motion before the contact is not that of the push.
fn pushed_from_above(force: fn(f64) -> f64, gripper: Option<Column<'static>>) -> String {
    let mut columns: Vec<Column> = vec![
        ("tcp_x", |passed| tool(passed.max(0.3))),
        ("tcp_y", still),
        ("tcp_z", |passed| 0.03 + 0.9 * (0.35 - passed).max(0.0)),
        ("ft_fx", force),
        ("ft_fy", scatter),
        ("ft_fz", scatter),
        ("block_x", block),
        ("block_y", still),
        ("block_z", |_| 0.03),
    ];
    columns.extend(gripper);
    binding(&columns)
}

#[test]
fn a_push_shows_the_sign_of_the_force() {
    let on_hand = pushed_from_above(|passed| -pushes(passed), None);
    assert_eq!(channel(&on_hand, "right.wrist.force"), Some("\"-ft_f<xyz>\""), "{on_hand}");
    assert!(on_hand.contains("the force on the hand: the hand pushes block, which moves against it"), "{on_hand}");
    let on_object = pushed_from_above(pushes, None);
    assert_eq!(channel(&on_object, "right.wrist.force"), Some("ft_f<xyz>"), "{on_object}");
    assert!(on_object.contains("on the object: the hand pushes block, which moves along it"), "{on_object}");
    // A gripper that is closed on the block may also pull it.
    let width: Column = ("gripper_width", |passed| if (0.35..0.75).contains(&passed) { 0.04 } else { 0.08 });
    let held = pushed_from_above(|passed| -pushes(passed), Some(width));
    assert!(held.contains("nothing in the log shows the sign"), "{held}");
}
