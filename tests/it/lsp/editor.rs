//! An editor: it starts the server, opens files, asks, and applies what it is reported, counting columns in UTF-16 as the protocol wants.

use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use tempfile::TempDir;

/// How long the server may take: far longer than it does.
const PATIENCE: Duration = Duration::from_secs(60);

/// A running server with a folder of its own.
pub struct Editor {
    /// The folder that is open.
    pub folder: TempDir,
    child: Child,
    input: Option<ChildStdin>,
    output: Receiver<Value>,
    asked: i32,
    /// The last diagnostics of each URI.
    pub diagnostics: BTreeMap<String, Value>,
    /// What the server wanted to be shown.
    pub shown: Vec<String>,
    texts: BTreeMap<String, String>,
}

impl Editor {
    /// A server that has only been started.
    pub fn started(args: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let cache = folder.path().join("cache");
        let mut child = Command::new(env!("CARGO_BIN_EXE_teachtree"))
            .arg("lsp")
            .args(args)
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .env("XDG_CACHE_HOME", cache)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (sender, output) = channel();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || {
            while let Some(message) = message(&mut stdout) {
                let _ = sender.send(message);
            }
        });
        let input = child.stdin.take();
        let (diagnostics, texts) = (BTreeMap::new(), BTreeMap::new());
        Self { folder, child, input, output, asked: 0, diagnostics, shown: Vec::new(), texts }
    }

    /// A server that is ready.
    pub fn new(args: &[&str]) -> Self {
        Self::with(args, json!(null))
    }

    /// A server that is ready, with options.
    pub fn with(args: &[&str], options: Value) -> Self {
        let mut editor = Self::started(args);
        let root = editor.uri("");
        let folders = json!([{ "uri": root, "name": "rules" }]);
        let params = json!({
            "processId": null, "rootUri": root, "capabilities": {}, "workspaceFolders": folders,
            "initializationOptions": options,
        });
        let answer = editor.ask("initialize", params);
        assert_eq!(answer["result"]["serverInfo"]["name"], "teachtree", "{answer}");
        editor.tell("initialized", json!({}));
        editor
    }

    /// The path of a file of the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().canonicalize().unwrap().join(name)
    }

    /// The URI of a file of the folder.
    pub fn uri(&self, name: &str) -> String {
        format!("file://{}", self.path(name).display()).trim_end_matches('/').to_string()
    }

    /// Bytes as they are.
    pub fn send(&mut self, bytes: &[u8]) {
        let input = self.input.as_mut().unwrap();
        input.write_all(bytes).unwrap();
        input.flush().unwrap();
    }

    fn post(&mut self, message: &Value) {
        self.send(framed(message).as_bytes());
    }

    /// A notification.
    pub fn tell(&mut self, method: &str, params: Value) {
        self.post(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    /// A request and the whole answer to it.
    pub fn ask(&mut self, method: &str, params: Value) -> Value {
        self.asked += 1;
        let id = self.asked;
        self.post(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }));
        loop {
            let message = self.next();
            if message["id"] == id {
                return message;
            }
        }
    }

    /// A request about a place, `|` in the text of a file, or the first place of a word in it; its result.
    pub fn at(&mut self, method: &str, name: &str, place: &str, more: Value) -> Value {
        let position = self.position(name, place);
        let mut params = json!({ "textDocument": { "uri": self.uri(name) }, "position": position });
        params.as_object_mut().unwrap().extend(more.as_object().cloned().unwrap_or_default());
        self.ask(method, params)
    }

    /// The position of the first character of a word in an open file.
    pub fn position(&self, name: &str, place: &str) -> Value {
        let text = &self.texts[&self.uri(name)];
        let mark = place.find('|');
        let word = place.replace('|', "");
        let offset = text.find(&word).unwrap_or_else(|| panic!("no `{word}` in {text}")) + mark.unwrap_or(0);
        let head = &text[..offset];
        let line = head.matches('\n').count();
        let column = head.rsplit('\n').next().unwrap().encode_utf16().count();
        json!({ "line": line, "character": column })
    }

    /// The next message; diagnostics and texts to be shown are kept.
    pub fn next(&mut self) -> Value {
        let message = self.output.recv_timeout(PATIENCE).expect("the server says something");
        let params = &message["params"];
        match message["method"].as_str() {
            Some("textDocument/publishDiagnostics") => {
                self.diagnostics.insert(params["uri"].as_str().unwrap().to_string(), params["diagnostics"].clone());
            }
            Some("window/showMessage") => self.shown.push(params["message"].as_str().unwrap().to_string()),
            _ => {}
        }
        message
    }

    /// Writes a file to disk.
    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    /// Opens a text as a file, which need not be on disk.
    pub fn open(&mut self, name: &str, text: &str) {
        let uri = self.uri(name);
        self.texts.insert(uri.clone(), text.to_string());
        let document = json!({ "uri": uri, "languageId": "teachtree", "version": 1, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
    }

    /// Types: the whole text anew.
    pub fn change(&mut self, name: &str, text: &str) {
        let uri = self.uri(name);
        self.texts.insert(uri.clone(), text.to_string());
        let document = json!({ "uri": uri, "version": 2 });
        self.tell("textDocument/didChange", json!({ "textDocument": document, "contentChanges": [{ "text": text }] }));
    }

    /// Closes a file.
    pub fn close(&mut self, name: &str) {
        let uri = self.uri(name);
        self.tell("textDocument/didClose", json!({ "textDocument": { "uri": uri } }));
    }

    /// The diagnostics of a file after all changes so far.
    pub fn findings(&mut self, name: &str) -> Vec<Value> {
        // Diagnostics come when there is nothing else to do. Behind an answer they are of all changes before it; saving brings some.
        let uri = self.uri(name);
        self.ask("textDocument/documentSymbol", json!({ "textDocument": { "uri": uri } }));
        self.diagnostics.remove(&uri);
        self.tell("textDocument/didSave", json!({ "textDocument": { "uri": uri } }));
        while !self.diagnostics.contains_key(&uri) {
            self.next();
        }
        self.diagnostics[&uri].as_array().unwrap().clone()
    }

    /// The codes of what is found in a file.
    pub fn codes(&mut self, name: &str) -> Vec<String> {
        self.findings(name).iter().map(|finding| finding["code"].as_str().unwrap().to_string()).collect()
    }

    /// The text at a range of an open file.
    pub fn text(&self, name: &str, range: &Value) -> String {
        let text = &self.texts[&self.uri(name)];
        text[offset(text, &range["start"])..offset(text, &range["end"])].to_string()
    }

    /// The byte at a position of an open file.
    pub fn offset(&self, name: &str, position: &Value) -> usize {
        offset(&self.texts[&self.uri(name)], position)
    }

    /// Applies a workspace edit, to open files in the editor and to closed ones on disk.
    pub fn apply(&mut self, edit: &Value) {
        for (uri, edits) in edit["changes"].as_object().unwrap() {
            let path = PathBuf::from(uri.strip_prefix("file://").unwrap());
            let open = self.texts.get(uri).cloned();
            let mut text = open.clone().unwrap_or_else(|| std::fs::read_to_string(&path).unwrap());
            let mut places: Vec<(usize, usize, &str)> = edits
                .as_array()
                .unwrap()
                .iter()
                .map(|edit| {
                    let (start, end) = (&edit["range"]["start"], &edit["range"]["end"]);
                    (offset(&text, start), offset(&text, end), edit["newText"].as_str().unwrap())
                })
                .collect();
            places.sort_unstable();
            for (start, end, new) in places.into_iter().rev() {
                text.replace_range(start..end, new);
            }
            let name = path.strip_prefix(self.path("")).unwrap().to_str().unwrap().to_string();
            if open.is_some() {
                self.change(&name, &text);
            }
            self.write(&name, &text);
        }
    }

    /// Ends the connection in good order.
    pub fn end(mut self) {
        let answer = self.ask("shutdown", json!(null));
        assert_eq!(answer.get("result"), Some(&Value::Null), "{answer}");
        self.tell("exit", json!(null));
        assert_eq!(self.exit_status(), 0);
    }

    /// How the server exited; its input ends.
    pub fn exit_status(&mut self) -> i32 {
        self.input = None;
        self.child.wait().unwrap().code().unwrap()
    }
}

impl Drop for Editor {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        // The server's cache is read-only, which would keep it in some systems.
        let _ = make_writable(self.folder.path());
    }
}

