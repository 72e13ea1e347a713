//! `mauve parse FILE`: the syntax tree of a file, and what is wrong in its text.

use std::path::PathBuf;

use clap::ValueEnum;
use mauve_projects::disk::text_of;
use mauve_projects::harmless::harmless;
use mauve_projects::json::object;
use mauve_projects::load::canonical_path;
use mauve_projects::output::Output;
use mauve_syntax::{NodeOrToken, SyntaxNode, SyntaxToken};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

#[derive(Debug, clap::Args)]
pub struct Parse {
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
                let tree = element(NodeOrToken::Node(parse.syntax()));
                let document = object! { tree: tree, errors: errors };
                serde_json::to_string(&document).map_err(|error| error.to_string())? + "\n"
            }
        };
        Ok(Output::verbatim(text, code))
    }
}

/// A node or a token in JSON. It is written while the tree is read: a document in memory takes a thousand times the text.
#[derive(Serialize)]
struct Element {
    kind: String,
    start: u32,
    #[serde(flatten)]
    content: Content,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Content {
    Token { text: String },
    Node { end: u32, children: Children },
}

struct Children(SyntaxNode);

impl Serialize for Children {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(self.0.children_with_tokens().map(element))
    }
}

fn element(of: NodeOrToken<SyntaxNode, SyntaxToken>) -> Element {
    let (kind, range) = (format!("{:?}", of.kind()), of.text_range());
    let content = match of {
        NodeOrToken::Node(node) => Content::Node { end: range.end().into(), children: Children(node) },
        NodeOrToken::Token(token) => Content::Token { text: token.text().to_owned() },
    };
    Element { kind, start: range.start().into(), content }
}
