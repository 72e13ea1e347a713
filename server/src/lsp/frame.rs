//! Messages on a byte stream: `Content-Length: N`, an empty line, N bytes of JSON.
//!
//! Reading continues after invalid input: a message that is not JSON gives an error and does not end the session. A
//! message ends where its JSON ends, so the server accepts messages of a client that counts characters instead of
//! bytes, and warns. Where the length is neither, bytes may be missing in it: the texts that it changes are unknown.
//! Bytes that are no message are passed over up to the next header; where none comes, the session ends with an error,
//! so that the client starts the server again.

use std::collections::{BTreeSet, VecDeque};
use std::io::{self, Read, Write};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use serde_json::Value;

/// The maximum lengths of a header line and of a message, in bytes: longer input is not this protocol.
const LONGEST_LINE: usize = 4096;
const LONGEST_MESSAGE: usize = 1 << 30;

/// How long to wait for the rest of a message whose JSON is longer than its `Content-Length`: the rest may not come.
const PAUSE: Duration = Duration::from_secs(1);

/// How long to wait for a header after bytes that are not a message.
const PATIENCE: Duration = Duration::from_secs(10);

/// The bytes of a chunk, and how many chunks are read ahead.
const CHUNK: usize = 1 << 16;
const CHUNKS: usize = 16;

/// A result of reading.
#[derive(Debug, PartialEq)]
pub(crate) enum Frame {
    Message(Value),
    /// The next message has another length than its header says.
    Miscounted,
    Invalid {
        why: String,
        /// The texts that are unknown now.
        lost: Lost,
    },
}

/// The texts that an invalid message may have changed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Lost {
    /// Whether all open texts are affected.
    pub(crate) all: bool,
    /// The URIs of affected texts, open or not.
    pub(crate) addresses: Vec<String>,
}

/// The messages that come on a stream. A separate thread reads it, so that a pause can be distinguished from the end.
pub(crate) struct Frames {
    chunks: mpsc::Receiver<io::Result<Vec<u8>>>,
    /// Bytes that are not yet part of a message.
    buffer: Vec<u8>,
    /// Frames to return before the next message is read.
    queued: VecDeque<Frame>,
    /// The value of the last `Content-Length`, until its message is read.
    length: Option<Result<usize, String>>,
    /// The time of the first byte that is not a message, if no header has followed.
    junk_since: Option<Instant>,
}

#[derive(PartialEq)]
enum More {
    Bytes,
    Silence,
    End,
}

impl Frames {
    /// Reads `input` from now on.
    pub(crate) fn new(mut input: impl Read + Send + 'static) -> io::Result<Frames> {
        let (sender, chunks) = mpsc::sync_channel(CHUNKS);
        std::thread::Builder::new().name("bytes".to_owned()).spawn(move || {
            loop {
                let mut chunk = vec![0; CHUNK];
                let read = match input.read(&mut chunk) {
                    Ok(0) => return,
                    Ok(count) => {
                        chunk.truncate(count);
                        Ok(chunk)
                    }
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                    Err(error) => Err(error),
                };
                let is_last = read.is_err();
                if sender.send(read).is_err() || is_last {
                    return;
                }
            }
        })?;
        Ok(Frames { chunks, buffer: Vec::new(), queued: VecDeque::new(), length: None, junk_since: None })
    }

    fn more(&mut self, patience: Option<Duration>) -> io::Result<More> {
        let chunk = match patience {
            None => self.chunks.recv().map_err(|_| mpsc::RecvTimeoutError::Disconnected),
            Some(patience) => self.chunks.recv_timeout(patience),
        };
        match chunk {
            Ok(chunk) => {
                self.buffer.extend(chunk?);
                Ok(More::Bytes)
            }
            Err(mpsc::RecvTimeoutError::Timeout) => Ok(More::Silence),
            Err(mpsc::RecvTimeoutError::Disconnected) => Ok(More::End),
        }
    }

