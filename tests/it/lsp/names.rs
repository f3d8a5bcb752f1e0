//! Names: where they are declared, where they stand, what becomes of them, and which fit.

use super::editor::Editor;
use crate::program::{all_said, teachtree};
use serde_json::{Value, json};

const PART: &str = "/// What every file of ours asks.\nuse \"single_hand.rules\"\n\n// As far as an arm reaches 🦾.\nparam far = 0.2 m in 0.1 m .. 0.5 m   // ours\n\nprimitive Hover\n\nfor each hand {\n  signal away = norm(target.position) > far\n  latch flown set away clear not away\n}\n";
const MAIN: &str = "use \"part.rules\"\r\n// 𝄞 ä: columns are counted in UTF-16\r\nextend single_hand.held before touchdown {\r\n  aloft: away and flown => Hover\r\n}\r\nextend single_hand.held before aloft { lifted and away => Hover }\r\ntask hover = Move .. Release with Hover before pick_and_place\r\nextend task hover with Translate\r\nrelabel hover { Hover between Translate and Translate becomes Translate }\r\n";

/// An editor with two files, the one that uses the other one open.
fn two_files() -> Editor {
    let mut editor = Editor::new(&[]);
    editor.write("part.rules", PART);
    editor.write("main.rules", MAIN);
    editor.open("main.rules", MAIN);
    assert_eq!(editor.codes("main.rules"), Vec::<String>::new());
    editor
}

/// `main.rules:4:16 away` for each place.
fn printed(locations: &Value) -> Vec<String> {
    let name = |uri: &str| uri.rsplit('/').next().unwrap().to_string();
    let place = |location: &Value| {
        let start = &location["range"]["start"];
        format!("{}:{}:{}", name(location["uri"].as_str().unwrap()), start["line"], start["character"])
    };
    locations.as_array().unwrap_or_else(|| panic!("{locations}")).iter().map(place).collect()
}

fn definition(editor: &mut Editor, name: &str, place: &str) -> Vec<String> {
    let answer = editor.at("textDocument/definition", name, place, json!({}));
    printed(&answer["result"])
}

fn references(editor: &mut Editor, name: &str, place: &str) -> Vec<String> {
    let answer =
        editor.at("textDocument/references", name, place, json!({ "context": { "includeDeclaration": true } }));
    printed(&answer["result"])
}

#[test]
fn a_declaration_is_found_in_every_file() {
    let mut editor = two_files();
    assert_eq!(definition(&mut editor, "main.rules", "a|way and"), ["part.rules:9:9"]);
    assert_eq!(definition(&mut editor, "main.rules", "away| and"), ["part.rules:9:9"], "at its end too");
    assert_eq!(definition(&mut editor, "main.rules", "=> H|over"), ["part.rules:6:10"]);
    assert_eq!(definition(&mut editor, "main.rules", "task h|over with"), ["main.rules:6:5"]);
    assert_eq!(definition(&mut editor, "main.rules", "before al|oft"), ["main.rules:3:2"]);
    assert_eq!(definition(&mut editor, "main.rules", "\"pa|rt.rules\""), ["part.rules:0:0"]);
    assert_eq!(definition(&mut editor, "main.rules", "e|xtend"), Vec::<String>::new());
    // What comes with the program is a file that can be opened, and read on from there.
    let answer = editor.at("textDocument/definition", "main.rules", "single_hand.h|eld", json!({}));
    let uri = answer["result"][0]["uri"].as_str().unwrap().to_string();
    let path = uri.strip_prefix("file://").unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    assert_eq!(text, std::fs::read_to_string("rules/single_hand.rules").unwrap());
    assert!(std::fs::metadata(path).unwrap().permissions().readonly());
    let line = answer["result"][0]["range"]["start"]["line"].as_u64().unwrap() as usize;
    assert!(text.lines().nth(line).unwrap().trim_start().starts_with("held:"));
    let document = json!({ "uri": uri, "languageId": "teachtree", "version": 1, "text": text });
    editor.tell("textDocument/didOpen", json!({ "textDocument": document }));
    let line = text.lines().position(|line| line.starts_with("use ")).unwrap();
    let params = json!({ "textDocument": { "uri": uri }, "position": { "line": line, "character": 8 } });
    let answer = editor.ask("textDocument/definition", params);
    assert!(answer["result"][0]["uri"].as_str().unwrap().ends_with("/rules/stream.rules"), "{answer}");
    editor.end();
}

