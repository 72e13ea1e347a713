//! Executes scripts of deployments with Lua and a stand-in for Orocos, `tests/deployer/rttlib.lua`.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// An argument of a call.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the types of Lua")]
pub enum Argument {
    Text(String),
    Number(f64),
    Bool(bool),
}

/// What a script asks of Orocos: a function of the deployer or of a task, `load`, or `set` for a property. The policy of a
/// connection is its type and its size.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "a call")]
pub struct Call {
    pub function: String,
    pub arguments: Vec<Argument>,
}

impl Call {
    /// The argument of that number, where it is a text.
    pub fn text(&self, number: usize) -> &str {
        match self.arguments.get(number) {
            Some(Argument::Text(text)) => text,
            _ => "",
        }
    }

    /// Its function and its first argument: what [`run`] makes fail.
    pub fn key(&self) -> String {
        format!("{} {}", self.function, self.text(0))
    }

    /// Reads a line of the stand-in.
    fn read(line: &str) -> Call {
        let mut fields = line.split('\t');
        let function = fields.next().unwrap().to_owned();
        let of = |field: &str| match field.split_at(1) {
            ("t", text) => {
                let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
                Argument::Text(String::from_utf8(text.as_bytes().chunks(2).map(byte).collect()).unwrap())
            }
            ("n", number) => Argument::Number(number.parse().unwrap()),
            ("b", value) => Argument::Bool(value == "true"),
            _ => panic!("{line}"),
        };
        Call { function, arguments: fields.map(of).collect() }
    }
}

/// Returns the calls of a script, and the message of its error, if it ends with one. Calls with the [key](Call::key) `failing`
/// fail, where that is not empty.
pub fn run(script: &str, failing: &str) -> (Vec<Call>, Option<String>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("deployer/?.lua");
    let mut command = Command::new("lua5.1");
    command.arg("-").env("LUA_PATH", path).env("FAILING", failing).env_remove("MAUVE_START");
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut lua = command.spawn().unwrap_or_else(|error| panic!("lua5.1 does not run: {error}"));
    lua.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
    let done = lua.wait_with_output().unwrap();
    let calls = String::from_utf8(done.stdout).unwrap().lines().map(Call::read).collect();
    (calls, (!done.status.success()).then(|| String::from_utf8(done.stderr).unwrap()))
}
