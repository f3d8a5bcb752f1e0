//! What is found, what is reported of a place, what a file holds, and what is proposed to be mended.

use super::editor::Editor;
use serde_json::{Value, json};

const THROW: &str = "use \"contact.rules\"\n\nparam fast = 200 mm\n\nprimitive Throw is Translate\n\nextend single_hand before carried {\n  grapsed and norm(target.velocity) > fast => Throw\n}\n";

#[test]
fn all_mistakes_of_a_file_are_reported_as_they_are_typed() {
    let mut editor = Editor::new(&[]);
    editor.open("throw.rules", THROW);
    let found = editor.findings("throw.rules");
    let printed: Vec<(String, String, &Value)> = found
        .iter()
        .map(|it| (it["code"].as_str().unwrap().to_string(), editor.text("throw.rules", &it["range"]), &it["severity"]))
        .collect();
    assert_eq!(printed, [("E201".into(), "grapsed".into(), &json!(1)), ("E301".into(), "fast".into(), &json!(1))]);
    let message = found[0]["message"].as_str().unwrap();
    assert_eq!(message, "there is no value `grapsed`\nnothing has this name\nhelp: did you mean `grasped`?");
    let related = &found[1]["relatedInformation"][0];
    assert_eq!(related["message"], "this is a speed (m/s)");
    assert_eq!(editor.text("throw.rules", &related["location"]["range"]), "norm(target.velocity)");
    // The code leads to its page.
    let page = found[1]["codeDescription"]["href"].as_str().unwrap().strip_prefix("file://").unwrap();
    assert!(std::fs::read_to_string(page).unwrap().starts_with("# E301\n"));
    // Mended, then broken in the middle of typing, then mended again.
    let mended = THROW.replace("grapsed", "grasped").replace("200 mm", "200 mm/s");
    editor.change("throw.rules", &mended);
    assert_eq!(editor.codes("throw.rules"), Vec::<String>::new());
    editor.change("throw.rules", &mended.replace("=> Throw\n}", "=> "));
    assert!(editor.codes("throw.rules").contains(&"E101".to_string()), "{:?}", editor.diagnostics);
    editor.change("throw.rules", &mended);
    assert_eq!(editor.codes("throw.rules"), Vec::<String>::new());
    editor.change("throw.rules", THROW);
    assert_eq!(editor.codes("throw.rules").len(), 2);
    let uri = editor.uri("throw.rules");
    editor.close("throw.rules");
    while editor.diagnostics[&uri] != json!([]) {
        editor.next();
    }
    editor.end();
}

#[test]
fn columns_are_counted_in_utf_16_and_lines_end_as_they_end() {
    for end in ["\n", "\r\n"] {
        let mut editor = Editor::new(&[]);
        let text =
            ["// 🦾 ä", "use \"𝄞ä.rules\" // 🦾", "/// 𝄞", "param a = 3 mmm // 🦾", "param b = 2 N", ""].join(end);
        editor.open("ä 🦾.rules", &text);
        // Editors write such a name with `%`, and it is the same file.
        let found = editor.findings("ä 🦾.rules");
        let range = |line: u32, from: u32, to: u32| json!({ "start": { "line": line, "character": from }, "end": { "line": line, "character": to } });
        assert_eq!(found[0]["range"], range(1, 4, 15), "{found:?}");
        assert_eq!(found[1]["range"], range(3, 12, 15), "{found:?}");
        let uri = editor.uri("").to_string() + "/%C3%A4%20%F0%9F%A6%BE.rules";
        let params = json!({ "textDocument": { "uri": uri }, "position": { "line": 4, "character": 6 } });
        let hover = editor.ask("textDocument/hover", params);
        assert_eq!(hover["result"]["range"], range(4, 6, 7), "{hover}");
        editor.end();
    }
}

#[test]
fn what_is_not_saved_counts_in_other_files_too() {
    let mut editor = Editor::new(&[]);
    editor.write("part.rules", "use \"contact.rules\"\nsignal old = true\n");
    editor.open("main.rules", "use \"part.rules\"\nsignal both = young and left.grasped\n");
    assert_eq!(editor.codes("main.rules"), ["E201"], "as it is on disk");
    editor.open("part.rules", "use \"contact.rules\"\nsignal young = true\n");
    assert_eq!(editor.codes("main.rules"), ["W201"], "as it is in the editor");
    // A mistake of the file that is used is shown there, and is not there any more when it is mended.
    editor.change("part.rules", "use \"contact.rules\"\nsignal young = tru\n");
    assert_eq!(editor.codes("part.rules"), ["E201"]);
    assert_eq!(editor.codes("main.rules"), Vec::<String>::new());
    editor.close("part.rules");
    assert_eq!(editor.codes("main.rules"), ["E201"], "as it is on disk again");
    // A file that exists in the editor only.
    editor.change("main.rules", "use \"new.rules\"\nsignal both = young and left.grasped\n");
    assert_eq!(editor.codes("main.rules"), ["E208"]);
    editor.open("new.rules", "use \"contact.rules\"\nsignal young = true\n");
    assert_eq!(editor.codes("main.rules"), ["W201"]);
    editor.end();
}

