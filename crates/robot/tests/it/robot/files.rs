//! Robot files: what is refused, and where.

use super::kinematics::shipped;
use teachtree_robot as robot;

/// Each fixture has one mistake; its first line says which place and words the error must have.
#[test]
fn every_mistake_in_a_robot_is_reported_at_its_line() {
    let folder = std::path::Path::new(crate::ROOT).join("tests/fixtures/robots");
    let mut seen = 0;
    let mut wrong = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_string();
        let text = std::fs::read_to_string(&path).unwrap();
        let wanted = text.lines().next().unwrap().trim_start_matches("# ");
        let error = robot::read(&text, &name).map_or_else(|error| error.to_string(), |_| "no error".into());
        let missing = wanted.split(" | ").filter(|word| !error.contains(word));
        wrong.extend(missing.map(|word| format!("{name}: expected `{word}`, found `{error}`")));
        seen += 1;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(seen >= 12, "{seen}");
}

#[test]
fn the_shipped_robots_can_be_read_and_an_unknown_name_lists_them() {
    for name in robot::names() {
        assert!(!shipped(name).tree.links.is_empty(), "{name}");
    }
    let error = robot::open("gifu", &|_| unreachable!()).unwrap_err().to_string();
    assert!(error.contains("`gifu_hand_iii_right`") && error.contains("neither a shipped robot"), "{error}");
}

#[test]
fn every_number_of_a_shipped_robot_says_where_it_comes_from() {
    let folder = std::path::Path::new(crate::ROOT).join("robots");
    for entry in std::fs::read_dir(folder).unwrap() {
        let text = std::fs::read_to_string(entry.unwrap().path()).unwrap();
        for line in text.lines().filter(|line| line.contains('{')) {
            assert!(line.contains("source: "), "{line}");
        }
    }
}

#[test]
fn a_hand_in_urdf_needs_only_its_fingertips_named() {
    let urdf = include_str!("../../../../../tests/fixtures/hand_of_urdf.urdf");
    let hand = "name: pinch\nurdf: hand.urdf\nhand:\n  side: right\n  palm: palm\n  fingers:\n    \
                index: {link: f2, tip: [40 mm, 0 mm, 0 mm], radius: 7 mm, pad: [0, 0, 1], force: 3 N, source: a test}\n";
    let open = |urdf: &'static str| {
        robot::open("lab/pinch.yaml", &move |file| match file {
            "lab/pinch.yaml" => Ok(hand.to_string()),
            other => {
                assert_eq!(other, "lab/hand.urdf", "the URDF lies beside the file that names it");
                Ok(urdf.to_string())
            }
        })
    };
    let robot = open(urdf).unwrap();
    assert_eq!((robot.tree.n_joints(), robot.tree.dofs.len()), (3, 2), "the third mimics");
    let finger = &robot.hands[&teachtree_base::hands::Side::Right].fingers[0];
    // Bent by 0.8 rad, and by half of it more.
    let mut angles = [0.0; robot::MAX_DOFS];
    angles[1] = 0.8;
    let tip = finger.posture(&angles).tip;
    let (near, far) = (0.8_f64, 1.2_f64);
    let wanted =
        nalgebra::Point3::new(0.05 + 0.05 * near.cos() + 0.04 * far.cos(), 0.0, 0.05 * near.sin() + 0.04 * far.sin());
    assert!((tip - wanted).norm() < 1e-12, "{tip} and {wanted}");
    let changed = |from: &str, to: &str| {
        let text = urdf.replace(from, to);
        assert_ne!(text, urdf);
        open(Box::leak(text.into_boxed_str())).unwrap()
    };
    // A joint that mimics another one with an offset is bent by it where the other one is straight.
    let offset = changed("<mimic ", "<mimic offset=\"0.3\" ");
    let tip = offset.hands[&teachtree_base::hands::Side::Right].fingers[0].posture(&[0.0; robot::MAX_DOFS]).tip;
    let wanted = nalgebra::Point3::new(0.05 + 0.05 + 0.04 * 0.3_f64.cos(), 0.0, 0.04 * 0.3_f64.sin());
    assert!((tip - wanted).norm() < 1e-12, "{tip} and {wanted}");
    // Soft limits are narrower.
    let soft = "<safety_controller soft_lower_limit=\"-0.3\" soft_upper_limit=\"1\" k_velocity=\"1\"/></joint>";
    let robot = changed("</joint>", soft);
    assert_eq!(robot.tree.dofs[0].range, [-0.3, 0.4]);
    // Friction against which no motor could move is a simulator's number.
    let friction = |damping: f64| {
        let dynamics = format!("<dynamics damping=\"{damping}\" friction=\"0.1\"/></joint>");
        let dof = changed("</joint>", &dynamics).tree.dofs[0].clone();
        [dof.damping, dof.friction]
    };
    assert_eq!([friction(0.07), friction(0.09)], [[0.07, 0.1], [0.0; 2]], "of 0.5 N m at 5 rad/s");
    // Elements for other programs need no declaration of their prefix.
    changed("</robot>", "<drake:joint name=\"x\"/></robot>");
    let wrong = |from: &str, to: &str| {
        let text: &'static str = Box::leak(urdf.replace(from, to).into_boxed_str());
        open(text).unwrap_err().to_string()
    };
    assert!(wrong("</robot>", "").starts_with("lab/hand.urdf:"), "{}", wrong("</robot>", ""));
    assert!(wrong("upper=\"0.4\"", "upper=\"-0.5\"").contains("`spread` goes from -0.4 to -0.5"));
    assert!(wrong("<parent link=\"f1\"/>", "<parent link=\"f3\"/>").contains("the unknown link `f3`"));
    assert!(wrong("joint=\"bend\"", "joint=\"bent\"").contains("`curl` mimics `bent`"));
    assert!(wrong("name=\"curl\"", "name=\"bend\"").contains("the joint `bend` occurs twice"));
    assert!(wrong("xyz=\"0.05 0 0\"", "xyz=\"0.05 0,0 0\"").contains("`xyz` is `0.05 0,0 0`, expected three numbers"));
    // A moment that is more than the other two together is balanced, as files of well-known hands want it.
    let balanced: &'static str = Box::leak(urdf.replace("ixx=\"1e-3\"", "ixx=\"4e-3\"").into_boxed_str());
    let palm = open(balanced).unwrap().tree.links.into_iter().find(|link| link.name == "palm").unwrap();
    assert!((palm.inertia - nalgebra::Matrix3::identity() * 2e-3).norm() < 1e-12, "{}", palm.inertia);
    assert!(wrong("ixx=\"1e-3\"", "ixx=\"-1e-3\"").contains("`palm` has an impossible inertia"));
    let boxes = "<collision><geometry><box size=\"0.06 0.06 0.02\"/></geometry></collision>".repeat(65);
    assert!(
        wrong("<link name=\"f0\"/>", &format!("<link name=\"f0\">{boxes}</link>"))
            .contains("`f0` has 65 shapes, at most 64")
    );
}

