//! Labels and params through the server: what is saved, who may overwrite it, and what `score` says of it.

use super::{OPENED, Studio, folder};
use crate::program::{complained, said, teachtree_in};
use crate::sets::with_set;
use serde_json::{Value, json};

pub fn line(label: &str, start_s: f64, end_s: f64) -> Value {
    json!({ "track": "right", "kind": "primitive", "label": label, "start_s": start_s, "end_s": end_s, "pinned": true,
        "by": "mika", "at": "2026-05-04T09:30:00Z" })
}

#[test]
fn labels_are_saved_beside_the_recording_and_scored() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    let file = folder.path().join("logs/b.labels.csv");
    assert_eq!(studio.get("api/recording/1/labels"), json!({ "version": "", "lines": [] }));
    let lines = json!([line("Approach", 13.5, 20.7), line("Move", 12.0, 13.5)]);
    let saved = studio.change("PUT", "api/recording/1/labels", &json!({ "base": "", "lines": lines }));
    assert_eq!(saved.status, 200, "{}", saved.json());
    assert_eq!(
        std::fs::read_to_string(&file).unwrap(),
        "track,kind,label,start_s,end_s,pinned,by,at\n\
         right,primitive,Move,12,13.5,pinned,mika,2026-05-04T09:30:00Z\n\
         right,primitive,Approach,13.5,20.7,pinned,mika,2026-05-04T09:30:00Z\n"
    );
    // The next message to the page is the saved state.
    let again = studio.get("api/recording/1/labels");
    assert_eq!(again["version"], saved.json()["version"]);
    assert_eq!(again["lines"][1], line("Approach", 13.5, 20.7));
    // The score of the list is that of the command.
    let row = studio.list()["recordings"][1].clone();
    let args = ["score", "logs/b.csv", "--binding", "lift.yaml", "--labels", "logs", "--format", "json"];
    let output = teachtree_in(folder.path(), &args);
    let scored: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", complained(&output)));
    let all = &scored["results"][0]["all"];
    for (shown, scored) in [("accuracy", &all["accuracy"]), ("scored_s", &all["scored_s"]), ("f1", &all["f1"]["50"])] {
        let (shown, scored) = (row["score"][shown].as_f64().unwrap(), scored.as_f64().unwrap());
        assert!((shown - scored).abs() < 1e-5, "{shown} {scored}");
    }
    assert!(row["score"]["accuracy"].as_f64().unwrap() < 1.0);
    assert_eq!(row["labels"], 2);
    // Without lines, the file is removed.
    let base = &again["version"];
    let emptied = studio.change("PUT", "api/recording/1/labels", &json!({ "base": base, "lines": [] }));
    assert_eq!((emptied.status, file.exists()), (200, false));
}

/// Rows that overlap are read as less than what stands there, which would then be saved.
#[test]
fn a_file_whose_rows_overlap_stays_as_it_is() {
    let folder = folder();
    let file = folder.path().join("logs/a.labels.csv");
    let text = "track,kind,label,start_s,end_s,pinned,by,at\nright,primitive,Move,12,14,pinned,mika,\nright,primitive,Approach,13.5,20,pinned,mika,\n";
    std::fs::write(&file, text).unwrap();
    let studio = Studio::start(folder.path(), &OPENED);
    let said = studio.get("api/recording/0")["label_error"].as_str().unwrap().to_string();
    assert!(said.contains("0.5 s have two labels that differ"), "{said}");
    let body = json!({ "base": "", "lines": [line("Grasp", 20.7, 21.0)] });
    assert_eq!(studio.change("PUT", "api/recording/0/labels", &body).status, 422);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), text);
}

