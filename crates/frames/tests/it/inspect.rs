//! Patterns that a template of a binding groups columns in.

use teachtree_frames::bind::template::groups;

#[test]
fn a_unit_at_the_end_of_a_name_is_read() {
    let columns =
        ["tip_x_mm", "tip_y_mm", "tip_z_mm", "yaw_deg", "comma"].map(|name| (name.into(), String::new(), false));
    let patterns: Vec<String> = groups(&columns).into_iter().map(|group| group.pattern).collect();
    assert_eq!(patterns, ["tip_<xyz>_mm [mm]", "yaw_deg [deg]", "comma"]);
}

#[test]
fn columns_that_are_numbered_on_are_no_vector() {
    let patterns = |names: &[&str]| -> Vec<String> {
        let columns: Vec<_> = names.iter().map(|name| (name.to_string(), String::new(), false)).collect();
        groups(&columns).into_iter().map(|group| group.pattern).collect()
    };
    assert_eq!(patterns(&["pos_1", "pos_2", "pos_3"]), ["pos<xyz=_1 _2 _3>"]);
    let joints = ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6", "joint_7"];
    assert_eq!(patterns(&joints), joints);
    assert_eq!(patterns(&["q_0", "q_1", "q_2", "q_3"]), ["q_0", "q_1", "q_2", "q_3"]);
}
