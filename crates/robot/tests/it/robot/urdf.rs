//! A robot of a URDF and the file beside it.

use crate::demonstrated::commanded;
use teachtree_robot as robot;
use teachtree_robot::simulation::simulate;
use teachtree_world as world;

/// The root of a URDF stands where the file beside it says, joints keep their names, and accelerations are given there.
#[test]
fn a_urdf_is_placed_and_limited_by_the_file_beside_it() {
    let urdf = include_str!("../../../../../tests/fixtures/hand_of_urdf.urdf");
    let open = |more: &str| {
        let text = format!("name: placed\nurdf: hand.urdf\n{more}");
        robot::open("own.yaml", &|file| Ok(if file == "own.yaml" { text.clone() } else { urdf.to_string() }))
    };
    let plain = open("").unwrap();
    let joint = plain.tree.dofs[0].name.clone();
    let placed = open(&format!(
        "at: [100 mm, 0 mm, 50 mm]\nturned: [0, 0, 0, 1]\nlimits:\n  {joint}: {{acceleration: 15 rad/s^2, source: ours}}\n"
    ))
    .unwrap();
    assert_eq!((&placed.tree.dofs[0].name, placed.tree.dofs[0].acceleration), (&joint, 15.0));
    assert_ne!(plain.tree.dofs[0].acceleration, 15.0);
    let q = plain.tree.middle();
    let [was, is] = [&plain, &placed].map(|robot| robot.tree.forward_kinematics(q.as_slice()));
    for (was, is) in was.iter().zip(&is) {
        let (was, is) = (was.translation.vector, is.translation.vector);
        let wanted = [0.1 - was.x, -was.y, 0.05 + was.z];
        assert!(wanted.iter().zip(is.iter()).all(|(a, b)| (a - b).abs() < 1e-9), "{was} became {is}");
    }
    let error = |more: &str| open(more).unwrap_err().to_string();
    let none = error("limits:\n  elbow: {acceleration: 15 rad/s^2, source: ours}\n");
    assert!(none.contains("own.yaml:4") && none.contains("is not a driven joint of the URDF"), "{none}");
    let slides = error(&format!("limits:\n  {joint}: {{slide_acceleration: 1 m/s^2, source: ours}}\n"));
    assert!(slides.contains("turns, expected `acceleration`, found `slide_acceleration`"), "{slides}");
    let limited = open(&format!("limits:\n  {joint}: {{jerk: 500 rad/s^3, source: ours}}\n")).unwrap();
    assert_eq!(limited.tree.dofs[0].jerk, 500.0);
    assert_eq!(limited.tree.dofs[0].acceleration, plain.tree.dofs[0].acceleration);
    let never = error(&format!("limits:\n  {joint}: {{jerk: 0 rad/s^3, source: ours}}\n"));
    assert!(never.contains("own.yaml:4") && never.contains("has the jerk 0, expected more than 0"), "{never}");
    let unit = error(&format!("limits:\n  {joint}: {{jerk: 5 rad/s^2, source: ours}}\n"));
    assert!(unit.contains("own.yaml:4") && unit.contains("expected a quantity in rad/s^3"), "{unit}");
    let none = error(&format!("limits:\n  {joint}: {{source: ours}}\n"));
    assert!(none.contains("has no limit, expected an acceleration or a jerk"), "{none}");
}

