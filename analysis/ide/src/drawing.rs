//! Common parts of drawings: the head and the arrows of SVG, and texts in SVG and DOT.

/// The format of a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawing {
    /// For Graphviz.
    Dot,
    /// For a browser.
    Svg,
}

/// Returns the head of an SVG document of this size: the tip of arrows, a white background, and the title.
///
/// `place` holds the attributes that place the title.
pub(crate) fn svg_head((width, height): (f64, f64), place: &str, title: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
         viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <defs><marker id=\"tip\" viewBox=\"0 0 10 10\" refX=\"9\" refY=\"5\" markerWidth=\"9\" markerHeight=\"9\" \
         markerUnits=\"userSpaceOnUse\" orient=\"auto\"><path d=\"M0 0 L10 5 L0 10 z\" fill=\"#456\"/></marker></defs>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <text {place} font-weight=\"bold\">{}</text>\n",
        svg_text(title)
    )
}

/// Returns an SVG arrow on a line of its own; `data-source` and `data-target` hold the numbers of its ends.
///
/// `style` is empty, or holds more attributes after a space.
pub(crate) fn svg_arrow(path: &str, (source, target): (usize, usize), style: &str) -> String {
    format!(
        "<path d=\"{path}\" data-source=\"{source}\" data-target=\"{target}\" fill=\"none\" stroke=\"#456\"{style} \
         marker-end=\"url(#tip)\"/>\n"
    )
}

/// Returns `text` escaped for SVG, including attributes.
pub(crate) fn svg_text(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Returns `text` as a quoted identifier of DOT.
pub(crate) fn dot_text(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}
