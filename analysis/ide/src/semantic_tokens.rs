//! Semantic tokens: the kinds of names, which a lexical grammar cannot know.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use mauve_hir::item_tree::FeatureKind;
use mauve_hir::{
    Builtin, Decl, File, Location, ModelDb, Project, built_in_type, declarations, is_model, parse, projects,
    shell, source_map,
};
use mauve_syntax::keywords::{BACKGROUND, TruthValue};
use mauve_syntax::{NodeOrToken, SyntaxKind, SyntaxToken, TextRange, TextSize};

use crate::document_symbols::SymbolKind;
use crate::occurrences::{
    Definition, FoundName, OccurrenceRole, names_in, occurrences_of, outside_declarations, segment,
};

/// A semantic token, on one line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SemanticToken {
    /// Its location.
    pub range: TextRange,
    /// Its kind.
    pub kind: TokenKind,
    /// Its modifiers.
    pub modifiers: TokenModifiers,
}

/// The kind of a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TokenKind {
    /// The name of a definition.
    Name(SymbolKind),
    /// `read`, `write`, `status`, `send`, `collect`.
    Function,
    /// A field of an activity, such as `period`.
    Field,
    /// `new_data`, `success`, …
    Status,
    /// A keyword, `true` or `false`.
    Keyword,
    /// A comment, or a line of one.
    Comment,
    /// A string.
    String,
    /// A number.
    Number,
    /// `+`, `->`, `=`, …
    Operator,
}

/// A modifier of a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TokenModifier {
    /// A declaration.
    Declaration,
    /// The definition of an operation that a shell declares.
    Definition,
    /// A constant.
    Readonly,
    /// A write.
    Modification,
    /// A word of the language.
    DefaultLibrary,
    /// A port that is read.
    Input,
    /// A port that is written.
    Output,
    /// A required operation.
    Required,
    /// A provided operation.
    Provided,
}

/// A set of modifiers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, salsa::SalsaValue)]
pub struct TokenModifiers(u16);

impl TokenModifiers {
    /// Adds a modifier.
    #[must_use]
    pub fn with(self, modifier: TokenModifier) -> TokenModifiers {
        TokenModifiers(self.0 | 1 << modifier as u16)
    }

    /// Returns whether a modifier is set.
    pub fn has(self, modifier: TokenModifier) -> bool {
        self.0 & 1 << modifier as u16 != 0
    }
}

/// Returns the tokens of a file that touch `range`, if given, in text order and without overlaps.
///
/// Without `all`, only resolved names. With `all`, also keywords, comments, strings, numbers and operators, for editors without a
/// grammar. In a table or a configuration, which all projects of a workspace share, the first of them that resolves a name decides.
///
/// ```
/// use mauve_hir::{Database, Workspace, projects};
/// let db = Database::default();
/// let text = "shell S { input port goal: int }".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let tokens = mauve_ide::semantic_tokens(&db, Some(projects(&db, workspace)[0]), file, None, false);
/// let texts: Vec<&str> = tokens.iter().map(|token| &file.text(&db)[token.range]).collect();
/// assert_eq!(texts, ["S", "goal", "int"]);
/// ```
pub fn semantic_tokens(
    db: &dyn ModelDb,
    project: Option<Project<'_>>,
    file: File,
    range: Option<TextRange>,
    all: bool,
) -> Vec<SemanticToken> {
    let is_asked = |token: TextRange| range.is_none_or(|range| touches(range, token));
    let mut found = Vec::new();
    for project in project.into_iter().flat_map(|project| resolving(db, project, file)) {
        names(db, project, file, is_asked, &mut found);
    }
    if all && is_model(file.path(db)) {
        let words = parse(db, file).syntax().descendants_with_tokens().filter_map(NodeOrToken::into_token);
        for token in words {
            db.unwind_if_revision_cancelled();
            word(&token, &mut found);
        }
    }
    found.retain(|token| !token.range.is_empty() && is_asked(token.range));
    // Of two tokens with one range, the first wins: a resolved name before the kind of the word.
    found.sort_by_key(|token| token.range.start());
    let mut end = TextSize::default();
    found.retain(|token| {
        let is_free = end <= token.range.start();
        end = if is_free { token.range.end() } else { end };
        is_free
    });
    found
}

