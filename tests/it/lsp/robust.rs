//! Whatever an editor sends, the server goes on.

use super::editor::{Editor, framed};
use proptest::prelude::*;
use serde_json::{Value, json};

const PART: &str = "use \"contact.rules\"\nparam far = 0.2 m\nsignal away = norm(right.target.position) > far\n";

/// The server answers as if nothing had been.
fn is_well(editor: &mut Editor) {
    editor.open("well.rules", PART);
    let hover = editor.at("textDocument/hover", "well.rules", "f|ar = 0.2 m", json!({}));
    assert!(hover["result"]["contents"]["value"].as_str().unwrap().contains("a length (m)"), "{hover}");
}

#[test]
fn a_connection_begins_and_ends_in_order() {
    let mut editor = Editor::started(&[]);
    let early = editor.ask("textDocument/hover", json!({}));
    assert_eq!(early["error"]["code"], -32002, "{early}");
    let mut editor = Editor::new(&["--stdio"]);
    assert_eq!(editor.ask("initialize", json!({}))["error"]["code"], -32600);
    is_well(&mut editor);
    assert_eq!(editor.ask("shutdown", json!(null))["result"], Value::Null);
    assert_eq!(editor.ask("textDocument/hover", json!({}))["error"]["code"], -32600);
    editor.tell("exit", json!(null));
    assert_eq!(editor.exit_status(), 0);
    let mut editor = Editor::new(&[]);
    assert_eq!(editor.exit_status(), 1, "the editor went without a word");
    let mut editor = Editor::new(&[]);
    editor.tell("exit", json!(null));
    assert_eq!(editor.exit_status(), 1, "`exit` without `shutdown`");
}

#[test]
fn what_is_not_a_message_is_said_and_skipped() {
    let mut editor = Editor::new(&[]);
    for garbage in [
        "Content-Length: 7\r\n\r\n{\"a\": 1",
        "Content-Length: 4\r\n\r\nnull",
        "Content-Length: many\r\n\r\n",
        "Content-Type: text/plain\r\n\r\n",
        "GET / HTTP/1.1\r\n\r\n",
        "\r\n",
        "Content-Length: 2\r\n\r\n\u{0}\u{1}",
    ] {
        editor.send(garbage.as_bytes());
        let answer = editor.next();
        assert_eq!((&answer["id"], &answer["error"]["code"]), (&Value::Null, &json!(-32700)), "{garbage:?}: {answer}");
    }
    editor.send(b"Content-Length: 3\r\n\r\n\xff\xfe\xfd");
    assert_eq!(editor.next()["error"]["code"], -32700);
    // Lower case, other fields, an end of line without its `\r`: all that occurs.
    let text = r#"{"jsonrpc":"2.0","id":"a","method":"textDocument/unheard"}"#;
    editor.send(format!("content-length:{}\nContent-Type: x\n\n{text}", text.len()).as_bytes());
    let answer = editor.next();
    assert_eq!((&answer["id"], &answer["error"]["code"]), (&json!("a"), &json!(-32601)), "{answer}");
    is_well(&mut editor);
    // The last message has a false length; the server does not allocate it.
    editor.send(b"Content-Length: 99999999999999999\r\n\r\n{}");
    assert_eq!(editor.exit_status(), 1);
}

#[test]
fn what_is_cancelled_is_answered_once_and_at_once() {
    let mut editor = Editor::new(&[]);
    editor.open("part.rules", PART);
    let place =
        json!({ "textDocument": { "uri": editor.uri("part.rules") }, "position": { "line": 1, "character": 6 } });
    let id = |at: usize| format!("hover {at}");
    let ask = |at| json!({ "jsonrpc": "2.0", "id": id(at), "method": "textDocument/hover", "params": place });
    let cancel = |at| json!({ "jsonrpc": "2.0", "method": "$/cancelRequest", "params": { "id": id(at) } });
    let messages: String = (0..100).map(ask).chain((0..100).map(cancel)).map(|message| framed(&message)).collect();
    editor.send(messages.as_bytes());
    let mut answered = std::collections::BTreeMap::new();
    while answered.len() < 100 {
        let message = editor.next();
        if let Some(id) = message["id"].as_str() {
            assert!(answered.insert(id.to_string(), message["error"]["code"].clone()).is_none(), "{message}");
        }
    }
    // Compiling for the first answer takes longer than reading all of these.
    assert!(answered.values().any(|code| *code == -32800), "{answered:?}");
    assert!(answered.values().all(|code| code.is_null() || *code == -32800), "{answered:?}");
    is_well(&mut editor);
    editor.end();
}

#[test]
fn wrong_parameters_are_refused() {
    let mut editor = Editor::new(&[]);
    editor.open("part.rules", PART);
    let uri = editor.uri("part.rules");
    for params in [
        json!(null),
        json!([]),
        json!({ "textDocument": uri }),
        json!({ "textDocument": { "uri": uri }, "position": { "line": -1, "character": 0 } }),
        json!({ "textDocument": { "uri": uri }, "position": { "line": 1e99, "character": "x" } }),
    ] {
        for method in ["hover", "definition", "references", "completion", "prepareRename", "rename"] {
            let answer = editor.ask(&format!("textDocument/{method}"), params.clone());
            assert_eq!(answer["error"]["code"], -32602, "{method} {params}: {answer}");
        }
    }
    editor.tell("textDocument/didOpen", json!({ "textDocument": 1 }));
    editor.tell("textDocument/didChange", json!(null));
    // A partial change, which the server does not support, changes nothing.
    let part = json!({ "range": { "start": { "line": 0, "character": 0 }, "end": { "line": 9, "character": 0 } }, "text": "" });
    let document = json!({ "uri": uri, "version": 3 });
    editor.tell("textDocument/didChange", json!({ "textDocument": document, "contentChanges": [part] }));
    editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": "untitled:nowhere" } }));
    editor.tell("$/setTrace", json!({ "value": "off" }));
    is_well(&mut editor);
    assert_eq!(editor.shown.len(), 2, "{:?}", editor.shown);
    assert!(editor.codes("part.rules").iter().all(|code| code.starts_with('W')), "{:?}", editor.diagnostics);
    editor.end();
}

