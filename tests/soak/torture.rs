//! A client that breaks the protocol: unknown methods, parameters of other types, ids that are taken, changes of texts that
//! are not open, positions outside a text, versions that go back. Each such message is answered with an error, or not at
//! all; afterwards the client says again what the texts are.

use super::*;

/// The errors that such messages are answered with: no method, no parameters, no request, no JSON; and those of other requests.
const EXPECTED: [i64; 5] = [-32601, -32602, -32600, -32700, -32002];

/// Parameters that no method takes, and those that some do.
const NONSENSE: [&str; 12] = [
    "null",
    "[]",
    "{}",
    "7",
    "\"text\"",
    "{\"textDocument\":5}",
    "{\"textDocument\":{\"uri\":\"%\"}}",
    "{\"textDocument\":{\"uri\":\"untitled:x\"},\"position\":{\"line\":-1,\"character\":0}}",
    "{\"textDocument\":{\"uri\":\"file:///\"},\"position\":{\"line\":1e9,\"character\":0.5}}",
    "{\"textDocument\":{\"uri\":\"file:///a.mal\"},\"range\":{\"start\":[],\"end\":null}}",
    "{\"item\":{\"name\":null},\"data\":{\"kind\":\"unknown\"}}",
    "{\"command\":\"mauve.fly\",\"arguments\":{}}",
];

/// Methods that the server does not have, and those that a client calls once.
const STRANGE: [&str; 8] = [
    "no/such/method",
    "$/such/method",
    "textDocument/",
    "",
    "initialize",
    "mauve/debug",
    "textDocument/didChange",
    "window/workDoneProgress/cancel",
];

impl Session {
    /// Returns whether a request that was to be refused was answered so.
    pub(super) fn is_expected(&self, message: &Value) -> bool {
        let is_of_torture = match message["id"].as_u64() {
            Some(id) => self.tortures.contains(&id),
            None => message["id"].is_null(),
        };
        let code = message.pointer("/error/code").and_then(Value::as_i64);
        is_of_torture && code.is_none_or(|code| EXPECTED.contains(&code) || LEGITIMATE.contains(&code))
    }

    /// One message, or a few, that break the protocol.
    pub(super) fn torture(&mut self, random: &mut Random) {
        match random.below(12) {
            0 => self.ask_nonsense(random),
            1 => self.ask_for_the_unknown(random),
            2 => self.use_an_id_twice(random),
            3 => self.change_what_is_not_open(random),
            4 => self.change_outside(random),
            5 => self.change_with_nonsense(random),
            6 => self.go_back(random),
            7 => self.open_twice(random),
            8 => self.cancel_nonsense(random),
            9 => self.notify_nonsense(random),
            10 => self.send_what_is_no_message(random),
            _ => self.reload(random),
        }
    }

    fn request_torture(&mut self, method: &str, params: Value) {
        let id = self.client.request(method, params);
        self.tortures.insert(id);
    }

    fn ask_nonsense(&mut self, random: &mut Random) {
        let method = random.of(&self.methods).name;
        let nonsense: &&str = random.of(&NONSENSE);
        let params = serde_json::from_str(nonsense).unwrap();
        self.request_torture(method, params);
    }

    fn ask_for_the_unknown(&mut self, random: &mut Random) {
        let method = *random.of(&STRANGE);
        // As a request, a change of a text leaves all texts unknown that it names: none.
        self.request_torture(method, json!({}));
        if method == "textDocument/didChange" {
            self.say_all_again();
        }
    }

    fn use_an_id_twice(&mut self, random: &mut Random) {
        let place = self.place(random);
        let params = json!({"textDocument": {"uri": place.uri}, "position": place.position});
        let id = self.client.request("textDocument/hover", params.clone());
        self.tortures.insert(id);
        for _ in 0..=random.below(3) {
            let method = random.of(&["textDocument/hover", "textDocument/completion", "no/such/method"]);
            self.client.send(&json!({"jsonrpc": "2.0", "id": id, "method": method, "params": params}));
        }
    }

    /// The server reads the text from the disk, and forgets it when the client closes what it has not opened.
    fn change_what_is_not_open(&mut self, random: &mut Random) {
        let file = random.below(FILES.len() + 1);
        if self.state.open.contains_key(&file) {
            return;
        }
        let uri = match FILES.get(file) {
            Some(_) => uri(&self.top, file),
            None => address(&self.top.join("p3dx/never.mal")),
        };
        let start = json!({"line": random.below(9), "character": random.below(9)});
        let change = json!({"range": {"start": start, "end": start}, "text": "x"});
        for _ in 0..=random.below(3) {
            let params =
                json!({"textDocument": {"uri": uri, "version": 5}, "contentChanges": [change.clone()]});
            self.client.notify("textDocument/didChange", params);
        }
        if random.below(2) == 0 {
            self.ask(random);
        }
        self.client.notify("textDocument/didClose", json!({"textDocument": {"uri": uri}}));
        if random.below(2) == 0 {
            self.client.notify("textDocument/didClose", json!({"textDocument": {"uri": uri}}));
        }
    }

