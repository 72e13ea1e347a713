//! The properties that `cargo fuzz` looks for exceptions to, on some thousand texts.
//!
//! `MAUVE_FUZZ=100000 cargo test --release -p mauve-diagnostics --test main fuzz::` tries more.

#[path = "../../../tests/fuzz/properties.rs"]
mod properties;

use mauve_tests::{Random, char_boundary, models, search};
use mauve_timing::task_set::{Notation, TaskSet};

use crate::damaged::cases;

/// Words and pieces that models are made of.
const PIECES: &str = "include \"a.mal\" library l { } use m codel f ( in a : int , out b : T ) : bool shell S extends B \
    property p : double [ 0 ; 1 ] = 0.5 constant input output port require provide core C ( S ) : var x = 1 ; handler h : f \
    update = { if a < b then { x = f ( 1 ) ; } else return read ( p , x ) == new_data && ! true - 2 statemachine initial \
    state A run entry exit handle transition t if to B component architecture import instance i : C connection a . b -> [ 4 ] \
    operation deployment activity priority = 9 period = 10.5 background 0x1F \"open /* */ // \n \n \t é \u{feff} § 1e9 5ms";

/// The same for tables, configurations, messages and task sets.
const OTHER_PIECES: &str = "[codel] [program] [component] [overhead] [timing] [types.X] [generate] [lints] levels = [1e-3,1e-4] \
    \"l.f\" l.f = [1,2] K/A.run = 3 unit = \"us\" tables = [\"t.toml\"] significance = 1e-3 cpp = \"int\" header \"a/b.h\" \
    out \"out\" dispatch { } . , # ' \"\"\" \n \n \n uint8 FULL=1 string<=3 s \"x\" int32[] v geometry_msgs/Pose[<=4] p é";

const TASK_SET: &str = r#"{"unit":"us","levels":[1e-4],"significance":1e-4,"cpus":1,"task":[{"name":"i","component":"K","cpus":1,
    "priority":1,"period":90,"deadline":80.5,"jitter":0,"machine":[{"from":"u","to":"u","time":[5],"name":"t"}]},{"name":"j",
    "not_analysed":[{"reason":"r"}]}],"other":[{"name":"lan","priority":2,"period":9,"time":1}],
    "operation":[{"name":"o","provider":"i","client":"i","sends":1,"time":[1]}]}"#;

const TASK_TABLE: &str =
    "unit,us\nlevels,1e-3,1e-4\nname,period,time,priority,cpus\nlaser,100,40 43.5,20,1\nmap,200,50,10,\n";

fn tried() -> u64 {
    search::cases("MAUVE_FUZZ", 1500)
}

/// Returns some of the pieces, one after the other.
fn soup(pieces: &str, most: usize, random: &mut Random) -> String {
    let pieces: Vec<&str> = pieces.split(' ').collect();
    let soup: Vec<&str> = (0..random.below(most)).map(|_| *random.of(&pieces)).collect();
    soup.join(["", " ", "\n"][random.below(3)])
}

#[test]
fn the_task_set_is_one() {
    assert!(TaskSet::parse(TASK_SET, Notation::Json).is_ok());
    assert!(TaskSet::parse(TASK_TABLE, Notation::Csv).is_ok());
}

#[test]
fn properties_hold_for_what_stands_beside_models() {
    let letters: Vec<char> = OTHER_PIECES.chars().collect();
    cases(tried() / 5, 0, |_, random| {
        let text = soup(OTHER_PIECES, 30, random);
        properties::config(&text);
        properties::table(&text);
        properties::message(&text);
        // One number, name or sign is another.
        for text in [TASK_SET, TASK_TABLE] {
            let at = random.below(text.len());
            let other = random.of(&letters);
            properties::task_set(&format!("{}{other}{}", &text[..at], &text[at + 1..]));
        }
    });
}

#[test]
fn properties_hold_for_any_text() {
    let sample = std::fs::read_to_string(models().join("p3dx/components/navigation.mal")).unwrap();
    cases(tried(), 0, |_, random| {
        let soup = soup(PIECES, 60, random);
        // A piece of a model with some of that in it.
        let mut cut = || char_boundary(&sample, random.below(sample.len()));
        let (one, other) = (cut(), cut());
        let damaged = format!("{}{soup}{}", &sample[..one.min(other)], &sample[one.max(other)..]);
        for text in [&soup, &damaged] {
            properties::parse(text);
            properties::format(text);
            properties::check(text);
        }
        properties::reparse(&format!("{sample}\0{damaged}"));
        properties::reparse(&format!("{damaged}\0{soup}"));
    });
}
