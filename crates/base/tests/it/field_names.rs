//! The field's names of channels, and how they are shown.

use teachtree_base::error::InputError;
use teachtree_base::field_names::{FieldNames, inside, of_hand};

#[test]
fn channels_and_columns_have_names_inside() {
    for (field, own) in [
        ("right.tcp.position", "right.thumb.position"),
        ("left.tcp.position.z", "left.thumb.position.z"),
        ("right.tcp.rotation.w", "right.palm.rotation.w"),
        ("right.wrist.force", "right.palm.force"),
        ("right.wrist.level", "right.palm.level"),
        ("right.wrist.noise", "right.palm.noise"),
    ] {
        assert_eq!(inside(field), own);
    }
    for own in
        ["right.tcp.force", "right.wrist.torque.x", "tcp.position", "both.tcp.position", "cube.position.x", "right.tcp"]
    {
        assert_eq!(inside(own), own);
    }
    assert_eq!((&*of_hand("wrist.force"), &*of_hand("wrist.torque")), ("palm.force", "wrist.torque"));
}

/// Each hand has the names that its log uses.
#[test]
fn texts_have_the_names_that_the_user_wrote() {
    let mut names = FieldNames::default();
    assert_eq!(names.shown("right.thumb.position"), "right.thumb.position");
    for column in ["right.tcp.position.x", "left.thumb.position.x"] {
        names.take(column);
    }
    assert_eq!(
        names.shown("`right.thumb.position` and right.palm.force.x, left.palm.force"),
        "`right.tcp.position` and right.wrist.force.x, left.palm.force"
    );
    // A hand with names of both kinds keeps both.
    names.take("right.palm.force.x");
    assert_eq!(names.shown("right.thumb.position, right.palm.force"), "right.tcp.position, right.palm.force");
    assert_eq!(
        names.shown("bright.thumb.position right.thumb.positions"),
        "bright.thumb.position right.thumb.positions"
    );
    let error = names.of_error(
        InputError::new("channel right.thumb.position", "the log lacks it").help("bind right.thumb.position"),
    );
    assert_eq!(error.to_string(), "channel right.tcp.position: the log lacks it\n  help: bind right.tcp.position");
}