#[test]
fn two_windows_do_not_lose_each_others_labels() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    let put = |base: &Value, label: &str| {
        let body = json!({ "base": base, "lines": [line(label, 12.0, 13.0)] });
        studio.change("PUT", "api/recording/0/labels", &body)
    };
    let first = put(&json!(""), "Move");
    assert_eq!(first.status, 200);
    // The second window has not seen the first one's labels: it gets an error with the saved ones.
    let second = put(&json!(""), "Grasp");
    assert_eq!(second.status, 409);
    assert_eq!(second.json()["lines"][0]["label"], "Move");
    assert_eq!(second.json()["version"], first.json()["version"]);
    let file = folder.path().join("logs/a.labels.csv");
    assert!(std::fs::read_to_string(&file).unwrap().contains("Move"));
    // So is one that changed what another program wrote.
    std::fs::write(&file, "track,label,start_s,end_s\nright,Grasp,12,13\n").unwrap();
    assert_eq!(put(&first.json()["version"], "Move").status, 409);
    let theirs = studio.get("api/recording/0/labels");
    assert_eq!((&theirs["lines"][0]["label"], &theirs["lines"][0]["pinned"]), (&json!("Grasp"), &json!(false)));
    assert_eq!(put(&theirs["version"], "Move").status, 200);
}

#[test]
fn wrong_labels_are_refused_and_nothing_is_written() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    let with = |key: &str, value: Value| {
        let mut line = line("Move", 12.0, 13.0);
        line[key] = value;
        line
    };
    for (lines, status, message) in [
        (json!([with("label", json!("Mov"))]), 422, "did you mean `Move`?"),
        (json!([with("label", json!(""))]), 422, "expected a primitive of the rules"),
        (json!([with("track", json!("middle"))]), 422, "expected left, right or both"),
        (json!([with("kind", json!("raw"))]), 422, "expected primitive or task"),
        (json!([with("end_s", json!(12.0))]), 422, "expected an end after the start"),
        (json!([with("start_s", json!(1e300))]), 422, "expected an end after the start"),
        (json!([with("by", json!("a\nb"))]), 422, "is printable"),
        (json!([line("Move", 12.0, 14.0), line("Grasp", 13.0, 15.0)]), 422, "overlap"),
        (json!([with("start_s", json!("12"))]), 400, "invalid body: "),
        (json!("lines"), 400, "invalid body: "),
    ] {
        let answer = studio.change("PUT", "api/recording/0/labels", &json!({ "base": "", "lines": lines }));
        assert_eq!(answer.status, status, "{lines}");
        assert!(answer.json()["error"].as_str().unwrap().contains(message), "{lines}: {}", answer.json());
    }
    assert!(!folder.path().join("logs/a.labels.csv").exists());
    // Unreadable labels are reported, and the recording is shown nevertheless.
    std::fs::write(folder.path().join("logs/c7.labels.csv"), "track,label,start_s,end_s\nright,Move,x,13\n").unwrap();
    let shown = studio.get("api/recording/2");
    assert!(shown["label_error"].as_str().unwrap().contains("row 2 column start_s"), "{}", shown["label_error"]);
    assert!(studio.list()["recordings"][2]["score_error"].as_str().unwrap().contains("row 2"));
}