#[test]
fn positions_beyond_the_text_are_its_end() {
    let mut editor = Editor::new(&[]);
    editor.open("part.rules", PART);
    let uri = editor.uri("part.rules");
    for (line, character) in [(0_u32, 4_000_000_000_u32), (3, 0), (4_000_000_000_u32, 4_000_000_000), (2, 60)] {
        for method in ["hover", "definition", "references", "completion", "prepareRename", "rename"] {
            let position = json!({ "line": line, "character": character });
            let params = json!({
                "textDocument": { "uri": uri }, "position": position, "newName": "x", "context": { "includeDeclaration": true },
            });
            let answer = editor.ask(&format!("textDocument/{method}"), params);
            assert_ne!(answer["error"]["code"], -32603, "{method} at {line}:{character}: {answer}");
        }
    }
    editor.end();
}

#[test]
fn a_file_that_is_not_open_has_no_answers() {
    let mut editor = Editor::new(&[]);
    editor.open("part.rules", PART);
    let params =
        json!({ "textDocument": { "uri": "file:///nowhere/x.rules" }, "position": { "line": 0, "character": 0 } });
    assert_eq!(editor.ask("textDocument/hover", params.clone())["result"], Value::Null);
    assert_eq!(editor.ask("textDocument/completion", params.clone())["result"], json!([]));
    assert!(editor.ask("textDocument/prepareRename", params)["error"]["message"].is_string());
    // A text that was never saved is a file all the same.
    let document = json!({ "uri": "untitled:Untitled-1", "languageId": "teachtree", "version": 1, "text": PART.replace("far\n", "fra\n") });
    editor.tell("textDocument/didOpen", json!({ "textDocument": document }));
    while !editor.diagnostics.contains_key("untitled:Untitled-1") {
        editor.next();
    }
    assert_eq!(editor.diagnostics["untitled:Untitled-1"][0]["code"], "E201");
    editor.end();
}

#[test]
fn a_huge_file_is_refused_and_forgotten() {
    let mut editor = Editor::new(&[]);
    editor.open("huge.rules", &"// nothing\n".repeat(200_000));
    let found = editor.findings("huge.rules");
    assert_eq!(found[0]["code"], "E703", "{found:?}");
    editor.change("huge.rules", &"(".repeat(40_000));
    assert_eq!(editor.codes("huge.rules"), ["E701"]);
    let long = format!("signal a = {}\n", "not ".repeat(100_000));
    editor.change("huge.rules", &long);
    assert!(!editor.codes("huge.rules").is_empty());
    let end = json!({ "textDocument": { "uri": editor.uri("huge.rules") }, "position": { "line": 1, "character": 0 } });
    assert!(editor.ask("textDocument/completion", end)["error"].is_null());
    is_well(&mut editor);
    editor.end();
}

/// Whatever stands in a file and wherever in it is asked, there is an answer, and all ranges lie in the text.
fn survives(editor: &mut Editor, text: &str, at: usize) {
    editor.change("any.rules", text);
    let at = (0..=at.min(text.len())).rev().find(|at| text.is_char_boundary(*at)).unwrap();
    let line = text[..at].matches('\n').count();
    let character = text[..at].rsplit('\n').next().unwrap().encode_utf16().count();
    let uri = editor.uri("any.rules");
    for method in
        ["hover", "definition", "references", "completion", "prepareRename", "rename", "documentSymbol", "codeAction"]
    {
        let here = json!({ "line": line, "character": character });
        let params = json!({
            "textDocument": { "uri": uri }, "position": here, "newName": "quite_new", "range": { "start": here, "end": here },
            "context": { "includeDeclaration": true, "diagnostics": [] },
        });
        let answer = editor.ask(&format!("textDocument/{method}"), params);
        let code = &answer["error"]["code"];
        assert!(code.is_null() || *code == -32803, "{method} at {at} of {text:?}: {answer}");
    }
    let lines = text.split('\n').count() as u64;
    for finding in editor.findings("any.rules") {
        assert!(finding["range"]["end"]["line"].as_u64().unwrap() < lines, "{finding}");
    }
}

#[test]
fn every_cut_of_a_real_file_is_survived() {
    let mut editor = Editor::new(&[]);
    let text = std::fs::read_to_string("rules/contact.rules").unwrap().replace('\n', "\r\n").replace("//", "// 🦾");
    editor.open("any.rules", "");
    for cut in (0..text.len()).step_by(211).filter(|cut| text.is_char_boundary(*cut)) {
        survives(&mut editor, &text[..cut], cut);
    }
    editor.end();
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 8, ..ProptestConfig::default() })]

    #[test]
    fn every_text_is_survived(texts in prop::collection::vec(("(use \"|signal |tree |\\{|\\}|\\(|=|=> |[a-zäß🦾_]{1,4}|[.]|[0-9]|\r\n|\n|//|extend | before |relabel |Move|\"){0,40}", 0_usize..200), 1..6)) {
        let mut editor = Editor::new(&[]);
        editor.open("any.rules", "");
        for (text, at) in texts {
            survives(&mut editor, &text, at);
        }
        editor.end();
    }
}
