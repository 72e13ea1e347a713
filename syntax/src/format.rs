//! Computes the edits that format the white space of a tree.
//!
//! **Only white space changes**: no token, no comment, no `;`. The formatter chooses the white space of each gap
//! between two tokens or comments, so a formatted text has the same tree apart from white space.
//!
//! Rules:
//! - Two spaces of indentation for each enclosing block. Inside a line one space, or none by convention: `f(a, b): T`,
//!   `a.b -> [4] c.d`, `x = -y + 1;`. Two spaces between neighbours on a line that no `;` or `}` separates.
//! - A block on one line stays on one line, unless it ends beyond column 120. In any other block, each item begins a
//!   line, and the closing brace has its own line. `{` and `else` stay on the line of their owner; an empty block is
//!   `{}`.
//! - Other line breaks are kept. A continuation line is aligned with the first token after the open parenthesis; it is
//!   indented by two spaces if the parenthesis ends its line, and by four spaces without a parenthesis.
//! - Blank lines are reduced to one, and removed at the beginning and the end of a block or of the file.
//! - A comment stays on its line. A comment on its own line is indented like the next item. Trailing `//` comments of
//!   consecutive lines are aligned in one column: the author's column if they share one, otherwise the smallest
//!   possible column. A comment below them continues their column.
//! - The activities of a deployment that take one line each are a table: its columns are as wide as necessary.
//! - Line breaks have the form of the majority. A byte order mark stays. The file ends with a line break.
//!
//! **Text with errors is not formatted**: behind an error, the parser recovers at the beginnings of lines, and the
//! intended structure is unknown. In an `ERROR` node, between the tokens beside it, and in an unclosed block, all white
//! space is kept. Elsewhere a line is broken or joined only where the nodes on both sides have no error: there the
//! parser ignores line breaks. Between git's conflict markers, all white space is kept.

mod layout;
mod lines;
mod pieces;
mod replacement;

use rowan::{TextRange, TextSize};

use crate::Parse;
use layout::TextLayout;
use lines::lines_of;
pub use replacement::{Replacement, applied};
use replacement::{range, replacement};

/// Returns the replacements that format a whole file: in text order, without overlaps, and each with an effect. Calls
/// `interrupt` often; it may unwind.
///
/// ```
/// let parse = mauve_syntax::parse("codel f( a:int ):int\n");
/// let tidy = mauve_syntax::format::format(&parse, &|| ());
/// assert_eq!(tidy.len(), 4);
/// ```
pub fn format(parse: &Parse, interrupt: &dyn Fn()) -> Vec<Replacement> {
    let text = parse.syntax().text().to_string();
    TextLayout::new(&parse.syntax(), &text, interrupt).replacements()
}

/// Returns the formatted text. Formatting is idempotent.
///
/// ```
/// let text = "shell S{input port goal:Pose;provide park( ):bool}";
/// let tidy = "shell S { input port goal: Pose; provide park(): bool }\n";
/// assert_eq!(mauve_syntax::format::formatted(text), tidy);
/// ```
pub fn formatted(text: &str) -> String {
    // A text that is too long is not parsed.
    if text.len() > crate::LONGEST_TEXT {
        return text.to_owned();
    }
    applied(text, &format(&crate::parse(text), &|| ()))
}

/// Returns the replacements of [`format`](fn@format) in the lines of `range`. A range that ends at the beginning of a
/// line does not include that line.
pub fn format_range(parse: &Parse, range: TextRange, interrupt: &dyn Fn()) -> Vec<Replacement> {
    let text = parse.syntax().text().to_string();
    let lines = lines_of(&text, range);
    let mut found = TextLayout::new(&parse.syntax(), &text, interrupt).replacements();
    found.retain(|it| lines.contains_range(it.range));
    found
}

