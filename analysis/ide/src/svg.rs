//! Writes SVG documents with the project's colours: one element in a line, with its class first, escaped texts, and attributes
//! with at most one decimal.
//!
//! A document is light or dark as its viewer prefers, by CSS (`drawing.css`). It contains no script and needs no other file.

use std::fmt::{Display, Write as _};
use std::sync::LazyLock;

use mauve_diagnostics::is_obeyed;

/// Elements in the order in which they are painted.
#[derive(Debug, Default)]
pub(crate) struct Svg {
    elements: String,
}

/// The part of a text that is at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// Names and values of attributes.
pub(crate) type Attributes<'a> = &'a [(&'a str, &'a dyn Display)];

impl Svg {
    /// Returns the document of this size with a title at a position.
    pub(crate) fn document(&self, (width, height): (f64, f64), (x, y): (f64, f64), title: &str) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"mauve\" role=\"group\" aria-label=\"{title}\" width=\"{width:.0}\" \
             height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\">\n\
             <style>\n{style}</style>\n\
             <rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n\
             <text x=\"{x}\" y=\"{y}\" class=\"heading\">{title}</text>\n{elements}</svg>\n",
            title = escaped(title),
            style = *STYLE,
            elements = self.elements,
        )
    }

    /// Begins an element: its name, its class and its attributes.
    fn begin(&mut self, name: &str, class: &str, attributes: Attributes<'_>) {
        self.elements += &format!("<{name}");
        if !class.is_empty() {
            let _ = write!(self.elements, " class=\"{class}\"");
        }
        for (name, value) in attributes {
            let _ = write!(self.elements, " {name}=\"{}\"", escaped(&value.to_string()));
        }
    }

    /// Goes on inside of the element, with what a tooltip says, if anything.
    fn inside(&mut self, title: &str) {
        self.elements.push('>');
        if !title.is_empty() {
            let _ = write!(self.elements, "<title>{}</title>", escaped(title));
        }
    }

    /// Writes an element with what a tooltip says, if anything.
    fn shape(&mut self, name: &str, class: &str, attributes: Attributes<'_>, title: &str) {
        self.begin(name, class, attributes);
        if title.is_empty() {
            self.elements += "/>\n";
        } else {
            self.inside(title);
            let _ = writeln!(self.elements, "</{name}>");
        }
    }

    /// Opens a group, with what a tooltip says, if anything.
    pub(crate) fn group(&mut self, class: &str, attributes: Attributes<'_>, title: &str) {
        self.begin("g", class, attributes);
        self.inside(title);
        self.elements.push('\n');
    }

    /// Closes a group.
    pub(crate) fn end(&mut self) {
        self.elements += "</g>\n";
    }

    /// Returns the elements, for a document with another head.
    pub(crate) fn elements(self) -> String {
        self.elements
    }

    /// Adds elements.
    pub(crate) fn markup(&mut self, elements: &str) {
        self.elements += elements;
        self.elements.push('\n');
    }

    /// Draws a rectangle: its left, top, width and height.
    pub(crate) fn rect(&mut self, class: &str, area: [f64; 4]) {
        self.rect_with(class, area, &[], "");
    }

    /// Draws a rectangle with further attributes, and what a tooltip says, if anything.
    pub(crate) fn rect_with(&mut self, class: &str, area: [f64; 4], further: Attributes<'_>, title: &str) {
        let [x, y, width, height] = area.map(number);
        let area: Attributes<'_> = &[("x", &x), ("y", &y), ("width", &width), ("height", &height)];
        self.shape("rect", class, &[area, further].concat(), title);
    }

    pub(crate) fn circle(&mut self, class: &str, (x, y): (f64, f64), radius: f64) {
        self.shape("circle", class, &[("cx", &number(x)), ("cy", &number(y)), ("r", &radius)], "");
    }

    /// Draws lines, if there are any.
    pub(crate) fn path(&mut self, class: &str, lines: &str) {
        self.titled_path(class, lines, "");
    }

    pub(crate) fn titled_path(&mut self, class: &str, lines: &str, title: &str) {
        if !lines.is_empty() {
            self.shape("path", class, &[("d", &lines)], title);
        }
    }

    pub(crate) fn text(&mut self, class: &str, at: (f64, f64), anchor: Anchor, text: &str) {
        self.text_with(class, at, anchor, &[], text);
    }

    /// Writes a text with further attributes.
    pub(crate) fn text_with(
        &mut self,
        class: &str,
        (x, y): (f64, f64),
        anchor: Anchor,
        further: Attributes<'_>,
        text: &str,
    ) {
        let anchor: Attributes<'_> = match anchor {
            Anchor::Start => &[],
            Anchor::Middle => &[("text-anchor", &"middle")],
            Anchor::End => &[("text-anchor", &"end")],
        };
        let position: Attributes<'_> = &[("x", &number(x)), ("y", &number(y))];
        self.begin("text", class, &[position, further, anchor].concat());
        self.inside("");
        let _ = writeln!(self.elements, "{}</text>", escaped(text));
    }

    /// Writes an entry of a legend: a sign, which is lines and shapes, and a text at a distance, each with its class.
    pub(crate) fn entry(
        &mut self,
        (x, y): (f64, f64),
        sign: &[(&str, &str)],
        (distance, class): (f64, &str),
        text: &str,
    ) {
        let place = format!("translate({} {})", number(x), number(y));
        self.group("", &[("transform", &place)], "");
        sign.iter().for_each(|(class, lines)| self.path(class, lines));
        self.text(class, (distance, 0.0), Anchor::Start, text);
        self.end();
    }
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