#[test]
fn a_finding_in_a_shipped_file_is_shown_where_the_author_can_do_something() {
    let mut editor = Editor::with(&[], json!({ "hand": "hand_nowhere.rules" }));
    editor.open("main.rules", "// mine\nuse \"contact.rules\"\n");
    let found = editor.findings("main.rules");
    assert!(
        found.iter().any(|it| it["code"] == "E208" && it["message"].as_str().unwrap().contains("hand_nowhere.rules")),
        "{found:?}"
    );
    assert_eq!(found[0]["range"]["start"], json!({ "line": 0, "character": 0 }));
    assert!(editor.diagnostics.keys().all(|uri| uri.ends_with("main.rules")), "{:?}", editor.diagnostics);
    editor.end();
}

#[test]
fn hover_on_a_learned_line_shows_its_evidence() {
    for end in ["\n", "\r\n"] {
        let mut editor = Editor::new(&[]);
        let text = [
            "use \"contact.rules\"",
            "param fast = 200 mm/s    // learned: held out in 4 groups: F1@50 62.1 -> 81.0 %",
            "primitive Throw is Translate",
            "extend single_hand before carried {",
            "  grasped and norm(target.velocity) > fast => Throw    // learned: 3 intervals of 3 recordings, median 0.3 s late",
            "}",
            "",
        ]
        .join(end);
        editor.open("throw.rules", &text);
        assert_eq!(editor.codes("throw.rules"), Vec::<String>::new(), "comments cause no findings");
        let evidence = "learned: 3 intervals of 3 recordings, median 0.3 s late";
        // A word of the comment is not a unit.
        for place in ["0.3 |s late", "// lear|ned: 3", "/|/ learned: 3"] {
            let answer = editor.at("textDocument/hover", "throw.rules", place, json!({}));
            assert_eq!(answer["result"]["contents"]["value"], evidence, "{place}");
            assert_eq!(editor.text("throw.rules", &answer["result"]["range"]), format!("// {evidence}"));
        }
        for place in ["gr|asped and", "> fa|st =>", "=> Thr|ow"] {
            let said = hover(&mut editor, "throw.rules", place);
            assert!(said.starts_with("```teachtree\n") && said.ends_with(&format!("\n\n{evidence}")), "{said}");
        }
        let fast = hover(&mut editor, "throw.rules", "param fa|st");
        assert_eq!(fast.matches("learned: held out in 4 groups: F1@50 62.1 -> 81.0 %").count(), 1, "{fast}");
        assert!(!hover(&mut editor, "throw.rules", "primitive Thr|ow").contains("learned"), "another line");
        editor.end();
    }
}

fn hover(editor: &mut Editor, name: &str, place: &str) -> String {
    let answer = editor.at("textDocument/hover", name, place, json!({}));
    answer["result"]["contents"]["value"].as_str().unwrap_or_else(|| panic!("{place}: {answer}")).to_string()
}