#[test]
fn an_abstract_signal_leads_to_its_declaration_and_its_implementation() {
    let mut editor = two_files();
    editor.open("asks.rules", "use \"single_hand.rules\"\nsignal held = left.squeeze > 1 N\n");
    let places = definition(&mut editor, "asks.rules", "left.s|queeze");
    let names: Vec<&str> = places.iter().map(|place| place.split(':').next().unwrap()).collect();
    assert_eq!(names, ["single_hand.rules", "hand_force.rules"]);
}

#[test]
fn references_are_found_over_files_open_or_not() {
    let mut editor = two_files();
    let everywhere = ["main.rules:3:9", "main.rules:5:50", "part.rules:9:9", "part.rules:10:18", "part.rules:10:33"];
    assert_eq!(references(&mut editor, "main.rules", "a|way and"), everywhere);
    // From the file that is used, with the one that uses it closed.
    editor.close("main.rules");
    editor.open("part.rules", PART);
    assert_eq!(references(&mut editor, "part.rules", "a|way ="), everywhere);
    let without = json!({ "context": { "includeDeclaration": false } });
    let answer = editor.at("textDocument/references", "part.rules", "a|way =", without);
    assert_eq!(printed(&answer["result"]).len(), 4);
    assert_eq!(references(&mut editor, "part.rules", "H|over").len(), 5);
    editor.end();
}

#[test]
fn a_name_is_changed_in_all_files_and_they_still_compile() {
    for (file, place, new) in [
        ("main.rules", "a|way and", "gone"),
        ("main.rules", "=> H|over", "Fly_2"),
        ("main.rules", "task h|over =", "hovering"),
        ("main.rules", "al|oft:", "up"),
        ("main.rules", "flo|wn", "_was_away"),
    ] {
        let mut editor = two_files();
        let prepared = editor.at("textDocument/prepareRename", file, place, json!({}));
        let range = &prepared["result"]["range"];
        assert_eq!(prepared["result"]["placeholder"], editor.text(file, range), "{prepared}");
        let answer = editor.at("textDocument/rename", file, place, json!({ "newName": new }));
        let old = prepared["result"]["placeholder"].as_str().unwrap();
        editor.apply(&answer["result"]);
        assert_eq!(editor.codes("main.rules"), Vec::<String>::new(), "{old} {answer}");
        let checked = teachtree(&["check", editor.path("main.rules").to_str().unwrap()]);
        assert!(checked.status.success(), "{}", all_said(&checked));
        for name in ["main.rules", "part.rules"] {
            let text = std::fs::read_to_string(editor.path(name)).unwrap();
            let code: String = text.lines().map(|line| line.split("//").next().unwrap().to_string() + "\n").collect();
            let words = code.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
            let left = words.filter(|word| *word == old && (old != "hover" || name == "main.rules")).count();
            assert_eq!(left, 0, "{old} in {text}");
        }
        editor.end();
    }
}

#[test]
fn a_name_is_changed_in_a_closed_file_that_uses_this_one() {
    let mut editor = two_files();
    editor.close("main.rules");
    // What is not saved yet counts.
    editor.open("part.rules", &format!("{PART}\nsignal nearer = norm(left.target.position) < far\n"));
    let answer = editor.at("textDocument/rename", "part.rules", "a|way =", json!({ "newName": "gone" }));
    editor.apply(&answer["result"]);
    let checked = teachtree(&["check", editor.path("main.rules").to_str().unwrap()]);
    assert!(checked.status.success(), "{}", all_said(&checked));
    assert!(std::fs::read_to_string(editor.path("main.rules")).unwrap().contains("aloft: gone and flown"));
    editor.end();
}

