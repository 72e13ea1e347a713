//! `mauve replay FILE`: a recorded session once more.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{BufReader, PipeReader, PipeWriter};
use std::path::PathBuf;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use mauve_projects::address::file_at;
use mauve_projects::disk::read;
use mauve_projects::output::Output;
use serde_json::{Value, json};

use crate::mirror::{Line, Side};
use crate::{frame, run};

/// `mauve replay`.
#[derive(Debug, clap::Args)]
pub struct Replay {
    /// The file that `mauve lsp --mirror FILE` has recorded.
    file: PathBuf,
    /// The folder of the models, if it is not the folder of the record.
    #[arg(long, value_name = "FOLDER")]
    folder: Option<PathBuf>,
}

/// The largest record that is read, in bytes.
const LONGEST: u64 = 1 << 28;

/// How long to wait for messages that do not come, all of them together.
const PATIENCE: Duration = Duration::from_secs(30);

impl Replay {
    /// Sends the client's messages again, each after the server's messages that preceded it in the record, and
    /// compares the answers.
    pub fn run(self) -> Result<Output, String> {
        let path = self.file.display();
        let bytes = read(&self.file, LONGEST).map_err(|error| format!("cannot read `{path}`: {error}"))?;
        let text = String::from_utf8(bytes)
            .map_err(|_| format!("cannot read `{path}`: the file is not UTF-8 text"))?;
        let text = match &self.folder {
            Some(folder) => moved(&text, folder)?,
            None => text,
        };
        let mut lines: Vec<Line> = Vec::new();
        let mut cut = false;
        for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            match serde_json::from_str(line) {
                Ok(line) => lines.push(line),
                // A session that was cut off ends in half a line.
                Err(_) if number + 1 == text.lines().count() && !lines.is_empty() => cut = true,
                Err(error) => {
                    return Err(format!("{path}:{}: not a line of a recorded session: {error}", number + 1));
                }
            }
        }
        // One file may hold several sessions: an editor starts a server again that has ended. The last one counts.
        let is_first = |line: &Line| line.from == Side::Client && line.message["method"] == "initialize";
        let sessions = lines.iter().filter(|line| is_first(line)).count();
        let lines = lines.split_off(lines.iter().rposition(is_first).unwrap_or_default());
        if let Some(folder) = lines.first().and_then(folder_of).filter(|folder| !folder.is_dir()) {
            let folder = folder.display();
            return Err(format!(
                "the folder `{folder}` of the record does not exist: name its new path with `--folder`"
            ));
        }
        let mut session = Session::begin()?;
        let begin = Instant::now();
        let mut late = Vec::new();
        for line in &lines {
            match line.from {
                Side::Client => session.say(&line.message)?,
                Side::Server if session.expect(&line.message) => {}
                Side::Server => late.push(&line.message),
            }
        }
        let said = lines.iter().filter(|line| line.from == Side::Client).count();
        let mut out =
            format!("{said} messages of the client replayed in {:.1} s\n", begin.elapsed().as_secs_f64());
        if sessions > 1 {
            let _ = writeln!(out, "the record has {sessions} sessions: only the last is replayed");
        }
        if cut {
            out += "the last line of the record is incomplete\n";
        }
        let differences = session.end(&lines, &late);
        let code = u8::from(!differences.is_empty());
        match differences.len() {
            0 => out += "all answers and the last diagnostics equal the record\n",
            count => {
                let _ = writeln!(out, "{count} differ from the record:");
                differences.iter().for_each(|difference| out += difference);
            }
        }
        Ok(Output::escaped(out, code))
    }
}

