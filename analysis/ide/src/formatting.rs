//! Formatting as in `mauve fmt`: of a file, of some lines, or while typing.

use mauve_hir::{File, ModelDb, Problem, is_model, parse};
use mauve_syntax::format::{Replacement, format, format_on_type, format_range};
use mauve_syntax::{SyntaxKind, TextRange, TextSize, tokens_at};

/// Returns the edits that format a file or a range of lines, in text order and without overlaps.
///
/// Empty for a file that is not a model, or whose text may be incomplete.
///
/// ```
/// use mauve_hir::{Database, Workspace};
/// let db = Database::default();
/// let text = "codel f( a:int ):int\n".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let edits = mauve_ide::formatting(&db, file, None);
/// assert_eq!(mauve_syntax::format::applied(file.text(&db), &edits), "codel f(a: int): int\n");
/// ```
pub fn formatting(db: &dyn ModelDb, file: File, lines: Option<TextRange>) -> Vec<Replacement> {
    if !is_certain(db, file) {
        return Vec::new();
    }
    let interrupt = || db.unwind_if_revision_cancelled();
    match lines {
        Some(lines) => format_range(parse(db, file), lines, &interrupt),
        None => format(parse(db, file), &interrupt),
    }
}

/// Returns the edits after `typed` was typed, with the cursor at `offset`: `}`, `;` or a line break, after which the editor may
/// have inserted an indentation. Empty inside a comment or a string.
pub fn formatting_on_type(db: &dyn ModelDb, file: File, offset: TextSize, typed: char) -> Vec<Replacement> {
    if !is_certain(db, file) {
        return Vec::new();
    }
    let interrupt = || db.unwind_if_revision_cancelled();
    let before = file.text(db).get(..usize::from(offset)).unwrap_or_default();
    if matches!(typed, '\n' | '\r') {
        let line = before.trim_end_matches([' ', '\t']);
        let typed = line.chars().next_back().unwrap_or(typed);
        return format_on_type(parse(db, file), TextSize::of(line), typed, &interrupt);
    }
    let token = tokens_at(&parse(db, file).syntax(), offset).left_biased();
    match token.map(|token| token.kind()) {
        Some(SyntaxKind::R_CURLY | SyntaxKind::SEMICOLON) => {
            format_on_type(parse(db, file), offset, typed, &interrupt)
        }
        _ => Vec::new(),
    }
}

/// Returns whether the file is a model whose complete text is known.
fn is_certain(db: &dyn ModelDb, file: File) -> bool {
    is_model(file.path(db)) && !matches!(file.problem(db), Some(Problem::Unknown(_) | Problem::Cut(_)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, broken_models};
    use mauve_syntax::format::{applied, formatted};

    /// What stands there when the character before the cursor was typed.
    fn typed(text: &str, letter: char, expected: &str) {
        let Fixture { db, file, offset, .. } = Fixture::new(text);
        let edits = formatting_on_type(&db, file, offset, letter);
        assert_eq!(applied(file.text(&db), &edits), expected);
    }

    #[test]
    fn a_line_break_with_the_indentation_of_an_editor() {
        typed("core C(S) {\nupdate  = {\n\t$0}\n}\n", '\n', "core C(S) {\n  update = {\n  }\n}\n");
        typed(
            "core C(S) {\r\n  var  a: int\r\n   $0\r\n}\r\n",
            '\n',
            "core C(S) {\r\n  var a: int\r\n  \r\n}\r\n",
        );
    }

    #[test]
    fn nothing_is_done_in_a_comment_or_a_string_or_for_another_character() {
        for text in
            ["// a  b;$0\n", "codel  f(): int /* é  } */;\n/* }$0 */\n", "include  \"a;$0\"\n", "use  a$0\n"]
        {
            typed(text, ';', &text.replace("$0", ""));
            typed(text, '}', &text.replace("$0", ""));
        }
    }

    #[test]
    fn a_file_of_another_kind_is_left_alone() {
        let Fixture { db, file, .. } = Fixture::new("//- /mauve.toml\n[project]\nroot  = \"a.mal\"\n");
        assert_eq!(formatting(&db, file, None), []);
        assert_eq!(formatting_on_type(&db, file, 9.into(), '\n'), []);
    }

    #[test]
    fn whatever_the_text_it_is_that_of_the_command_line_and_loses_nothing() {
        let solid = |text: &str| text.split_whitespace().collect::<String>();
        for text in broken_models(29) {
            let Fixture { db, file, .. } = Fixture::of_text(&text);
            let all = formatting(&db, file, None);
            let tidy = applied(&text, &all);
            assert_eq!(tidy, formatted(&text));
            assert_eq!(solid(&tidy), solid(&text));
            assert!(all.windows(2).all(|pair| pair[0].range.end() <= pair[1].range.start()), "{text}");
            // The lines of a range are a part of it; all lines are all of it.
            let whole = TextRange::up_to(TextSize::of(&*text));
            assert_eq!(formatting(&db, file, Some(whole)), all);
            let half = TextRange::new(0.into(), (text.len() as u32 / 2).into());
            assert!(formatting(&db, file, Some(half)).iter().all(|edit| all.contains(edit)), "{text}");
        }
    }
}