#[test]
fn hover_tells_declaration_type_range_and_comments() {
    let mut editor = Editor::new(&[]);
    let text = "use \"contact.rules\"\r\n\r\n// Not about it.\r\n\r\n// Once moved,\r\n/// it goes on <fast>.\r\nparam quick = 20 cm/s in 50 mm/s .. 1 m/s // ours 🦾\r\nfor each hand {\r\n  signal runs = norm(target.velocity) above quick\r\n                until below 0.5 * quick // per hand\r\n}\r\n";
    editor.open("main.rules", text);
    assert_eq!(
        hover(&mut editor, "main.rules", "above q|uick"),
        "```teachtree\nparam quick = 20 cm/s in 50 mm/s .. 1 m/s\n```\n\na speed (m/s), from 50 mm/s to 1 m/s\n\nOnce moved,\nit goes on \\<fast>.\nours 🦾\n\nnow 200 mm/s"
    );
    assert_eq!(
        hover(&mut editor, "main.rules", "r|uns"),
        "```teachtree\nsignal runs = norm(target.velocity) above quick\n  until below 0.5 * quick\n```\n\na condition, of each hand\n\nper hand"
    );
    let velocity = hover(&mut editor, "main.rules", "target.v|elocity");
    assert!(velocity.contains("a vec3 (m/s), of each hand") && velocity.contains("without the tremor"), "{velocity}");
    let norm = hover(&mut editor, "main.rules", "n|orm");
    assert!(norm.contains("norm(v)") && norm.contains("the length of a vec3"), "{norm}");
    let above = hover(&mut editor, "main.rules", "a|bove");
    assert!(above.contains("\n\na condition\n\na hysteresis: true once"), "{above}");
    assert_eq!(hover(&mut editor, "main.rules", "20 c|m/s"), "`cm`: a length, 0.01 m");
    let grasped = {
        editor.change("main.rules", "use \"contact.rules\"\nsignal a = left.grasped and left.squeeze > 1 N\n");
        hover(&mut editor, "main.rules", "g|rasped")
    };
    assert!(grasped.contains("signal grasped") && grasped.contains("a condition, of each hand"), "{grasped}");
    // The implementation of an abstract signal is shown, with its declaration.
    let squeeze = hover(&mut editor, "main.rules", "s|queeze");
    assert!(squeeze.contains("signal squeeze = ") && squeeze.contains("a force (N)"), "{squeeze}");
    assert!(!squeeze.contains("no value"), "{squeeze}");
    editor.change("main.rules", "use \"contact.rules\"\ntask lost = Move .. Release with Push is failure before push\nsignal a = (left.grasped) lasting 2 s\n");
    let lost = hover(&mut editor, "main.rules", "l|ost");
    assert!(lost.contains("is failure before push\n```\n\na task that is a failure"), "{lost}");
    let push = hover(&mut editor, "main.rules", "before p|ush");
    assert!(push.contains("task push") && !push.contains("failure"), "{push}");
    let lasting = hover(&mut editor, "main.rules", "l|asting");
    assert!(
        lasting.contains("(left.grasped) lasting 2 s") && lasting.contains("if it holds for at least the time"),
        "{lasting}"
    );
    // In a broken file too.
    editor.change(
        "main.rules",
        "use \"contact.rules\"\nsignal a = left.grasped and and\nsignal b = left.lifted\nsignal c = left.grasped\n",
    );
    assert!(hover(&mut editor, "main.rules", "left.g|rasped\n").contains("a condition, of each hand"));
    editor.end();
}

const LOG: &str = "demos/robosuite/SawyerLift_demo_1.csv";
const BINDING: &str = "demos/robosuite/sawyer_lift.binding.yaml";

#[test]
fn hover_tells_values_of_a_recording() {
    let root = env!("CARGO_MANIFEST_DIR");
    let by_options = ["--log", LOG, "--binding", BINDING, "--at", "9.5s"];
    let by_settings = json!({ "teachtree": { "log": format!("{root}/{LOG}"), "binding": format!("{root}/{BINDING}"), "at": "9.5s" } });
    for mut editor in [Editor::new(&by_options), Editor::with(&["--at", "8s"], by_settings)] {
        let text = "use \"contact.rules\"\nfor each hand {\n  signal high = touching and target.position.z > 0.5 m\n}\nextend single_hand.held before Press {\n  high and lifted => Press\n}\n";
        editor.open("main.rules", text);
        assert_eq!(editor.codes("main.rules"), Vec::<String>::new(), "the hand model is that of the binding");
        let touching = hover(&mut editor, "main.rules", "t|ouching");
        assert!(touching.contains("at 9.500 s of `SawyerLift_demo_1.csv`\n- right **false**\n"), "{touching}");
        let compared = hover(&mut editor, "main.rules", "target.position.z >| 0.5 m");
        assert!(compared.contains("- right **") && compared.contains("> 500 mm, 320 mm to spare"), "{compared}");
        let position = hover(&mut editor, "main.rules", "target.p|osition");
        assert!(position.contains("- right **("), "{position}");
        let leaf = hover(&mut editor, "main.rules", "=> P|ress");
        assert!(leaf.contains("- right **Release**"), "{leaf}");
        let high = hover(&mut editor, "main.rules", "signal h|igh");
        assert!(high.contains("- right **"), "{high}");
        // Another time, while it runs.
        let before = hover(&mut editor, "main.rules", "target.p|osition");
        editor.tell("workspace/didChangeConfiguration", json!({ "settings": { "teachtree": { "at": "11s" } } }));
        let after = hover(&mut editor, "main.rules", "target.p|osition");
        assert!(after.contains("at 11.000 s") && after != before, "{before}\n{after}");
        editor.tell("workspace/didChangeConfiguration", json!({ "settings": { "at": "1000s" } }));
        let beyond = hover(&mut editor, "main.rules", "target.p|osition");
        assert!(beyond.contains("no value: nothing is known at 1000.000 s"), "{beyond}");
        editor.change("main.rules", &text.replace("0.5 m", "0.5 N"));
        let broken = hover(&mut editor, "main.rules", "t|ouching");
        assert!(broken.contains("no value: the rules have mistakes"), "{broken}");
        editor.end();
    }
}

