//! Fuzzy search for declarations in all files.

use std::cmp::Reverse;
use std::collections::HashSet;

use mauve_hir::item_tree::{Data, Kind, NameRef};
use mauve_hir::{Decl, File, Location, ModelDb, Workspace, declarations, is_model, item_tree_of};
use mauve_syntax::TextRange;

use crate::document_symbols::SymbolKind;
use crate::occurrences::{kind_of, libraries, name_spaces};

/// A found declaration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundSymbol {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: SymbolKind,
    /// The library and the declaration that contain it, `library.Core`; empty at the top level.
    pub container: String,
    /// The file.
    pub file: File,
    /// The range of its name.
    pub range: TextRange,
}

/// Returns at most `limit` declarations of the workspaces' models that match `query`, the best first.
///
/// The letters of the query occur in the name in this order, in any case; best at the beginnings of words, such as `gmS` for
/// `GMappingShell`, or consecutively. Words separated by `.`, `::` or spaces may also match the library or the declaration around
/// it: `nav.plan`. An empty query matches all declarations.
///
/// Hooks are omitted: their names are keywords, and every core has them.
///
/// ```
/// use mauve_hir::{Database, Workspace};
/// let db = Database::default();
/// let text = "library robot { codel find_path(): int }".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let found = mauve_ide::workspace_symbols(&db, &[workspace], "fp", 10);
/// assert_eq!((found[0].name.as_str(), found[0].container.as_str()), ("find_path", "robot"));
/// ```
pub fn workspace_symbols(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    query: &str,
    limit: usize,
) -> Vec<FoundSymbol> {
    let words: Vec<&str> = query.split(['.', ':', ' ', '\t']).filter(|word| !word.is_empty()).collect();
    let mut search = SymbolSearch { words, found: Vec::new() };
    let mut seen = HashSet::new();
    for workspace in workspaces {
        for (path, &file) in workspace.files(db).iter() {
            if is_model(path) && seen.insert(file) {
                search.file(db, file);
            }
        }
    }
    let mut found = search.found;
    found.sort_by(|one, two| one.order().cmp(&two.order()).then_with(|| one.file_order(db, two)));
    found.truncate(limit);
    found.into_iter().map(|candidate| candidate.symbol(db)).collect()
}

struct Candidate<'db> {
    score: i32,
    name: &'db str,
    kind: SymbolKind,
    containers: [&'db str; 2],
    place: Location<'db>,
}

impl Candidate<'_> {
    fn order(&self) -> (Reverse<i32>, usize, bool, &str) {
        (Reverse(self.score), self.name.len(), !self.containers[1].is_empty(), self.name)
    }

    fn file_order(&self, db: &dyn ModelDb, other: &Self) -> std::cmp::Ordering {
        let paths = self.place.file(db).path(db).cmp(other.place.file(db).path(db));
        paths.then_with(|| self.place.range(db).start().cmp(&other.place.range(db).start()))
    }

    fn symbol(self, db: &dyn ModelDb) -> FoundSymbol {
        let containers = self.containers.into_iter().filter(|name| !name.is_empty());
        FoundSymbol {
            name: self.name.to_owned(),
            kind: self.kind,
            container: containers.collect::<Vec<_>>().join("."),
            file: self.place.file(db),
            range: self.place.range(db),
        }
    }
}

struct SymbolSearch<'a, 'db> {
    words: Vec<&'a str>,
    found: Vec<Candidate<'db>>,
}

