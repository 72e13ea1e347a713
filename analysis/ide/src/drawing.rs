//! Common parts of drawings: their formats, their names, and texts in DOT.

use mauve_diagnostics::shortened;
use serde::Deserialize;

use crate::svg::{Anchor, Svg, text_width, visible};

/// The format of a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Drawing {
    /// For a browser.
    #[default]
    Svg,
    /// For a narrow part of a window, as SVG: the boxes of an architecture one below the other, schedules and plots with short axes.
    Narrow,
    /// For Graphviz.
    Dot,
    /// For a terminal: lines of characters, boxes of box-drawing characters. At most so many columns wide where that is possible;
    /// none for any width.
    Text(#[serde(skip)] Option<usize>),
}

impl Drawing {
    /// Returns how wide a text may be; none for any width.
    pub(crate) fn columns(self) -> Option<usize> {
        if let Drawing::Text(columns) = self { columns } else { None }
    }
}

/// The letters of a name in a drawing.
const MOST_LETTERS: usize = 100;

/// Returns a name as a drawing shows it.
pub(crate) fn drawn_name(name: &str) -> String {
    shortened(name, MOST_LETTERS)
}

/// Returns what is shown instead of a drawing that is too large: what it would have, and the command that lists all of it.
pub(crate) fn too_large(drawing: Drawing, title: &str, content: &str, command: &str) -> String {
    let why =
        format!("too large to draw: {content}; `{command} --format dot` writes all of them for Graphviz");
    match drawing {
        Drawing::Svg | Drawing::Narrow => {
            let size = (text_width(title, 14.0, true).max(text_width(&why, 12.0, false)) + 48.0, 90.0);
            let mut svg = Svg::default();
            svg.text("soft", (24.0, 60.0), Anchor::Start, &why);
            svg.document(size, (24.0, 30.0), title)
        }
        Drawing::Dot | Drawing::Text(_) => format!("{title}\n\n{why}\n"),
    }
}

/// Returns `text` as a quoted identifier of DOT.
pub(crate) fn dot_text(text: &str) -> String {
    format!("\"{}\"", visible(text).replace('\\', "\\\\").replace('"', "\\\""))
}

/// Returns the head of a graph in DOT: its name and its title, and the style of its boxes.
pub(crate) fn dot_head(name: &str, title: &str, style: &str) -> String {
    let (name, title) = (dot_text(name), dot_text(title));
    format!("digraph {name} {{\n  label={title}; labelloc=t; rankdir=LR; node [shape=box, style={style}];\n")
}
