//! Messages on a byte stream: `Content-Length: N`, an empty line, N bytes of JSON.
//!
//! Whatever comes, reading goes on: a message that is no JSON costs an error, not the session.

use std::io::{self, BufRead, Read as _, Write};

use serde_json::Value;

/// No header line is longer, and no message: whoever sends more does not speak this protocol.
const LONGEST_LINE: u64 = 4096;
const LONGEST_MESSAGE: u64 = 1 << 30;

/// What was read.
#[derive(Debug, PartialEq)]
pub(crate) enum Frame {
    /// A message.
    Message(Value),
    /// Something else.
    Invalid {
        /// Why it is no message.
        why: String,
        /// May it have been a change of a text?
        may_be_change: bool,
    },
}

/// Reads one message; `None` at the end of the stream.
///
/// # Errors
///
/// Those of `input`, and a stream that ends within a message or cannot be one of messages.
pub(crate) fn read(input: &mut impl BufRead) -> io::Result<Option<Frame>> {
    let mut length: Option<Result<u64, String>> = None;
    loop {
        let mut line = Vec::new();
        if input.take(LONGEST_LINE).read_until(b'\n', &mut line)? == 0 {
            return Ok(None);
        }
        let line = String::from_utf8_lossy(&line);
        let line = line.trim_end();
        if line.is_empty() {
            match length.take() {
                Some(Ok(length)) => return body(input, length).map(Some),
                Some(Err(why)) => return Ok(Some(Frame::Invalid { why, may_be_change: true })),
                // An empty line between messages is not worth an error.
                None => continue,
            }
        }
        let header = line.split_once(':');
        // Any other header, or what is left of a message that went wrong, is passed over.
        if let Some((_, value)) = header.filter(|(name, _)| name.eq_ignore_ascii_case("content-length")) {
            let number = value.trim().parse::<u64>();
            length = Some(number.map_err(|_| format!("`{}` is no Content-Length", value.trim())));
        }
    }
}

fn body(input: &mut impl BufRead, length: u64) -> io::Result<Frame> {
    if length > LONGEST_MESSAGE {
        let why = format!("a message of {length} bytes: at most {LONGEST_MESSAGE} are read");
        return Err(io::Error::new(io::ErrorKind::InvalidData, why));
    }
    let mut bytes = Vec::new();
    if (&mut *input).take(length).read_to_end(&mut bytes)? as u64 != length {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(match serde_json::from_slice(&bytes) {
        Ok(message) => Frame::Message(message),
        Err(error) => {
            let name = b"textDocument/did";
            let may_be_change = bytes.windows(name.len()).any(|part| part == name);
            Frame::Invalid { why: format!("not JSON: {error}"), may_be_change }
        }
    })
}

/// Writes one message, and what is buffered with it.
///
/// # Errors
///
/// Those of `output`.
pub(crate) fn write(output: &mut impl Write, message: &str) -> io::Result<()> {
    write!(output, "Content-Length: {}\r\n\r\n{message}", message.len())?;
    output.flush()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn all(mut input: &[u8]) -> Vec<Option<Frame>> {
        std::iter::from_fn(|| match read(&mut input) {
            Ok(None) => None,
            Ok(frame) => Some(frame),
            Err(_) => {
                input = &[];
                Some(None)
            }
        })
        .collect()
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
    fn other_headers_and_stray_lines_are_passed_over() {
        let text = "junk\r\n\r\ncontent-length: 2\r\nContent-Type: application/vscode-jsonrpc; charset=utf-8\r\n\r\n{}";
        assert_eq!(all(text.as_bytes()), [Some(Frame::Message(json!({})))]);
    }

    #[test]
    fn a_stream_that_ends_within_a_message_is_an_error() {
        assert_eq!(all(b"Content-Length: 10\r\n\r\n{}"), [None]);
        assert_eq!(all(b"Content-Length: 99999999999999\r\n\r\n{}"), [None]);
    }
}
