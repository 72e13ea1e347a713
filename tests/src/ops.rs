//! Reads the scripts of Orocos' deployer strictly, and executes their effects that a test can observe.
//!
//! It accepts only forms of generated scripts, and has the traps of RTT's parser. A statement ends with its line, so a
//! comment after it is an error. A statement is parsed after the execution of the previous ones, and may only name
//! existing objects. Texts have the escapes of C, except numeric ones, which have no end there. Keywords of the parser
//! are not names; some of them are recognised as prefixes of any word at the beginning of a statement.

use std::collections::{BTreeMap, BTreeSet};

/// An argument, or a value.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the types of the scripts")]
pub enum Literal {
    Text(String),
    Int(i32),
    /// With the mark of one that has no sign.
    Unsigned(u32),
    Double(f64),
    Bool(bool),
}

/// An action of a script, in order: a function of the deployer or of a task, `load`, or `set` for a property; the
/// connection policy is its type and its size. `failed` is the end of a script that names a missing object.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "a call")]
pub struct Call {
    pub function: String,
    pub arguments: Vec<Literal>,
}

impl Call {
    fn new(function: &str, arguments: impl IntoIterator<Item = Literal>) -> Call {
        Call { function: function.to_owned(), arguments: arguments.into_iter().collect() }
    }

    /// The argument of that number, where it is a text.
    pub fn text(&self, number: usize) -> &str {
        match self.arguments.get(number) {
            Some(Literal::Text(text)) => text,
            _ => "",
        }
    }
}

/// Words that the parser keeps for itself, and operations that every task has.
const WORDS: [&str; 50] = [
    "do",
    "until",
    "done",
    "or",
    "and",
    "not",
    "include",
    "if",
    "define",
    "then",
    "else",
    "for",
    "foreach",
    "while",
    "true",
    "false",
    "const",
    "nothing",
    "yield",
    "var",
    "set",
    "alias",
    "send",
    "collect",
    "collectIfDone",
    "return",
    "call",
    "try",
    "catch",
    "activate",
    "cleanup",
    "configure",
    "error",
    "getCpuAffinity",
    "getPeriod",
    "inException",
    "inFatalError",
    "inRunTimeError",
    "isActive",
    "isConfigured",
    "isRunning",
    "loadService",
    "setCpuAffinity",
    "setPeriod",
    "start",
    "stop",
    "trigger",
    "update",
    "this",
    "Deployer",
];

/// Recognised at the beginning of a statement, even as a prefix of a longer word.
const PREFIXES: [&str; 10] = [
    "true",
    "false",
    "done",
    "yield",
    "nothing",
    "program",
    "function",
    "export",
    "StateMachine",
    "RootMachine",
];

/// Executes a script; `fails` tells which calls fail; these are executed too.
///
/// # Errors
///
/// The error, after the number of the line.
pub fn run(script: &str, fails: impl Fn(&Call) -> bool) -> Result<Vec<Call>, String> {
    let mut machine = Machine {
        fails: &fails,
        calls: Vec::new(),
        packages: BTreeSet::new(),
        tasks: BTreeSet::new(),
        lost: BTreeSet::new(),
        has_failed: false,
        has_lost_package: false,
        flags: BTreeMap::new(),
        policies: BTreeMap::new(),
        block: None,
    };
    if !script.ends_with('\n') {
        return Err("the last statement has no end".to_owned());
    }
    let (mut functions, mut in_function) = (Vec::new(), false);
    for (number, line) in script.lines().enumerate() {
        if machine.has_failed {
            return Ok(machine.calls);
        }
        // Functions of the script itself: a real deployer shows whether they are right.
        if let Some((name, _)) = line.strip_prefix("bool ").and_then(|rest| rest.split_once('(')) {
            functions.push(name);
            in_function = true;
        } else if in_function {
            in_function = line != "}";
        } else {
            machine.line(line).map_err(|why| format!("line {}: {why}: {line}", number + 1))?;
        }
    }
    if !functions.is_empty() && functions != ["worked", "imported", "loaded"] {
        return Err(format!("functions {functions:?}"));
    }
    if machine.block.is_some() { Err("a block has no end".to_owned()) } else { Ok(machine.calls) }
}