#[test]
fn a_name_that_cannot_be_changed_is_refused_with_the_reason() {
    let mut editor = two_files();
    for (place, new, reason) in [
        ("before t|ouchdown", "x", "the choice `touchdown` comes with the program"),
        ("Release with Hover b|efore", "x", "nothing here has a name"),
        ("M|ove ..", "Put", "the primitive `Move` comes with the program (rules/single_hand.rules:"),
        ("s|ingle_hand.held", "tree", "the tree `single_hand` comes with the program"),
        ("single_hand.h|eld", "x", "the choice `held` comes with the program"),
        ("a|way and", "lifted", "`lifted` is a latch already"),
        ("a|way and", "far", "`far` is a param already"),
        ("a|way and", "target", "`target` is a channel already"),
        ("a|way and", "norm", "`norm` is a function already"),
        ("a|way and", "ms", "`ms` is a unit already"),
        ("a|way and", "left", "`left` is a hand already"),
        ("a|way and", "until", "`until` is a word of the language"),
        ("a|way and", "Away", "`Away` is not a name: a small letter"),
        ("a|way and", "a way", "`a way` is not a name"),
        ("a|way and", "", "`` is not a name"),
        ("=> H|over", "hover", "`hover` is not a name of a primitive"),
        ("=> H|over", "Grasp", "`Grasp` is a primitive already"),
        ("task h|over =", "push", "`push` is a task already"),
        ("e|xtend", "x", "nothing here has a name that can be changed"),
        ("\"pa|rt.rules\"", "x", "rename the file itself"),
    ] {
        if reason.contains("`push`") {
            // The tasks of contact.rules are there only when it is used.
            let text = format!("use \"contact.rules\"\r\n{}", MAIN);
            editor.change("main.rules", &text);
        }
        let answer = editor.at("textDocument/rename", "main.rules", place, json!({ "newName": new }));
        let message = answer["error"]["message"].as_str().unwrap_or_else(|| panic!("{place} {new}: {answer}"));
        assert!(message.contains(reason), "{place} {new}: {message}");
    }
    editor.open(
        "names.rules",
        "use \"stream.rules\"\nsignal a = norm(left.target.velocity) > 1 m/s\nstream { own.thing : scalar N }\n",
    );
    for (place, reason) in [
        ("n|orm", "`norm` is a function of the language"),
        ("t|arget", "`target.velocity` is derived by the program"),
        ("o|wn.thing", "`own.thing` is the name of this channel in logs"),
    ] {
        let answer = editor.at("textDocument/prepareRename", "names.rules", place, json!({}));
        assert!(answer["error"]["message"].as_str().unwrap().contains(reason), "{answer}");
    }
    // What cannot be read may name it too.
    editor.change("main.rules", &format!("{MAIN}\r\nsignal b = away and and\r\n"));
    let answer = editor.at("textDocument/rename", "main.rules", "a|way and flown", json!({ "newName": "gone" }));
    let message = answer["error"]["message"].as_str().unwrap();
    assert!(message.contains("files with errors are not changed"), "{message}");
    editor.end();
}

/// What is proposed where `|` stands in a text.
fn proposed(editor: &mut Editor, text: &str) -> Vec<String> {
    let cursor = text.find('|').unwrap();
    let text = text.replacen('|', "", 1);
    editor.change("new.rules", &text);
    let head = &text[..cursor];
    let character = head.rsplit('\n').next().unwrap().encode_utf16().count();
    let position = json!({ "line": head.matches('\n').count(), "character": character });
    let params = json!({ "textDocument": { "uri": editor.uri("new.rules") }, "position": position });
    let answer = editor.ask("textDocument/completion", params);
    let word = head.rsplit(|c: char| !c.is_ascii_alphanumeric() && c != '_' && c != '"').next().unwrap();
    answer["result"]
        .as_array()
        .unwrap_or_else(|| panic!("{answer}"))
        .iter()
        .map(|item| {
            let range = &item["textEdit"]["range"];
            assert_eq!(range["end"], position, "{item}");
            assert_eq!(editor.text("new.rules", range), word.trim_matches('"'), "{item}");
            assert_eq!(item["textEdit"]["newText"], item["label"]);
            item["label"].as_str().unwrap().to_string()
        })
        .collect()
}