/// A message as it goes over the wire.
pub fn framed(message: &Value) -> String {
    let text = message.to_string();
    format!("Content-Length: {}\r\n\r\n{text}", text.len())
}

fn make_writable(folder: &Path) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            make_writable(&path)?;
        } else {
            let mut permissions = std::fs::metadata(&path)?.permissions();
            #[allow(clippy::permissions_set_readonly_false, reason = "it is about to be removed")]
            permissions.set_readonly(false);
            std::fs::set_permissions(&path, permissions)?;
        }
    }
    Ok(())
}

/// The byte at a position.
fn offset(text: &str, position: &Value) -> usize {
    let line = position["line"].as_u64().unwrap() as usize;
    let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
    let mut units = position["character"].as_u64().unwrap() as usize;
    let mut at = start;
    for c in text[start..].chars() {
        if units == 0 {
            break;
        }
        units -= c.len_utf16();
        at += c.len_utf8();
    }
    at
}

fn message(stdout: &mut impl BufRead) -> Option<Value> {
    let mut length = 0;
    loop {
        let mut line = String::new();
        if stdout.read_line(&mut line).ok()? == 0 {
            return None;
        }
        match line.trim_end() {
            "" => break,
            header => length = header.strip_prefix("Content-Length: ")?.parse().ok()?,
        }
    }
    let mut body = vec![0; length];
    stdout.read_exact(&mut body).ok()?;
    serde_json::from_slice(&body).ok()
}
