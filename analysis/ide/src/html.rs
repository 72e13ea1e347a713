//! Pages in HTML without scripts, and texts in them.

use crate::svg::escaped;

/// Returns a page with the styles of all pages and its own ones; `body` is HTML.
pub fn page(title: &str, style: &str, body: &str) -> String {
    let title = text(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\"/>\n\
         <title>{title}</title>\n<style>\n{}{style}</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        include_str!("html.css")
    )
}

/// Returns a text from outside, escaped. Characters that no reader sees, or that reorder a line, are replaced.
pub fn text(outside: &str) -> String {
    escaped(&outside.replace(char::is_control, "\u{fffd}")).replace('\'', "&#39;")
}

/// Returns a text whose names, in backquotes, are code.
pub fn words(outside: &str) -> String {
    let parts: Vec<&str> = outside.split('`').collect();
    if parts.len().is_multiple_of(2) {
        return text(outside);
    }
    let part = |(index, it): (usize, &&str)| if index % 2 == 0 { text(it) } else { code(it) };
    parts.iter().enumerate().map(part).collect()
}

/// Returns a name in code, with the places where a narrow column may break it.
pub fn code(name: &str) -> String {
    let parts: Vec<String> = name.split_inclusive(['.', '/', '_', '(', ',', ':']).map(text).collect();
    format!("<code>{}</code>", parts.join("<wbr/>"))
}