#[test]
fn what_fits_is_proposed() {
    let mut editor = two_files();
    editor.open("new.rules", "");
    let head = "use \"part.rules\" // 🦾\r\nparam near_by = 30 mm\r\n";
    let tree = format!("{head}extend single_hand.held before touchdown {{\r\n  up: away and flown => Hover\r\n");
    for (text, some, none) in [
        ("|", "use param primitive tree extend signal", "and touching Grasp else"),
        ("par|", "param", "touching"),
        (&format!("{head}|"), "use task relabel", "touching"),
        (&format!("{head}signal a = |"), "near_by away norm left true not from", "Grasp param mm else"),
        (&format!("{head}signal a = aw|"), "away near_by", "Grasp"),
        (&format!("{head}signal a = left.|"), "away target.velocity touching", "near_by norm left"),
        (&format!("{head}signal a = left.target.|"), "velocity depth", "away near_by target.velocity"),
        (&format!("{head}signal a = left.target.velocity.|"), "x y z", "away velocity"),
        (&format!("{head}signal a = norm(|"), "target.velocity away", "param"),
        (&format!("{head}signal a = left.fingers.force[|"), "thumb opposing", "away"),
        (&format!("{head}signal a = left.target.depth > 3 |"), "mm m mm/s and or", "away Grasp"),
        (&format!("{head}signal a = left.target.depth > 3 m|"), "mm m", "away"),
        (&format!("{head}signal a = left.target.depth |"), "above below and", "mm Grasp until"),
        (&format!("{head}signal a = left.target.depth above 3 mm |"), "until", "above Grasp"),
        (&format!("{head}signal a = (left.away) |"), "for|within last|within next|bridging|lasting|at least|and", "mm"),
        (&format!("{head}signal a = (left.away) within |"), "last next", "mm"),
        (&format!("{head}signal a = max(left.target.depth |"), "over last|since|and", "mm"),
        (&format!("{head}signal a = max(left.target.depth over |"), "last", "next mm"),
        (&format!("{head}param p = 3 mm |"), "in", "and Grasp until"),
        (&format!("{head}for each hand {{\r\n  |"), "signal latch", "param tree"),
        (&format!("{head}for each hand {{\r\n  latch l set away |"), "clear and", "mm"),
        (&format!("{head}for each hand {{ latch l set from(|"), "Grasp Hover none", "away"),
        (&format!("{head}param p = 3 mm/|"), "s", "Grasp"),
        (&format!("{head}stream {{ a.b : |"), "bool scalar vec3", "Grasp"),
        (&format!("{head}stream {{ a.b : vec3 N per |"), "finger contact", "mm"),
        (&format!("{tree}  |"), "away else touching not", "Grasp param"),
        (&format!("{tree}  away => |"), "Grasp Hover stay", "away else"),
        (&format!("{tree}  away => Gr|"), "Grasp", "away"),
        (&format!("{tree}}}\r\n|"), "task relabel", "away"),
        (&format!("{head}extend |"), "task single_hand", "Grasp away"),
        (&format!("{head}extend single_hand.|"), "held", "lifted Grasp"),
        (&format!("{head}extend single_hand |"), "first last before after", "Grasp"),
        (&format!("{head}extend single_hand.held before |"), "touchdown Slide", "away"),
        (&format!("{head}task t = |"), "Move Hover", "away"),
        (&format!("{head}task t = Move .. Release |"), "with", "Grasp"),
        (&format!("{head}task t = Move .. Release with Hover |"), "lasting travelling before without", "Grasp"),
        (&format!("{head}task t = Move .. Release with Hover before |"), "pick_and_place", "away Grasp"),
        (&format!("{head}task t = Move .. Release with Hover |"), "is before lasting", "Grasp"),
        (&format!("{head}task t = Move .. Release with Hover is |"), "failure", "Grasp before"),
        (&format!("{head}task t = Move .. Release with Hover is failure |"), "before", "lasting without"),
        (&format!("{head}task t = pick_and_place, push |"), "is", "before"),
        (&format!("{head}extend task |"), "pick_and_place", "away Grasp"),
        (&format!("{head}relabel {{ Hover |"), "between|becomes|shorter than", "Grasp"),
        (&format!("{head}relabel {{ Hover between |"), "Grasp Move", "away"),
        ("use \"|", "part.rules main.rules contact.rules bimanual.rules", "new.rules param"),
        ("use \"con|", "contact.rules", "param"),
        ("use \"part.rules\" |", "before", "param Grasp"),
        ("use \"part.rules\" before \"|", "contact.rules", "param"),
    ] {
        let found = proposed(&mut editor, text);
        let words =
            |list: &str| list.split(if list.contains('|') { '|' } else { ' ' }).map(str::to_string).collect::<Vec<_>>();
        for word in words(some) {
            assert!(found.contains(&word), "no `{word}` at {text:?}: {found:?}");
        }
        for word in words(none) {
            assert!(!found.contains(&word), "`{word}` at {text:?}: {found:?}");
        }
    }
    for silent in ["// a comment |", "param |", "signal n|", "primitive G|", "\"|"] {
        assert_eq!(proposed(&mut editor, silent), Vec::<String>::new(), "{silent}");
    }
    editor.end();
}