impl<'db> SymbolSearch<'_, 'db> {
    fn add(
        &mut self,
        name: &'db str,
        kind: SymbolKind,
        containers: [&'db str; 2],
        place: impl FnOnce() -> Location<'db>,
    ) {
        let score = score(&self.words, name, containers);
        if let Some(score) = score.filter(|_| !name.is_empty()) {
            self.found.push(Candidate { score, name, kind, containers, place: place() });
        }
    }

    fn file(&mut self, db: &'db dyn ModelDb, file: File) {
        self.libraries(db, file);
        let outline = file.outline(db).declarations.iter();
        let data = &item_tree_of(db, file).data;
        for ((declaration, data), &decl) in outline.zip(data).zip(&declarations(db, file).all) {
            db.unwind_if_revision_cancelled();
            let library = declaration.library.as_ref().map_or("", |library| library.as_str());
            if declaration.kind == Kind::Use {
                continue;
            }
            self.add(declaration.name.as_str(), kind_of(declaration.kind), [library, ""], || {
                Location::name_of(decl)
            });
            self.parts(decl, data, [library, declaration.name.as_str()]);
        }
    }

    fn libraries(&mut self, db: &'db dyn ModelDb, file: File) {
        let outline = file.outline(db);
        let fits = |name: &str| !name.is_empty() && score(&self.words, name, ["", ""]).is_some();
        if !outline.libraries.iter().any(|name| fits(name)) {
            return;
        }
        for (_, name) in libraries(db, file) {
            let range = name.text_range();
            let known = outline.libraries.iter().find(|known| name.text() == known.as_str());
            if let Some(known) = known {
                let place = Location::Range(file, range.start().into(), range.end().into());
                self.add(known.as_str(), SymbolKind::Library, ["", ""], || place);
            }
        }
    }

    fn parts(&mut self, decl: Decl<'db>, data: &'db Data, containers: [&'db str; 2]) {
        for (kind, NameRef { name, id }) in name_spaces(data).into_iter().flatten() {
            if kind != SymbolKind::Parameter {
                self.add(name.as_str(), kind, containers, || Location::Source(decl, *id));
            }
        }
    }
}

/// Scores the words: at least one in the name, the others in the name or its containers. `None` if one does not match.
fn score(words: &[&str], name: &str, containers: [&str; 2]) -> Option<i32> {
    if words.is_empty() {
        return Some(0);
    }
    let mut in_name = None;
    for word in words {
        let found = fit(word, name);
        if found.is_none() && !containers.iter().any(|container| fit(word, container).is_some()) {
            return None;
        }
        in_name = in_name.max(found);
    }
    in_name
}

/// Scores `word` in an ASCII name: `None` unless its letters occur in this order.
fn fit(word: &str, name: &str) -> Option<i32> {
    const LETTER: i32 = 1;
    const IN_A_ROW: i32 = 6;
    const BEGINS_A_WORD: i32 = 5;
    const SAME_CASE: i32 = 1;
    const PREFIX: i32 = 10;
    const ALL: i32 = 20;
    let (word, name) = (word.as_bytes(), name.as_bytes());
    let mut rest = name.iter();
    if !word.iter().all(|letter| rest.any(|other| other.eq_ignore_ascii_case(letter))) {
        return None;
    }
    // The best score of all placements: `ending[at]` is the best so far with the last letter at `at`.
    let mut ending: Vec<Option<i32>> = Vec::new();
    for (index, letter) in word.iter().enumerate() {
        let mut best_before: Option<i32> = None;
        let mut next = vec![None; name.len()];
        for (at, (other, place)) in name.iter().zip(&mut next).enumerate() {
            let in_a_row = at.checked_sub(1).and_then(|before| *ending.get(before)?).map(|it| it + IN_A_ROW);
            if other.eq_ignore_ascii_case(letter) {
                let before = if index == 0 { Some(0) } else { best_before.max(in_a_row) };
                *place = before.map(|before| {
                    before
                        + LETTER
                        + if begins_a_word(name, at) { BEGINS_A_WORD } else { 0 }
                        + if other == letter { SAME_CASE } else { 0 }
                });
            }
            // A directly preceding letter continues a run, which never lowers the score.
            best_before = best_before.max(ending.get(at).copied().flatten());
        }
        ending = next;
    }
    let best = ending.into_iter().flatten().max()?;
    let is_prefix = name.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word));
    let is_all = is_prefix && name.len() == word.len();
    let bonus = [(is_prefix, PREFIX), (is_all, ALL), (word == name, ALL)];
    Some(best + bonus.into_iter().filter(|(is_so, _)| *is_so).map(|(_, bonus)| bonus).sum::<i32>())
}

