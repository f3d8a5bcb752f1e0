//! Names of the channels of a log: read, printed, refused.

use teachtree_base::channels::Shape;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{BodyPart, FingerPart, LogChannel, columns};
use teachtree_base::units::Dimension;
use teachtree_logs::names;

const CHANNELS: [(&str, Shape, Dimension); 18] = [
    ("right.thumb.position", Shape::Vec3, Dimension::LENGTH),
    ("left.palm.force", Shape::Vec3, Dimension::FORCE),
    ("left.little.noise", Shape::Scalar, Dimension::FORCE),
    ("left.ring.level", Shape::Scalar, Dimension::FORCE),
    ("right.index.contact", Shape::Bool, Dimension::NONE),
    ("right.index.contact.cube", Shape::Bool, Dimension::NONE),
    ("right.palm.rotation", Shape::Rotation, Dimension::NONE),
    ("right.gripper.closed", Shape::Bool, Dimension::NONE),
    ("right.gripper.opening", Shape::Scalar, Dimension::LENGTH),
    ("right.wrist.torque", Shape::Vec3, Dimension::TORQUE),
    ("cube.rotation", Shape::Rotation, Dimension::NONE),
    ("cube.velocity", Shape::Vec3, Dimension::SPEED),
    ("cube.angular_velocity", Shape::Vec3, Dimension::ANGULAR_SPEED),
    ("peg.depth.hole", Shape::Scalar, Dimension::LENGTH),
    ("valve.angle.bearing", Shape::Scalar, Dimension::ANGLE),
    ("contact.cube.wall", Shape::Bool, Dimension::NONE),
    ("contact.cube.wall.force", Shape::Vec3, Dimension::FORCE),
    ("contact.cube.wall.normal", Shape::Vec3, Dimension::NONE),
];

#[test]
fn a_name_is_printed_as_it_was_read() {
    for (name, shape, dimension) in CHANNELS {
        let channel = LogChannel::parse(name).unwrap_or_else(|| panic!("{name} is not read"));
        assert_eq!((channel.to_string().as_str(), channel.shape(), channel.dimension()), (name, shape, dimension));
        for (at, column) in channel.columns().iter().enumerate() {
            let meaning = names::meaning(column).unwrap_or_else(|| panic!("{column} is not read"));
            let found = (meaning.channel, meaning.component, meaning.shape, meaning.dimension, meaning.bodies);
            assert_eq!(found, (name, at, shape, dimension, channel.bodies()));
        }
    }
}

#[test]
fn the_names_of_the_field_mean_the_same() {
    let tip = LogChannel::Finger(Side::Right, Finger::Thumb, FingerPart::Position);
    let wrist = |part| LogChannel::Finger(Side::Left, Finger::Palm, part);
    for (name, channel) in [
        ("right.tcp.position", tip),
        ("right.tcp.rotation", LogChannel::PalmRotation(Side::Right)),
        ("left.wrist.force", wrist(FingerPart::Force)),
        ("left.wrist.level", wrist(FingerPart::Level)),
        ("left.wrist.noise", wrist(FingerPart::Noise)),
    ] {
        assert_eq!(LogChannel::parse(name), Some(channel));
    }
    for name in ["right.tcp.force", "right.tcp.contact", "right.wrist.position", "right.wrist.rotation", "cube.torque"]
    {
        assert_eq!(LogChannel::parse(name), None, "{name}");
    }
}

#[test]
fn other_names_are_not_channels() {
    let wrong = [
        "",
        "cube",
        ".position",
        "cube.",
        "cube.colour",
        "right.position",
        "right.thunb.force",
        "right.thumb.velocity",
        "both.position",
        "time.position",
        "contact.cube",
        "contact.cube.wall.torque",
        "right.thumb.force.cube",
    ];
    for name in wrong {
        assert_eq!(LogChannel::parse(name), None, "{name}");
    }
    // A channel of several columns is none of them, and a column of one has no component.
    assert_eq!(names::meaning("cube.position"), None);
    assert_eq!(names::meaning("right.gripper.closed.x"), None);
}

#[test]
fn columns_are_listed_in_order() {
    let tip = LogChannel::Finger(Side::Right, Finger::Thumb, FingerPart::Contact);
    let listed = columns(&[tip, LogChannel::Body("cube", BodyPart::Rotation)]);
    let names: Vec<&str> = listed.iter().map(|(name, _)| name.as_str()).collect();
    let rotation = ["cube.rotation.w", "cube.rotation.x", "cube.rotation.y", "cube.rotation.z"];
    assert_eq!(names, [&["right.thumb.contact"][..], &rotation].concat());
}
