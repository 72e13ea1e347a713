//! A document, such as the explanation of a response time. It is made once, and printed as Markdown for a hover, as text for a terminal
//! and as HTML for a report.

use mauve_hir::item_tree::Name;
use mauve_hir::{Location, ModelDb};

use crate::html;
use crate::markdown::{self, Links};

/// A document: its blocks, in the order in which they are read.
///
/// ```text
/// ✓ 53 / 100 ms, slack 47 ms        a line
///
///               jobs      time      a table
/// own time  1 × 43 ms   43 ms
///
/// - period 100 ms                   a list
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Doc<'db> {
    pub(crate) blocks: Vec<DocBlock<'db>>,
}

/// A part of a document.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum DocBlock<'db> {
    Line(DocLine<'db>),
    List(Vec<DocLine<'db>>),
    Table(DocTable<'db>),
    /// What follows is less important.
    Rule,
}

/// Texts beside each other.
pub(crate) type DocLine<'db> = Vec<DocSpan<'db>>;

/// A part of a line.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum DocSpan<'db> {
    /// Words, with names in backquotes.
    Words(String),
    Strong(String),
    Code(String),
    /// The name of a declaration, which links to it if it has a location.
    Name(Name, Option<Location<'db>>),
    /// A bar for a share of the whole.
    Bar(f64),
}

/// A table. Its heads may be empty.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DocTable<'db> {
    pub(crate) columns: &'static [(&'static str, Align)],
    pub(crate) rows: Vec<Vec<DocLine<'db>>>,
}

/// Where the cells of a column stand in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Middle,
    Right,
}

/// Returns a line of words.
pub(crate) fn words<'db>(text: impl Into<String>) -> DocLine<'db> {
    vec![DocSpan::Words(text.into())]
}

impl<'db> Doc<'db> {
    /// Adds a list, unless it is empty.
    pub(crate) fn list(&mut self, lines: impl IntoIterator<Item = DocLine<'db>>) {
        let lines: Vec<DocLine<'db>> = lines.into_iter().collect();
        if !lines.is_empty() {
            self.blocks.push(DocBlock::List(lines));
        }
    }

    /// Returns the document in Markdown; `links` has the addresses of declarations.
    pub fn markdown(&self, db: &dyn ModelDb, links: Links<'_>) -> String {
        let line = |line: &DocLine<'db>| line.iter().map(|span| span.markdown(db, links)).collect::<String>();
        let block = |block: &DocBlock<'db>| match block {
            DocBlock::Line(of) => line(of) + "\n",
            DocBlock::List(lines) => lines.iter().map(|of| format!("- {}\n", line(of))).collect(),
            DocBlock::Table(table) => table.markdown(&line),
            DocBlock::Rule => "---\n".to_owned(),
        };
        self.blocks.iter().map(block).collect::<Vec<_>>().join("\n")
    }

    /// Returns the document as text. A rule is the blank line that is between all blocks.
    pub fn text(&self) -> String {
        let block = |block: &DocBlock<'db>| match block {
            DocBlock::Line(of) => Some(text(of) + "\n"),
            DocBlock::List(lines) => Some(lines.iter().map(|of| format!("- {}\n", text(of))).collect()),
            DocBlock::Table(table) => Some(table.text()),
            DocBlock::Rule => None,
        };
        self.blocks.iter().filter_map(block).collect::<Vec<_>>().join("\n")
    }

    /// Returns the document in HTML.
    pub fn html(&self) -> String {
        let line = |line: &DocLine<'_>| line.iter().map(DocSpan::html).collect::<String>();
        let cells = |name: &str, columns: &[(&str, Align)], cells: Vec<String>| {
            let cell = |(cell, (_, align)): (String, &(&str, Align))| {
                let class = if *align == Align::Left { "" } else { " class=\"number\"" };
                format!("<{name}{class}>{cell}</{name}>")
            };
            format!("<tr>{}</tr>\n", cells.into_iter().zip(columns).map(cell).collect::<String>())
        };
        let block = |block: &DocBlock<'db>| match block {
            DocBlock::Line(of) => format!("<p>{}</p>\n", line(of)),
            DocBlock::List(lines) => {
                let lines: String = lines.iter().map(|of| format!("<li>{}</li>\n", line(of))).collect();
                format!("<ul>\n{lines}</ul>\n")
            }
            DocBlock::Table(DocTable { columns, rows }) => {
                let heads = cells("th", columns, columns.iter().map(|(head, _)| html::text(head)).collect());
                let rows = rows.iter().map(|row| cells("td", columns, row.iter().map(line).collect()));
                let rows: String = rows.collect();
                format!("<table>\n<thead>{heads}</thead>\n<tbody>\n{rows}</tbody>\n</table>\n")
            }
            DocBlock::Rule => String::new(),
        };
        self.blocks.iter().map(block).collect()
    }
}