    /// Reads one message; `None` at the end of the stream.
    ///
    /// # Errors
    ///
    /// Those of the stream; it ends within a message; a message is too long; no header follows what is no message.
    pub(crate) fn next(&mut self) -> io::Result<Option<Frame>> {
        if let Some(frame) = self.queued.pop_front() {
            return Ok(Some(frame));
        }
        loop {
            let Some(end) = self.buffer.iter().position(|byte| *byte == b'\n') else {
                if self.buffer.len() > LONGEST_LINE {
                    // This may be the begin of a header name.
                    let junk: Vec<u8> =
                        self.buffer.drain(..self.buffer.len() - CONTENT_LENGTH.len()).collect();
                    if let Some(frame) = self.junk(&junk) {
                        return Ok(Some(frame));
                    }
                    continue;
                }
                // The rest of a header follows soon.
                let is_begun = self.length.is_some() || !self.buffer.trim_ascii().is_empty();
                let patience = match self.junk_since {
                    Some(since) => Some(PATIENCE.saturating_sub(since.elapsed())),
                    None => is_begun.then_some(PATIENCE),
                };
                match self.more(patience)? {
                    More::Bytes => continue,
                    More::End => return Ok(None),
                    More::Silence => return Err(no_header()),
                }
            };
            let line: Vec<u8> = self.buffer.drain(..=end).collect();
            let line = String::from_utf8_lossy(&line);
            let line = line.trim();
            if line.is_empty() {
                match self.length.take() {
                    Some(Ok(length)) => return self.body(length).map(Some),
                    Some(Err(why)) => {
                        let lost = Lost { all: true, addresses: Vec::new() };
                        return Ok(Some(Frame::Invalid { why, lost }));
                    }
                    // An empty line between messages is not worth an error.
                    None => continue,
                }
            }
            let at = line.to_ascii_lowercase().rfind(CONTENT_LENGTH);
            let junk = match at {
                Some(at) => line.get(..at).unwrap_or_default(),
                // Other headers are ignored.
                None if is_header(line) => "",
                None => line,
            };
            let frame = if junk.is_empty() { None } else { self.junk(junk.as_bytes()) };
            if let Some(at) = at {
                let value = line.get(at + CONTENT_LENGTH.len()..).unwrap_or_default().trim();
                let number = value.parse::<usize>();
                self.length = Some(number.map_err(|_| format!("`{value}` is not a Content-Length")));
                self.junk_since = None;
            }
            if frame.is_some() {
                return Ok(frame);
            }
            if self.junk_since.is_some_and(|since| since.elapsed() >= PATIENCE) {
                return Err(no_header());
            }
        }
    }

    /// Records bytes that are not a message. Reports the first ones, and those that name a text.
    fn junk(&mut self, bytes: &[u8]) -> Option<Frame> {
        let is_first = self.junk_since.is_none();
        self.junk_since.get_or_insert_with(Instant::now);
        let addresses = addresses_in(bytes);
        let why = "the bytes before a `Content-Length` are not a message".to_owned();
        (is_first || !addresses.is_empty())
            .then_some(Frame::Invalid { why, lost: Lost { all: true, addresses } })
    }

