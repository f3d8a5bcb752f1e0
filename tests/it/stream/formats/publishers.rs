//! Several publishers on one topic: what each of them sends, and what is said of it.

use crate::program::{all_said, complained, teachtree_in};
use crate::shared::bags::{JOINT_STATE, TRANSFORMS, Topic, joint_state, transforms, write};
use crate::shared::files::{SCENE, bound, values};
use teachtree_base::recording::Recording;
use teachtree_logs::issue::Issue;

/// Returns a topic with transforms, each with its stamp in half seconds.
fn poses<'a>(messages: impl Iterator<Item = (u32, Vec<(&'a str, f64)>)>) -> Topic<'static> {
    let message = |(half, of): (u32, Vec<(&str, f64)>)| (f64::from(half) / 2.0, transforms(half, &of));
    ("/tf", "cdr", "tf2_msgs/msg/TFMessage", TRANSFORMS, messages.map(message).collect())
}

/// Returns a topic with joints, each recorded at a time in half seconds.
fn joints<'a>(messages: impl Iterator<Item = (u32, Vec<(&'a str, f64)>)>) -> Topic<'static> {
    let message = |(half, of): (u32, Vec<(&str, f64)>)| (f64::from(half) / 2.0, joint_state(&of));
    ("/joint_states", "cdr", "sensor_msgs/msg/JointState", JOINT_STATE, messages.map(message).collect())
}

/// A binding of the frame `cube` and the joint `finger`.
const BINDING: &str = "
resample: 2 Hz
channels:
  cube.position: /tf.transforms.cube.translation.<xyz>
  right.gripper.opening: /joint_states.position.finger
";

/// Reads a bag of these topics.
fn read(topics: &[Topic]) -> Result<(Recording, Vec<Issue>), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    write(&path, None, topics);
    bound(&path, BINDING)
}

#[test]
fn publishers_of_elements_that_are_not_bound_repeat_nothing() {
    let x = f64::from;
    let of_cube = |half| (half, vec![("cube", x(half))]);
    let of_lamp = |half| (half, vec![("lamp", 1.0)]);
    let of_finger = |half| (half, vec![("finger", x(half))]);
    let of_arm = |half| (half, vec![("elbow", 0.1), ("wrist", 0.2)]);
    for is_last in [true, false] {
        let order = |bound, other| if is_last { [bound, other] } else { [other, bound] };
        let (recording, issues) = read(&[
            poses((10..16).flat_map(|half| order(of_cube(half), of_lamp(half)))),
            joints((10..16).flat_map(|half| order(of_finger(half), of_arm(half)))),
        ])
        .unwrap();
        assert_eq!(issues, []);
        let halves: Vec<f64> = (10..16).map(x).collect();
        assert_eq!(values(&recording, "cube.position.x"), halves);
        assert_eq!(values(&recording, "right.gripper.opening"), halves);
    }
    // A frame that is bound has two values with one stamp: the issue names the topic.
    let again = |half| (half == 12).then(|| (half, vec![("cube", 0.0)]));
    let twice = (10..16).flat_map(|half| std::iter::once(of_cube(half)).chain(again(half)));
    let (_, issues) = read(&[poses(twice), joints((10..16).map(of_finger))]).unwrap();
    assert_eq!(issues.len(), 1, "{issues:?}");
    assert_eq!((issues[0].kind.name(), issues[0].channel.as_str()), ("duplicate_stamp", "/tf"));
    assert!(issues[0].message.starts_with("1 row repeats the time stamp"), "{issues:?}");
}

/// Two values of one name in a message are ambiguous.
#[test]
fn an_element_that_is_twice_in_a_message_is_refused() {
    let x = f64::from;
    let cubes = || (10..16).map(|half| (half, vec![("cube", x(half)), ("lamp", 1.0), ("cube", 0.0)]));
    let cube = || (10..16).map(|half| (half, vec![("cube", x(half))]));
    let fingers = || (10..16).map(|half| (half, vec![("finger", x(half)), ("elbow", 1.0), ("finger", 0.0)]));
    let finger = || (10..16).map(|half| (half, vec![("finger", x(half))]));
    let of_cube = "`/tf` cannot be read: message 1: `transforms.cube` occurs twice";
    let of_finger = "`/joint_states` cannot be read: message 1: `position.finger` occurs twice";
    for (topics, why) in
        [([poses(cubes()), joints(finger())], of_cube), ([poses(cube()), joints(fingers())], of_finger)]
    {
        let refused = read(&topics).unwrap_err();
        assert!(refused.ends_with(why), "{refused}");
        let folder = tempfile::tempdir().unwrap();
        write(&folder.path().join("log.mcap"), None, &topics);
        std::fs::write(folder.path().join("b.yaml"), format!("{BINDING}{}", SCENE)).unwrap();
        let output = teachtree_in(folder.path(), &["live", "log.mcap", "--binding", "b.yaml"]);
        assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
        let why = why.replace("message 1: ", "");
        assert!(complained(&output).contains(&why), "{}", complained(&output));
    }
}
