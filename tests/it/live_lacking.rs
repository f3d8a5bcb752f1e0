//! What the rules cannot detect in a live log is said before its first label.

use crate::program::{all_said, said, teachtree_fed};
use std::fmt::Write;

/// A gripper as one point, with the force at its wrist, beside a cube; a hand that feels with two fingertips has `fingertips` too.
fn log(fingertips: bool) -> String {
    let hand = "time,cube.position.x,cube.position.y,cube.position.z,cube.rotation.w,cube.rotation.x,cube.rotation.y,cube.rotation.z,\
                right.thumb.position.x,right.thumb.position.y,right.thumb.position.z";
    let wrist = ",right.palm.position.x,right.palm.position.y,right.palm.position.z,right.palm.force.x,right.palm.force.y,right.palm.force.z";
    let fingers = ",right.index.position.x,right.index.position.y,right.index.position.z,right.thumb.force.x,right.thumb.force.y,right.thumb.force.z,\
                   right.index.force.x,right.index.force.y,right.index.force.z,right.thumb.contact.cube,right.index.contact.cube,contact.cube.base,\
                   contact.cube.base.force.x,contact.cube.base.force.y,contact.cube.base.force.z";
    let mut text = format!("{hand}{}\n", if fingertips { fingers } else { wrist });
    for row in 0..600 {
        let time = f64::from(row) * 0.01;
        let height = 0.3 + 0.05 * (time * 2.0).sin();
        let _ = write!(text, "{time},0,0,0.06,1,0,0,0,0,0,{height}");
        match fingertips {
            true => {
                let noise = 0.001 * f64::from(row % 3);
                let _ = writeln!(text, ",0.05,0,{height},{noise},0,0,0,{noise},0,0,0,1,0,0,0.5");
            }
            false => {
                let _ = writeln!(text, ",0,0,{height},0,0,{}", 0.1 * (time * 3.0).cos());
            }
        }
    }
    text
}

fn printed(scene: &str, rules: &[&str], log: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("cell.scene.yaml");
    std::fs::write(&file, scene).unwrap();
    let args = [&["live", "-", "--scene", file.to_str().unwrap()], rules].concat();
    let output = teachtree_fed(&args, log.as_bytes());
    assert!(output.status.success(), "{}", all_said(&output));
    said(&output)
}

fn scene(fingers: &str) -> String {
    format!(
        "bodies:\n  cube: {{role: object, mass: 50 g, parts: [{{box: [120 mm, 120 mm, 120 mm]}}]}}\n  base: {{role: support, position: [0 m, 0 m, -10 mm], \
         parts: [{{box: [600 mm, 600 mm, 20 mm]}}]}}\nhands:\n  right: {{fingers: [{fingers}]}}\n"
    )
}

#[test]
fn what_prompt_rules_cannot_detect_is_said_before_the_first_label() {
    let prompt = ["--rules", "prompt.rules"];
    let said = printed(&scene("thumb, palm"), &prompt, &log(false));
    let before: Vec<&str> = said.lines().take_while(|line| !line.starts_with("now ")).collect();
    let lacks = before.iter().find(|line| line.starts_with("issue   undetectable right: "));
    let lacks = lacks.unwrap_or_else(|| panic!("{said}"));
    assert!(
        lacks.contains("Grasp") && lacks.contains("Translate") && lacks.contains("cannot be detected: "),
        "{lacks}"
    );
    // A hand with forces of two fingertips has all that they need.
    let said = printed(&scene("thumb, index"), &prompt, &log(true));
    let lacks: Vec<&str> = said.lines().filter(|line| line.contains("undetectable")).collect();
    assert_eq!(lacks, ["issue   undetectable right: Insert, Pullout cannot be detected: the scene has no socket"]);
    assert!(said.contains("now "), "{said}");
}