/// Returns a value that changes whenever the kinds of a file's names change: with the same text and the same value, the tokens are
/// the same.
pub fn meanings_of_names(db: &dyn ModelDb, project: Project<'_>, file: File) -> u64 {
    let mut hasher = DefaultHasher::new();
    for project in resolving(db, project, file) {
        if is_model(file.path(db)) {
            for &decl in &declarations(db, file).all {
                for it in occurrences_of(db, project, decl) {
                    (it.id, it.segment, it.kind).hash(&mut hasher);
                }
                modifiers_in(db, project, decl).hash(&mut hasher);
            }
        } else {
            names_in(db, project, file).iter().for_each(|it| (it.range, it.kind).hash(&mut hasher));
        }
    }
    hasher.finish()
}

/// Returns the projects that resolve the names of a file.
fn resolving<'db>(db: &'db dyn ModelDb, project: Project<'db>, file: File) -> Vec<Project<'db>> {
    if is_model(file.path(db)) { vec![project] } else { projects(db, project.workspace(db)).clone() }
}

fn touches(range: TextRange, token: TextRange) -> bool {
    token.start() < range.end() && range.start() < token.end()
}

/// Returns the modifiers of the names of a declaration, in their order. An edit elsewhere recomputes none of them.
#[salsa::tracked(returns(ref))]
fn modifiers_in<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<TokenModifiers> {
    let names = occurrences_of(db, project, of).iter();
    names.map(|it| modifiers(db, &it.definition, it.kind, it.role)).collect()
}

fn names(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    is_asked: impl Fn(TextRange) -> bool,
    found: &mut Vec<SemanticToken>,
) {
    let token = |it: FoundName<'_>| SemanticToken {
        range: it.range,
        kind: TokenKind::Name(it.kind),
        modifiers: modifiers(db, &it.definition, it.kind, it.role),
    };
    if !is_model(file.path(db)) {
        let names = names_in(db, project, file).into_iter().filter(|it| it.kind != SymbolKind::File);
        found.extend(names.map(token));
        return;
    }
    let outside = outside_declarations(db, project, file).into_iter();
    found.extend(outside.filter(|it| it.kind != SymbolKind::File).map(token));
    let text: &str = file.text(db);
    for (&decl, map) in declarations(db, file).all.iter().zip(&source_map(db, file).declarations) {
        if !is_asked(map.range) {
            continue;
        }
        let names = occurrences_of(db, project, decl).iter().zip(modifiers_in(db, project, decl));
        found.extend(names.filter_map(|(it, &modifiers)| {
            db.unwind_if_revision_cancelled();
            let range = segment(text, map.range_of(it.id)?, it.segment)?;
            Some(SemanticToken { range, kind: TokenKind::Name(it.kind), modifiers })
        }));
    }
}