/// Replaces the URI of the record's first workspace folder with that of `folder`.
fn moved(text: &str, folder: &std::path::Path) -> Result<String, String> {
    let shown = folder.display();
    let folder = folder.canonicalize().map_err(|error| format!("cannot read `{shown}`: {error}"))?;
    let new = mauve_projects::address::address_of(&folder)
        .ok_or_else(|| format!("`{shown}` cannot be written as a URI"))?;
    let first = text.lines().find_map(|line| serde_json::from_str::<Line>(line).ok());
    let old = first.as_ref().and_then(folder_address);
    let old =
        old.ok_or("the record does not begin with a workspace folder, so `--folder` cannot replace it")?;
    Ok(text.replace(old.trim_end_matches('/'), new.as_str().trim_end_matches('/')))
}

fn folder_address(first: &Line) -> Option<&str> {
    let params = first.message.get("params")?;
    params.pointer("/workspaceFolders/0/uri").or_else(|| params.get("rootUri"))?.as_str()
}

fn folder_of(first: &Line) -> Option<PathBuf> {
    file_at(folder_address(first)?)
}

struct Session {
    input: Option<PipeWriter>,
    said: mpsc::Receiver<Value>,
    heard: Vec<Value>,
    /// How long it still waits for messages that do not come.
    patience: Duration,
}

impl Session {
    fn begin() -> Result<Session, String> {
        let pipe = || std::io::pipe().map_err(|error| format!("no pipe to the server: {error}"));
        let ((server_input, input), (output, server_output)) = (pipe()?, pipe()?);
        std::thread::spawn(move || run(server_input, server_output, None, false, None));
        let (sender, said) = mpsc::channel();
        std::thread::spawn(move || listen(output, &sender));
        Ok(Session { input: Some(input), said, heard: Vec::new(), patience: PATIENCE })
    }

    fn say(&mut self, message: &Value) -> Result<(), String> {
        // Answers to questions of the server are given at once, whatever number the question has this time.
        if message.get("method").is_none() {
            return Ok(());
        }
        let mut message = message.clone();
        if let Some(params) = message.get_mut("params").and_then(Value::as_object_mut) {
            // That process is gone.
            params.remove("processId");
        }
        self.write(&message)
    }

    fn write(&mut self, message: &Value) -> Result<(), String> {
        let Some(input) = &mut self.input else { return Ok(()) };
        frame::write(input, &message.to_string()).map_err(|error| format!("the server has ended: {error}"))
    }

    /// Waits for the server message that the record has here: an answer, or diagnostics. Returns whether it came.
    fn expect(&mut self, recorded: &Value) -> bool {
        let Some(is_it) = matching(recorded) else { return true };
        let begin = Instant::now();
        while !self.heard.iter().any(&is_it) {
            let Ok(message) = self.said.recv_timeout(self.patience.saturating_sub(begin.elapsed())) else {
                // The next messages may still come: the last comparison shows it.
                self.patience = self.patience.saturating_sub(begin.elapsed());
                return false;
            };
            self.hear(message);
        }
        true
    }

    fn hear(&mut self, message: Value) {
        if message.get("method").is_some() && message.get("id").is_some() {
            let answer = json!({"jsonrpc": "2.0", "id": message["id"], "result": null});
            let _ = self.write(&answer);
        }
        self.heard.push(message);
    }

    /// Ends the session, and lists the differences from the record.
    fn end(mut self, lines: &[Line], late: &[&Value]) -> Vec<String> {
        self.input = None;
        while let Ok(message) = self.said.recv_timeout(PATIENCE) {
            self.hear(message);
        }
        let recorded: Vec<&Value> =
            lines.iter().filter(|line| line.from == Side::Server).map(|line| &line.message).collect();
        let mut found = Vec::new();
        let is_missing = |it: &&&Value| matching(it).is_some_and(|is_it| !self.heard.iter().any(&is_it));
        let missing = late.iter().filter(is_missing).count();
        if missing > 0 {
            found.push(format!(
                "{missing} messages of the record did not come, with a wait of {} s for all of them\n",
                PATIENCE.as_secs()
            ));
        }
        for answer in &recorded {
            let Some(id) = id_of(answer) else { continue };
            let again = self.heard.iter().find(|heard| id_of(heard) == Some(id));
            // Whether an edit, or its client, ends a request in time depends on the hour.
            let is_ended = |answer: &Value| {
                let code = answer.pointer("/error/code").and_then(Value::as_i64);
                code.is_some_and(|code| [-32801, -32800].contains(&code))
            };
            if again.is_none_or(|again| again != *answer && !is_ended(again) && !is_ended(answer)) {
                found.push(difference(&method_of(lines, id), answer, again));
            }
        }
        // The last ones of each document.
        let diagnostics =
            |message: &Value| Some((uri_of(message)?.to_owned(), message["params"]["diagnostics"].clone()));
        let now: BTreeMap<String, Value> = self.heard.iter().filter_map(diagnostics).collect();
        let then: BTreeMap<String, Value> = recorded.into_iter().filter_map(diagnostics).collect();
        for (uri, diagnostics) in &then {
            if now.get(uri) != Some(diagnostics) {
                found.push(difference(&format!("diagnostics of {uri}"), diagnostics, now.get(uri)));
            }
        }
        found
    }
}

