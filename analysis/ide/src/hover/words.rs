//! Hovers over words that no model declares: built-in functions, status values, the programs of cores and states, the fields of
//! an activity, and the buffer of a connection.

use mauve_hir::{File, ModelDb, field_entry, is_model, parse};
use mauve_syntax::SyntaxKind::{self, *};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::keywords::{ActivityField, BACKGROUND};
use mauve_syntax::{SyntaxToken, TextSize, tokens_at};

use super::format::Hover;
use crate::markdown;

const FUNCTIONS: [(&str, &str, &str); 5] = [
    (
        "read",
        "read(port, variable)",
        "Copies the value of an input port to the variable, if the port has a value. Returns the port status: `no_data`, \
         `old_data` or `new_data`. Never waits.",
    ),
    ("write", "write(port, value)", "Publishes the value on an output port. Has no result. Never waits."),
    (
        "status",
        "status(port)",
        "Returns the port status of the last `read` of this port, or `no_data` before the first. Does not read the port.",
    ),
    (
        "send",
        "handler = send(operation, argument, …)",
        "Starts a call of a required operation with its `in` and `inout` arguments. Never waits: a later `collect` of the \
         handler fetches the results.",
    ),
    (
        "collect",
        "collect(handler, variable, …)",
        "Copies the results of a finished call to the variables: its result, unless that is `void`, then its `out` and \
         `inout` parameters. Returns the call status: `not_ready`, `success` or `failure`. Never waits.",
    ),
];

const STATUSES: [(SyntaxKind, &str); 6] = [
    (NO_DATA_KW, "Port status: no value was ever written to the port."),
    (OLD_DATA_KW, "Port status: the port has the same value as at the last read."),
    (NEW_DATA_KW, "Port status: the port has a value that was not read before."),
    (NOT_READY_KW, "Call status: the call is not finished."),
    (SUCCESS_KW, "Call status: the call is finished, and its results are in the variables."),
    (FAILURE_KW, "Call status: the call has failed."),
];

const PROGRAMS: [(SyntaxKind, &str); 9] = [
    (
        CONFIGURE_KW,
        "Executed once, before all other programs. Returns `true` if the component may be started; without `return`, `true`.",
    ),
    (
        START_KW,
        "Executed when the component is started, if `configure` returned `true`. Returns `true` if the component may run; \
         without `return`, `true`.",
    ),
    (
        UPDATE_KW,
        "Executed each period while the component runs. A core has either an `update` or a state machine.",
    ),
    (STOP_KW, "Executed when the component is stopped. Has no result."),
    (CLEANUP_KW, "Executed once, after all other programs. Has no result."),
    (
        ENTRY_KW,
        "Executed when the state is entered: by a transition, including one from the state to itself, or at the start of the \
         state machine.",
    ),
    (RUN_KW, "Executed each period that begins in the state, before the guards of its transitions."),
    (HANDLE_KW, "Executed each period after `run`, when no transition fires."),
    (EXIT_KW, "Executed when a transition leaves the state, before the program of the transition."),
];

const OF_BACKGROUND: &str =
    "The activity is not real-time: it runs only when no real-time activity does, and needs no period.";

const BUFFERED: &str = "Circular buffer: the connection keeps this many of the last values, and each read takes the oldest. Without a \
                      buffer, a connection keeps the last value only.";

pub(super) fn of_word(db: &dyn ModelDb, file: File, offset: TextSize) -> Option<Hover> {
    if !is_model(file.path(db)) {
        return None;
    }
    let tokens = tokens_at(&parse(db, file).syntax(), offset);
    tokens.into_iter().find_map(|token| Some(Hover { range: token.text_range(), markdown: meaning(&token)? }))
}

fn meaning(token: &SyntaxToken) -> Option<String> {
    let text = token.text();
    let parent = token.parent()?;
    let kind_of_owner = parent.parent().map(|owner| owner.kind());
    // A name may be any word; the hover then shows its declaration.
    let keyword = |words: &[(SyntaxKind, &str)]| {
        words
            .iter()
            .find(|(kind, _)| *kind == token.kind())
            .map(|(_, meaning)| format!("`{text}`: {meaning}\n"))
    };
    match (parent.kind(), kind_of_owner) {
        (LITERAL, _) => keyword(&STATUSES),
        (HOOK | METHOD, _) => keyword(&PROGRAMS),
        (BUFFER, _) => Some(format!("{}: {BUFFERED}\n", markdown::code(parent.text().to_string().trim()))),
        (NAME_REF, Some(CALL_EXPR)) => {
            let (_, shape, meaning) = FUNCTIONS.iter().find(|(name, ..)| *name == text)?;
            Some(format!("```mauve\n{shape}\n```\n\n{meaning}\n"))
        }
        (NAME_REF, Some(FIELD)) => {
            let entry = field_entry(ActivityField::from_keyword(text)?);
            Some(format!("`{text}`: {}\n", entry.meaning))
        }
        (NAME_REF, Some(NAME_EXPR)) if text == BACKGROUND => {
            let field = token.parent_ancestors().find_map(ast::Field::cast)?;
            (field.field() == Some(ActivityField::Priority)).then(|| format!("`{text}`: {OF_BACKGROUND}\n"))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use crate::fixture::Fixture;

    const MODEL: &str = "shell S { input port goal: int  output port next: int  require plan(): int }
core C(S) {
  var g: int = 0
  handler h: plan
  configure = { } start = { } stop = { } cleanup = { }
  statemachine {
    initial state A {
      entry = { } run = { } handle = { } exit = { }
      transition t if read(goal, g) == new_data && status(goal) != old_data to A { write(next, g); h = send(plan); }
      transition u if collect(h, g) == success to A
    }
  }
}
core D(S) {
  handler h: plan
  var none: bool = false
  update = { none = collect(h) == failure || collect(h) == not_ready || status(goal) == no_data; }
}
component K(S, C)
architecture X { instance a: K  instance b: K  connection a.next -> [4] b.goal }
deployment Y { architecture X
  activity a { affinity = 1 priority = 3 period = 10 deadline = 10 jitter = 0.5 offset = 2 }
  activity b { priority = background }
}
";

    fn shown(at: usize) -> String {
        let fixture = Fixture::new(&format!("{}$0{}", &MODEL[..at], &MODEL[at..]));
        fixture.hover().map_or_else(String::new, |it| it.markdown)
    }

    #[test]
    fn every_word_says_what_it_means() {
        for word in [
            "read(",
            "write(",
            "status(",
            "send(",
            "collect(",
            "no_data",
            "old_data",
            "new_data",
            "not_ready",
            "success",
            "failure",
            "configure",
            "start ",
            "update",
            "stop",
            "cleanup",
            "entry",
            "run",
            "handle ",
            "exit",
            "affinity",
            "priority",
            "period",
            "deadline",
            "jitter",
            "offset",
            "background",
            "4]",
        ] {
            let shown = shown(MODEL.find(word).unwrap() + 1);
            assert!(shown.contains(word.trim_end_matches(['(', ' '])), "{word}: {shown:?}");
        }
    }

    #[test]
    fn a_name_is_what_the_model_declares() {
        let fixture = Fixture::new("codel read(): int\nshell S { }\ncore C(S) { update = { re$0ad(); } }\n");
        let shown = fixture.hover().unwrap().markdown;
        assert!(shown.contains("codel read(): int") && !shown.contains("variable"), "{shown}");
    }
}
