//! A client of the language server, over the binary's standard streams.

use std::collections::{HashMap, VecDeque};
use std::io::{BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Condvar, Mutex, mpsc};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// No answer takes longer, unless it does not come.
const PATIENCE: Duration = Duration::from_secs(60);

/// A running server, and the messages that it has sent.
pub struct Client {
    process: Child,
    input: Option<ChildStdin>,
    messages: mpsc::Receiver<(Instant, Value)>,
    /// Whether the server's output is read.
    gate: Arc<(Mutex<bool>, Condvar)>,
    /// Heard, and not asked for yet.
    waiting: VecDeque<(Instant, Value)>,
    next_id: u64,
    /// The newest diagnostics of each file.
    published: HashMap<String, Value>,
    /// How many diagnostics and refresh requests were received.
    received: u64,
    /// The user's settings, for a server that requests them.
    pub settings: Value,
    /// Whether requests of the server are answered immediately; otherwise the test answers them.
    pub answers_itself: bool,
}

impl Client {
    /// Starts `mauve lsp` (its path is the caller's `CARGO_BIN_EXE_mauve`) with further arguments.
    pub fn start(binary: &str, arguments: &[&str]) -> Client {
        Client::start_with_models(binary, arguments, "")
    }

    /// [`Client::start`] with `MAUVE_MODELS`.
    pub fn start_with_models(binary: &str, arguments: &[&str], models: &str) -> Client {
        Client::start_where(binary, arguments, &[("MAUVE_MODELS", models)])
    }