/// Recognises a message.
type Recognition<'a> = Box<dyn Fn(&Value) -> bool + 'a>;

/// Returns what recognises a recorded message of the server: an answer, or diagnostics; nothing for others.
fn matching(recorded: &Value) -> Option<Recognition<'_>> {
    match (id_of(recorded), uri_of(recorded)) {
        (Some(id), _) => Some(Box::new(move |heard| id_of(heard) == Some(id))),
        // Those of a version that was overtaken then may come now, and the other way round: a newer one is as good.
        (None, Some(uri)) => {
            let version = |it: &Value| it.pointer("/params/version").and_then(Value::as_i64);
            let at_least = version(recorded)?;
            Some(Box::new(move |heard| {
                uri_of(heard) == Some(uri) && version(heard).is_some_and(|version| version >= at_least)
            }))
        }
        _ => None,
    }
}

fn listen(output: PipeReader, sender: &mpsc::Sender<Value>) {
    let mut output = BufReader::new(output);
    while let Ok(Some(frame)) = frame::read(&mut output) {
        if let Ok(message) = frame
            && sender.send(message).is_err()
        {
            return;
        }
    }
}

/// The key of an answer.
fn id_of(message: &Value) -> Option<&Value> {
    if message.get("method").is_some() { None } else { message.get("id") }
}

/// The key of published diagnostics.
fn uri_of(message: &Value) -> Option<&str> {
    let is_publication = message.get("method").is_some_and(|it| it == "textDocument/publishDiagnostics");
    message.pointer("/params/uri").filter(|_| is_publication)?.as_str()
}

fn method_of(lines: &[Line], id: &Value) -> String {
    let mut requests = lines.iter().filter(|line| line.from == Side::Client).map(|line| &line.message);
    let request = requests.find(|it| it.get("id") == Some(id) && it.get("method").is_some());
    let method = request.and_then(|it| it["method"].as_str()).unwrap_or("?");
    format!("{method}, request {id}")
}

fn difference(what: &str, recorded: &Value, now: Option<&Value>) -> String {
    let now = now.map_or_else(|| "nothing".to_owned(), Value::to_string);
    format!("{what}\n  recorded {recorded}\n  now      {now}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_messages_are_waited_for_once() {
        let mut session = Session::begin().unwrap();
        session.patience = Duration::from_millis(500);
        let begin = Instant::now();
        let recorded: Vec<Value> =
            (0..1000).map(|id| json!({ "jsonrpc": "2.0", "id": id, "result": null })).collect();
        assert!(recorded.iter().all(|it| !session.expect(it)));
        // With a wait for each of them, more than eight minutes.
        assert!(begin.elapsed() < Duration::from_secs(60));
        // What comes late is not missing.
        session.heard.extend(recorded.iter().skip(3).cloned());
        let found = session.end(&[], &recorded.iter().collect::<Vec<_>>());
        assert_eq!(found, ["3 messages of the record did not come, with a wait of 30 s for all of them\n"]);
    }
}
