//! Editors reject an answer whose range does not contain the cursor, or misplace it: at random positions of the sample robots and
//! of random models, whole and damaged, all ranges are those that the protocol and its clients demand.
//!
//! `MAUVE_RANGES=1000 cargo test --release -p mauve-ide --test main ranges::` tries more models, `MAUVE_SEED=7` others.

use std::path::{Path, PathBuf};

use mauve_hir::{Database, File, Workspace};
use mauve_ide::{
    HierarchyItem, HoverFormat, Symbol, call_items, completions, declaration, definition, document_links,
    document_symbols, folding_ranges, highlights, hover, implementation, inlay_hints, prepare_rename,
    selection_ranges, signature_help, type_definition, type_items,
};
use mauve_syntax::{TextRange, TextSize};
use mauve_tests::{Random, char_boundary, models, random_model, texts_moved};

use crate::project_of;

type Texts = Vec<(PathBuf, String)>;

fn number(variable: &str, otherwise: u64) -> u64 {
    std::env::var(variable).ok().and_then(|it| it.parse().ok()).unwrap_or(otherwise)
}

#[test]
fn ranges_contain_the_cursor_and_each_other() {
    let mut random = Random::of_seed(number("MAUVE_SEED", 0));
    let mut answers = 0;
    for robot in ["p3dx", "p3dx_entry"] {
        answers += check(texts_moved(&models().join(robot), "/"), 150, &mut random);
    }
    for seed in 0..number("MAUVE_RANGES", 25) {
        let mut texts = random_model(seed).texts();
        damage(&mut texts, &mut random);
        answers += check(texts, 40, &mut random);
    }
    assert!(answers > 1000, "{answers} answers with ranges");
}

/// Writes letters of several bytes, a name at the end, a line end of another kind, or cuts a text off.
fn damage(texts: &mut Texts, random: &mut Random) {
    for (path, text) in texts.iter_mut() {
        let at = char_boundary(text, random.below(text.len() + 1));
        match random.below(5) {
            0 => text.truncate(at),
            1 => text.insert_str(at, "\u{1f980}é"),
            2 if path.extension().is_some_and(|it| it == "mal") => text.push_str("codel \u{e9}last(): int"),
            3 => *text = text.replace("\r\n", "\n").replace('\n', "\r\n"),
            _ => {}
        }
    }
}

/// Returns the number of answers that have a range.
fn check(texts: Texts, tries: usize, random: &mut Random) -> usize {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), texts.iter().cloned());
    let mut answers = 0;
    for (path, text) in &texts {
        let file = workspace.file(&db, path).unwrap();
        of_file(&db, workspace, file);
        let words: Vec<usize> = text
            .char_indices()
            .map(|(at, _)| at)
            .filter(|&at| {
                text[..at].ends_with(char::is_alphanumeric) && !text[at..].starts_with(char::is_alphanumeric)
            })
            .chain([text.len()])
            .collect();
        for number in 0..tries.div_ceil(texts.len()).max(4) {
            // Half of them at the end of a word.
            let at = if number % 2 == 0 { *random.of(&words) } else { random.below(text.len() + 1) };
            let offset = TextSize::new(char_boundary(text, at) as u32);
            answers += at_offset(&db, workspace, file, path, offset);
        }
    }
    answers
}

