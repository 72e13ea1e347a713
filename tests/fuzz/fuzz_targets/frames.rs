#![no_main]

#[path = "../../../server/lsp/src/frame.rs"]
#[allow(dead_code, reason = "the target only reads")]
mod frame;

// Whatever bytes come, reading ends, and every message that is read is found again when it is written alone.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    for message in messages(bytes) {
        let mut written = Vec::new();
        frame::write(&mut written, &message.to_string()).expect("a vector takes all");
        assert_eq!(messages(&written), [message]);
    }
});

fn messages(mut bytes: &[u8]) -> Vec<serde_json::Value> {
    let frames = std::iter::from_fn(|| frame::read(&mut bytes).ok().flatten());
    frames.filter_map(Result::ok).collect()
}