    /// A range that ends behind the text, one that ends before it begins, and one within a character.
    fn change_outside(&mut self, random: &mut Random) {
        let Some(file) = self.an_open_file(random) else { return };
        let Some(open) = self.state.open.get_mut(&file) else { return };
        let start = boundary(&open.text.text, random.below(open.text.text.len() + 1));
        let end = open.text.text.len();
        let mut change = open.replace(start..end, "\n// end\n");
        let beyond = json!({"line": 4_000_000, "character": random.below(9)});
        change["range"]["end"] = beyond;
        self.say_changes(file, &[change]);
        if random.below(2) == 0 {
            let positions = [(random.below(50), 70), (random.below(9), 3)]
                .map(|(line, character)| json!({"line": line, "character": character}));
            let change = json!({"range": {"start": positions[0], "end": positions[1]}, "text": "\u{1f916}"});
            self.say_changes(file, &[change]);
            self.say_again(file);
        }
    }

    fn change_with_nonsense(&mut self, random: &mut Random) {
        let Some(file) = self.an_open_file(random) else { return };
        let uri = uri(&self.top, file);
        let params = match random.below(4) {
            0 => json!({"textDocument": {"uri": uri}, "contentChanges": []}),
            1 => {
                json!({"textDocument": {"uri": uri, "version": 1}, "contentChanges": [{"range": 5, "text": 7}]})
            }
            2 => json!({"textDocument": {"uri": uri, "version": "x"}, "contentChanges": null}),
            _ => json!({"textDocument": {"uri": uri, "version": 1, "languageId": 5}, "contentChanges": [{}]}),
        };
        let method = random.of(&["textDocument/didChange", "textDocument/didOpen"]);
        self.client.notify(method, params);
        if random.below(2) == 0 {
            self.ask(random);
        }
        self.say_again(file);
    }

    fn go_back(&mut self, random: &mut Random) {
        let Some(file) = self.an_open_file(random) else { return };
        let version = *random.of(&[-5, 0, 1, 1_000_000]);
        if let Some(open) = self.state.open.get_mut(&file) {
            open.text.version = version;
        }
        self.edit_file(random, file);
    }

    fn open_twice(&mut self, random: &mut Random) {
        let Some(file) = self.an_open_file(random) else { return };
        let touched = self.tick();
        let Some(open) = self.state.open.get_mut(&file) else { return };
        open.touched = touched;
        open.undo.clear();
        let columns = open.text.columns;
        let text = random.of(&[self.originals[file].clone(), open.text.text.clone()]).clone();
        open.text = self.client.open_at(&uri(&self.top, file), &text);
        open.text.columns = columns;
    }

    fn cancel_nonsense(&mut self, random: &mut Random) {
        let id = random.of(&[json!(null), json!("x"), json!(-1), json!(999_999_999), json!({})]).clone();
        self.client.notify("$/cancelRequest", json!({"id": id}));
        self.client.notify("window/workDoneProgress/cancel", json!({"token": id}));
        if let Some(&id) = self.asked.keys().min() {
            for _ in 0..3 {
                self.client.notify("$/cancelRequest", json!({"id": id}));
            }
        }
    }

    /// Notifications with parameters of other types. What they say of texts is said again.
    fn notify_nonsense(&mut self, random: &mut Random) {
        let methods = [
            "workspace/didChangeWatchedFiles",
            "workspace/didChangeConfiguration",
            "textDocument/didSave",
            "initialized",
            "no/such/notification",
            "$/setTrace",
            "textDocument/hover",
        ];
        let nonsense: &&str = random.of(&NONSENSE);
        let params = serde_json::from_str(nonsense).unwrap();
        let method: &&str = random.of(&methods);
        self.client.notify(method, params);
        self.say_all_again();
    }

    fn send_what_is_no_message(&mut self, random: &mut Random) {
        let bytes: &&[u8] = random.of(&[
            b"Content-Length: 2\r\n\r\n[]" as &[u8],
            b"Content-Length: 7\r\n\r\n{\"a\":1}",
            b"Content-Length: 41\r\n\r\n{\"jsonrpc\":\"2.0\",\"id\":4711,\"result\":null}",
        ]);
        self.client.write(bytes);
        self.say_all_again();
    }

    fn reload(&mut self, random: &mut Random) {
        if random.below(4) == 0 {
            self.request_torture("workspace/executeCommand", json!({"command": "mauve.reload"}));
        }
    }

    fn an_open_file(&self, random: &mut Random) -> Option<usize> {
        let open: Vec<usize> = self.state.open.keys().copied().collect();
        if open.is_empty() { None } else { Some(*random.of(&open)) }
    }

    /// Says what a text is: as a whole.
    fn say_again(&mut self, file: usize) {
        let Some(open) = self.state.open.get(&file) else { return };
        let change = json!({"text": open.text.text});
        self.say_changes(file, &[change]);
    }

    fn say_all_again(&mut self) {
        let open: Vec<usize> = self.state.open.keys().copied().collect();
        open.into_iter().for_each(|file| self.say_again(file));
    }
}
