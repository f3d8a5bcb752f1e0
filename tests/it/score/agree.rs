//! `agree`: the labels of two people, against examples that are computed by hand.

use crate::program::{all_said, complained, teachtree_in};
use crate::studio::folder;
use serde_json::json;

/// 20 frames both say yes, 15 both say no, 5 and 10 one says yes: p = 0.7, pₑ = 0.5, κ = 0.4.
const ONE: &str = "label,start_frame,end_frame\nMove,0,25\nGrasp,25,50\n";
const OTHER: &str = "label,start_frame,end_frame\nMove,0,20\nGrasp,20,25\nMove,25,35\nGrasp,35,50\n";

#[test]
fn kappa_and_distances_are_those_computed_by_hand() {
    let folder = folder();
    std::fs::write(folder.path().join("mika.csv"), ONE).unwrap();
    std::fs::write(folder.path().join("noor.csv"), OTHER).unwrap();
    let args = ["agree", "mika.csv", "noor.csv", "logs/a.csv", "--binding", "lift.yaml"];
    let output = teachtree_in(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
    assert_eq!(
        all_said(&output),
        "mika.csv and noor.csv, 1 recording\n\n\
         primitives: kappa 0.400, the same label on 70.0 % of 50 frames that both labeled\n\
         \x20 label                  kappa  frames of both  boundaries     alone    median      90 %\n\
         \x20 Grasp                  0.400              15           1     0 + 1    250 ms    250 ms\n\
         \x20 Move                   0.400              20           0     0 + 1         -         -\n\
         \x20 all                    0.400              35           1     0 + 2    250 ms    250 ms\n"
    );
    for (least, status) in [("0.39", 0), ("0.41", 1)] {
        let output = teachtree_in(folder.path(), &[&args[..], &["--min-kappa", least]].concat());
        assert_eq!(output.status.code(), Some(status), "{least}");
    }
}

/// In JSON, with other names: what is mapped to `mask` is not compared.
#[test]
fn the_agreement_is_also_json_and_labels_can_be_renamed() {
    let folder = folder();
    std::fs::write(folder.path().join("mika.csv"), ONE.replace("Grasp", "S2")).unwrap();
    std::fs::write(folder.path().join("noor.csv"), OTHER).unwrap();
    let args = ["agree", "mika.csv", "noor.csv", "logs/a.csv", "--binding", "lift.yaml"];
    let json = |more: &[&str]| -> serde_json::Value {
        let output = teachtree_in(folder.path(), &[&args[..], &["--format", "json"], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
        serde_json::from_str(&all_said(&output)).unwrap()
    };
    let found = json(&["--map", "S2=Grasp"]);
    assert_eq!(found["schema"], "teachtree.agreement/1");
    assert_eq!((&found["people"], &found["tasks"]), (&json!(["mika.csv", "noor.csv"]), &json!(null)));
    assert_eq!(found["primitives"]["all"]["kappa"], 0.4);
    assert_eq!(found["primitives"]["confusion"][0], json!({ "first": "Grasp", "second": "Grasp", "frames": 15 }));
    assert_eq!(found["primitives"]["rows"][0]["log"], "logs/a.csv");
    let masked = json(&["--map", "S2=mask"]);
    assert_eq!(masked["primitives"]["all"]["alone_frames"], json!([0, 25]));
    let output = teachtree_in(folder.path(), &[&args[..], &["--map", "S2=Grasp|Move"]].concat());
    assert_eq!(output.status.code(), Some(2));
    assert!(
        complained(&output).contains("mika.csv row 3: `S2` is mapped to 2 names, expected one"),
        "{}",
        complained(&output)
    );
    let output = teachtree_in(folder.path(), &[&args[..], &["-o", "noor.csv"]].concat());
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(folder.path().join("noor.csv")).unwrap(), OTHER);
}

#[test]
fn recordings_of_folders_add_up_in_either_order_of_the_people() {
    let folder = folder();
    for (person, text) in [("mika", ONE), ("noor", OTHER)] {
        std::fs::create_dir(folder.path().join(person)).unwrap();
        for name in ["a", "b", "c7"] {
            let text = if name == "c7" { ONE } else { text };
            std::fs::write(folder.path().join(person).join(format!("{name}.labels.csv")), text).unwrap();
        }
    }
    let said = |one: &str, other: &str| {
        all_said(&teachtree_in(folder.path(), &["agree", one, other, "logs", "--binding", "lift.yaml", "-q"]))
    };
    let printed = said("mika", "noor");
    // 2 · (20, 5, 10, 15) and (25, 0, 0, 25): p = 0.8, pₑ = 0.5.
    assert!(printed.contains("kappa 0.600, the same label on 80.0 % of 150 frames"), "{printed}");
    assert!(printed.contains("logs/c7.csv") && printed.contains("1.000"), "{printed}");
    assert!(said("noor", "mika").contains("kappa 0.600, the same label on 80.0 % of 150 frames"));
    // One file of one recording is not that of several.
    let args = ["agree", "mika/a.labels.csv", "noor", "logs", "--binding", "lift.yaml"];
    assert!(complained(&teachtree_in(folder.path(), &args)).contains("one label file for 3 recordings"));
}

/// Where label files are in a folder, recordings without one are left out with one warning.
#[test]
fn recordings_without_labels_are_left_out() {
    let folder = folder();
    for (person, names) in [("mika", &["a", "b", "c7"][..]), ("noor", &["a", "c7"])] {
        std::fs::create_dir(folder.path().join(person)).unwrap();
        for name in names {
            std::fs::write(folder.path().join(person).join(format!("{name}.labels.csv")), ONE).unwrap();
        }
    }
    let warning = "warning: 1 of 3 recordings have no label file in noor: they are left out\n";
    let run = |args: &[&str]| teachtree_in(folder.path(), &[args, &["--binding", "lift.yaml"]].concat());
    for args in [&["agree", "mika", "noor", "logs"][..], &["score", "logs", "--labels", "noor"]] {
        let output = run(args);
        assert_eq!((output.status.code(), complained(&output).as_str()), (Some(0), warning), "{args:?}");
    }
    assert!(all_said(&run(&["agree", "mika", "noor", "logs"])).contains("of 100 frames that both labeled"));
    assert!(all_said(&run(&["score", "logs", "--labels", "noor"])).contains("2 recordings"));
    // Rules are compared all the same.
    let compared = all_said(&run(&["diff", "contact.rules", "contact.rules", "logs", "--labels", "noor"]));
    assert_eq!(
        compared.matches("  no label file in noor: which agrees better is not known\n").count(),
        1,
        "{compared}"
    );
    // Nothing is left.
    std::fs::create_dir(folder.path().join("unlabeled")).unwrap();
    for (person, message) in
        [("unlabeled", "the log has no label file"), ("nofolder", "nofolder: there is no such file or folder")]
    {
        let output = run(&["agree", "mika", person, "logs"]);
        assert_eq!(output.status.code(), Some(2));
        assert!(complained(&output).contains(message), "{}", complained(&output));
    }
}