fn at_offset(db: &Database, workspace: Workspace, file: File, path: &Path, offset: TextSize) -> usize {
    let project = project_of(db, workspace, file);
    let text = file.text(db);
    let mut ranges: Vec<(&str, TextRange)> = Vec::new();
    ranges.extend(hover(db, Some(project), file, offset, HoverFormat::Text).map(|it| ("hover", it.range)));
    for (what, found) in [
        ("definition", definition(db, project, file, offset)),
        ("declaration", declaration(db, project, file, offset)),
        ("type definition", type_definition(db, project, file, offset)),
        ("implementation", implementation(db, project, file, offset)),
    ] {
        for target in found.iter().flat_map(|it| &it.targets) {
            assert!(target.range.contains_range(target.name), "{what} in {}", path.display());
        }
        ranges.extend(found.map(|it| (what, it.origin)));
    }
    let renamed = prepare_rename(db, &[workspace], file, offset).ok();
    if let Some(renamed) = &renamed {
        assert_eq!(&text[std::ops::Range::<usize>::from(renamed.range)], renamed.name, "{}", path.display());
    }
    ranges.extend(renamed.map(|it| ("rename", it.range)));
    let highlights = highlights(db, project, file, offset);
    let has_cursor = highlights.iter().any(|it| it.range.contains_inclusive(offset));
    assert!(highlights.is_empty() || has_cursor, "no highlight at {offset:?} of {}", path.display());
    let selected = selection_ranges(db, file, offset);
    let is_model = mauve_hir::is_model(path);
    assert!(!selected.is_empty() || !is_model, "no selection at {offset:?} of {}", path.display());
    for pair in selected.windows(2) {
        assert!(pair[1].contains_range(pair[0]) && pair[0] != pair[1], "{pair:?} of {}", path.display());
    }
    ranges.extend(selected.into_iter().map(|it| ("selection", it)));
    for item in completions(db, project, file, offset).items {
        let word = &text[std::ops::Range::<usize>::from(item.replaced)];
        assert!(!word.contains('\n'), "{:?} replaces {word:?}", item.label);
        let is_apart = |range: TextRange| range.intersect(item.replaced).is_none_or(TextRange::is_empty);
        assert!(item.more.iter().all(|it| is_apart(it.range)), "{:?} of {}", item.more, path.display());
        ranges.push(("completion", item.replaced));
    }
    let items =
        call_items(db, project, file, offset).into_iter().chain(type_items(db, project, file, offset));
    for HierarchyItem { range, name_range, name, .. } in items {
        assert!(range.contains_range(name_range), "{name}");
    }
    if let Some(signature) = signature_help(db, project, file, offset) {
        let is_in = |range: &TextRange| signature.label.get(std::ops::Range::<usize>::from(*range)).is_some();
        assert!(signature.parameters.iter().all(is_in), "{signature:?}");
    }
    for (what, range) in &ranges {
        assert!(
            range.contains_inclusive(offset) && text.get(std::ops::Range::<usize>::from(*range)).is_some(),
            "the range of a {what}, {range:?}, is not at {offset:?} of {}:\n{text}",
            path.display()
        );
    }
    ranges.len()
}

/// The ranges of answers about a whole file.
fn of_file(db: &Database, workspace: Workspace, file: File) {
    let (text, path) = (file.text(db), file.path(db).display());
    let mut open: Vec<(TextRange, Symbol)> = document_symbols(db, file)
        .into_iter()
        .map(|it| (TextRange::up_to(TextSize::of(&**text)), it))
        .collect();
    while let Some((parent, symbol)) = open.pop() {
        assert!(symbol.range.contains_range(symbol.name_range), "{}: {symbol:?}", path);
        assert!(parent.contains_range(symbol.range), "{}: {symbol:?} in {parent:?}", path);
        open.extend(symbol.children.into_iter().map(|it| (symbol.range, it)));
    }
    for fold in folding_ranges(db, file) {
        let folded = text.get(std::ops::Range::<usize>::from(fold.range));
        assert!(folded.is_some_and(|it| it.contains('\n')), "{}: {fold:?}", path);
    }
    let project = project_of(db, workspace, file);
    let links = document_links(db, workspace, Some(project), file);
    for pair in links.windows(2) {
        assert!(pair[0].range.end() <= pair[1].range.start(), "{}: {pair:?}", path);
    }
    let half = TextSize::new(char_boundary(text, text.len() / 2) as u32);
    let asked = TextRange::up_to(half);
    for hint in inlay_hints(db, project, file, asked, Default::default(), &Default::default()) {
        assert!(asked.contains_inclusive(hint.offset), "{}: {hint:?}", path);
    }
}