#[test]
fn params_run_at_once_and_are_written_when_asked() {
    let folder = folder();
    let rules = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("rules");
    for name in ["contact.rules", "single_hand.rules", "stream.rules"] {
        std::fs::copy(rules.join(name), folder.path().join(name)).unwrap();
    }
    let text = || std::fs::read_to_string(folder.path().join("single_hand.rules")).unwrap();
    let before = text();
    let studio = Studio::start(folder.path(), &[&OPENED[..], &["--rules", "contact.rules"]].concat());
    studio.list();
    let shown = studio.get("api/recording/0");
    let near = shown["params"].as_array().unwrap().iter().find(|param| param["name"] == "near_on").unwrap();
    assert_eq!(
        (&near["value"], &near["low"], &near["unit"], &near["si"]),
        (&json!(50.0), &json!(10.0), &json!("mm"), &json!(0.001))
    );
    // Thresholds in the plots know their params.
    let lines = shown["data"]["signals"].as_array().unwrap().iter().filter_map(|entry| entry["thresholds"].as_array());
    assert!(lines.flatten().any(|line| line[2] == "near_on" && line[0] == 50.0));
    // A truth of 13.5 s, which the rules as they are miss.
    let lines = json!([line("Move", 12.0, 13.5), line("Approach", 13.5, 20.7)]);
    for at in [0, 1] {
        let saved = studio.change("PUT", &format!("api/recording/{at}/labels"), &json!({ "base": "", "lines": lines }));
        assert_eq!(saved.status, 200);
    }
    let turned = studio.change("POST", "api/recording/0/params", &json!({ "near_on": 30.0 }));
    assert_eq!(turned.status, 200, "{}", turned.json());
    assert_eq!(turned.json()["tracks"][0]["relabeled"][1][1], 13.5);
    let list = studio.list();
    assert_eq!(list["params"], json!({ "near_on": "30 mm" }));
    let row = &list["recordings"][0];
    assert!(row["score"]["accuracy"].as_f64() > row["base"]["accuracy"].as_f64(), "{row}");
    assert_eq!((&list["better"], &list["worse"], &list["labeled"]), (&json!(2), &json!(0), &json!(2)));
    // Beyond the range, against the order of thresholds, unknown: the values of before stay.
    for (values, message) in [
        (json!({ "near_on": 5.0 }), "expected 10 to 200"),
        (json!({ "near_on": 100.0 }), "wrong order"),
        (json!({ "far_on": 1.0 }), "is not a param"),
    ] {
        let refused = studio.change("POST", "api/recording/0/params", &values);
        assert_eq!(refused.status, 422);
        assert!(refused.json()["error"].as_str().unwrap().contains(message), "{}", refused.json());
    }
    assert_eq!(studio.list()["params"], json!({ "near_on": "30 mm" }));
    assert_eq!(text(), before, "nothing is written before it is asked for");
    let written = studio.change("POST", "api/recording/0/params/save", &json!({}));
    assert_eq!(written.json()["files"], json!(["single_hand.rules"]), "{}", written.json());
    let changed: Vec<(String, String)> =
        before.lines().zip(text().lines()).filter(|(a, b)| a != b).map(|(a, b)| (a.into(), b.into())).collect();
    let [(was, is)] = changed.as_slice() else { panic!("{changed:?}") };
    assert_eq!(was.replace("50 mm", "30 mm"), *is);
    let list = studio.list();
    assert_eq!(list["params"], json!({}));
    assert_eq!(list["recordings"][1]["base"], list["recordings"][1]["score"]);
}

#[test]
fn shipped_rules_are_not_written() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    assert_eq!(studio.change("POST", "api/recording/0/params", &json!({ "near_on": 30.0 })).status, 200);
    let refused = studio.change("POST", "api/recording/0/params/save", &json!({}));
    let error = refused.json()["error"].as_str().unwrap().to_string();
    assert_eq!(refused.status, 422);
    assert!(error.contains("comes with the program") && error.contains("teachtree show single_hand.rules"), "{error}");
}