/// An inertia that no body has and limits of 0 to 0 on an antenna are warnings; on the arm of a hand they are errors, also if the arm is another part.
#[test]
fn what_is_odd_about_a_link_matters_if_a_hand_needs_it() {
    let hand = include_str!("../../../../../tests/fixtures/gripper_of_urdf.urdf");
    let side = include_str!("../../../../../tests/fixtures/gripper_of_urdf.yaml");
    let odd = |joint: &str| {
        format!(
            r#"<robot name="odd"><link name="foot"/><link name="arm"><inertial><mass value="1"/></inertial></link>
            <link name="antenna"><inertial><mass value="1"/><inertia ixx="-1" iyy="1" izz="1"/></inertial></link>
            <joint name="shoulder" type="revolute"><parent link="foot"/><child link="arm"/>{joint}</joint>
            <joint name="swivel" type="revolute"><parent link="foot"/><child link="antenna"/><limit lower="0" upper="0"/></joint>
            <joint name="blinks" type="revolute"><parent link="antenna"/><child link="lamp"/><mimic joint="nothing"/></joint>
            <link name="lamp"/></robot>"#
        )
    };
    let read = |joint: &str, on: &str| {
        let urdf = odd(joint);
        let parts = format!(
            "name: parts\nparts:\n  a: {{robot: odd.yaml, source: a test}}\n  g: {{robot: gripper.yaml, on: a/{on}, source: a test}}\n"
        );
        let text_of = |file: &str| {
            Ok(match file {
                "parts.yaml" => parts.clone(),
                "odd.yaml" => "name: odd\nurdf: odd.urdf\n".into(),
                "odd.urdf" => urdf.clone(),
                "gripper.yaml" => side.into(),
                _ => hand.into(),
            })
        };
        robot::open("parts.yaml", &text_of).map_err(|error| error.to_string())
    };
    let limits = r#"<limit lower="-1" upper="1"/>"#;
    let read_all = read(limits, "arm").unwrap();
    let links: Vec<&str> = read_all.oddities.iter().map(|oddity| oddity.link.as_str()).collect();
    assert_eq!(links, ["a/antenna", "a/lamp"], "{:?}", read_all.oddities);
    assert!(read_all.tree.links.iter().all(|link| link.inertia.iter().all(|moment| moment.is_finite())));
    let locked = read(r#"<limit lower="0" upper="0"/>"#, "arm").unwrap_err();
    assert!(locked.contains("odd.urdf:3:") && locked.contains("`shoulder` goes from 0 to 0"), "{locked}");
    let needed = read(limits, "antenna").unwrap_err();
    assert!(needed.contains("odd.urdf:") && needed.contains("`swivel` goes from 0 to 0"), "{needed}");
    // Of no hand at all, nothing matters.
    let whole = odd(r#"<limit lower="-1e16" upper="1e16"/>"#);
    let alone = robot::open("odd.yaml", &|file| {
        Ok(if file == "odd.yaml" { "name: odd\nurdf: odd.urdf\n".into() } else { whole.clone() })
    });
    assert_eq!(alone.unwrap().oddities.len(), 3);
}

/// Motors of an arm of links without masses have an inertia, so that the simulated arm and its jaws follow their targets.
#[test]
fn an_arm_of_links_without_masses_is_simulated() {
    let urdf = include_str!("../../../../../robots/panda.urdf");
    let jaw = |side: &str, pad: i32| {
        format!(
            "{{link: panda_{side}_pad, tip: [0 mm, 0 mm, 0 mm], radius: 8 mm, pad: [0, {pad}, 0], force: 20 N, source: ours}}"
        )
    };
    let text = format!(
        "name: panda\nurdf: panda.urdf\nat: [0 mm, -450 mm, 0 mm]\nturned: [0.70710678, 0, 0, 0.70710678]\nhand:\n  side: right\n  palm: panda_hand\n  fingers:\n    thumb: {}\n    index: {}\n",
        jaw("left", -1),
        jaw("right", 1)
    );
    let open = |urdf: &str| {
        robot::open("panda.yaml", &|file| Ok(if file == "panda.yaml" { text.clone() } else { urdf.into() })).unwrap()
    };
    let panda = open(urdf);
    let massless: Vec<&str> = panda.massless_arm().iter().map(|dof| panda.tree.dofs[*dof].name.as_str()).collect();
    assert_eq!(massless.len(), 7, "{massless:?}");
    // 87 N m bring 0.999 kg m² from rest to 2.175 rad/s in 25 ms.
    let first = &panda.tree.dofs[panda.massless_arm()[0]];
    assert!((first.armature * first.speed / first.torque - 0.025).abs() < 1e-12, "{first:?}");
    let hand = r#"<link name="panda_hand"/>"#;
    assert!(urdf.contains(hand));
    let loaded =
        open(&urdf.replace(hand, r#"<link name="panda_hand"><inertial><mass value="0.7"/></inertial></link>"#));
    assert!(loaded.massless_arm().is_empty());
    for seed in [1, 3] {
        let mut commands = commanded("pick_and_place", seed);
        let scene = world::scene("pick_and_place").unwrap();
        robot::map(&mut commands, &panda, &scene).unwrap();
        let done = simulate(&commands, &panda, &scene, &mut |_| {}).unwrap();
        assert!(done.outcomes.len() == 1 && done.outcomes[0].done, "{:?}", done.outcomes);
    }
}
