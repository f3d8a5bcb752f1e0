//! The server's loop: reads messages, dispatches them, and writes answers and diagnostics.

use super::recording::Recording;
use super::settings::Settings;
use super::wire::{self, WireMessage};
use super::workspace::{Document, Spot, Workspace};
use super::{
    Answer, FileValidator, RequestError, actions, completion, findings, hover, library::Library, navigation, outline,
    rename, uri,
};
use lsp_server::{ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::{
    CodeActionOptions, CodeActionParams, CompletionOptions, DidChangeTextDocumentParams, DidCloseTextDocumentParams,
    DidOpenTextDocumentParams, DocumentSymbolParams, ReferenceParams, RenameOptions, RenameParams, ServerCapabilities,
    TextDocumentContentChangeEvent, TextDocumentPositionParams, TextDocumentSyncKind, TextDocumentSyncOptions, Uri,
};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::collections::{BTreeMap, VecDeque};
use std::io::{self, BufReader, Read, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use teachtree_base::yaml::is_yaml;
use teachtree_session::Log;
use teachtree_session::LogInternals;

/// Where the connection stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    Fresh,
    Running,
    ShutDown,
}

/// Serves an editor until it says `exit` or its messages end. Returns whether it said `shutdown` before.
///
/// # Errors
/// When nothing can be written any more.
pub fn serve(
    input: impl Read + Send + 'static,
    output: impl Write,
    settings: Settings,
    validate: FileValidator,
) -> io::Result<bool> {
    let (sender, receiver) = channel();
    // Reading beside the work lets what is no longer wanted be dropped, and diagnostics wait until a burst of changes is over.
    std::thread::spawn(move || {
        let mut input = BufReader::new(input);
        while let Ok(Some(incoming)) = wire::read(&mut input) {
            if sender.send(incoming).is_err() {
                return;
            }
        }
    });
    let mut server = Server {
        output,
        phase: Phase::Fresh,
        workspace: Workspace::default(),
        recording: Recording::default(),
        settings,
        validate,
        published: BTreeMap::new(),
        stale: false,
    };
    server.run(&receiver)
}

struct Server<W> {
    output: W,
    phase: Phase,
    workspace: Workspace,
    recording: Recording,
    settings: Settings,
    validate: FileValidator,
    /// The files that have diagnostics in the editor, with their URIs.
    published: BTreeMap<PathBuf, Uri>,
    /// Whether diagnostics may have changed.
    stale: bool,
}

impl<W: Write> Server<W> {
    fn run(&mut self, receiver: &Receiver<WireMessage>) -> io::Result<bool> {
        let mut queue: VecDeque<WireMessage> = VecDeque::new();
        loop {
            loop {
                match receiver.try_recv() {
                    Ok(incoming) => self.queue(&mut queue, incoming)?,
                    Err(TryRecvError::Empty) => break,
                    Err(TryRecvError::Disconnected) if queue.is_empty() => return Ok(self.phase == Phase::ShutDown),
                    Err(TryRecvError::Disconnected) => break,
                }
            }
            let incoming = match queue.pop_front() {
                Some(incoming) => incoming,
                None => {
                    self.publish()?;
                    match receiver.recv() {
                        Ok(incoming) => {
                            self.queue(&mut queue, incoming)?;
                            continue;
                        }
                        Err(_) => return Ok(self.phase == Phase::ShutDown),
                    }
                }
            };
            match incoming {
                WireMessage::Message(Message::Request(request)) => self.request(request)?,
                WireMessage::Message(Message::Notification(notification)) if notification.method == "exit" => {
                    return Ok(self.phase == Phase::ShutDown);
                }
                WireMessage::Message(Message::Notification(notification)) => self.notification(notification)?,
                // Nothing is asked of the editor.
                WireMessage::Message(Message::Response(_)) => {}
                WireMessage::Malformed(reason) => self.broken(&reason)?,
            }
        }
    }

    /// Puts a message after the others; a request that is cancelled goes.
    fn queue(&mut self, queue: &mut VecDeque<WireMessage>, incoming: WireMessage) -> io::Result<()> {
        let cancelled = match &incoming {
            WireMessage::Message(Message::Notification(it)) if it.method == "$/cancelRequest" => {
                it.params.get("id").cloned()
            }
            _ => None,
        };
        let Some(id) = cancelled else {
            queue.push_back(incoming);
            return Ok(());
        };
        let meant = |incoming: &WireMessage| match incoming {
            WireMessage::Message(Message::Request(request)) => {
                serde_json::to_value(&request.id).is_ok_and(|it| it == id)
            }
            _ => false,
        };
        if let Some(WireMessage::Message(Message::Request(request))) =
            queue.iter().position(meant).and_then(|at| queue.remove(at))
        {
            let refused = RequestError { code: ErrorCode::RequestCanceled, message: "cancelled".into() };
            self.answer(request.id, Err(refused))?;
        }
        Ok(())
    }

    fn request(&mut self, request: Request) -> io::Result<()> {
        let Request { id, method, params } = request;
        let answer = match (self.phase, method.as_str()) {
            (Phase::Fresh, "initialize") => {
                self.phase = Phase::Running;
                Ok(self.initialize(&params)?)
            }
            (Phase::Fresh, _) => Err(RequestError {
                code: ErrorCode::ServerNotInitialized,
                message: format!("`initialize` comes before `{method}`"),
            }),
            (Phase::ShutDown, _) => Err(RequestError {
                code: ErrorCode::InvalidRequest,
                message: format!("`{method}` came after `shutdown`"),
            }),
            (Phase::Running, "initialize") => {
                Err(RequestError { code: ErrorCode::InvalidRequest, message: "`initialize` came twice".into() })
            }
            (Phase::Running, "shutdown") => {
                self.phase = Phase::ShutDown;
                Ok(Value::Null)
            }
            // A panic is a bug, but not one for which an author should lose the server.
            (Phase::Running, _) => {
                catch_unwind(AssertUnwindSafe(|| self.dispatch(&method, params))).unwrap_or_else(|_| {
                    Err(RequestError {
                        code: ErrorCode::InternalError,
                        message: format!("`{method}` failed: this is a bug"),
                    })
                })
            }
        };
        self.answer(id, answer)
    }

    /// Answers a request about rule files. Of its parameters only what is needed is read.
    fn dispatch(&mut self, method: &str, params: Value) -> Answer<Value> {
        // Other files only get diagnostics.
        let uri = params.pointer("/textDocument/uri").and_then(Value::as_str);
        if uri.is_some_and(|uri| is_yaml(&uri::path_of(uri))) {
            return Ok(Value::Null);
        }
        match method {
            "textDocument/hover" => {
                let at = read(params)?;
                // A recording that was written anew has other values.
                self.open_recording();
                let spot = self.spot(&at);
                let hover = spot.and_then(|spot| hover::hover(&spot, &mut self.recording));
                to_json(&hover)
            }
            "textDocument/definition" => {
                let at = read(params)?;
                let spot = self.spot(&at);
                to_json(&spot.map_or(Vec::new(), |spot| navigation::definition(&self.workspace, &spot)))
            }
            "textDocument/references" => {
                let ReferenceParams { text_document_position_params: at, context, .. } = read(params)?;
                let spot = self.spot(&at);
                let declarations = context.include_declaration;
                to_json(
                    &spot.map_or(Vec::new(), |spot| navigation::references(&mut self.workspace, &spot, declarations)),
                )
            }
            "textDocument/prepareRename" => {
                let at = read(params)?;
                let spot = self.spot(&at).ok_or_else(|| RequestError::failed("this file is not open"))?;
                to_json(&rename::prepare(&self.workspace, &spot)?)
            }
            "textDocument/rename" => {
                let RenameParams { text_document_position_params: at, new_name, .. } = read(params)?;
                let spot = self.spot(&at).ok_or_else(|| RequestError::failed("this file is not open"))?;
                let changes = rename::rename(&mut self.workspace, &spot, new_name.trim())?;
                to_json(&json!({ "changes": changes }))
            }
            "textDocument/completion" => {
                let at = read(params)?;
                let spot = self.spot(&at);
                to_json(&spot.map_or(Vec::new(), |spot| completion::complete(&spot)))
            }
            "textDocument/documentSymbol" => {
                let DocumentSymbolParams { text_document, .. } = read(params)?;
                let document = self.workspace.open.get(&uri::path_of(text_document.uri.as_ref()));
                to_json(&document.map_or(Vec::new(), |document| outline::outline(&document.text)))
            }
            "textDocument/formatting" => {
                let DocumentSymbolParams { text_document, .. } = read(params)?;
                to_json(&actions::style(&self.workspace, &text_document.uri)?)
            }
            "textDocument/codeAction" => {
                let params: CodeActionParams = read(params)?;
                to_json(&actions::fixes(&mut self.workspace, &params))
            }
            _ => Err(RequestError { code: ErrorCode::MethodNotFound, message: format!("`{method}` is not supported") }),
        }
    }

    fn spot(&mut self, at: &TextDocumentPositionParams) -> Option<Spot> {
        self.workspace.spot(&at.text_document.uri, at.position)
    }

    fn initialize(&mut self, params: &Value) -> io::Result<Value> {
        let uri = |value: &Value| value.as_str().map(uri::path_of);
        let folders = params.get("workspaceFolders").and_then(Value::as_array);
        self.workspace.folders = match folders {
            Some(folders) => folders.iter().filter_map(|folder| uri(folder.get("uri")?)).collect(),
            None => params.get("rootUri").and_then(uri).into_iter().collect(),
        };
        self.workspace.library = Library::open();
        let sent = params.get("initializationOptions").cloned().unwrap_or_default();
        self.configure(&sent)?;
        let capabilities = ServerCapabilities {
            text_document_sync: Some(
                TextDocumentSyncOptions {
                    open_close: Some(true),
                    change: Some(TextDocumentSyncKind::Full),
                    save: Some(true.into()),
                    ..TextDocumentSyncOptions::default()
                }
                .into(),
            ),
            hover_provider: Some(true.into()),
            definition_provider: Some(true.into()),
            references_provider: Some(true.into()),
            document_symbol_provider: Some(true.into()),
            document_formatting_provider: Some(true.into()),
            rename_provider: Some(RenameOptions { prepare_provider: Some(true), ..RenameOptions::default() }.into()),
            completion_provider: Some(CompletionOptions {
                trigger_characters: Some([".", "[", "\"", ">"].map(str::to_string).to_vec()),
                ..CompletionOptions::default()
            }),
            code_action_provider: Some(
                CodeActionOptions {
                    code_action_kinds: Some(vec![lsp_types::CodeActionKind::QuickFix]),
                    ..CodeActionOptions::default()
                }
                .into(),
            ),
            ..ServerCapabilities::default()
        };
        Ok(json!({
            "capabilities": capabilities,
            "serverInfo": { "name": "teachtree", "version": env!("CARGO_PKG_VERSION") },
        }))
    }

    /// Takes settings over; what is wrong with them is shown to the author, and the old ones stay.
    fn configure(&mut self, sent: &Value) -> io::Result<()> {
        match self.settings.with(sent, self.workspace.folders.first().map(PathBuf::as_path)) {
            Ok(settings) => self.settings = settings,
            Err(error) => self.warn(&error)?,
        }
        match self.open_recording() {
            Some(error) => self.warn(&error),
            None => Ok(()),
        }
    }

    /// Opens the recording that is set, unless it is open; the rules are loaded as its binding wants them. Returns what is wrong with it.
    fn open_recording(&mut self) -> Option<String> {
        let (changed, error) = match self.recording.open(&self.settings) {
            Ok(changed) => (changed, None),
            Err(error) => (true, Some(error)),
        };
        let of_log = |log: &Log| (log.chosen_hand_model().map(|model| model.file), log.params());
        let (hand_file, params) = self.recording.log().map(of_log).unwrap_or_default();
        let hand_file = self.settings.hand.clone().or(hand_file);
        if changed || hand_file != self.workspace.hand_file {
            self.workspace.overrides = params;
            self.workspace.hand_file = hand_file;
            self.workspace.change();
            self.stale = true;
        }
        error
    }

    fn notification(&mut self, notification: Notification) -> io::Result<()> {
        if self.phase != Phase::Running {
            return Ok(());
        }
        let Notification { method, params } = notification;
        let outcome = match method.as_str() {
            "textDocument/didOpen" => read(params).map(|params: DidOpenTextDocumentParams| {
                let document = params.text_document;
                self.put(document.uri, document.version, document.text);
            }),
            "textDocument/didChange" => read(params).map(|params: DidChangeTextDocumentParams| {
                // The whole text is asked for; of several the last one counts.
                let text = params.content_changes.into_iter().rev().find_map(|change| match change {
                    TextDocumentContentChangeEvent::TextDocumentContentChangeWholeDocument(change) => Some(change.text),
                    TextDocumentContentChangeEvent::TextDocumentContentChangePartial(_) => None,
                });
                let document = params.text_document;
                if let Some(text) = text {
                    self.put(document.text_document_identifier.uri, document.version, text);
                }
            }),
            "textDocument/didClose" => read(params).map(|params: DidCloseTextDocumentParams| {
                let path = uri::path_of(params.text_document.uri.as_ref());
                self.workspace.open.remove(&path);
                self.workspace.others.remove(&path);
                self.changed();
            }),
            // Something on disk may be another one now.
            "textDocument/didSave" | "workspace/didChangeWatchedFiles" => {
                self.changed();
                Ok(())
            }
            "workspace/didChangeConfiguration" => {
                let sent = params.get("settings").cloned().unwrap_or_default();
                return self.configure(&sent);
            }
            _ => Ok(()),
        };
        match outcome {
            Ok(()) => Ok(()),
            Err(refused) => self.warn(&format!("{method}: {}", refused.message)),
        }
    }

    fn put(&mut self, uri: Uri, version: i32, text: String) {
        let path = uri::path_of(uri.as_ref());
        let files = if is_yaml(&path) { &mut self.workspace.others } else { &mut self.workspace.open };
        files.insert(path, Document { uri, version, text });
        self.changed();
    }

    fn changed(&mut self) {
        self.workspace.change();
        self.stale = true;
    }

    /// Sends the diagnostics, when they may have changed.
    fn publish(&mut self) -> io::Result<()> {
        if !std::mem::take(&mut self.stale) {
            return Ok(());
        }
        let all = catch_unwind(AssertUnwindSafe(|| findings::all(&mut self.workspace, self.validate)));
        let Ok(all) = all else { return self.warn("checking the files failed: this is a bug") };
        let gone: Vec<Uri> =
            self.published.iter().filter(|(path, _)| !all.contains_key(*path)).map(|(_, uri)| uri.clone()).collect();
        self.published.clear();
        for uri in gone {
            self.notify("textDocument/publishDiagnostics", json!({ "uri": uri, "diagnostics": [] }))?;
        }
        for (path, diagnostics) in all {
            let uri = self.workspace.uri(&path);
            let Workspace { open, others, .. } = &self.workspace;
            let version = open.get(&path).or_else(|| others.get(&path)).map(|document| document.version);
            let mut params = json!({ "uri": uri, "diagnostics": diagnostics });
            if let (Some(version), Some(params)) = (version, params.as_object_mut()) {
                params.insert("version".into(), version.into());
            }
            self.published.insert(path, uri);
            self.notify("textDocument/publishDiagnostics", params)?;
        }
        Ok(())
    }

    fn warn(&mut self, message: &str) -> io::Result<()> {
        self.notify("window/showMessage", json!({ "type": 2, "message": message }))
    }

    fn notify(&mut self, method: &str, params: Value) -> io::Result<()> {
        Message::Notification(Notification { method: method.into(), params }).write(&mut self.output)
    }

    fn answer(&mut self, id: RequestId, answer: Answer<Value>) -> io::Result<()> {
        let response = match answer {
            Ok(result) => Response::new_ok(id, result),
            Err(refused) => Response::new_err(id, refused.code as i32, refused.message),
        };
        Message::Response(response).write(&mut self.output)
    }

    /// Answers a malformed message, whose request is unknown.
    fn broken(&mut self, reason: &str) -> io::Result<()> {
        let error = json!({ "code": ErrorCode::ParseError as i32, "message": reason });
        let text = json!({ "jsonrpc": "2.0", "id": null, "error": error }).to_string();
        write!(self.output, "Content-Length: {}\r\n\r\n{text}", text.len())?;
        self.output.flush()
    }
}

fn read<P: DeserializeOwned>(params: Value) -> Answer<P> {
    serde_json::from_value(params)
        .map_err(|error| RequestError { code: ErrorCode::InvalidParams, message: format!("wrong parameters: {error}") })
}

fn to_json<R: serde::Serialize>(result: &R) -> Answer<Value> {
    serde_json::to_value(result)
        .map_err(|error| RequestError { code: ErrorCode::InternalError, message: error.to_string() })
}