    /// [`Client::start`] with these variables of the environment, and no others that name folders.
    pub fn start_where(binary: &str, arguments: &[&str], environment: &[(&str, &str)]) -> Client {
        let mut process = Command::new(binary)
            .arg("lsp")
            .args(arguments)
            .env_remove("MAUVE_MODELS")
            .env_remove("ROS_PACKAGE_PATH")
            .env_remove("AMENT_PREFIX_PATH")
            .env_remove("CMAKE_PREFIX_PATH")
            .envs(environment.iter().copied())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            // Panics that tests ask for say so there.
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|error| panic!("{binary} does not run: {error}"));
        let input = process.stdin.take();
        let output = process.stdout.take();
        let (sender, messages) = mpsc::channel();
        let gate = Arc::new((Mutex::new(true), Condvar::new()));
        let is_open = Arc::clone(&gate);
        std::thread::spawn(move || {
            let mut output = BufReader::new(output?);
            loop {
                let open = is_open.1.wait_while(is_open.0.lock().ok()?, |open| !*open);
                drop(open.ok()?);
                sender.send(read(&mut output)?).ok()?;
            }
            #[allow(unreachable_code, reason = "the type of the closure")]
            Some(())
        });
        let waiting = VecDeque::new();
        let (published, settings) = (HashMap::new(), Value::Null);
        Client {
            process,
            input,
            messages,
            gate,
            waiting,
            next_id: 0,
            published,
            received: 0,
            settings,
            answers_itself: true,
        }
    }

    /// A server for `folder` and a client that can do what good editors can.
    pub fn of_folder(binary: &str, folder: &Path) -> Client {
        let mut client = Client::start(binary, &[]);
        client.initialize(Some(folder), &good_editor());
        client
    }

    /// Begins a session; returns the capabilities of the server.
    pub fn initialize(&mut self, folder: Option<&Path>, capabilities: &Value) -> Value {
        let folders = folder.map(|folder| json!([{"uri": address(folder), "name": "models"}]));
        let result = self.call(
            "initialize",
            json!({
                "processId": std::process::id(), "rootUri": null,
                "capabilities": capabilities, "workspaceFolders": folders,
            }),
        );
        self.notify("initialized", json!({}));
        result.unwrap_or_else(|error| panic!("no server: {error}"))
    }

    /// Writes bytes as they are.
    pub fn write(&mut self, bytes: &[u8]) {
        let Some(input) = &mut self.input else { return };
        // If the server has ended, the reader of the answer reports it.
        let _ = input.write_all(bytes).and_then(|()| input.flush());
    }

    /// Sends a message.
    pub fn send(&mut self, message: &Value) {
        let message = message.to_string();
        self.write(format!("Content-Length: {}\r\n\r\n{message}", message.len()).as_bytes());
    }

    /// Sends a notification.
    pub fn notify(&mut self, method: &str, params: Value) {
        self.send(&json!({"jsonrpc": "2.0", "method": method, "params": params}));
    }

    /// Sends a request; returns its id.
    pub fn request(&mut self, method: &str, params: Value) -> u64 {
        self.next_id += 1;
        self.send(&json!({"jsonrpc": "2.0", "id": self.next_id, "method": method, "params": params}));
        self.next_id
    }

    /// Sends a request and waits for the answer: a result, or an error.
    pub fn call(&mut self, method: &str, params: Value) -> Result<Value, Value> {
        let id = self.request(method, params);
        self.answer(id)
    }

    /// Waits for the answer of a request.
    pub fn answer(&mut self, id: u64) -> Result<Value, Value> {
        let (_, answer) = self.wait(&format!("an answer to request {id}"), |message| is_answer(message, id));
        match answer.get("error") {
            Some(error) => Err(error.clone()),
            None => Ok(answer["result"].clone()),
        }
    }

    /// Waits for a message; others are kept for later. Questions of the server are answered with nothing.
    pub fn wait(&mut self, what: &str, is_it: impl Fn(&Value) -> bool) -> (Instant, Value) {
        if let Some(index) = self.waiting.iter().position(|(_, message)| is_it(message))
            && let Some(found) = self.waiting.remove(index)
        {
            return found;
        }
        let end = Instant::now() + PATIENCE;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            match self.hear(left) {
                Some((at, message)) if is_it(&message) => return (at, message),
                Some(other) => self.waiting.push_back(other),
                None => {
                    let ended = if Instant::now() < end { ", it has ended" } else { "" };
                    panic!("the server does not send {what}{ended}; it said {:?}", self.waiting)
                }
            }
        }
    }

    /// Returns the next message within `time`, if any.
    fn hear(&mut self, time: Duration) -> Option<(Instant, Value)> {
        let (at, message) = self.messages.recv_timeout(time).ok()?;
        if self.answers_itself && message.get("method").is_some() && message.get("id").is_some() {
            let asked = message.pointer("/params/items").and_then(Value::as_array);
            let result = match message["method"].as_str() {
                Some("workspace/configuration") => {
                    asked.map(|it| vec![self.settings.clone(); it.len()]).into()
                }
                Some("workspace/applyEdit") => {
                    json!({"applied": false, "failureReason": "this client has no files"})
                }
                _ => Value::Null,
            };
            self.send(&json!({"jsonrpc": "2.0", "id": message["id"], "result": result}));
        }
        if let Some(uri) = message.pointer("/params/uri").and_then(Value::as_str)
            && message["method"] == "textDocument/publishDiagnostics"
        {
            self.published.insert(uri.to_owned(), message["params"]["diagnostics"].clone());
        }
        let method = message["method"].as_str().unwrap_or_default();
        let is_counted = method == "textDocument/publishDiagnostics" || method.ends_with("/refresh");
        self.received += u64::from(is_counted);
        Some((at, message))
    }

    /// Receives what comes until nothing has come for `quiet`. To wait for the server, see [`Client::idle`].
    pub fn settle(&mut self, quiet: Duration) {
        while let Some(message) = self.hear(quiet) {
            self.waiting.push_back(message);
        }
    }

    /// Receives messages until one of them answers request `id`. Returns false where none does. All stay to be taken.
    pub fn receive_answer(&mut self, id: u64) -> bool {
        let end = Instant::now() + PATIENCE;
        while !self.waiting.iter().any(|(_, message)| is_answer(message, id)) {
            let Some(message) = self.hear(end.saturating_duration_since(Instant::now())) else {
                return false;
            };
            self.waiting.push_back(message);
        }
        true
    }

    /// [`Client::settle`]; gives what was heard and not asked for, in its order.
    pub fn take(&mut self, quiet: Duration) -> Vec<Value> {
        self.settle(quiet);
        self.waiting.drain(..).map(|(_, message)| message).collect()
    }

    /// Waits until the server has nothing left to do and everything that it sent by itself is received.
    ///
    /// The server handles messages in order. Only changes of files reach it another way: see [`wait_for_watcher`].
    pub fn idle(&mut self) {
        let mut settled = 0;
        let end = Instant::now() + PATIENCE;
        // The first answer comes after the events that the client's own answers to the server have caused.
        while settled < 2 {
            assert!(Instant::now() < end, "the server is busy");
            let status = self.call("mauve/status", Value::Null);
            let sent = status.ok().and_then(|status| status["settled"].as_u64());
            settled = if sent.is_some() { settled + 1 } else { 0 };
            if sent.is_none() {
                // Answers take the time of processors that the server needs for its work.
                std::thread::sleep(Duration::from_millis(2));
            }
            while sent.is_some_and(|sent| self.received < sent) {
                let message = self.hear(PATIENCE);
                self.waiting.push_back(message.unwrap_or_else(|| panic!("{sent:?} messages do not come")));
            }
        }
    }

    /// Discards the received messages that answer no request.
    pub fn forget(&mut self) {
        self.waiting.clear();
    }

    /// How many messages were heard and not asked for that are like this.
    pub fn count(&self, is_it: impl Fn(&Value) -> bool) -> usize {
        self.waiting.iter().filter(|(_, message)| is_it(message)).count()
    }

    /// The newest diagnostics of every file that has one.
    pub fn published(&self) -> HashMap<String, Value> {
        let some = self.published.iter().map(|(uri, found)| (uri.clone(), without_hints(found)));
        some.filter(|(_, found)| !found.is_empty()).map(|(uri, found)| (uri, found.into())).collect()
    }

    /// Opens a text.
    pub fn open(&mut self, path: &Path, text: &str) -> Text {
        let uri = address(path);
        self.open_at(&uri, text)
    }

    /// Opens a text by its address.
    pub fn open_at(&mut self, uri: &str, text: &str) -> Text {
        let document = json!({"uri": uri, "languageId": "mauve", "version": 1, "text": text});
        self.notify("textDocument/didOpen", json!({"textDocument": document}));
        Text { uri: uri.to_owned(), version: 1, text: text.to_owned(), columns: Columns::Utf16 }
    }

    /// Opens a file of the disk.
    pub fn open_file(&mut self, path: &Path) -> Text {
        let text = std::fs::read_to_string(path);
        let text = text.unwrap_or_else(|error| panic!("cannot read {}: {error}", path.display()));
        self.open(path, &text)
    }

    /// Replaces the first `from` of a text by `to`.
    pub fn edit(&mut self, text: &mut Text, from: &str, to: &str) {
        let Some(start) = text.text.find(from) else { panic!("no `{from}` in {}", text.text) };
        self.replace(text, start..start + from.len(), to);
    }

    /// Replaces these bytes of a text.
    pub fn replace(&mut self, text: &mut Text, range: std::ops::Range<usize>, to: &str) {
        let (start, end) = (text.position(range.start), text.position(range.end));
        text.text.replace_range(range, to);
        text.version += 1;
        let change = json!({"range": {"start": start, "end": end}, "text": to});
        self.notify(
            "textDocument/didChange",
            json!({"textDocument": {"uri": text.uri, "version": text.version}, "contentChanges": [change]}),
        );
    }

    /// Waits for the diagnostics of this version of a text. The first ones of a text that was opened may be those that it has by
    /// itself; then also for the others.
    pub fn diagnostics(&mut self, text: &Text) -> Vec<Value> {
        let what = format!("diagnostics of version {} of {}", text.version, text.uri);
        let is_it = |it: &Value| is_publication(it, &text.uri) && it["params"]["version"] == text.version;
        let (_, mut found) = self.wait(&what, is_it);
        if text.version == 1 {
            self.idle();
            while self.count(is_it) > 0 {
                found = self.wait(&what, is_it).1;
            }
        }
        without_hints(&found["params"]["diagnostics"])
    }

    /// Waits for the diagnostics of this version of a text; returns their time of arrival.
    pub fn wait_for_diagnostics(&mut self, text: &Text) -> Instant {
        let is_it = |it: &Value| is_publication(it, &text.uri) && it["params"]["version"] == text.version;
        self.wait("diagnostics", is_it).0
    }

    /// The codes of the diagnostics of this version of a text.
    pub fn codes(&mut self, text: &Text) -> Vec<String> {
        let found = self.diagnostics(text);
        found.iter().map(|it| it["code"].as_str().unwrap_or_default().to_owned()).collect()
    }

    /// The inlay hints of a text: lines, from 0, and labels. An edit that overtakes the question has it asked again.
    pub fn hints(&mut self, uri: &str) -> Vec<(u64, String)> {
        loop {
            match self.call("textDocument/inlayHint", whole_text(uri)) {
                Ok(hints) => {
                    let hints = hints.as_array().cloned().unwrap_or_default();
                    let label = |hint: &Value| hint["label"].as_str().unwrap_or_default().to_owned();
                    let line = |hint: &Value| hint["position"]["line"].as_u64().unwrap_or_default();
                    return hints.iter().map(|hint| (line(hint), label(hint))).collect();
                }
                Err(error) if error["code"] == -32801 => {}
                // A text that is not analysed has no hints.
                Err(error) if error.to_string().contains("under another URI") => return Vec::new(),
                Err(error) => panic!("no hints: {error}"),
            }
        }
    }

    /// The last hint in the first line that has `beside` in it.
    pub fn hint(&mut self, text: &Text, beside: &str) -> String {
        let hint = self.hint_if_any(text, beside);
        hint.unwrap_or_else(|| panic!("no hint beside `{beside}` in {}", text.uri))
    }

    fn hint_if_any(&mut self, text: &Text, beside: &str) -> Option<String> {
        let line = text.text.lines().position(|line| line.contains(beside))?;
        let hints = self.hints(&text.uri);
        hints.into_iter().rfind(|(at, _)| *at as usize == line).map(|(_, label)| label)
    }

    /// Asks for a hint again and again until it is as expected, as a client does that is told to ask again.
    pub fn wait_for_hint(&mut self, text: &Text, beside: &str, is_it: impl Fn(&str) -> bool) {
        let found = wait_for_watcher(PATIENCE, || match self.hint_if_any(text, beside) {
            Some(hint) if is_it(&hint) => Ok(()),
            hint => Err(hint),
        });
        found.unwrap_or_else(|hint| panic!("the hint stays {hint:?}"));
    }

    /// Waits until the published diagnostics are as expected; returns them.
    pub fn wait_for_published(
        &mut self,
        is_it: impl Fn(&HashMap<String, Value>) -> bool,
    ) -> HashMap<String, Value> {
        let found = wait_for_watcher(PATIENCE, || {
            self.settle(Duration::ZERO);
            let published = self.published();
            if is_it(&published) { Ok(published) } else { Err(published) }
        });
        found.unwrap_or_else(|published| panic!("published is {published:?}"))
    }

    /// Stops reading the server's output, except for messages already on their way.
    pub fn stop_reading(&mut self) {
        self.set_gate(false);
    }

    /// Reads again.
    pub fn read_on(&mut self) {
        self.set_gate(true);
    }

    fn set_gate(&mut self, open: bool) {
        if let Ok(mut gate) = self.gate.0.lock() {
            *gate = open;
        }
        self.gate.1.notify_all();
    }

    /// Closes the server's input.
    pub fn hang_up(&mut self) {
        self.input = None;
    }

    /// How the server ends, within `time`; none where it does not.
    pub fn wait_for_end(&mut self, time: Duration) -> Option<i32> {
        let end = Instant::now() + time;
        while Instant::now() < end {
            if let Ok(Some(status)) = self.process.try_wait() {
                return Some(status.code().unwrap_or(-1));
            }
            // The standard library waits for a process without a limit, or not at all.
            std::thread::sleep(Duration::from_millis(2));
        }
        None
    }

    /// The process.
    pub fn process(&self) -> u32 {
        self.process.id()
    }

    /// The memory that the process holds, in kB; none where the system does not say.
    pub fn memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.process())).ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
        line.trim().trim_end_matches(" kB").parse().ok()
    }

    /// Ends the session as a client does; returns the exit code.
    pub fn shut_down(mut self) -> Option<i32> {
        let _ = self.call("shutdown", Value::Null);
        self.notify("exit", Value::Null);
        self.wait_for_end(Duration::from_secs(10))
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Calls `check` until it succeeds, with pauses of at most `time` together. Returns its last result.
///
/// This is for changes of files: the server notices them some time later, and no request waits for that. For all else
/// there is [`Client::idle`].
pub fn wait_for_watcher<T, E>(time: Duration, mut check: impl FnMut() -> Result<T, E>) -> Result<T, E> {
    let (mut left, mut pause) = (time, Duration::from_millis(2));
    loop {
        let result = check();
        if result.is_ok() || left.is_zero() {
            return result;
        }
        std::thread::sleep(pause);
        left = left.saturating_sub(pause);
        pause = (2 * pause).min(Duration::from_millis(100));
    }
}

/// The unit of columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Columns {
    Utf8,
    Utf16,
    Utf32,
}

