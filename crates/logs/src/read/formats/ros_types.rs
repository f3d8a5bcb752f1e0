//! Definitions of common ROS types, for bags that have none, or in another language: recorders of ROS 2 before Iron write only the names of types into `.db3`.
//!
//! `ros_types.msg` is made by tools/make_bag_fixtures.py.

const ALL: &str = include_str!("ros_types.msg");

/// The definition of a type, such as `geometry_msgs/msg/Pose`, with those of all types that it may name.
pub(super) fn definition(name: &str) -> Option<String> {
    let head = format!("MSG: {}\n", name.replace("/msg/", "/"));
    let begin = ALL.find(&head)? + head.len();
    let own = ALL.get(begin..)?.split("====").next()?;
    Some(format!("{own}{ALL}"))
}