#[test]
fn the_guide_shows_what_hover_tells() {
    let mut editor = Editor::new(&["--log", LOG, "--binding", BINDING, "--at", "11.3s"]);
    editor.open("mine.rules", &std::fs::read_to_string("rules/single_hand.rules").unwrap());
    let mut printed = hover(&mut editor, "mine.rules", "latch l|ifted");
    for sign in ["```teachtree\n", "\n```", "**", "`", "\\"] {
        printed = printed.replace(sign, "");
    }
    assert!(
        include_str!("../../../editors/README.md").contains(&printed),
        "editors/README.md shows something else than\n{printed}"
    );
    editor.end();
}

#[test]
fn a_recording_that_is_written_anew_is_read_anew() {
    let mut editor = Editor::new(&["--binding", BINDING]);
    let text = std::fs::read_to_string(LOG).unwrap();
    editor.write("taught.csv", &text);
    editor.tell("workspace/didChangeConfiguration", json!({ "settings": { "teachtree": { "log": "taught.csv" } } }));
    editor.open("main.rules", "use \"contact.rules\"\nsignal a = right.touching\n");
    let first = hover(&mut editor, "main.rules", "t|ouching");
    assert!(first.contains("at 7.904 s of `taught.csv`"), "{first}");
    let mut rows: Vec<&str> = text.lines().collect();
    rows.drain(1..101);
    editor.write("taught.csv", &rows.join("\n"));
    let second = hover(&mut editor, "main.rules", "t|ouching");
    assert!(second.contains("of `taught.csv`") && !second.contains("at 7.904 s"), "{second}");
    std::fs::remove_file(editor.path("taught.csv")).unwrap();
    assert!(!hover(&mut editor, "main.rules", "t|ouching").contains("taught.csv"));
    editor.end();
}

#[test]
fn settings_that_are_wrong_are_shown() {
    let mut editor = Editor::with(&[], json!({ "log": "nowhere.csv" }));
    for (sent, printed) in [
        (json!({ "teachtree": { "at": "noon" } }), "expected a time such as 3.41s or 3410ms, found `noon`"),
        (json!({ "teachtree": { "log": 7 } }), "the settings of teachtree are wrong"),
        (json!({ "log": "elsewhere.csv" }), "elsewhere.csv"),
        (json!({ "log": "", "at": "" }), ""),
    ] {
        editor.tell("workspace/didChangeConfiguration", json!({ "settings": sent }));
        editor.ask("textDocument/unheard", json!(null));
        if printed.is_empty() {
            continue;
        }
        assert!(editor.shown.last().unwrap().contains(printed), "{:?}", editor.shown);
    }
    // `nowhere.csv`, first and again behind each setting that was refused.
    assert!(editor.shown[0].contains("nowhere.csv"), "{:?}", editor.shown);
    editor.end();
}

#[test]
fn a_file_is_reported_as_a_tree_of_declarations() {
    let mut editor = Editor::new(&[]);
    let text = std::fs::read_to_string("rules/contact.rules").unwrap();
    editor.open("contact.rules", &text);
    let answer =
        editor.ask("textDocument/documentSymbol", json!({ "textDocument": { "uri": editor.uri("contact.rules") } }));
    let mut printed = String::new();
    write(&editor, &answer["result"], 0, &mut printed);
    insta::assert_snapshot!(printed);
    editor.end();
}

/// Symbols as lines; each one's own place lies in the whole of it, and that within what is above.
fn write(editor: &Editor, symbols: &Value, depth: usize, printed: &mut String) {
    for symbol in symbols.as_array().unwrap() {
        let (whole, own) =
            (editor.text("contact.rules", &symbol["range"]), editor.text("contact.rules", &symbol["selectionRange"]));
        assert!(whole.contains(&own) && !own.is_empty(), "{symbol}");
        let detail = symbol["detail"].as_str().unwrap_or("");
        printed.push_str(&format!(
            "{}{} [{detail}] {}\n",
            "  ".repeat(depth),
            symbol["name"].as_str().unwrap(),
            symbol["kind"]
        ));
        if let Some(children) = symbol.get("children") {
            write(editor, children, depth + 1, printed);
        }
    }
}

