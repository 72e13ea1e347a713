//! Common parts of drawings: SVG documents with the project's colours, lines, and texts in SVG and DOT.
//!
//! A drawing is light or dark as its viewer prefers, by CSS (`drawing.css`). It contains no script and needs no other file.

use std::fmt::Write as _;
use std::sync::LazyLock;

use mauve_diagnostics::shortened;
use serde::Deserialize;

use crate::layout::{Area, Placement};

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

/// Returns the head of an SVG document of this size: the style, the tip of arrows, a background, and the title.
///
/// `place` holds the attributes that place the title.
pub(crate) fn svg_head((width, height): (f64, f64), place: &str, title: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"mauve\" role=\"group\" aria-label=\"{title}\" width=\"{width:.0}\" \
         height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\">\n\
         <style>\n{style}</style>\n\
         <rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n\
         <text {place} class=\"heading\">{title}</text>\n",
        title = svg_text(title),
        style = *STYLE,
    )
}

/// The styles of drawings. Before each declaration of a colour that depends on the viewer stands the one of the light colours: viewers
/// such as librsvg know no custom properties.
static STYLE: LazyLock<String> = LazyLock::new(|| {
    let css = include_str!("drawing.css");
    let light = |name: &str| css.split_once(&format!("--{name}: "))?.1.split(';').next();
    let with_light = |piece: &str| {
        let declaration = piece.rfind('{').map_or(piece, |at| &piece[at + 1..]);
        let plain = declaration.split_once("var(--").and_then(|(property, rest)| {
            let (name, rest) = rest.split_once(')')?;
            Some(format!("{property}{}{rest}", light(name)?))
        });
        let rule = &piece[..piece.len() - declaration.len()];
        format!("{rule}{}{declaration}", plain.unwrap_or_default())
    };
    css.split_inclusive(';').map(with_light).collect()
});

/// Returns what is shown instead of a drawing that is too large: what it would have, and the command that lists all of it.
pub(crate) fn too_large(drawing: Drawing, title: &str, content: &str, command: &str) -> String {
    let why =
        format!("too large to draw: {content}; `{command} --format dot` writes all of them for Graphviz");
    match drawing {
        Drawing::Svg | Drawing::Narrow => {
            let size = (text_width(title, 14.0, true).max(text_width(&why, 12.0, false)) + 48.0, 90.0);
            let head = svg_head(size, "x=\"24\" y=\"30\"", title);
            format!("{head}<text class=\"soft\" x=\"24\" y=\"60\">{}</text>\n</svg>\n", svg_text(&why))
        }
        Drawing::Dot | Drawing::Text(_) => format!("{title}\n\n{why}\n"),
    }
}

/// Returns the frame of a box, with corners of this radius.
pub(crate) fn svg_frame(area: Area, radius: u32) -> String {
    let [x, y, width, height] = [area.x, area.y, area.width, area.height].map(number);
    format!(
        "<rect class=\"frame\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"{radius}\"/>"
    )
}

/// Returns the attributes of a line through these points, with round corners.
pub(crate) fn svg_path(points: &[(f64, f64)]) -> String {
    let mut path = String::new();
    for (index, &(x, y)) in points.iter().enumerate() {
        let before = index.checked_sub(1).and_then(|before| points.get(before));
        match (before, points.get(index + 1)) {
            (None, _) => {
                let _ = write!(path, "M{} {}", number(x), number(y));
            }
            (Some(_), None) => {
                let _ = write!(path, "L{} {}", number(x), number(y));
            }
            (Some(&before), Some(&after)) => {
                let ((bx, by), (ax, ay)) = (towards((x, y), before), towards((x, y), after));
                let [bx, by, ax, ay, x, y] = [bx, by, ax, ay, x, y].map(number);
                let _ = write!(path, "L{bx} {by}Q{x} {y} {ax} {ay}");
            }
        }
    }
    path
}

/// The point next to a corner from which the line bends.
fn towards((x, y): (f64, f64), (to_x, to_y): (f64, f64)) -> (f64, f64) {
    const RADIUS: f64 = 5.0;
    let part = |from: f64, to: f64| {
        from + (to - from).clamp(-RADIUS.min((to - from).abs() / 2.0), RADIUS.min((to - from).abs() / 2.0))
    };
    (part(x, to_x), part(y, to_y))
}