fn begins_a_word(name: &[u8], at: usize) -> bool {
    let (Some(letter), before) = (name.get(at), at.checked_sub(1).and_then(|before| name.get(before))) else {
        return false;
    };
    let Some(before) = before else { return true };
    let is_capital = letter.is_ascii_uppercase()
        && (!before.is_ascii_uppercase() || name.get(at + 1).is_some_and(u8::is_ascii_lowercase));
    !before.is_ascii_alphanumeric() || is_capital || letter.is_ascii_digit() != before.is_ascii_digit()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use expect_test::{Expect, expect};

    const ROBOT: &str = r#"
//- /robot.mal
include "parts.mal"
/* 🦀 é */ architecture GridArchitecture { instance gmapping: slam.GMapping }
deployment Robot { architecture GridArchitecture activity gmapping { priority = 1 period = 1 } }
//- /parts.mal
library slam {
  codel new_grid(): int
  codel new_angle(): int
  codel wangle(): int
  shell GMappingShell { property grid_size: int constant gain: int input port map: int require gone(): int }
  core GMappingCore(GMappingShell) {
    var map_grid: int;
    handler pending: gone
    update = { var local: int; }
    statemachine { var g: int; initial state Going { transition get_map to Going } }
  }
  component GMapping(GMappingShell, GMappingCore)
}
"#;

    fn check(query: &str, expected: Expect) {
        let Fixture { db, workspace, .. } = Fixture::new(ROBOT);
        let mut shown = String::new();
        for found in workspace_symbols(&db, &[workspace], query, 6) {
            assert_eq!(&found.file.text(&db)[found.range], found.name);
            let path = found.file.path(&db).display();
            shown += &format!("{} {:?} | {} | {path}\n", found.name, found.kind, found.container);
        }
        expected.assert_eq(&shown);
    }

    #[test]
    fn the_best_matches_come_first() {
        check(
            "gmapping",
            expect![[r#"
            gmapping Instance | GridArchitecture | /robot.mal
            gmapping Activity | Robot | /robot.mal
            GMapping Component | slam | /parts.mal
            GMappingCore Core | slam | /parts.mal
            GMappingShell Shell | slam | /parts.mal
        "#]],
        );
        check(
            "gmS",
            expect![[r#"
            GMappingShell Shell | slam | /parts.mal
        "#]],
        );
        check(
            "ng",
            expect![[r#"
            new_grid Codel | slam | /parts.mal
            Going State | slam.GMappingCore | /parts.mal
            wangle Codel | slam | /parts.mal
            pending Handler | slam.GMappingCore | /parts.mal
            GMapping Component | slam | /parts.mal
            gmapping Instance | GridArchitecture | /robot.mal
        "#]],
        );
        check(
            "grid",
            expect![[r#"
            grid_size Property | slam.GMappingShell | /parts.mal
            GridArchitecture Architecture |  | /robot.mal
            new_grid Codel | slam | /parts.mal
            map_grid Variable | slam.GMappingCore | /parts.mal
        "#]],
        );
        check("zzz", expect![[""]]);
    }

    #[test]
    fn words_of_what_is_around() {
        check(
            "slam.grid",
            expect![[r#"
            grid_size Property | slam.GMappingShell | /parts.mal
            new_grid Codel | slam | /parts.mal
            map_grid Variable | slam.GMappingCore | /parts.mal
        "#]],
        );
        check(
            "core::g",
            expect![[r#"
            g Variable | slam.GMappingCore | /parts.mal
            GMappingCore Core | slam | /parts.mal
            get_map Transition | slam.GMappingCore | /parts.mal
            Going State | slam.GMappingCore | /parts.mal
            map_grid Variable | slam.GMappingCore | /parts.mal
            pending Handler | slam.GMappingCore | /parts.mal
        "#]],
        );
        check(
            "map GMC",
            expect![[r#"
            map_grid Variable | slam.GMappingCore | /parts.mal
            GMappingCore Core | slam | /parts.mal
            get_map Transition | slam.GMappingCore | /parts.mal
        "#]],
        );
    }

    #[test]
    fn libraries_and_everything() {
        check(
            "sl",
            expect![[r#"
            slam Library |  | /parts.mal
            GMappingShell Shell | slam | /parts.mal
        "#]],
        );
        let Fixture { db, workspace, .. } = Fixture::new(ROBOT);
        let all = workspace_symbols(&db, &[workspace, workspace], "", 512);
        assert_eq!(all.len(), 20);
    }

    #[test]
    fn capitals_digits_and_underscores_begin_words() {
        let words = |name: &str| -> String {
            (0..name.len())
                .filter(|&at| begins_a_word(name.as_bytes(), at))
                .map(|at| &name[at..=at])
                .collect()
        };
        assert_eq!(words("p3dx_driver"), "p3dd");
        assert_eq!(words("GMappingShell"), "GMS");
        assert_eq!(words("XMLReader"), "XR");
    }

    #[test]
    fn the_placing_is_the_best_of_all() {
        // Against all placings, tried one by one.
        fn all(word: &[u8], name: &[u8], from: usize, last: Option<usize>) -> Option<i32> {
            let Some((letter, rest)) = word.split_first() else { return Some(0) };
            let mut best = None;
            for at in from..name.len() {
                if name[at].eq_ignore_ascii_case(letter) {
                    let row = if last.is_some_and(|last| last + 1 == at) { 6 } else { 0 };
                    let word = if begins_a_word(name, at) { 5 } else { 0 };
                    let case = i32::from(name[at] == *letter);
                    best = best.max(all(rest, name, at + 1, Some(at)).map(|it| it + 1 + row + word + case));
                }
            }
            best
        }
        for name in ["abAbaB", "a_b_ab", "GMappingShell", "b", "new_angle_gain"] {
            for word in ["ab", "a", "ba", "aab", "bb", "ms", "ng", "nag", "Sh"] {
                let expected = all(word.as_bytes(), name.as_bytes(), 0, None);
                let is_prefix = name.len() >= word.len() && name[..word.len()].eq_ignore_ascii_case(word);
                let more = match is_prefix {
                    true if name == word => 50,
                    true if name.len() == word.len() => 30,
                    true => 10,
                    false => 0,
                };
                assert_eq!(fit(word, name), expected.map(|it| it + more), "{word} in {name}");
            }
        }
    }
}
