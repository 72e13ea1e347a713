//! `mauve parse FILE`: the syntax tree of a file, and what is wrong in its text.

use std::path::PathBuf;

use clap::ValueEnum;
use mauve_syntax::{NodeOrToken, SyntaxNode};
use serde_json::{Value, json};

use crate::disk::text_of;
use crate::harmless::harmless;
use crate::load::canonical_path;
use crate::output::Output;

#[derive(Debug, clap::Args)]
pub(crate) struct Parse {
    /// The file to parse.
    file: PathBuf,
    /// The output format.
    #[arg(long, value_enum, default_value = "tree")]
    format: TreeFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TreeFormat {
    /// One line for each node or token, indented.
    Tree,
    /// Nested JSON objects.
    Json,
}

impl Parse {
    pub(crate) fn run(self) -> Result<Output, String> {
        let (text, problem) = text_of(&canonical_path(&self.file));
        if let Some(problem) = problem {
            return Err(format!("`{}`: {problem}", self.file.display()));
        }
        let parse = mauve_syntax::parse(&text);
        let code = u8::from(!parse.errors().is_empty());
        let text = match self.format {
            TreeFormat::Tree => harmless(&mauve_diagnostics::tree_of(&parse, &|| ())),
            TreeFormat::Json => {
                let error = |error: &mauve_syntax::SyntaxError| {
                    let (start, end): (u32, u32) = (error.range.start().into(), error.range.end().into());
                    json!({ "start": start, "end": end, "message": mauve_diagnostics::syntax_error_message(&parse, error) })
                };
                let errors: Vec<Value> = parse.errors().iter().map(error).collect();
                crate::json::text(&json!({ "tree": node(&parse.syntax()), "errors": errors }))?
            }
        };
        Ok(Output::verbatim(text, code))
    }
}

fn node(of: &SyntaxNode) -> Value {
    let child = |child| match child {
        NodeOrToken::Node(child) => node(&child),
        NodeOrToken::Token(token) => {
            let start: u32 = mauve_syntax::SyntaxToken::text_range(&token).start().into();
            json!({ "kind": format!("{:?}", token.kind()), "start": start, "text": token.text() })
        }
    };
    let (start, end): (u32, u32) = (of.text_range().start().into(), of.text_range().end().into());
    let children: Vec<Value> = of.children_with_tokens().map(child).collect();
    json!({ "kind": format!("{:?}", of.kind()), "start": start, "end": end, "children": children })
}
