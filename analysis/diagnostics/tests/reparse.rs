//! What the database makes of an edited text, and reads from it, is what a database makes that never saw another text.

use std::path::PathBuf;

use mauve_hir::{Database, File, item_tree_of, parse, source_map};
use mauve_tests::{Random, models};

const PIECES: [&str; 12] =
    ["x", " ", "\n", "{", "}", "(", ";", "\"", "/*", "state S { }", "run = { f(); }", "// "];

#[test]
fn edits_of_two_files_by_turns() {
    let texts = ["p3dx/components/navigation.mal", "p3dx/deployment.mal"]
        .map(|path| std::fs::read_to_string(models().join(path)).unwrap());
    let mut db = Database::default();
    let files = texts.clone().map(|text| File::new(&db, PathBuf::from("/a.mal"), text.into(), None));
    let mut random = Random(1);
    for round in 0..300 {
        let which = random.below(2);
        let mut text = files[which].text(&db).to_string();
        if round % 30 == 29 {
            text.clone_from(&texts[which]);
        }
        let at = text.char_indices().nth(random.below(text.len())).map_or(text.len(), |(at, _)| at);
        match random.below(3) {
            0 => text.truncate(at + text[at..].find('\n').unwrap_or(0)),
            1 => text.replace_range(at..at + text[at..].find(' ').unwrap_or(0), ""),
            _ => text.insert_str(at, PIECES[random.below(PIECES.len())]),
        }
        files[which].set_text(&mut db, text.clone().into());
        // A reader in a worker, or nobody, asks first.
        if random.below(2) == 0 {
            let reader = db.clone();
            std::thread::spawn(move || parse(&reader, files[which]).errors().len()).join().unwrap();
        }
        if random.below(3) > 0 {
            let fresh = Database::default();
            let file = File::new(&fresh, PathBuf::from("/a.mal"), text.into(), None);
            assert_eq!(parse(&db, files[which]), parse(&fresh, file));
            assert_eq!(item_tree_of(&db, files[which]), item_tree_of(&fresh, file));
            assert_eq!(source_map(&db, files[which]), source_map(&fresh, file));
        }
    }
}
