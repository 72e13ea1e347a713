//! Hovers on the keys of `mauve.toml` and of timing tables.

use mauve_hir::config_keys::SECTIONS;
use mauve_hir::{File, ModelDb, Project, config_file};
use mauve_syntax::TextSize;
use mauve_timing::table_keys::KEYS;
use mauve_timing::toml_key::{TomlKey, ValueKind, keys_to_write};
use mauve_wcrt::table_files;

use super::Hover;
use crate::toml_place::key_at;

/// Returns what the key at `offset` means.
pub(super) fn of_key(db: &dyn ModelDb, project: Project<'_>, file: File, offset: TextSize) -> Option<Hover> {
    let workspace = project.workspace(db);
    let is_config = config_file(db, workspace) == Some(file);
    if !is_config && !table_files(db, workspace).files.contains(&file) {
        return None;
    }
    let (section, key, range) = key_at(file.text(db), offset)?;
    let found = if is_config { meaning(&SECTIONS, &section, &key) } else { meaning(&KEYS, &section, &key) };
    let page = if is_config { page_of(&section, &key) } else { "timing-tables.md" };
    Some(Hover { range, markdown: format!("{}\nReference: {page}\n", found?) })
}

/// Returns the page of the reference that explains a key of `mauve.toml`.
fn page_of(section: &str, key: &str) -> &'static str {
    match section.split('.').next() {
        Some("locks") => "computer.md",
        Some("platform") if section == "platform.other" || matches!(key, "other" | "rt_throttling") => {
            "computer.md"
        }
        Some("chains") => "chains.md",
        Some("ros2" | "host" | "link") => "ros2.md",
        Some("timing" | "deployment") if matches!(key, "significance" | "required" | "dependent") => {
            "levels.md"
        }
        _ => "configuration.md",
    }
}

fn meaning<K: ValueKind>(keys: &'static [TomlKey<K>], section: &str, key: &str) -> Option<String> {
    let found = keys_to_write(keys, section).find(|it| it.name == key)?;
    let default = found.default.map_or_else(String::new, |it| format!("\n\nDefault: `{it}`"));
    Some(format!("{}{default}\n", found.documentation))
}

#[cfg(test)]
mod tests {
    use crate::fixture::Fixture;

    fn hover(config: &str) -> Option<String> {
        let model = "use std_msgs
shell S { output port state: String }
core C(S) { update = { } }
component Driver(S, C)
architecture A { instance left: Driver }
deployment D { architecture A  activity left { priority = 1  period = 100 } }
//- /mauve.toml
";
        Some(Fixture::new(&format!("{model}{config}\n")).hover()?.markdown)
    }

    #[test]
    fn keys_of_the_configuration_and_of_tables_in_it() {
        let shown = |config| hover(config).unwrap_or_default();
        let depth = shown("[ros2]\ntopics = { \"left.state\" = { name = \"/s\", de$0pth = 2 } }");
        assert_eq!(
            depth,
            "How many samples are kept, and moved in a period of the gateway at most.\n\nDefault: `1`\n\nReference: ros2.md\n"
        );
        assert_eq!(shown("[ros2.topics]\n\"left.state\" = { de$0pth = 2 }"), depth);
        assert!(shown("[ros2]\ntop$0ics = { }").starts_with("The topics of ports"));
        for (key, page) in [
            ("cp$0us = 2", "configuration.md"),
            ("rt_throt$0tling = true", "computer.md"),
            ("[[platform.other]]\nti$0me = \"1 ms\"", "computer.md"),
        ] {
            let found = hover(&format!("[platform]\n{key}")).unwrap_or_default();
            assert!(found.ends_with(&format!("Reference: {page}\n")), "{key}: {found}");
        }
        assert!(shown("ros2.gateway = { per$0iod = \"1 ms\" }").starts_with("Its period"));
        let port = shown("[ros2]\ntopics = { \"left.st$0ate\" = { name = \"/s\" } }");
        assert!(port.contains("left.state publishes /s: std_msgs/msg/String"), "{port}");
        for config in
            ["[ros2]\n\"dom$0ain\" = 1", "[ros2]\nname$0 = 1", "[ros2]\ndomain = 1 # dom$0ain", "[ro$0s2]"]
        {
            assert_eq!(hover(config), None, "{config}");
        }
    }

    #[test]
    fn keys_of_timing_tables() {
        let shown =
            |table: &str| hover(&format!("timing.tables = [\"times.toml\"]\n//- /times.toml\n{table}"));
        assert_eq!(
            shown("un$0it = \"us\""),
            Some(
                "The unit of all times in this table.\n\nDefault: `\"ms\"`\n\nReference: timing-tables.md\n"
                    .into()
            )
        );
        let dispatch = Some("To dispatch a job.\n\nDefault: `0`\n\nReference: timing-tables.md\n".into());
        assert_eq!(shown("[overhead]\ndis$0patch = 1"), dispatch);
        assert_eq!(
            shown("[measured.\"a\"]\nbyt$0es = 1"),
            Some("Their size together: it grows with each run.\n\nReference: timing-tables.md\n".into())
        );
        assert_eq!([shown("[codel]\nun$0it = 1"), shown("un$0its = 1")], [None, None]);
    }
}