struct Machine<'a> {
    fails: &'a dyn Fn(&Call) -> bool,
    calls: Vec<Call>,
    packages: BTreeSet<String>,
    tasks: BTreeSet<String>,
    /// Those that could not be loaded: a script that names one ends there.
    lost: BTreeSet<String>,
    has_failed: bool,
    /// Whether an import has failed: a missing object is then no error.
    has_lost_package: bool,
    flags: BTreeMap<String, bool>,
    /// Type and size.
    policies: BTreeMap<String, (Option<String>, i32)>,
    /// The enclosing block, if any, and whether it is still executed.
    block: Option<bool>,
}

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Name(String),
    Literal(Literal),
    Sign(&'static str),
}

const SIGNS: [&str; 12] = ["&&", "!=", "!", "(", ")", "{", "}", ",", ".", "=", "-", "+"];

fn tokens(line: &str) -> Result<Vec<Token>, String> {
    let mut found = Vec::new();
    let mut rest = line;
    loop {
        rest = rest.trim_start_matches(' ');
        let Some(first) = rest.chars().next() else { return Ok(found) };
        let of = |is_part: &dyn Fn(char) -> bool| rest.find(|c| !is_part(c)).unwrap_or(rest.len());
        if first == '"' {
            let (text, length) = quoted(rest)?;
            found.push(Token::Literal(Literal::Text(text)));
            rest = &rest[length..];
        } else if first.is_ascii_digit() {
            let mut length = of(&|c| c.is_ascii_alphanumeric() || c == '.');
            if rest[..length].ends_with('e') && rest[length..].starts_with('-') {
                length += 1 + rest[length + 1..]
                    .find(|c: char| !c.is_ascii_digit())
                    .unwrap_or(rest.len() - length - 1);
            }
            found.push(Token::Literal(number(&rest[..length])?));
            rest = &rest[length..];
        } else if first.is_ascii_alphabetic() {
            let length = of(&|c| c.is_ascii_alphanumeric() || c == '_');
            found.push(match &rest[..length] {
                "true" => Token::Literal(Literal::Bool(true)),
                "false" => Token::Literal(Literal::Bool(false)),
                name => Token::Name(name.to_owned()),
            });
            rest = &rest[length..];
        } else {
            let sign = SIGNS.into_iter().find(|sign| rest.starts_with(sign));
            let sign = sign.ok_or_else(|| format!("`{first}` has no meaning here"))?;
            found.push(Token::Sign(sign));
            rest = &rest[sign.len()..];
        }
    }
}

/// The text at the beginning, and how long it is with its quotes.
fn quoted(text: &str) -> Result<(String, usize), String> {
    let mut found = String::new();
    let mut letters = text.char_indices().skip(1);
    while let Some((at, letter)) = letters.next() {
        match letter {
            '"' => return Ok((found, at + 1)),
            '\\' => found.push(match letters.next().map(|(_, letter)| letter) {
                Some('n') => '\n',
                Some('t') => '\t',
                Some('r') => '\r',
                Some('b') => '\u{8}',
                Some('f') => '\u{c}',
                Some(letter @ ('"' | '\'' | '\\')) => letter,
                other => return Err(format!("an escape that has another meaning, or none: {other:?}")),
            }),
            letter => found.push(letter),
        }
    }
    Err("a text has no end".to_owned())
}

fn number(text: &str) -> Result<Literal, String> {
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    if let Some(unsigned) = text.strip_suffix('u').filter(|text| digits(text)) {
        return unsigned.parse().map(Literal::Unsigned).map_err(|_| format!("{text} is too great"));
    }
    if digits(text) {
        return text.parse().map(Literal::Int).map_err(|_| format!("{text} is too great"));
    }
    let (mantissa, exponent) =
        text.split_once('e').map_or((text, None), |(mantissa, rest)| (mantissa, Some(rest)));
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, "0"));
    let is_right = digits(whole)
        && digits(fraction)
        && exponent.is_none_or(|exponent| digits(exponent.strip_prefix('-').unwrap_or(exponent)));
    match text.parse() {
        Ok(number) if is_right => Ok(Literal::Double(number)),
        _ => Err(format!("`{text}` is no number")),
    }
}