/// Returns a line through these points, with round corners.
pub(crate) fn path_through(points: &[(f64, f64)]) -> String {
    let [(x, y), rest @ ..] = points else { return String::new() };
    let mut path = format!("M{} {}", number(*x), number(*y));
    for corner in points.windows(3) {
        let [before, (x, y), after] = corner else { continue };
        let ((bx, by), (ax, ay)) = (towards((*x, *y), *before), towards((*x, *y), *after));
        let [bx, by, ax, ay, x, y] = [bx, by, ax, ay, *x, *y].map(number);
        let _ = write!(path, "L{bx} {by}Q{x} {y} {ax} {ay}");
    }
    if let [.., (x, y)] = rest {
        let _ = write!(path, "L{} {}", number(*x), number(*y));
    }
    path
}

/// The point next to a corner from which the line bends.
fn towards((x, y): (f64, f64), (to_x, to_y): (f64, f64)) -> (f64, f64) {
    const RADIUS: f64 = 5.0;
    let part = |from: f64, to: f64| from + ((to - from) / 2.0).clamp(-RADIUS, RADIUS);
    (part(x, to_x), part(y, to_y))
}

/// Returns the lines of the tip of an arrow that ends at the last of these points.
pub(crate) fn tip_of(points: &[(f64, f64)]) -> String {
    let [.., (from_x, from_y), (x, y)] = points else { return String::new() };
    let (dx, dy) =
        ((x - from_x).signum() * f64::from(x != from_x), (y - from_y).signum() * f64::from(y != from_y));
    // Two corners, 8 before the end, 3.5 to each side.
    let corner = |side: f64| (x - 8.0 * dx - side * dy, y - 8.0 * dy + side * dx);
    let ((ax, ay), (bx, by)) = (corner(3.5), corner(-3.5));
    let [x, y, ax, ay, bx, by] = [*x, *y, ax, ay, bx, by].map(number);
    format!("M{x} {y}L{ax} {ay}L{bx} {by}z")
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

/// Returns a text in which each character that a terminal or a browser would obey is replaced. Line breaks are kept.
pub(crate) fn visible(text: &str) -> String {
    text.replace(|letter| letter != '\n' && is_obeyed(letter), "\u{fffd}")
}

/// Returns `text` escaped for SVG, including attributes.
pub(crate) fn escaped(text: &str) -> String {
    visible(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
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