    fn body(&mut self, length: usize) -> io::Result<Frame> {
        if length > LONGEST_MESSAGE {
            let why = format!("a message of {length} bytes: at most {LONGEST_MESSAGE} are read");
            return Err(io::Error::new(io::ErrorKind::InvalidData, why));
        }
        let mut json = Json::default();
        while self.buffer.len() < length {
            json.read(&self.buffer);
            // The next header is there already.
            if json
                .end
                .and_then(|end| self.buffer.get(end..))
                .is_some_and(|rest| !rest.trim_ascii().is_empty())
            {
                break;
            }
            let patience = (json.end.is_some() || json.is_broken).then_some(PAUSE);
            match self.more(patience)? {
                More::Bytes => {}
                More::Silence => break,
                More::End if json.end.is_some() => break,
                More::End => return Err(io::ErrorKind::UnexpectedEof.into()),
            }
        }
        json.read(self.buffer.get(..length).unwrap_or(&self.buffer));
        // Too short: the rest follows.
        while json.end.is_none() && !json.is_broken && json.seen <= LONGEST_MESSAGE {
            if self.buffer.len() <= json.seen && self.more(Some(PAUSE))? != More::Bytes {
                break;
            }
            json.read(&self.buffer);
        }
        let Some(end) = json.end else {
            let bytes: Vec<u8> = self.buffer.drain(..length.min(self.buffer.len())).collect();
            return Ok(parsed(&bytes));
        };
        let is_white = |bytes: &[u8]| bytes.iter().all(u8::is_ascii_whitespace);
        let is_counted = end <= length && self.buffer.get(end..length).is_some_and(is_white);
        let bytes: Vec<u8> = self.buffer.drain(..if is_counted { length } else { end }).collect();
        let frame = parsed(&bytes);
        if is_counted {
            return Ok(frame);
        }
        let counts_letters =
            |text: &str| [text.chars().count(), text.encode_utf16().count()].contains(&length);
        let lost = match &frame {
            Frame::Message(message) if !std::str::from_utf8(&bytes).is_ok_and(counts_letters) => {
                lost_by(message)
            }
            _ => Lost::default(),
        };
        self.queued.push_back(frame);
        if lost != Lost::default() {
            let why = format!(
                "a message has {end} bytes, but its Content-Length is {length}: some bytes may \
                be missing"
            );
            self.queued.push_back(Frame::Invalid { why, lost });
        }
        Ok(Frame::Miscounted)
    }
}

const CONTENT_LENGTH: &str = "content-length:";

fn no_header() -> io::Error {
    let why = "no `Content-Length` within 10 s after bytes that are not a message";
    io::Error::new(io::ErrorKind::InvalidData, why)
}

/// `Name: value`
fn is_header(line: &str) -> bool {
    let is_name = |name: &str| name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
    line.split_once(':').is_some_and(|(name, _)| !name.is_empty() && is_name(name))
}

fn parsed(bytes: &[u8]) -> Frame {
    match serde_json::from_slice(bytes) {
        Ok(message) => Frame::Message(message),
        Err(error) => Frame::Invalid { why: format!("not JSON: {error}"), lost: lost_in(bytes) },
    }
}

/// Returns the texts that a message which is not JSON may have changed.
fn lost_in(bytes: &[u8]) -> Lost {
    // JavaScript may write half of a surrogate pair, which is invalid JSON: without it, the message can be parsed.
    match serde_json::from_slice::<Value>(&without_halves(bytes)) {
        Ok(message) => lost_by(&message),
        Err(_) => Lost { all: true, addresses: addresses_in(bytes) },
    }
}

/// Returns the texts that an invalid message may have changed.
pub(crate) fn lost_by(message: &Value) -> Lost {
    let mut lost = Lost::default();
    for message in message.as_array().map_or(std::slice::from_ref(message), Vec::as_slice) {
        // JavaScript omits `undefined` values: an answer may have only its id.
        let is_answer = ["result", "error"].iter().any(|it| message.get(it).is_some())
            || message.get("id").is_some() && message.get("params").is_none();
        let may_change = match message.get("method") {
            Some(method) => method.as_str().is_none_or(|method| method.starts_with("textDocument/did")),
            None => !is_answer,
        };
        if may_change {
            match message.pointer("/params/textDocument/uri").and_then(Value::as_str) {
                Some(address) => lost.addresses.push(address.to_owned()),
                None => lost.all = true,
            }
        }
    }
    lost
}