impl Columns {
    /// The length of a text.
    fn count(self, text: &str) -> usize {
        match self {
            Columns::Utf8 => text.len(),
            Columns::Utf16 => text.encode_utf16().count(),
            Columns::Utf32 => text.chars().count(),
        }
    }

    /// The byte at a position in `text`.
    pub fn offset(self, text: &str, position: &Value) -> usize {
        let [line, column] =
            ["line", "character"].map(|it| position[it].as_u64().unwrap_or_default() as usize);
        let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
        let rest = &text[start..];
        let mut ends = rest.char_indices().map(|(at, _)| at).chain([rest.len()]);
        let length = ends.find(|&end| self.count(&rest[..end]) == column);
        start + length.unwrap_or_else(|| panic!("no {position} in {text}"))
    }
}

/// An open text, as the client has it.
#[derive(Debug, Clone)]
pub struct Text {
    /// Its address.
    pub uri: String,
    /// Counts the edits.
    pub version: i64,
    /// Its contents.
    pub text: String,
    /// The unit of its columns.
    pub columns: Columns,
}

impl Text {
    /// The position of a byte.
    pub fn position(&self, offset: usize) -> Value {
        let before = &self.text[..offset];
        let line = before.rsplit('\n').next().unwrap_or_default();
        json!({"line": before.matches('\n').count(), "character": self.columns.count(line)})
    }