fn modifiers(
    db: &dyn ModelDb,
    definition: &Definition<'_>,
    kind: SymbolKind,
    role: OccurrenceRole,
) -> TokenModifiers {
    let of_role = match role {
        OccurrenceRole::Declaration => Some(TokenModifier::Declaration),
        OccurrenceRole::Definition => Some(TokenModifier::Definition),
        OccurrenceRole::Write | OccurrenceRole::ReadWrite => Some(TokenModifier::Modification),
        OccurrenceRole::Read | OccurrenceRole::Call | OccurrenceRole::Mention => None,
    };
    let own = match (kind, definition) {
        (SymbolKind::Constant, _) => Some(TokenModifier::Readonly),
        (SymbolKind::Type, Definition::Type(name)) if built_in_type(name).is_some() => {
            Some(TokenModifier::DefaultLibrary)
        }
        (SymbolKind::Port | SymbolKind::Operation, Definition::At(Location::Source(of, id))) => {
            let mut features = shell(db, *of).into_iter().flat_map(|shell| &shell.features);
            match features.find(|feature| feature.name.id == *id).map(|feature| feature.kind) {
                Some(FeatureKind::Input) => Some(TokenModifier::Input),
                Some(FeatureKind::Output) => Some(TokenModifier::Output),
                Some(FeatureKind::Required) => Some(TokenModifier::Required),
                Some(FeatureKind::Provided) => Some(TokenModifier::Provided),
                Some(FeatureKind::Constant | FeatureKind::Property) | None => None,
            }
        }
        _ => None,
    };
    of_role.into_iter().chain(own).fold(TokenModifiers::default(), TokenModifiers::with)
}

fn word(token: &SyntaxToken, found: &mut Vec<SemanticToken>) {
    let mut modifiers = TokenModifiers::default();
    let parent = token.parent();
    let parent = parent.as_ref();
    let kind = match token.kind() {
        SyntaxKind::BLOCK_COMMENT => {
            // One token per line: not every editor supports tokens of several lines.
            let mut start = token.text_range().start();
            for line in token.text().split_inclusive('\n') {
                let range = TextRange::at(start, TextSize::of(line.trim_end_matches(['\r', '\n'])));
                found.push(SemanticToken { range, kind: TokenKind::Comment, modifiers });
                start += TextSize::of(line);
            }
            return;
        }
        SyntaxKind::LINE_COMMENT => TokenKind::Comment,
        SyntaxKind::STRING | SyntaxKind::UNTERMINATED_STRING => TokenKind::String,
        SyntaxKind::INT_NUMBER | SyntaxKind::FLOAT_NUMBER | SyntaxKind::BAD_NUMBER => TokenKind::Number,
        kind if (SyntaxKind::ARROW..=SyntaxKind::PIPE2).contains(&kind) => TokenKind::Operator,
        _ if parent.is_some_and(|it| matches!(it.kind(), SyntaxKind::NAME | SyntaxKind::NAME_REF)) => {
            let around = parent.and_then(|parent| parent.parent());
            let is_value =
                around.as_ref().and_then(|it| it.parent()).is_some_and(|it| it.kind() == SyntaxKind::FIELD);
            modifiers = modifiers.with(TokenModifier::DefaultLibrary);
            match around.map(|around| around.kind()) {
                Some(SyntaxKind::FIELD) => TokenKind::Field,
                Some(SyntaxKind::NAME_EXPR) if is_value && token.text() == BACKGROUND => TokenKind::Keyword,
                Some(SyntaxKind::CALL_EXPR) if Builtin::of_name(token.text()).is_some() => {
                    TokenKind::Function
                }
                _ => return,
            }
        }
        kind if TruthValue::from_kind(kind).is_some() => TokenKind::Keyword,
        kind if kind.is_word() && parent.is_some_and(|it| it.kind() == SyntaxKind::LITERAL) => {
            modifiers = modifiers.with(TokenModifier::Readonly).with(TokenModifier::DefaultLibrary);
            TokenKind::Status
        }
        // The unit of a rate.
        SyntaxKind::IDENT if parent.is_some_and(|it| it.kind() == SyntaxKind::FIELD) => TokenKind::Number,
        SyntaxKind::IDENT => return,
        kind if kind.is_word() && parent.is_some_and(|it| it.kind() != SyntaxKind::ERROR) => {
            TokenKind::Keyword
        }
        _ => return,
    };
    found.push(SemanticToken { range: token.text_range(), kind, modifiers });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, broken, project_of, project_with, sample_models};
    use expect_test::{Expect, expect};
    use mauve_hir::{Database, Workspace};

    const MODIFIERS: [TokenModifier; 9] = [
        TokenModifier::Declaration,
        TokenModifier::Definition,
        TokenModifier::Readonly,
        TokenModifier::Modification,
        TokenModifier::DefaultLibrary,
        TokenModifier::Input,
        TokenModifier::Output,
        TokenModifier::Required,
        TokenModifier::Provided,
    ];

    fn check(fixture: &str, all: bool, expected: Expect) {
        let Fixture { db, workspace, file, .. } = Fixture::new(fixture);
        let text: &str = file.text(&db);
        let (mut shown, mut last) = (String::new(), 0);
        for token in semantic_tokens(&db, project_with(&db, workspace, file), file, None, all) {
            let line = text[..token.range.start().into()].matches('\n').count() + 1;
            let modifiers = MODIFIERS.iter().filter(|it| token.modifiers.has(**it));
            let modifiers: String = modifiers.map(|it| format!(" {it:?}")).collect();
            let kind = match token.kind {
                TokenKind::Name(kind) => format!("{kind:?}"),
                kind => format!("{kind:?}!"),
            };
            shown += match last {
                0 => "",
                _ if line == last => " · ",
                _ => "\n",
            };
            last = line;
            shown += &format!("{} {kind}{modifiers}", &text[token.range]);
        }
        expected.assert_eq(&shown);
    }

    const ROBOT: &str = r#"