/// Returns the URIs in the remains of a message. Quotes within a text are escaped, so they end no URI.
fn addresses_in(bytes: &[u8]) -> Vec<String> {
    let key = b"\"uri\"";
    let ends = (key.len()..=bytes.len()).filter(|&end| bytes[..end].ends_with(key));
    let address = |end: usize| {
        let value = bytes[end..].trim_ascii_start().strip_prefix(b":")?.trim_ascii_start();
        let length = value.iter().skip(1).position(|byte| *byte == b'"')? + 2;
        serde_json::from_slice::<String>(value.get(..length)?).ok()
    };
    let found: BTreeSet<String> = ends.filter_map(address).take(MOST_ADDRESSES).collect();
    found.into_iter().collect()
}

/// The maximum number of URIs that are searched in the remains of a message.
const MOST_ADDRESSES: usize = 100;

/// Returns the bytes without escapes of half a surrogate pair.
fn without_halves(bytes: &[u8]) -> Vec<u8> {
    let half = |at: usize| -> Option<u16> {
        let escape = bytes.get(at..at + 6)?.strip_prefix(b"\\u")?;
        let unit = u16::from_str_radix(std::str::from_utf8(escape).ok()?, 16).ok()?;
        (0xd800..0xe000).contains(&unit).then_some(unit)
    };
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let taken = match (half(at), half(at + 6)) {
            (Some(0xd800..0xdc00), Some(0xdc00..)) => 12,
            (Some(_), _) => {
                out.extend(b"\\ufffd");
                at += 6;
                continue;
            }
            // An escaped character does not begin an escape.
            _ if byte == b'\\' => 2,
            _ => 1,
        };
        out.extend(bytes.iter().skip(at).take(taken));
        at += taken;
    }
    out
}

/// Finds where a JSON object or array ends, without reading what is in it.
#[derive(Default)]
struct Json {
    seen: usize,
    depth: usize,
    is_text: bool,
    is_escaped: bool,
    is_broken: bool,
    end: Option<usize>,
}

impl Json {
    /// Scans the new part of `bytes`.
    fn read(&mut self, bytes: &[u8]) {
        for &byte in bytes.get(self.seen..).unwrap_or_default() {
            if self.end.is_some() || self.is_broken {
                return;
            }
            self.seen += 1;
            match byte {
                _ if self.is_escaped => self.is_escaped = false,
                b'\\' if self.is_text => self.is_escaped = true,
                b'"' => {
                    self.is_text = !self.is_text;
                    self.is_broken = self.depth == 0;
                }
                // A JSON string contains no line break.
                0..0x20 if self.is_text => self.is_broken = true,
                _ if self.is_text => {}
                b'{' | b'[' => self.depth += 1,
                b'}' | b']' => {
                    self.is_broken = self.depth == 0;
                    self.depth = self.depth.saturating_sub(1);
                    self.end = (self.depth == 0 && !self.is_broken).then_some(self.seen);
                }
                b' ' | b'\t' | b'\r' | b'\n' => {}
                b',' | b':' | b'+' | b'-' | b'.' | b'0'..=b'9' | b'E' | b'a'..=b'z' => {
                    self.is_broken = self.depth == 0;
                }
                _ => self.is_broken = true,
            }
        }
    }
}