#[test]
fn what_is_proposed_says_what_it_is() {
    let mut editor = two_files();
    editor.open("new.rules", "use \"part.rules\"\nsignal a = ");
    let place =
        json!({ "textDocument": { "uri": editor.uri("new.rules") }, "position": { "line": 1, "character": 11 } });
    let answer = editor.ask("textDocument/completion", place);
    let item = |label: &str| {
        let items = answer["result"].as_array().unwrap();
        items.iter().find(|item| item["label"] == label).unwrap_or_else(|| panic!("no {label}")).clone()
    };
    assert_eq!(item("far")["detail"], "a length (m), from 100 mm to 500 mm");
    assert_eq!(item("far")["documentation"], "As far as an arm reaches 🦾.\nours");
    assert_eq!(item("away")["detail"], "a condition, of each hand");
    assert_eq!(item("norm")["detail"], "norm(v)");
    assert_eq!(
        item("target.radius")["documentation"],
        "radius of the sphere about the target's origin that contains it"
    );
}

/// Declarations of a file: what they are, and where their names begin.
fn declarations(symbols: &Value, found: &mut Vec<(String, Value)>) {
    for symbol in symbols.as_array().unwrap() {
        let detail = symbol["detail"].as_str().unwrap_or("").to_string();
        found.push((detail, symbol["selectionRange"]["start"].clone()));
        if let Some(children) = symbol.get("children") {
            declarations(children, found);
        }
    }
}

#[test]
fn names_of_real_rules_are_changed_without_breaking_them() {
    let mut editor = Editor::new(&[]);
    let names = ["bimanual.rules", "contact.rules", "single_hand.rules", "stream.rules"];
    let text = |name: &str| std::fs::read_to_string(format!("tests/fixtures/language/{name}")).unwrap();
    for name in names {
        editor.write(name, &text(name));
        editor.open(name, &text(name));
    }
    let elsewhere = tempfile::tempdir().unwrap();
    let mut changed = 0;
    for name in names {
        let uri = editor.uri(name);
        let answer = editor.ask("textDocument/documentSymbol", json!({ "textDocument": { "uri": uri } }));
        let mut found = Vec::new();
        declarations(&answer["result"], &mut found);
        let kinds = ["param", "signal", "latch", "primitive", "tree", "task"];
        found.retain(|(kind, _)| kinds.contains(&kind.as_str()));
        for (kind, position) in &found {
            let new = if kind == "primitive" { "Quite_new" } else { "quite_new" };
            let params = json!({ "textDocument": { "uri": uri }, "position": position, "newName": new });
            let answer = editor.ask("textDocument/rename", params);
            let mut edits = 0;
            for name in names {
                let mut text = text(name);
                let own = answer["result"]["changes"][editor.uri(name)].as_array().cloned().unwrap_or_default();
                edits += own.len();
                for edit in own.iter().rev() {
                    let old = editor.text(name, &edit["range"]);
                    let start = editor.offset(name, &edit["range"]["start"]);
                    text.replace_range(start..start + old.len(), new);
                }
                std::fs::write(elsewhere.path().join(name), text).unwrap();
            }
            assert!(edits > 0, "{answer}");
            let files = vec![elsewhere.path().join("bimanual.rules")];
            let loaded = teachtree_language::load(&teachtree_language::Request { files, ..Default::default() });
            assert!(loaded.rules.is_some(), "{kind} at {position} of {name}: {:?}", loaded.diagnostics);
            changed += 1;
        }
    }
    assert!(changed > 60, "{changed}");
    editor.end();
}