    /// The text with the edits of a server.
    pub fn applied(&self, edits: &Value) -> String {
        let mut text = self.text.clone();
        for (range, new) in self.edits(edits) {
            text.replace_range(range, new);
        }
        text
    }

    /// The edits of a server: the replaced bytes and their replacements. They go from the end of the text to its
    /// beginning, so that each leaves the bytes of the next ones where they are.
    pub fn edits<'a>(&self, edits: &'a Value) -> Vec<(std::ops::Range<usize>, &'a str)> {
        let range = |range: &Value| {
            let offset = |end: &str| self.columns.offset(&self.text, &range[end]);
            offset("start")..offset("end")
        };
        let edits = edits.as_array().unwrap_or_else(|| panic!("no edits: {edits}")).iter();
        let mut edits: Vec<_> =
            edits.map(|it| (range(&it["range"]), it["newText"].as_str().unwrap_or_default())).collect();
        edits.sort_by_key(|(range, _)| (range.start, range.end));
        edits.reverse();
        edits
    }

    /// Returns the parameters of a request at the first `at`.
    pub fn at(&self, at: &str) -> Value {
        let Some(offset) = self.text.find(at) else { panic!("no `{at}` in {}", self.text) };
        json!({"textDocument": {"uri": self.uri}, "position": self.position(offset)})
    }
}