/// Writes one message, and what is buffered with it.
pub(crate) fn write(output: &mut impl Write, message: &str) -> io::Result<()> {
    write!(output, "Content-Length: {}\r\n\r\n{message}", message.len())?;
    output.flush()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    /// What is read of these bytes; nothing in place of an error.
    fn all(bytes: &[u8]) -> Vec<Option<Frame>> {
        let mut frames = Frames::new(io::Cursor::new(bytes.to_vec())).unwrap();
        let mut found = Vec::new();
        loop {
            match frames.next() {
                Ok(None) => return found,
                Ok(frame) => found.push(frame),
                Err(_) => {
                    found.push(None);
                    return found;
                }
            }
        }
    }

    fn framed(message: &str, length: usize) -> Vec<u8> {
        format!("Content-Length: {length}\r\n\r\n{message}").into_bytes()
    }

    fn invalid(why: &str, lost: Lost) -> Option<Frame> {
        Some(Frame::Invalid { why: why.to_owned(), lost })
    }

    #[test]
    fn what_is_written_is_read() {
        let mut bytes = Vec::new();
        for message in ["{}", r#"{"text":"à la carte"}"#] {
            write(&mut bytes, message).unwrap();
        }
        assert_eq!(
            all(&bytes),
            [Some(Frame::Message(json!({}))), Some(Frame::Message(json!({"text": "à la carte"})))]
        );
    }

    #[test]
    fn one_bad_message_costs_one_error() {
        let good = "Content-Length: 2\r\n\r\n{}";
        for bad in [
            "Content-Length: 3\r\n\r\n{,}",
            "Content-Length: many\r\n\r\n",
            "Content-Length: 2\r\n\r\n\u{fffd}",
            "Content-Length: -1\r\n\r\n",
            "Content-Length: 5\r\n\r\n{\"a\":",
        ] {
            let mut bytes = bad.as_bytes().to_vec();
            if bad.ends_with('\u{fffd}') {
                bytes.truncate(bytes.len() - 3);
                bytes.extend([0xff, 0xfe]);
            }
            bytes.extend(good.as_bytes());
            let frames = all(&bytes);
            assert!(
                matches!(frames.as_slice(), [Some(Frame::Invalid { .. }), Some(Frame::Message(_))]),
                "{bad}: {frames:?}"
            );
        }
    }

    #[test]
    fn other_headers_and_white_space_are_passed_over() {
        let text = "\r\n \r\ncontent-length: 4\r\nContent-Type: application/vscode-jsonrpc; charset=utf-8\r\n\r\n{}\r\n";
        assert_eq!(all(text.as_bytes()), [Some(Frame::Message(json!({})))]);
    }

    #[test]
    fn junk_is_passed_over_up_to_the_next_header() {
        let junk = "the bytes before a `Content-Length` are not a message";
        let long = "x".repeat(3 * LONGEST_LINE);
        for text in
            ["what is this?\r\n\r\n", "{\"a\": 1}", "\u{1f916}\n\nx\n", &long, "Content-Length: 5\r\n{}"]
        {
            let mut bytes = text.as_bytes().to_vec();
            bytes.extend(framed("{\"b\":2}", 7));
            bytes.extend(framed("{\"c\":3}", 7));
            let message = |message: Value| Some(Frame::Message(message));
            assert_eq!(
                all(&bytes),
                [
                    invalid(junk, Lost { all: true, addresses: Vec::new() }),
                    message(json!({"b": 2})),
                    message(json!({"c": 3}))
                ],
                "{text}"
            );
        }
    }

    #[test]
    fn a_length_that_is_far_too_great_delays_nothing() {
        let begin = Instant::now();
        let mut bytes = framed("{\"a\":1}", 100_000_000);
        bytes.extend(framed("{\"b\":2}", 7));
        let why = "a message has 7 bytes, but its Content-Length is 100000000: some bytes may be \
            missing"
            .to_owned();
        let lost = Frame::Invalid { why, lost: Lost { all: true, addresses: Vec::new() } };
        let (first, second) = (Frame::Message(json!({"a": 1})), Frame::Message(json!({"b": 2})));
        assert_eq!(all(&bytes), [Frame::Miscounted, first, lost, second].map(Some));
        assert!(begin.elapsed() < PAUSE);
    }

    #[test]
    fn a_length_in_letters_is_believed_and_no_other() {
        let params = "{\"textDocument\":{\"uri\":\"file:///a.mal\",\"text\":\"\u{e9}\u{1f916}\"}}";
        let open = format!("{{\"method\":\"textDocument/didOpen\",\"params\":{params}}}");
        let (bytes, letters) = (open.len(), open.chars().count());
        for (length, is_believed) in
            [(letters, true), (letters + 1, true), (bytes + 1, false), (letters - 1, false)]
        {
            let frames = all(&framed(&open, length));
            let lost = frames.iter().flatten().find_map(|frame| match frame {
                Frame::Invalid { lost, .. } => Some(lost.addresses.clone()),
                _ => None,
            });
            assert!(frames.iter().flatten().any(|frame| matches!(frame, Frame::Message(_))), "{length}");
            assert_eq!(lost, (!is_believed).then(|| vec!["file:///a.mal".to_owned()]), "{length}");
        }
    }

    #[test]
    fn an_answer_without_a_result_loses_nothing() {
        assert_eq!(lost_by(&json!({"jsonrpc": "2.0", "id": 1})), Lost::default());
        assert!(lost_by(&json!({"jsonrpc": "2.0", "id": 1, "params": {}})).all);
    }

    #[test]
    fn a_stream_that_ends_within_a_message_is_an_error() {
        assert_eq!(all(b"Content-Length: 10\r\n\r\n{\"a\":"), [None]);
        assert_eq!(all(b"Content-Length: 99999999999\r\n\r\n{}"), [None]);
    }

    #[test]
    fn half_of_a_pair_says_of_which_text_nothing_is_known() {
        let change = |text: &str| {
            let params = format!(r#"{{"textDocument":{{"uri":"file:///a.mal","text":"{text}"}}}}"#);
            format!(r#"{{"jsonrpc":"2.0","method":"textDocument/didOpen","params":{params}}}"#)
        };
        for half in [r"\ud83e", r"\udd16", r"\\\ud83e", r"a \ud83e\ud83e\udd16 b"] {
            let text = change(half);
            let frames = all(&framed(&text, text.len()));
            let [Some(Frame::Invalid { lost, .. })] = frames.as_slice() else { panic!("{half}: {frames:?}") };
            assert_eq!(*lost, Lost { all: false, addresses: vec!["file:///a.mal".to_owned()] }, "{half}");
        }
        // Of a message that is cut off, what is left says which text it was about, whatever stands in that.
        let text = change(r#"\"uri\": \"no\""#);
        for (cut, length) in [(&text[..text.len() - 3], text.len() - 3), (&text[1..], 0)] {
            let mut bytes = framed(cut, length);
            bytes.extend(framed("{}", 2));
            let frames = all(&bytes);
            let lost = frames.iter().find_map(|frame| match frame {
                Some(Frame::Invalid { lost, .. }) if !lost.addresses.is_empty() => Some(lost),
                _ => None,
            });
            assert_eq!(lost, Some(&Lost { all: true, addresses: vec!["file:///a.mal".to_owned()] }), "{cut}");
        }
        for whole in [r"\ud83e\udd16", r"\\ud83e"] {
            let text = change(whole);
            assert!(
                matches!(all(&framed(&text, text.len())).as_slice(), [Some(Frame::Message(_))]),
                "{whole}"
            );
        }
    }

    proptest! {
        /// However a client counts, its messages are read, each once.
        #[test]
        fn a_message_ends_where_its_json_ends(
            messages in prop::collection::vec(("[a\u{e9}\u{1f916}\\\\\"{}\\]\\[ \r\n:C]{0,12}", -9..60i64), 1..5)
        ) {
            let mut bytes = Vec::new();
            let mut expected = Vec::new();
            for (text, wrong) in &messages {
                let message = json!({"text": text, "more": [{"a": 1.5e-3}, true, null]});
                let text = message.to_string();
                let length = text.len() as i64 + wrong;
                bytes.extend(framed(&text, usize::try_from(length).unwrap()));
                expected.push(message);
            }
            let found: Vec<Value> = all(&bytes)
                .into_iter()
                .filter_map(|frame| match frame {
                    Some(Frame::Message(message)) => Some(message),
                    Some(Frame::Miscounted | Frame::Invalid { .. }) => None,
                    other => panic!("{other:?}"),
                })
                .collect();
            prop_assert_eq!(found, expected);
        }

        /// Nothing that comes ends the reading but what is too long.
        #[test]
        fn any_bytes_are_read(mut bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            bytes.extend(framed("{}", 2));
            prop_assert!(all(&bytes).len() < 100);
        }
    }
}