#[test]
fn the_parts_of_a_robot_lie_beside_the_file_that_names_them() {
    let cell = "name: cell\nparts:\n  arm: {robot: my_arm.yaml, source: ours}\n  hand: {robot: gifu_hand_iii_left, on: arm/flange, source: ours}\n";
    let arm = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/arm_6dof.yaml")).unwrap();
    let robot = robot::open("lab/cell.yaml", &|file| match file {
        "lab/cell.yaml" => Ok(cell.to_string()),
        other => {
            assert_eq!(other, "lab/my_arm.yaml");
            Ok(arm.clone())
        }
    });
    assert_eq!(robot.unwrap().tree.n_joints(), 6 + 20);
    let error = robot::open("lab/hand.urdf", &|_| unreachable!()).unwrap_err().to_string();
    assert!(error.contains("name the URDF and its fingertips in a YAML file"), "{error}");
}

/// A gripper of a URDF in parts, with these lines after them.
fn of_parts(parts: &[&str], more: &str) -> Result<teachtree_robot::Robot, String> {
    let folder = std::path::Path::new(crate::ROOT).join("tests/fixtures");
    let side = |at: usize| ["left", "right"][at];
    let lines = parts.iter().enumerate().map(|(at, part)| {
        format!(
            "  {part}: {{robot: gripper_of_urdf.yaml, side: {}, at: [0 mm, {at} mm, 0 mm], source: a test}}\n",
            side(at)
        )
    });
    let file = format!("name: parts\nparts:\n{}{more}", lines.collect::<String>());
    let text_of = |name: &str| match name {
        "parts.yaml" => Ok(file.clone()),
        "gripper.urdf" => Ok(std::fs::read_to_string(folder.join("gripper_of_urdf.urdf")).unwrap()),
        name => Ok(std::fs::read_to_string(folder.join(name)).unwrap()),
    };
    teachtree_robot::open("parts.yaml", &text_of).map_err(|error| error.to_string())
}

/// A controller knows the names of the URDF, whatever a part is called; of two equal parts the names are told apart by the parts, or as the file says.
#[test]
fn joints_of_parts_keep_the_names_of_their_urdf() {
    let name = |robot: &teachtree_robot::Robot, joint: &str| {
        assert!(robot.tree.dof(joint).is_some(), "{joint}");
        robot.controller_name(joint).to_string()
    };
    let one = of_parts(&["gripper"], "").unwrap();
    assert_eq!(name(&one, "gripper/finger_1"), "finger_1");
    let two = of_parts(&["a", "b"], "").unwrap();
    assert_eq!([name(&two, "a/finger_1"), name(&two, "b/finger_1")], ["a/finger_1", "b/finger_1"]);
    let two = of_parts(&["a", "b"], "joint_names: {a/finger_1: left_finger, b/finger_1: right_finger}\n").unwrap();
    assert_eq!([name(&two, "a/finger_1"), name(&two, "b/finger_1")], ["left_finger", "right_finger"]);
    assert_eq!(two.limb(teachtree_base::hands::Side::Left).unwrap().controller_name("a/finger_1"), "left_finger");
    let unknown = of_parts(&["a"], "joint_names:\n  a/finger_3: finger\n").unwrap_err();
    assert!(unknown.contains("parts.yaml:5: `a/finger_3` is not a joint that moves by itself"), "{unknown}");
    assert!(unknown.contains("did you mean `a/finger_1`?"), "{unknown}");
    let same = of_parts(&["a", "b"], "joint_names: {a/finger_1: finger, b/finger_1: finger}\n").unwrap_err();
    assert!(same.contains("`b/finger_1` is called `finger`, as `a/finger_1` is"), "{same}");
}
