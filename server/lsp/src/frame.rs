//! Messages on a byte stream: `Content-Length: N`, an empty line, N bytes of JSON.
//!
//! A message that is not JSON is one error. The length says where the next message begins: after a wrong one, no message is
//! found any more, and the session ends.

use std::io::{self, BufRead, Read as _, Write};

use serde_json::Value;

/// The maximum lengths of a header line and of a message, in bytes: longer input is not this protocol.
const LONGEST_LINE: u64 = 4096;
const LONGEST_MESSAGE: u64 = 1 << 30;

const CONTENT_LENGTH: &str = "content-length";

/// A message, or why it is not JSON.
pub(crate) type MessageFrame = Result<Value, serde_json::Error>;

/// Reads one message; `None` at the end of the stream.
///
/// # Errors
///
/// Those of the stream; it ends within a message; a line is no header; a message has no valid length.
pub(crate) fn read(input: &mut impl BufRead) -> io::Result<Option<MessageFrame>> {
    let Some(length) = read_header(input)? else { return Ok(None) };
    let mut message = Vec::new();
    if input.take(length).read_to_end(&mut message)? as u64 != length {
        let why = format!("the stream ends within a message of {length} bytes, after {}", message.len());
        return Err(io::Error::new(io::ErrorKind::UnexpectedEof, why));
    }
    Ok(Some(serde_json::from_slice(&message)))
}

/// Returns the length of the message that follows; `None` at the end of the stream.
fn read_header(input: &mut impl BufRead) -> io::Result<Option<u64>> {
    let mut length = None;
    for index in 0.. {
        let mut line = Vec::new();
        input.take(LONGEST_LINE).read_until(b'\n', &mut line)?;
        if line.is_empty() && index == 0 {
            return Ok(None);
        }
        let line = String::from_utf8_lossy(&line);
        if matches!(&*line, "\r\n" | "\n") {
            break;
        }
        let header = line.strip_suffix('\n').and_then(|line| line.split_once(':'));
        let is_name = |name: &str| name.bytes().all(|it| it.is_ascii_alphanumeric() || it == b'-');
        let Some((name, value)) = header.filter(|(name, _)| is_name(name)) else {
            return Err(invalid(format!("{line:?} is not a header")));
        };
        if name.eq_ignore_ascii_case(CONTENT_LENGTH) {
            let number = value.trim().parse().ok().filter(|&length| length <= LONGEST_MESSAGE);
            length = Some(number.ok_or_else(|| invalid(format!("{value:?} is not a valid Content-Length")))?);
        }
    }
    length.map(Some).ok_or_else(|| invalid("a message without Content-Length".to_owned()))
}

fn invalid(why: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, why)
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

    /// The messages that are read from these bytes, `None` for one that is not JSON; and the error that ends them.
    fn all(mut bytes: &[u8]) -> (Vec<Option<Value>>, Option<String>) {
        let mut found = Vec::new();
        loop {
            match read(&mut bytes) {
                Ok(None) => return (found, None),
                Ok(Some(frame)) => found.push(frame.ok()),
                Err(error) => return (found, Some(error.to_string())),
            }
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let mut bytes = Vec::new();
        for message in ["{}", r#"{"text":"à la carte"}"#] {
            write(&mut bytes, message).unwrap();
        }
        assert_eq!(all(&bytes), (vec![Some(json!({})), Some(json!({"text": "à la carte"}))], None));
    }

    #[test]
    fn a_message_that_is_not_json_does_not_end_the_stream() {
        for bad in [b"{,}" as &[u8], b"\xff\xfe", b"{\"a\":", br#"{"text":"\ud83e"}"#, b""] {
            let mut bytes = format!("Content-Length: {}\r\n\r\n", bad.len()).into_bytes();
            bytes.extend(bad);
            bytes.extend(b"Content-Length: 2\r\n\r\n{}");
            assert_eq!(all(&bytes), (vec![None, Some(json!({}))], None), "{bad:?}");
        }
    }

    #[test]
    fn other_headers_are_passed_over() {
        let text =
            "content-length: 4\r\nContent-Type: application/vscode-jsonrpc; charset=utf-8\r\n\r\n{}\r\n";
        assert_eq!(all(text.as_bytes()), (vec![Some(json!({}))], None));
    }

    #[test]
    fn a_wrong_length_ends_the_stream_with_a_reason() {
        for (text, reason) in [
            ("Content-Length: 10\r\n\r\n{\"a\":", "the stream ends within a message of 10 bytes, after 5"),
            ("Content-Length: 99999999999\r\n\r\n{}", "\" 99999999999\\r\" is not a valid Content-Length"),
            ("Content-Length: -1\r\n\r\n{}", "\" -1\\r\" is not a valid Content-Length"),
            ("Content-Type: x\r\n\r\n{}", "a message without Content-Length"),
            ("Content-Length: 2\r\n", "\"\" is not a header"),
            ("{\"id\":1}\n", "\"{\\\"id\\\":1}\\n\" is not a header"),
            ("what is this?\r\n\r\n", "\"what is this?\\r\\n\" is not a header"),
        ] {
            assert_eq!(all(text.as_bytes()), (Vec::new(), Some(reason.to_owned())), "{text}");
        }
        // Of this length, the rest is no header.
        let short = format!("Content-Length: 2\r\n\r\n{{}}{}", "x".repeat(9999));
        let (found, error) = all(short.as_bytes());
        assert_eq!(found, [Some(json!({}))]);
        assert!(error.is_some_and(|error| error.ends_with("x\" is not a header")));
    }

    proptest! {
        #[test]
        fn any_bytes_are_read(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            all(&bytes);
        }
    }
}