#[test]
fn corrected_labels_go_to_elan_and_to_lerobot() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    let lines = json!([line("Move", 12.0, 13.5), line("Approach", 13.5, 20.7)]);
    studio.change("PUT", "api/recording/0/labels", &json!({ "base": "", "lines": lines }));
    let written = studio.change("POST", "api/recording/0/export/elan", &json!({}));
    assert_eq!(written.json()["file"], "logs/a.eaf", "{}", written.json());
    let text = std::fs::read_to_string(folder.path().join("logs/a.eaf")).unwrap();
    for (value, ms) in [("Move", "0"), ("Approach", "1500"), ("Grasp", "8700")] {
        assert!(text.contains(&format!("<ANNOTATION_VALUE>{value}</ANNOTATION_VALUE>")), "{value}");
        assert!(text.contains(&format!("TIME_VALUE=\"{ms}\"")), "{value}");
    }
    assert_eq!(studio.change("POST", "api/recording/0/export/lerobot", &json!({})).status, 422);
    // What a person corrected in ELAN stays until it is to be replaced.
    std::fs::write(folder.path().join("logs/a.eaf"), "corrected").unwrap();
    let kept = studio.change("POST", "api/recording/0/export/elan", &json!({}));
    assert_eq!((kept.status, kept.json()["error"].as_str().unwrap()), (409, "logs/a.eaf exists already"));
    let read = || std::fs::read_to_string(folder.path().join("logs/a.eaf")).unwrap();
    assert_eq!(read(), "corrected");
    assert_eq!(studio.change("POST", "api/recording/0/export/elan", &json!({ "replace": true })).status, 200);
    assert_eq!(read(), text);
    drop(studio);

    let set = with_set();
    let studio = Studio::start(set.path(), &["set", "--binding", "b.yaml"]);
    let list = studio.list();
    assert_eq!(
        list["recordings"].as_array().unwrap().iter().map(|row| &row["name"]).collect::<Vec<_>>(),
        ["set_0", "set_1", "set_2"]
    );
    let lanes = studio.get("api/recording/1")["data"]["tracks"][0]["relabeled"].clone();
    // The second segment begins two frames later.
    let time = |at: usize, place: usize| lanes[at][place].as_f64().unwrap();
    let name = |at: usize| lanes[at][0].as_str().unwrap();
    let corrected = json!([line(name(0), time(0, 1), time(1, 1) + 0.1), line(name(1), time(1, 1) + 0.1, time(1, 2))]);
    let saved = studio.change("PUT", "api/recording/1/labels", &json!({ "base": "", "lines": corrected }));
    assert_eq!(saved.status, 200, "{}", saved.json());
    assert!(set.path().join("set_1.labels.csv").is_file());
    let written = studio.change("POST", "api/recording/1/export/lerobot", &json!({}));
    assert_eq!(written.json()["file"], "set/meta/lerobot_annotations.json", "{}", written.json());
    // The file is one that `score` reads: against it the uncorrected episodes are all right.
    let score = |log: &str| {
        let output =
            teachtree_in(set.path(), &["score", log, "--binding", "b.yaml", "--labels", "set", "--format", "json"]);
        let scored: Value = serde_json::from_str(&said(&output)).unwrap_or_else(|_| panic!("{}", complained(&output)));
        scored["results"][0]["all"]["accuracy"].as_f64().unwrap()
    };
    assert!((score("set#0") - 1.0).abs() < 1e-9);
    assert!(score("set#1") < 1.0);
}

#[test]
fn explanations_are_those_of_the_command() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    let shown = studio.get("api/recording/0/explain?t=14&track=right&why_not=Grasp");
    let args =
        ["explain", "logs/a.csv", "--binding", "lift.yaml", "--at", "14s", "--track", "right", "--why-not", "Grasp"];
    assert_eq!(shown["text"].as_str().unwrap().trim(), said(&teachtree_in(folder.path(), &args)).trim());
    assert_eq!(studio.get_with("api/recording/0/explain?t=x", "").status, 400);
    assert_eq!(studio.get_with("api/recording/0/explain?t=99", "").status, 422);
}

#[test]
fn videos_are_served_in_parts() {
    let folder = folder();
    let bytes: Vec<u8> = (0..=255).collect();
    std::fs::write(folder.path().join("logs/a.mp4"), &bytes).unwrap();
    let studio = Studio::start(folder.path(), &OPENED);
    assert_eq!(studio.get("api/recording/0")["videos"], json!([{ "camera": "video", "offset": 0.0 }]));
    assert_eq!(studio.get("api/recording/1")["videos"], json!([]));
    let part = |range: &str| studio.get_with("video/0/0", &format!("Range: {range}\r\n"));
    let whole = studio.get_with("video/0/0", "");
    assert_eq!((whole.status, &whole.body), (200, &bytes));
    assert!(whole.head.contains("Content-Type: video/mp4") && whole.head.contains("Accept-Ranges: bytes"));
    for (range, expected) in
        [("bytes=10-19", 10..20), ("bytes=250-", 250..256), ("bytes=-6", 250..256), ("bytes=0-999", 0..256)]
    {
        let answer = part(range);
        assert_eq!((answer.status, &answer.body[..]), (206, &bytes[expected.clone()]), "{range}");
        let said = format!("Content-Range: bytes {}-{}/256", expected.start, expected.end - 1);
        assert!(answer.head.contains(&said), "{}", answer.head);
    }
    assert_eq!(part("bytes=256-").status, 416);
    for path in ["video/0/1", "video/1/0", "video/0/-1", "video/0/..%2f..%2fa.csv"] {
        assert_eq!(studio.get_with(path, "").status, 404, "{path}");
    }
}