/// Returns a name that may follow a point, or be in a text.
fn checked(name: &str) -> Result<&str, String> {
    let is_name = name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    match WORDS.contains(&name) {
        true => Err(format!("`{name}` is a word of the scripts")),
        false if is_name => Ok(name),
        false => Err(format!("`{name}` is no name")),
    }
}

impl Machine<'_> {
    fn line(&mut self, line: &str) -> Result<(), String> {
        let trimmed = line.trim_start_matches(' ');
        if trimmed.is_empty() || trimmed.starts_with("//") {
            return Ok(());
        }
        let tokens = tokens(line)?;
        use Token::{Name, Sign};
        if tokens == [Sign("}")] {
            return self.block.take().map(|_| ()).ok_or("no block ends here".to_owned());
        }
        if let [Name(word), Sign("("), condition @ .., Sign(")"), Name(then), Sign("{")] = tokens.as_slice()
            && word == "if"
            && then == "then"
        {
            if self.block.is_some() {
                return Err("a block in a block".to_owned());
            }
            self.block = Some(self.condition(condition)?);
            return Ok(());
        }
        self.statement(&tokens)
    }

    fn condition(&self, tokens: &[Token]) -> Result<bool, String> {
        let mut all = true;
        for part in tokens.split(|token| *token == Token::Sign("&&")) {
            let (flag, expected) = match part {
                [Token::Name(flag)] => (flag, true),
                [Token::Sign("!"), Token::Name(flag)] => (flag, false),
                // No file has values.
                [Token::Name(values), Token::Sign("!="), Token::Literal(Literal::Text(text))]
                    if values == "values" && text.is_empty() =>
                {
                    return Ok(false);
                }
                _ => return Err("expected a variable".to_owned()),
            };
            all &= *self.flags.get(flag).ok_or_else(|| format!("nothing is called {flag}"))? == expected;
        }
        Ok(all)
    }

    fn statement(&mut self, tokens: &[Token]) -> Result<(), String> {
        use Token::{Name, Sign};
        match tokens {
            [Name(var), Name(ty), Name(name), Sign("="), value @ ..] if var == "var" => {
                checked(name)?;
                if self.block.is_some() || self.flags.contains_key(name) || self.policies.contains_key(name) {
                    return Err(format!("{name} is declared twice, or in a block"));
                }
                match (ty.as_str(), value) {
                    ("bool", [Token::Literal(Literal::Bool(value))]) => {
                        self.flags.insert(name.clone(), *value);
                    }
                    (
                        "bool" | "string",
                        [
                            Name(os),
                            Sign("."),
                            Name(getenv),
                            Sign("("),
                            Token::Literal(Literal::Text(_)),
                            Sign(")"),
                            rest @ ..,
                        ],
                    ) if os == "os" && getenv == "getenv" => match rest {
                        [] if ty == "string" => {}
                        [Sign("!="), Token::Literal(Literal::Text(_))] if ty == "bool" => {
                            self.flags.insert(name.clone(), true);
                        }
                        _ => return Err("no question to the environment".to_owned()),
                    },
                    ("ConnPolicy", [Name(ty), Sign("("), Sign(")")]) if ty == "ConnPolicy" => {
                        // A member of it would be a property of the task.
                        if self.tasks.contains(name) {
                            return Err(format!("{name} is a task"));
                        }
                        self.policies.insert(name.clone(), (None, 0));
                    }
                    _ => return Err("a declaration that has another type than its value".to_owned()),
                }
                Ok(())
            }
            [Name(stopped), Sign("="), call @ ..] if stopped == "stopped" => self.call(call).map(|_| ()),
            [Name(print), Sign("."), Name(err), Sign("("), Token::Literal(Literal::Text(_)), Sign(")")]
                if print == "print" && err == "err" =>
            {
                Ok(())
            }
            [Name(require), Sign("("), Token::Literal(Literal::Text(service)), Sign(")")]
                if require == "require" =>
            {
                let known = ["print", "os"].contains(&service.as_str());
                if known { Ok(()) } else { Err("an unknown service".to_owned()) }
            }
            [Name(flag), Sign("="), call @ .., Sign("&&"), Name(same)] if flag == same => {
                let call = match call {
                    [
                        Name(worked),
                        Sign("("),
                        call @ ..,
                        Sign(","),
                        Token::Literal(Literal::Text(_)),
                        Sign(")"),
                    ] if worked == "worked" => call,
                    call => call,
                };
                let succeeds = self.call(call)?;
                let flag = self.flags.get_mut(flag).ok_or("an unknown variable")?;
                *flag &= succeeds;
                Ok(())
            }
            [Name(policy), Sign("."), Name(member), Sign("="), value]
                if self.policies.contains_key(policy) =>
            {
                let policy = self.policies.get_mut(policy).ok_or("an unknown policy")?;
                match (member.as_str(), value) {
                    ("type", Name(ty)) if ty == "DATA" || ty == "CIRCULAR_BUFFER" => {
                        policy.0 = Some(ty.clone())
                    }
                    ("size", Token::Literal(Literal::Int(size @ 1..))) => policy.1 = *size,
                    _ => return Err("no value of a connection policy".to_owned()),
                }
                Ok(())
            }
            [Name(task), Sign("."), Name(property), Sign("="), value @ ..] => {
                let value = match value {
                    [Token::Literal(value)] => value.clone(),
                    [Sign("-"), Token::Literal(Literal::Int(value))] => Literal::Int(-value),
                    [Sign("-"), Token::Literal(Literal::Double(value))] => Literal::Double(-value),
                    // The least number, which has no literal.
                    [
                        Sign("-"),
                        Token::Literal(Literal::Int(i32::MAX)),
                        Sign("-"),
                        Token::Literal(Literal::Int(1)),
                    ] => Literal::Int(i32::MIN),
                    _ => return Err("no value".to_owned()),
                };
                let task = Literal::Text(self.task(task)?.to_owned());
                self.execute(Call::new("set", [task, Literal::Text(checked(property)?.to_owned()), value]));
                Ok(())
            }
            call => {
                // One that fails in a block ends that.
                if !self.call(call)? && self.block.is_some() {
                    self.block = Some(false);
                }
                Ok(())
            }
        }
    }

    /// A task with which a statement begins.
    fn task<'a>(&mut self, name: &'a str) -> Result<&'a str, String> {
        if self.lost.contains(name) {
            self.has_failed = true;
            self.calls.push(Call::new("failed", []));
            return Ok(name);
        }
        if let Some(word) = PREFIXES.into_iter().find(|word| name.starts_with(word)) {
            return Err(format!("`{name}` is read as `{word}`"));
        }
        if self.tasks.contains(name) { Ok(name) } else { Err(format!("there is no task `{name}`")) }
    }

    /// `task.name` in a text.
    fn end(&self, text: &str) -> Result<Literal, String> {
        let (task, name) = text.split_once('.').ok_or_else(|| format!("{text} has no point"))?;
        checked(name)?;
        match self.tasks.contains(task) || self.lost.contains(task) {
            true => Ok(Literal::Text(text.to_owned())),
            false => Err(format!("there is no task `{task}`")),
        }
    }

    /// Returns whether the call succeeds.
    fn call(&mut self, tokens: &[Token]) -> Result<bool, String> {
        use Literal::{Double, Int, Text, Unsigned};
        use Token::{Literal as Value, Name, Sign};
        let comma = Sign(",");
        let call = match tokens {
            [Name(task), Sign("."), Name(operation), Sign("("), arguments @ .., Sign(")")] => {
                let task = Text(self.task(task)?.to_owned());
                match (operation.as_str(), arguments) {
                    ("configure" | "start" | "stop" | "getPeriod", []) => Call::new(operation, [task]),
                    ("mauve_runs_as", [Value(Int(priority)), Sign(","), Value(mask)]) => {
                        Call::new(operation, [task, Int(*priority), mask.clone()])
                    }
                    ("mauve_set", [Value(Text(property)), Sign(","), Value(Text(text))]) => {
                        Call::new(operation, [task, Text(property.clone()), Text(text.clone())])
                    }
                    ("setCpuAffinity", [Value(Int(mask @ 1..))]) => Call::new(operation, [task, Int(*mask)]),
                    ("setCpuAffinity", [Value(Unsigned(mask))]) => {
                        Call::new(operation, [task, Unsigned(*mask)])
                    }
                    _ => return Err(format!("no task has an operation `{operation}` with such arguments")),
                }
            }
            [
                Name(task),
                Sign("."),
                Name(service),
                Sign("."),
                Name(operation),
                Sign("("),
                Name(values),
                Sign("+"),
                Value(Text(_)),
                Sign(")"),
            ] if [service, operation, values] == ["marshalling", "updateProperties", "values"] => {
                Call::new(operation, [Text(self.task(task)?.to_owned())])
            }
            [Name(function), Sign("("), arguments @ .., Sign(")")] => {
                let arguments: Vec<&[Token]> = arguments.split(|token| *token == comma).collect();
                match (function.as_str(), arguments.as_slice()) {
                    ("imported", [[Value(Text(package))]]) => Call::new("import", [Text(package.clone())]),
                    ("loadService", [[Value(Text(name))], [Value(Text(service))]])
                        if service == "marshalling" =>
                    {
                        Call::new(function, [Text(name.clone()), Text(service.clone())])
                    }
                    ("aliasPeer", [[Value(Text(_))], [Value(Text(name))], [Value(Text(alias))]]) => {
                        if self.block != Some(false) {
                            self.tasks.insert(alias.clone());
                        }
                        self.lost.insert("all_is_well".to_owned());
                        if self.tasks.contains(alias) {
                            self.lost.remove(alias);
                        }
                        let _ = name;
                        return Ok(true);
                    }
                    ("loaded", [[Value(Text(name))], [Value(Text(class))]]) => {
                        checked(name)?;
                        let (package, short) = class.split_once("::").ok_or("a class without a namespace")?;
                        if short.contains(':') {
                            return Err("a class in two namespaces".to_owned());
                        }
                        if !self.packages.contains(package)
                            && self.block != Some(false)
                            && !self.has_lost_package
                        {
                            return Err(format!("nothing has been imported from {package}"));
                        }
                        if self.tasks.contains(name) {
                            return Err(format!("there is a task `{name}` already"));
                        }
                        Call::new("load", [Text(name.clone()), Text(class.clone())])
                    }
                    ("connect", [[Value(Text(from))], [Value(Text(to))], [Name(policy)]]) => {
                        let policy =
                            self.policies.get(policy).ok_or_else(|| format!("no policy `{policy}`"))?;
                        let (Some(ty), size) = policy else {
                            return Err("a policy without a type".to_owned());
                        };
                        if (ty == "DATA") != (*size == 0) {
                            return Err(format!("{ty} with a size of {size}"));
                        }
                        Call::new("connect", [self.end(from)?, self.end(to)?, Text(ty.clone()), Int(*size)])
                    }
                    ("connectOperations", [[Value(Text(required))], [Value(Text(provided))]]) => {
                        Call::new(function, [self.end(required)?, self.end(provided)?])
                    }
                    (
                        "setActivity",
                        [
                            [Value(Text(name))],
                            [Value(period @ Double(_))],
                            [Value(Int(priority))],
                            [Name(of)],
                        ],
                    ) => {
                        let is_right = match of.as_str() {
                            "ORO_SCHED_RT" => (1..=99).contains(priority),
                            "ORO_SCHED_OTHER" => *priority == 0,
                            _ => false,
                        };
                        let is_there = self.tasks.contains(name) || self.lost.contains(name);
                        if !is_right || *period == Double(0.0) || !is_there {
                            return Err("no such activity".to_owned());
                        }
                        let scheduler = Text(of.clone());
                        Call::new(function, [Text(name.clone()), period.clone(), Int(*priority), scheduler])
                    }
                    ("setWaitPeriodPolicy", [[Value(Text(name))], [Name(policy)]])
                        if policy == "ORO_WAIT_REL" =>
                    {
                        Call::new(function, [Text(name.clone()), Text(policy.clone())])
                    }
                    (
                        "stream",
                        [
                            [Value(Text(port))],
                            [
                                Name(ros),
                                Sign("."),
                                Name(comm),
                                Sign("."),
                                Name(topic),
                                Sign("("),
                                Value(Text(name)),
                                Sign(")"),
                            ],
                        ],
                    ) => {
                        let of_topics = ["rtt_ros", "rtt_rosnode", "rtt_roscomm"];
                        if [ros, comm, topic] != ["ros", "comm", "topic"] || self.tasks.contains("ros") {
                            return Err("no topic".to_owned());
                        }
                        if !self.has_lost_package
                            && !of_topics.into_iter().all(|package| self.packages.contains(package))
                        {
                            return Err("ROS has not been imported".to_owned());
                        }
                        Call::new("stream", [self.end(port)?, Text(name.clone())])
                    }
                    _ => return Err(format!("no function `{function}` with such arguments")),
                }
            }
            _ => return Err("no statement".to_owned()),
        };
        Ok(self.execute(call))
    }

    fn execute(&mut self, call: Call) -> bool {
        if self.block == Some(false) || self.has_failed {
            return true;
        }
        // The script reports a failure by naming an object that exists only after success.
        if call.function == "getPeriod" {
            return true;
        }
        let succeeds = !(self.fails)(&call);
        match call.function.as_str() {
            "import" if succeeds => drop(self.packages.insert(call.text(0).to_owned())),
            "import" => self.has_lost_package = true,
            "load" if succeeds => drop(self.tasks.insert(call.text(0).to_owned())),
            "load" => drop(self.lost.insert(call.text(0).to_owned())),
            _ => {}
        }
        self.calls.push(call);
        succeeds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrong(script: &str) -> String {
        let script = format!("imported(\"p\")\nloaded(\"a\", \"p::A\")\n{script}\n");
        run(&script, |_| false).expect_err(&script)
    }

    #[test]
    fn what_the_parser_of_rtt_does_not_take_is_wrong() {
        for (script, why) in [
            ("a.configure() // now", "`/` has no meaning"),
            ("a.configure() a.start()", "no task has an operation `configure` with"),
            ("b.configure()", "no task `b`"),
            ("a.start = 1", "a word of the scripts"),
            ("a.x = \"\\101\"", "an escape"),
            ("a.x = \"b", "a text has no end"),
            ("a.x = 2147483648", "too great"),
            ("a.x = 1.", "no number"),
            ("a.cleanup()", "no task has an operation `cleanup`"),
            ("var ConnPolicy a = ConnPolicy()", "a is a task"),
            ("connect(\"a.x\", \"a.y\", cp)", "no policy"),
            ("connect(\"a.x\", \"b.y\", cp)", "no policy"),
            ("setActivity(\"a\", 1, 10, ORO_SCHED_RT)", "no function `setActivity`"),
            ("setActivity(\"a\", 0.0, 10, ORO_SCHED_RT)", "no such activity"),
            ("setActivity(\"a\", 0.1, 0, ORO_SCHED_RT)", "no such activity"),
            ("stream(\"a.x\", ros.comm.topic(\"/a/x\"))", "ROS has not been imported"),
            ("loaded(\"done\", \"p::B\")", "a word of the scripts"),
            ("loaded(\"_x\", \"p::B\")", "is no name"),
            ("loaded(\"b\", \"q::B\")", "imported from q"),
            ("loaded(\"b\", \"::p::B\")", "a class in two namespaces"),
            ("loaded(\"donee\", \"p::B\")\ndonee.start()", "is read as `done`"),
            ("if ( ok ) then {\n}", "nothing is called ok"),
            ("var bool ok = true\nif ( ok ) then {", "has no end"),
        ] {
            assert!(wrong(script).contains(why), "{}", wrong(script));
        }
    }

    #[test]
    fn what_fails_in_a_block_ends_it() {
        let script = "imported(\"p\")\nloaded(\"a\", \"p::A\")\nvar bool ok = true\nok = a.configure() && ok\n\
                      a.x = -2147483647 - 1\nif ( ok ) then {\n  a.start()\n  a.setCpuAffinity(1)\na.setCpuAffinity(2147483648u)\n}\n";
        let done = |failing: &str| {
            let calls = run(script, |call| call.function == failing).unwrap();
            calls.into_iter().map(|call| call.function).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(done(""), "import load configure set start setCpuAffinity setCpuAffinity");
        assert_eq!(done("start"), "import load configure set start");
        assert_eq!(done("configure"), "import load configure set");
        assert_eq!(done("load"), "import load failed");
    }
}