impl<'db> DocTable<'db> {
    /// Returns the width of each column, in letters.
    fn widths(&self) -> Vec<usize> {
        let letters = |text: &str| text.chars().count();
        let width = |(column, (head, _)): (usize, &(&str, Align))| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| letters(&text(cell))).max().unwrap_or_default().max(letters(head))
        };
        self.columns.iter().enumerate().map(width).collect()
    }

    /// Returns the table in Markdown, with columns of one width: most editors in terminals show its text, without its signs.
    fn markdown(&self, line: &impl Fn(&DocLine<'db>) -> String) -> String {
        // The line below the heads has at least three signs in a column.
        let widths: Vec<usize> = self.widths().into_iter().map(|width| width.max(3)).collect();
        let row = |cells: &mut dyn Iterator<Item = (String, usize)>| {
            let cells = cells.zip(self.columns).zip(&widths).map(|(((cell, width), (_, align)), widest)| {
                let space = " ".repeat(widest.saturating_sub(width));
                let cell = cell.replace('|', "\\|");
                if *align == Align::Right { space + &cell } else { cell + &space }
            });
            format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
        };
        let heads = row(&mut self.columns.iter().map(|(head, _)| ((*head).to_owned(), head.chars().count())));
        let aligned = row(&mut self.columns.iter().zip(&widths).map(|((_, align), width)| match align {
            Align::Left => (format!(":{}", "-".repeat(width - 1)), *width),
            Align::Middle => (format!(":{}:", "-".repeat(width - 2)), *width),
            Align::Right => (format!("{}:", "-".repeat(width - 1)), *width),
        }));
        let rows = self
            .rows
            .iter()
            .map(|cells| row(&mut cells.iter().map(|cell| (line(cell), text(cell).chars().count()))));
        heads + &aligned + &rows.collect::<String>()
    }

    /// Returns the rows as text, with columns of one width.
    fn text(&self) -> String {
        let widths = self.widths();
        let row = |cells: Vec<String>| {
            let cells = cells.into_iter().zip(self.columns).zip(&widths);
            let cells = cells.map(|((cell, (_, align)), width)| match align {
                Align::Left => format!("{cell:<width$}"),
                Align::Middle | Align::Right => format!("{cell:>width$}"),
            });
            cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
        };
        let heads = row(self.columns.iter().map(|(head, _)| (*head).to_owned()).collect());
        heads + &self.rows.iter().map(|cells| row(cells.iter().map(text).collect())).collect::<String>()
    }
}

/// Returns the text of a line.
fn text(line: &DocLine<'_>) -> String {
    line.iter().map(DocSpan::text).collect()
}

impl DocSpan<'_> {
    fn markdown(&self, db: &dyn ModelDb, links: Links<'_>) -> String {
        match self {
            DocSpan::Words(text) => markdown::words(text),
            DocSpan::Strong(text) => format!("**{}**", markdown::words(text)),
            DocSpan::Code(text) => markdown::code(text),
            DocSpan::Name(name, at) => markdown::link(db, links, name, at.as_ref()),
            DocSpan::Bar(share) => markdown::bar(*share),
        }
    }

    fn text(&self) -> String {
        match self {
            DocSpan::Words(text) | DocSpan::Strong(text) | DocSpan::Code(text) => {
                text.replace(['\n', '\r'], " ")
            }
            DocSpan::Name(name, _) => name.to_string(),
            DocSpan::Bar(share) => markdown::bar(*share),
        }
    }

    fn html(&self) -> String {
        match self {
            DocSpan::Words(text) => html::words(text),
            DocSpan::Strong(text) => format!("<b>{}</b>", html::words(text)),
            DocSpan::Code(text) => html::code(text),
            DocSpan::Name(name, _) => html::code(name),
            DocSpan::Bar(share) => markdown::bar(*share),
        }
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;
    use mauve_hir::Database;

    use super::*;

    const COLUMNS: &[(&str, Align)] =
        &[("", Align::Left), ("priority", Align::Middle), ("time", Align::Right), ("", Align::Left)];

    fn doc() -> Doc<'static> {
        let row = |name: &str, priority: &str, time: &str, share: f64| {
            vec![
                vec![DocSpan::Name(name.into(), None)],
                words(priority),
                words(time),
                vec![DocSpan::Bar(share)],
            ]
        };
        let rows = vec![row("a|b", "9", "43 ms", 0.81), row("<c>", "10", "10 ms", 0.19)];
        Doc {
            blocks: vec![
                DocBlock::Line(vec![
                    DocSpan::Strong("✓ 53 ms".into()),
                    DocSpan::Words(", no time for `x_y` <b>".into()),
                ]),
                DocBlock::Table(DocTable { columns: COLUMNS, rows }),
                DocBlock::Rule,
                DocBlock::List(vec![
                    words("one"),
                    vec![DocSpan::Words("of ".into()), DocSpan::Code("A & B".into())],
                ]),
            ],
        }
    }

    #[test]
    fn a_document_in_markdown() {
        expect![[r#"
            **✓ 53 ms**, no time for `x_y` &lt;b>

            |     | priority |  time |                   |
            | :-- | :------: | ----: | :---------------- |
            | `a\|b` | 9        | 43 ms | ████████████████▎ |
            | `<c>` | 10       | 10 ms | ███▊              |

            ---

            - one
            - of `A & B`
        "#]]
        .assert_eq(&doc().markdown(&Database::default(), &|_, _| None));
    }

    #[test]
    fn a_document_as_text() {
        expect![[r#"
            ✓ 53 ms, no time for `x_y` <b>

                 priority   time
            a|b         9  43 ms  ████████████████▎
            <c>        10  10 ms  ███▊

            - one
            - of A & B
        "#]]
        .assert_eq(&doc().text());
    }

    #[test]
    fn a_document_in_html() {
        expect![[r#"
            <p><b>✓ 53 ms</b>, no time for <code>x_<wbr/>y</code> &lt;b&gt;</p>
            <table>
            <thead><tr><th></th><th class="number">priority</th><th class="number">time</th><th></th></tr>
            </thead>
            <tbody>
            <tr><td><code>a|b</code></td><td class="number">9</td><td class="number">43 ms</td><td>████████████████▎</td></tr>
            <tr><td><code>&lt;c&gt;</code></td><td class="number">10</td><td class="number">10 ms</td><td>███▊</td></tr>
            </tbody>
            </table>
            <ul>
            <li>one</li>
            <li>of <code>A &amp; B</code></li>
            </ul>
        "#]]
        .assert_eq(&doc().html());
    }
}