//- /parts.mal
library parts {
  use std_msgs
  codel shoot(in a: int, out n: double): std_msgs.String
  shell Laser {
    constant k: int = 2
    property rate: ArPtr = k * 2
    input port in: int
    output port out: int
    require wipe(n: int): int
    provide clear(): int
  }
  core LaserCore(Laser) {
    var n: int
    handler h: wipe
    provide clear(): int = { return n; }
    update = { /* 🦀 é */ read(in, n); write(out, n + rate + unknown); h = send(wipe); clear(); shoot(n, n); }
  }
  core Other(Laser) { statemachine { initial state A { transition t if true to A } } }
  component LaserC(Laser, LaserCore)
}
//- /robot.mal
include "parts.mal"
architecture A { instance laser: parts.LaserC connection laser.out -> laser.in property laser.rate = 3 }
deployment D { architecture A activity laser { priority = 1 period = 100 } }
//- /mauve.toml
project.root = "robot.mal"
timing.tables = ["t.toml"]
types.ArPtr.cpp = "Ar*"
//- /t.toml
codel."parts.shoot" = 3
"#;

    fn of(path: &str, all: bool, expected: Expect) {
        let header = format!("//- {path}\n");
        check(&ROBOT.replace(&header, &format!("{header}$0")), all, expected);
    }

    #[test]
    fn names_of_parts() {
        of(
            "/parts.mal",
            false,
            expect![[r#"
                parts Library Declaration
                std_msgs Package
                shoot Codel Declaration · a Parameter Declaration · int Type DefaultLibrary · n Parameter Declaration · double Type DefaultLibrary · std_msgs Package · String Message
                Laser Shell Declaration
                k Constant Declaration Readonly · int Type DefaultLibrary
                rate Property Declaration · ArPtr Type · k Constant Readonly
                in Port Declaration Input · int Type DefaultLibrary
                out Port Declaration Output · int Type DefaultLibrary
                wipe Operation Declaration Required · n Parameter Declaration · int Type DefaultLibrary · int Type DefaultLibrary
                clear Operation Declaration Provided · int Type DefaultLibrary
                LaserCore Core Declaration · Laser Shell
                n Variable Declaration · int Type DefaultLibrary
                h Handler Declaration · wipe Operation Required
                clear Operation Definition Provided · int Type DefaultLibrary · n Variable
                in Port Input · n Variable Modification · out Port Modification Output · n Variable · rate Property · h Handler Modification · wipe Operation Required · clear Operation Provided · shoot Codel · n Variable · n Variable Modification
                Other Core Declaration · Laser Shell · A State Declaration · t Transition Declaration · A State
                LaserC Component Declaration · Laser Shell · LaserCore Core"#]],
        );
    }

    #[test]
    fn names_of_architectures_and_deployments() {
        of(
            "/robot.mal",
            false,
            expect![[r#"
                A Architecture Declaration · laser Instance Declaration · parts Library · LaserC Component · laser Instance · out Port Output · laser Instance · in Port Input · laser Instance · rate Property Modification
                D Deployment Declaration · A Architecture · laser Instance"#]],
        );
    }

    #[test]
    fn names_in_tables() {
        of("/t.toml", false, expect!["parts Library · shoot Codel"]);
    }

    #[test]
    fn each_word_has_its_type() {
        check(
            "
use read // é
core C(S) {
  update = { var state: int = 1 + 2.5; read(p, q); /* 🦀
    two */ if status(p) != new_data && true then { f(); } else {} } }
deployment D { architecture A activity a { priority = background period = 0x10 } }
include \"a.mal\"
",
            true,
            expect![[r#"
                use Keyword! · read Package · // é Comment!
                core Keyword! · C Core Declaration
                update Keyword! · = Operator! · var Keyword! · state Variable Declaration · int Type DefaultLibrary · = Operator! · 1 Number! · + Operator! · 2.5 Number! · read Function! DefaultLibrary · /* 🦀 Comment!
                    two */ Comment! · if Keyword! · status Function! DefaultLibrary · != Operator! · new_data Status! Readonly DefaultLibrary · && Operator! · true Keyword! · then Keyword! · else Keyword!
                deployment Keyword! · D Deployment Declaration · architecture Keyword! · activity Keyword! · priority Field! DefaultLibrary · = Operator! · background Keyword! DefaultLibrary · period Field! DefaultLibrary · = Operator! · 0x10 Number!
                include Keyword! · "a.mal" String!"#]],
        );
    }

    fn set(db: &mut Database, file: File, text: &str) {
        file.set_text(db, text.into());
    }

    #[test]
    fn what_names_mean_follows_other_files() {
        let Fixture { mut db, workspace, file, .. } = Fixture::new(&ROBOT.replace("include", "$0include"));
        let hash = |db: &Database| meanings_of_names(db, project_of(db, workspace, file), file);
        let before = hash(&db);
        let other = workspace.file(&db, "/parts.mal".as_ref()).unwrap();
        let text = other.text(&db).to_string();
        set(&mut db, other, &text.replace("library", "// a line\nlibrary"));
        assert_eq!(hash(&db), before);
        set(&mut db, other, &text.replace("output port out", "output port oof"));
        assert_ne!(hash(&db), before);
    }

    #[test]
    fn whatever_the_text_they_are_in_order_and_in_lines() {
        let files = sample_models();
        let db = &mut Database::default();
        let folder = mauve_tests::models();
        let workspace = Workspace::of_texts(db, folder, files.clone());
        for (path, text) in files.iter().filter(|(path, _)| path.ends_with("components/navigation.mal")) {
            let file = workspace.file(db, path).unwrap();
            for text in broken(text, 37) {
                set(db, file, &text);
                for all in [false, true] {
                    let tokens = semantic_tokens(db, project_with(db, workspace, file), file, None, all);
                    for pair in tokens.windows(2) {
                        assert!(pair[0].range.end() <= pair[1].range.start(), "{pair:?} {text}");
                    }
                    for token in &tokens {
                        assert!(!token.range.is_empty() && !text[token.range].contains('\n'), "{token:?}");
                    }
                    // A part of it is a part of them.
                    let third = text.len() as u32 / 3;
                    let id = TextRange::new(third.into(), (third * 2).into());
                    let touching: Vec<_> =
                        tokens.iter().copied().filter(|token| touches(id, token.range)).collect();
                    assert_eq!(
                        semantic_tokens(db, project_with(db, workspace, file), file, Some(id), all),
                        touching
                    );
                }
            }
            set(db, file, text);
        }
    }
}
