//! `certify`: a box of cells in which a program succeeds.

use crate::program::{all_said, complained, demonstrate, said, teachtree, teachtree_in};
use crate::schemas::{schemas, validated};
use serde_json::Value;
use std::fs::{read_to_string, write};
use teachtree_command::Commands;
use teachtree_robot::certificate::{CellQuantity, Limits, QUANTITIES, certify};
use teachtree_robot::simulation::{CellVariation, Fault, FaultKind};
use teachtree_robot_report::certificate::CertificateDocument;

/// The commands of a demonstration for a gripper without an arm, in a folder.
fn gripper() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    demonstrate("pick_and_place", &[], path("log.csv"));
    let retargeted = ["retarget", &path("log.csv"), "--robot", "parallel_jaw", "-o", &path("commands.json")];
    let retargeted = teachtree(&retargeted);
    assert!(retargeted.status.success(), "{}", all_said(&retargeted));
    folder
}

const CERTIFY: [&str; 4] = ["certify", "commands.json", "--robot", "parallel_jaw"];

/// The number of threads does not change the certificate, its page has a picture of each first failure, and that failure is found again by `simulate`.
#[test]
fn a_certificate_is_the_same_on_any_number_of_threads() {
    let folder = gripper();
    let certified = |jobs: &str| {
        let args = ["--scene", "pick_and_place", "--vary", "friction", "--format", "json", "--report", "page.html"];
        let output = teachtree_in(folder.path(), &[&CERTIFY[..], &args, &["--jobs", jobs]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
        (said(&output), read_to_string(folder.path().join("page.html")).unwrap())
    };
    let one = certified("1");
    assert!(one == certified("2"));
    let (printed, page) = one;
    let document: Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(document["certified"], true);
    let verification = &document["verification"];
    assert_eq!(verification["successes"], verification["runs"]);
    let friction = &document["quantities"][0];
    let failure = &friction["lower"]["first_failure"];
    assert_eq!(failure["fault"]["kind"], "not_done");
    assert_eq!(page.matches("<figure>").count(), 1);
    assert!(page.contains("friction below "), "{page}");
    write(folder.path().join("cell.yaml"), failure["variation"].to_string()).unwrap();
    let args = ["simulate", "commands.json", "--robot", "parallel_jaw", "--scene", "pick_and_place", "-o", "robot.csv"];
    let again = teachtree_in(folder.path(), &[&args[..], &["--variation", "cell.yaml"]].concat());
    assert_eq!(again.status.code(), Some(4), "{}", all_said(&again));
}

#[test]
fn what_cannot_be_certified_is_refused() {
    let folder = gripper();
    let run = |args: &[&str]| teachtree_in(folder.path(), &[&CERTIFY[..], args].concat());
    let few = run(&["--scene", "pick_and_place", "--runs", "1"]);
    assert_eq!(few.status.code(), Some(1), "{}", all_said(&few));
    assert_eq!(said(&few), "not certified: no box was verified within 1 runs\n");
    let scene = include_str!("../../../scenes/pick_and_place.yaml").replace("mass: 40 g", "mass: 2 kg");
    write(folder.path().join("heavy.yaml"), scene).unwrap();
    let heavy = run(&["--scene", "heavy.yaml"]);
    assert_eq!(heavy.status.code(), Some(4), "{}", all_said(&heavy));
    assert!(said(&heavy).contains("the program fails in the cell of the scene itself: pick_and_place: `box` is "));
    let unknown = run(&["--scene", "pick_and_place", "--vary", "frictio"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(complained(&unknown).contains("'friction'"), "{}", complained(&unknown));
}

/// A certificate of a program whose limits are known keeps to the schema, and text and page name what fails.
#[test]
fn a_certificate_says_what_fails_beyond_each_face() {
    let quantities: Vec<&'static CellQuantity> = QUANTITIES.iter().collect();
    let fault = |cell: &CellVariation| {
        let fault = Fault {
            time_s: Some(2.5),
            link: Some("arm/joint_2".into()),
            contact: Some("rail".into()),
            ..Fault::new(FaultKind::Collisions, "`arm/joint_2` is inside `rail`".into())
        };
        (cell.object_offset[0].0 > 0.018).then_some(fault)
    };
    let mut runs = |_: &str, cells: &[CellVariation]| Ok::<_, ()>(cells.iter().map(fault).collect());
    let result = certify(&quantities, Limits { seed: 1, runs: 10_000 }, &mut runs).unwrap();
    assert!(result.is_ok(), "{result:?}");
    let commands = Commands { log: "a <log>".into(), ..Commands::default() };
    let document = CertificateDocument { commands: &commands, quantities: &quantities, seed: 1, result };
    let (_, schema) = schemas().into_iter().find(|(name, _)| name == "certificate-1.schema.json").unwrap();
    let value: Value = serde_json::from_str(&document.json()).unwrap();
    validated(&[(schema, value.clone())]);
    let offset = &value["quantities"][0];
    assert_eq!(
        (&offset["name"], offset["upper"]["value"].as_f64(), offset["lower"]["value"].as_f64()),
        (&"object_offset_x".into(), Some(0.015), Some(-0.05))
    );
    assert_eq!(offset["upper"]["first_failure"]["fault"]["link"], "arm/joint_2");
    let text = document.text();
    let line = text.lines().find(|line| line.starts_with("object_offset_x")).unwrap();
    assert!(line.contains("-50 mm to 15 mm  (alone -50 mm to 15 mm; step 5 mm)"), "{line}");
    assert!(text.contains("above: ") && text.contains("first collisions: `arm/joint_2` is inside `rail`"), "{text}");
    let page = document.page(&["<svg/>".into()]);
    assert!(page.contains("a &lt;log&gt;") && page.matches("<figure><svg/>").count() == 1, "{page}");
}