#[test]
fn a_file_gets_the_one_style_and_keeps_its_ends_of_lines() {
    for end in ["\n", "\r\n"] {
        let mut editor = Editor::new(&[]);
        let text = [
            "// 🦾",
            "param a   =  3 mm",
            "",
            "",
            "",
            "param b = 2 N // ä",
            "for each hand {",
            "signal c = ( true )",
            "}",
            "",
        ]
        .join(end);
        editor.open("main.rules", &text);
        let options = json!({ "tabSize": 4, "insertSpaces": true });
        let params = json!({ "textDocument": { "uri": editor.uri("main.rules") }, "options": options });
        let answer = editor.ask("textDocument/formatting", params.clone());
        let edits = json!({ "changes": { editor.uri("main.rules"): answer["result"] } });
        editor.apply(&edits);
        let formatted = std::fs::read_to_string(editor.path("main.rules")).unwrap();
        let wanted = teachtree_language::format::format(&text).unwrap().replace('\n', end);
        assert_eq!(formatted, wanted);
        assert_ne!(formatted, text);
        assert_eq!(editor.ask("textDocument/formatting", params.clone())["result"], json!([]), "nothing is left to do");
        editor.change("main.rules", "param a = = 3 mm");
        let refused = editor.ask("textDocument/formatting", params);
        assert!(
            refused["error"]["message"].as_str().unwrap().contains("a file with syntax errors is not formatted"),
            "{refused}"
        );
        editor.end();
    }
}

#[test]
fn fixes_mend() {
    let mut editor = Editor::new(&[]);
    editor.open(
        "throw.rules",
        &THROW.replace("200 mm\n", "200 mm/s\n").replace("=> Throw", "Throw").replace('\n', "\r\n"),
    );
    let mut mended = Vec::new();
    for _ in 0..5 {
        let found = editor.findings("throw.rules");
        let Some(first) = found.first() else { break };
        let context = json!({ "diagnostics": [first] });
        let params = json!({ "textDocument": { "uri": editor.uri("throw.rules") }, "range": first["range"], "context": context });
        let answer = editor.ask("textDocument/codeAction", params.clone());
        let action = &answer["result"][0];
        assert_eq!(
            (&action["kind"], &action["diagnostics"][0]["code"]),
            (&json!("quickfix"), &first["code"]),
            "{answer}"
        );
        mended.push(action["title"].as_str().unwrap().to_string());
        let mut other = params;
        other["context"]["only"] = json!(["source.organizeImports"]);
        assert_eq!(editor.ask("textDocument/codeAction", other.clone())["result"], json!([]));
        editor.apply(&action["edit"]);
    }
    assert_eq!(mended, ["write `=>` before a leaf", "did you mean `grasped`?"]);
    assert_eq!(editor.codes("throw.rules"), Vec::<String>::new());
    // Far from what is found there is nothing to mend.
    editor.change("throw.rules", THROW);
    let nowhere = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 0, "character": 3 } });
    let params = json!({ "textDocument": { "uri": editor.uri("throw.rules") }, "range": nowhere, "context": { "diagnostics": [] } });
    assert_eq!(editor.ask("textDocument/codeAction", params)["result"], json!([]));
    editor.end();
}

/// Scenes, operator scripts, bindings and robot files are read as the commands read them; nothing else is offered for them.
#[test]
fn yaml_files_have_their_error_at_its_place() {
    let mut editor = Editor::new(&[]);
    let text = "bodies:\n  cube: {role: objekt, mass: 50 g}\n";
    editor.open("cell.scene.yaml", text);
    let found = editor.findings("cell.scene.yaml");
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(editor.text("cell.scene.yaml", &found[0]["range"]), "objekt, mass: 50 g}");
    assert!(found[0]["message"].as_str().unwrap().contains("expected"), "{found:?}");
    let at = editor.at("textDocument/hover", "cell.scene.yaml", "objekt", json!({}));
    assert!(at["result"].is_null(), "{at}");
    editor.change("cell.scene.yaml", &text.replace("objekt", "object"));
    assert!(editor.findings("cell.scene.yaml").is_empty());
    editor.open("lab.binding.yaml", "channels:\n  right.thumb.force: [a, b]\n");
    assert_eq!(editor.findings("lab.binding.yaml").len(), 1);
    editor.open("notes.yaml", "a: [\n");
    assert!(editor.findings("notes.yaml").is_empty());
}