/// The capabilities of a modern editor.
fn good_editor() -> Value {
    json!({
        "general": {"positionEncodings": ["utf-16"]},
        "workspace": {"inlayHint": {"refreshSupport": true}},
        "textDocument": {
            "hover": {"contentFormat": ["markdown", "plaintext"]},
            "definition": {"linkSupport": true},
            "documentSymbol": {"hierarchicalDocumentSymbolSupport": true},
            "publishDiagnostics": {"relatedInformation": true, "versionSupport": true},
        },
    })
}

/// The address of a file.
pub fn address(path: &Path) -> String {
    format!("file://{}", path.display())
}

/// Returns whether this is the answer to request `id`.
pub fn is_answer(message: &Value, id: u64) -> bool {
    message.get("method").is_none() && message["id"] == id
}

/// Returns whether these are the diagnostics of a file.
pub fn is_publication(message: &Value, uri: &str) -> bool {
    message["method"] == "textDocument/publishDiagnostics" && message["params"]["uri"] == uri
}

/// The parameters of a request about all of a text.
pub fn whole_text(uri: &str) -> Value {
    let end = json!({"line": 1_000_000, "character": 0});
    json!({"textDocument": {"uri": uri}, "range": {"start": {"line": 0, "character": 0}, "end": end}})
}

/// Reads a message; returns it with the time of its arrival.
fn read(output: &mut impl std::io::BufRead) -> Option<(Instant, Value)> {
    let mut length = 0;
    loop {
        let mut line = String::new();
        if output.read_line(&mut line).ok()? == 0 {
            return None;
        }
        match line.trim_end().split_once(": ") {
            Some(("Content-Length", value)) => length = value.parse().ok()?,
            Some(_) => {}
            None => break,
        }
    }
    let mut bytes = vec![0; length];
    output.read_exact(&mut bytes).ok()?;
    let at = Instant::now();
    Some((at, serde_json::from_slice(&bytes).ok()?))
}

/// Errors and warnings without hints: hints suggest improvements, and tests do not depend on them.
fn without_hints(diagnostics: &Value) -> Vec<Value> {
    let all = diagnostics.as_array().map_or(&[] as &[Value], Vec::as_slice);
    all.iter().filter(|it| it["severity"] != 4).cloned().collect()
}