/// Returns the tip of an arrow that ends at the last of these points.
pub(crate) fn svg_tip(points: &[(f64, f64)]) -> String {
    let [.., (from_x, from_y), (x, y)] = points else { return String::new() };
    let (dx, dy) =
        ((x - from_x).signum() * f64::from(x != from_x), (y - from_y).signum() * f64::from(y != from_y));
    // Two corners, 8 before the end, 3.5 to each side.
    let corner = |side: f64| (x - 8.0 * dx - side * dy, y - 8.0 * dy + side * dx);
    let ((ax, ay), (bx, by)) = (corner(3.5), corner(-3.5));
    let [x, y, ax, ay, bx, by] = [*x, *y, ax, ay, bx, by].map(number);
    format!("<path class=\"tip\" d=\"M{x} {y}L{ax} {ay}L{bx} {by}z\"/>")
}

/// Returns a placement with all positions moved.
pub(crate) fn moved(mut placement: Placement, (x, y): (f64, f64)) -> Placement {
    for placed in &mut placement.boxes {
        placed.area.x += x;
        placed.area.y += y;
        for slot in &mut placed.slots {
            slot.y += y;
        }
    }
    for line in &mut placement.lines {
        for point in &mut line.points {
            *point = (point.0 + x, point.1 + y);
        }
        if let Some(label) = &mut line.label {
            label.x += x;
            label.y += y;
        }
    }
    placement
}

/// Returns a number with at most one decimal.
pub(crate) fn number(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

/// Returns a width that the text does not exceed in common sans-serif fonts of this size. DejaVu Sans is the widest of them; bold
/// letters are up to a tenth wider.
pub(crate) fn text_width(text: &str, size: f64, is_bold: bool) -> f64 {
    let of = |letter: char| match letter {
        'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '|' | '\'' | ' ' => 0.36,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '-' | '·' | '/' => 0.42,
        'm' | 'w' | 'M' | 'W' | '%' | '@' | '—' => 1.0,
        'A'..='Z' => 0.75,
        'a'..='z' | '0'..='9' | '_' => 0.64,
        letter if letter.is_ascii() => 0.84,
        _ => 1.0,
    };
    text.chars().map(of).sum::<f64>() * size * if is_bold { 1.12 } else { 1.0 }
}

/// Returns a text that is at most this wide: its end becomes `…`.
pub(crate) fn fitted(text: &str, width: f64, size: f64, is_bold: bool) -> String {
    if text_width(text, size, is_bold) <= width {
        return text.to_owned();
    }
    let mut fitting = String::new();
    for letter in text.chars() {
        let longer = format!("{fitting}{letter}");
        if text_width(&format!("{longer}…"), size, is_bold) > width {
            break;
        }
        fitting = longer;
    }
    fitting + "…"
}

/// Returns `text` escaped for SVG, including attributes.
pub(crate) fn svg_text(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A line of text; `anchor` holds further attributes.
pub(crate) fn svg_line(class: &str, at: (f64, f64), anchor: &str, text: &str) -> String {
    format!(
        "<text class=\"{class}\" x=\"{}\" y=\"{}\"{anchor}>{}</text>\n",
        number(at.0),
        number(at.1),
        svg_text(text)
    )
}

/// Returns `text` as a quoted identifier of DOT.
pub(crate) fn dot_text(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_colour_has_a_light_value_for_viewers_without_custom_properties() {
        let pieces: Vec<&str> = STYLE.split_inclusive(';').collect();
        let (plain, custom): (Vec<_>, Vec<_>) = (1..pieces.len())
            .filter(|&at| pieces[at].contains("var("))
            .map(|at| (pieces[at - 1].rsplit('{').next().unwrap_or_default(), pieces[at]))
            .unzip();
        assert!(custom.len() > 40, "{custom:?}");
        for (plain, custom) in plain.iter().zip(&custom) {
            let of = |declaration: &str| {
                declaration
                    .split_once(':')
                    .map(|(property, value)| (property.trim().to_owned(), value.trim().to_owned()))
            };
            let (Some((property, light)), Some((same, value))) = (of(plain), of(custom)) else {
                panic!("{plain} {custom}")
            };
            assert_eq!(property, same);
            assert!(light.starts_with('#') && value.starts_with("var(--"), "{light} before {value}");
        }
        assert!(
            STYLE.contains(".mauve .missed .filled { fill: #b3261e; fill: var(--missed); }"),
            "{}",
            *STYLE
        );
    }
}
