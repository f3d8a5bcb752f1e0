//! Robot files: what is refused, and where.

use super::kinematics::shipped;
use teachtree::robot;

/// Each fixture has one mistake; its first line says which place and words the error must have.
#[test]
fn every_mistake_in_a_robot_is_told_at_its_line() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/robots");
    let mut seen = 0;
    let mut wrong = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_string();
        let text = std::fs::read_to_string(&path).unwrap();
        let wanted = text.lines().next().unwrap().trim_start_matches("# ");
        let error = robot::read(&text, &name).map_or_else(|error| error.to_string(), |_| "no error".into());
        let missing = wanted.split(" | ").filter(|word| !error.contains(word));
        wrong.extend(missing.map(|word| format!("{name}: wanted `{word}`, found `{error}`")));
        seen += 1;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(seen >= 12, "{seen}");
}

#[test]
fn the_shipped_robots_can_be_read_and_an_unknown_name_lists_them() {
    for name in robot::names() {
        assert!(!shipped(name).links.is_empty(), "{name}");
    }
    let error = robot::open("gifu", &|_| unreachable!()).unwrap_err().to_string();
    assert!(error.contains("`gifu_hand_iii_right`") && error.contains("no shipped robot"), "{error}");
}

#[test]
fn every_number_of_a_shipped_robot_says_where_it_comes_from() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("robots");
    for entry in std::fs::read_dir(folder).unwrap() {
        let text = std::fs::read_to_string(entry.unwrap().path()).unwrap();
        for line in text.lines().filter(|line| line.contains('{')) {
            assert!(line.contains("source: "), "{line}");
        }
    }
}

#[test]
fn a_hand_in_urdf_needs_only_its_fingertips_named() {
    let urdf = include_str!("../../fixtures/hand_of_urdf.urdf");
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
    assert_eq!((robot.n_joints(), robot.dofs.len()), (3, 2), "the third mimics");
    let finger = &robot.hands[&teachtree::base::hands::Side::Right].fingers[0];
    // Bent by 0.8 rad, and by half of it more.
    let mut angles = [0.0; robot::MAX_DOFS];
    angles[1] = 0.8;
    let tip = finger.posture(&angles).tip;
    let (near, far) = (0.8_f64, 1.2_f64);
    let wanted =
        nalgebra::Point3::new(0.05 + 0.05 * near.cos() + 0.04 * far.cos(), 0.0, 0.05 * near.sin() + 0.04 * far.sin());
    assert!((tip - wanted).norm() < 1e-12, "{tip} and {wanted}");
    let wrong = |from: &str, to: &str| {
        let text: &'static str = Box::leak(urdf.replace(from, to).into_boxed_str());
        open(text).unwrap_err().to_string()
    };
    assert!(wrong("</robot>", "").starts_with("lab/hand.urdf:"), "{}", wrong("</robot>", ""));
    assert!(wrong("upper=\"0.4\"", "upper=\"-0.5\"").contains("`spread` goes from -0.4 to -0.5"));
    assert!(wrong("<parent link=\"f1\"/>", "<parent link=\"f3\"/>").contains("`f3`, which is no link"));
    assert!(wrong("joint=\"bend\"", "joint=\"bent\"").contains("`curl` mimics `bent`"));
}