/// Returns the on-type formatting edits after `typed` was typed right before `offset`; none except for `}`, `;` and
/// line breaks.
///
/// `}` formats the item that ends with its block, `;` the item that it ends, and a line break the line that it ends. A
/// line break also indents the new line: this is the only replacement behind `offset`.
pub fn format_on_type(
    parse: &Parse,
    offset: TextSize,
    typed: char,
    interrupt: &dyn Fn(),
) -> Vec<Replacement> {
    let text = parse.syntax().text().to_string();
    let at = usize::from(offset).min(text.len());
    if !text.get(..at).is_some_and(|before| before.ends_with(typed)) {
        return Vec::new();
    }
    let layout = TextLayout::new(&parse.syntax(), &text, interrupt);
    let mut found = layout.replacements();
    match typed {
        '}' | ';' => {
            let Some(start) = layout.item_before(at) else { return Vec::new() };
            let lines = lines_of(&text, range(start..at));
            // The rest of the line is not finished.
            found.retain(|it| lines.contains_range(it.range) && it.range.end() <= offset);
        }
        '\n' | '\r' => {
            let line = text.get(..at).map_or("", |before| before.trim_end_matches(['\n', '\r']));
            // White space at the end of the finished line may be the first half of a line break.
            let finished = lines_of(&text, range(line.len()..line.len()));
            found.retain(|it| finished.contains_range(it.range));
            let rest = text.get(at..).unwrap_or_default();
            let white = rest.len() - rest.trim_start_matches([' ', '\t']).len();
            if let Some(indent) = layout.indent_at(at..at + white) {
                found.extend(replacement(at, &rest[..white], " ".repeat(indent)));
            }
        }
        _ => return Vec::new(),
    }
    found
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};

    use super::*;

    fn check(text: &str, expected: Expect) {
        expected.assert_eq(&formatted(text));
    }

    #[test]
    fn spaces_in_a_line() {
        check(
            "codel f( in a:int ,out b : x . y :: z,c:int ) : bool
shell S  extends A,B{property r:double[0.1 ;1]=-0.3;provide g( ):int}
architecture A { connection a . b->[ 4 ]c.d  property a.b=2*( 1+c ) }
core C( S ) :{ update={ x=!f( a,- 1 )&&y<=2 ; return ; } }
component P(S,C)",
            expect![[r#"
                codel f(in a: int, out b: x.y::z, c: int): bool
                shell S extends A, B { property r: double [0.1; 1] = -0.3; provide g(): int }
                architecture A { connection a.b -> [4] c.d  property a.b = 2 * (1 + c) }
                core C(S): { update = { x = !f(a, -1) && y <= 2; return; } }
                component P(S, C)
            "#]],
        );
    }

    #[test]
    fn lines_of_blocks() {
        check(
            "library a{use b use c
core C(S) {


  // First.

  var a: int
  provide f() = { } ; start = {}
  statemachine { initial state A
    {
      run = { if a then { b(); } else { } }
      transition t to A } }

}
}
shell Short { input port a: int  input port b: int }
shell Long { input port aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa: int; input port bbbbbbbbbbbbbbbbbbbbb: int; input port c: int; } // no",
            expect![[r#"
                library a {
                  use b
                  use c
                  core C(S) {
                    // First.

                    var a: int
                    provide f() = {};
                    start = {}
                    statemachine {
                      initial state A {
                        run = { if a then { b(); } else {} }
                        transition t to A
                      }
                    }
                  }
                }
                shell Short { input port a: int  input port b: int }
                shell Long {
                  input port aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa: int;
                  input port bbbbbbbbbbbbbbbbbbbbb: int;
                  input port c: int;
                } // no
            "#]],
        );
    }

    #[test]
    fn lines_of_expressions_are_the_authors() {
        check(
            "codel f(in a: int,
in b: int, // the other
out c: int): bool
core C(S) { update = {
if a(b,
c) &&
d
then { e(
f,
// why
g
); }
// otherwise
else { x = 1
+ 2; } } }",
            expect![[r#"
                codel f(in a: int,
                        in b: int, // the other
                        out c: int): bool
                core C(S) {
                  update = {
                    if a(b,
                         c) &&
                        d
                        then {
                      e(
                        f,
                        // why
                        g
                      );
                    }
                    // otherwise
                    else {
                      x = 1
                          + 2;
                    }
                  }
                }
            "#]],
        );
    }

    #[test]
    fn activities_are_a_table() {
        check(
            "deployment D {
architecture A
activity a { affinity = 1 priority = 10; period = 5 deadline = 5 }
// The slow one.
activity slow { affinity = 0x10 priority = 9 period = 1000 }

activity rest { priority = background }
activity long {
  priority = 1 period = 10
}
}",
            expect![[r#"
                deployment D {
                  architecture A
                  activity a    { affinity = 1     priority = 10;  period = 5  deadline = 5 }
                  // The slow one.
                  activity slow { affinity = 0x10  priority = 9    period = 1000 }

                  activity rest { priority = background }
                  activity long {
                    priority = 1
                    period = 10
                  }
                }
            "#]],
        );
    }

    #[test]
    fn comments_stay_where_they_stand() {
        check(
            "

// Of the file.


/* And
     more. */ library a { // trailing
use b // one
use longer    // two
              // goes on
// alone
use c       // far
use ccc     // away
/* before */ codel f(/*x*/ a: int /* y */): int
   // last

}
// end",
            expect![[r#"
                // Of the file.

                /* And
                     more. */ library a { // trailing
                  use b      // one
                  use longer // two
                             // goes on
                  // alone
                  use c     // far
                  use ccc   // away
                  /* before */ codel f(/*x*/ a: int /* y */): int
                  // last
                }
                // end
            "#]],
        );
    }

    #[test]
    fn errors_are_formatted_around() {
        check(
            "shell  S {
      input  port
   input  port a  :int
   property  b:  =  3
      property c :int
}
core  C(S) {
   update  = {
         x  =  1;
   if  a  then {
  y=2;
}
   start  = { f( a  b ) ; g( ) ; }
}
what  is   this
    codel  f( ):int",
            expect![[r#"
                shell S {
                  input port
                  input port a: int
                  property b:  = 3
                  property c: int
                }
                core C(S) {
                  update = {
                         x  =  1;
                   if  a  then {
                  y=2;
                }
                  start = { f(a  b); g(); }
                }
                what  is   this
                codel f(): int
            "#]],
        );
    }

    #[test]
    fn no_line_is_broken_where_the_parser_would_be_misled() {
        // `architecture A` at the beginning of a line would be a declaration.
        check(
            "deployment D { architecture A\n{ } }",
            expect![[r#"
            deployment D { architecture A
            { } }
        "#]],
        );
    }

    #[test]
    fn line_breaks_and_marks_of_files() {
        assert_eq!(formatted(""), "");
        assert_eq!(formatted(" \n\n"), "");
        assert_eq!(formatted("\u{feff}\n use a"), "\u{feff}use a\n");
        assert_eq!(
            formatted("use a  \r\n\r\n\r\nuse b\r\nuse c use d\n"),
            "use a\r\n\r\nuse b\r\nuse c\r\nuse d\r\n"
        );
        assert_eq!(formatted("use a /* open\n"), "use a /* open\n");
    }

    #[test]
    fn only_the_selected_lines_are_formatted() {
        let text = "use  a\nuse  b\nuse  c\n";
        let parse = crate::parse(text);
        let second = applied(text, &format_range(&parse, range(8..9), &|| ()));
        assert_eq!(second, "use  a\nuse b\nuse  c\n");
        // Editors select complete lines.
        let two = applied(text, &format_range(&parse, range(0..14), &|| ()));
        assert_eq!(two, "use a\nuse b\nuse  c\n");
    }

    /// Checks the text after on-type formatting of the character before `|`.
    fn typed(text: &str, expected: &str) {
        let at = text.find('|').unwrap_or_default();
        let text = text.replacen('|', "", 1);
        let letter = text[..at].chars().next_back().unwrap_or_default();
        let found = format_on_type(&crate::parse(&text), TextSize::new(at as u32), letter, &|| ());
        assert_eq!(applied(&text, &found), expected);
    }

    #[test]
    fn an_item_is_formatted_when_it_ends() {
        // Formats the item that ends, and no text around it.
        typed("core C(S) {\nvar  a:int;|\nvar  b:int\n}", "core C(S) {\n  var a: int;\nvar  b:int\n}");
        typed(
            "core C(S) {\nupdate={\nf( a );\n}|\nstop={}\n}",
            "core C(S) {\n  update = {\n    f(a);\n  }\nstop={}\n}",
        );
        // A new line is indented like its future text.
        typed("core C(S) {\nvar  b:int\n|\n}", "core C(S) {\n  var b: int\n  \n}");
        typed("core C(S) {\n  update = {\n|", "core C(S) {\n  update = {\n    ");
        typed("core C(S) {\n  update = {\n|}\n}", "core C(S) {\n  update = {\n  }\n}");
        typed("codel f(in a: int,\n|): bool", "codel f(in a: int,\n        ): bool");
        typed("codel f(\n|", "codel f(\n  ");
        typed("core C(S) {\n  var a: int =\n|\n}", "core C(S) {\n  var a: int =\n      \n}");
        // No formatting in a comment.
        typed("/* a\n|\n*/", "/* a\n\n*/");
        typed("// a;|", "// a;");
    }
}
