//! The user's editor settings. Project settings are in `mauve.toml`.
//!
//! | key | value | means |
//! |---|---|---|
//! | `mauve.timing.significance` | a level such as `1e-4`, or `null` | shows everything at this level; with `null`, at that of `mauve.toml` |
//! | `mauve.codeLens.enable` | `true` or `false` | shows lenses |
//! | `mauve.timing.tightSlack` | percent, 0 to 100 | slack below this share of the deadline is shown as tight; 10 by default |
//! | `mauve.inlayHints.responseTimes` | `true` or `false` | shows response times beside activities, and how long data takes beside connections |
//! | `mauve.inlayHints.loads` | `true` or `false` | shows the load of CPUs beside deployments |
//! | `mauve.inlayHints.programTimes` | `true` or `false` | shows what programs, states and transitions take |
//! | `mauve.inlayHints.values` | `true` or `false` | shows the values that instances and settings override |
//!
//! They come in three ways, with the same keys: as initialization options, as the answer to `workspace/configuration`, and
//! with `workspace/didChangeConfiguration`. What one does not say, an earlier one may have said.

use mauve_ide::HintOptions;
use mauve_timing::Level;
use serde_json::Value;

/// The name of the section.
pub(crate) const SECTION: &str = "mauve";

/// The values of the settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Settings {
    pub(crate) significance: Option<Level>,
    pub(crate) lenses: bool,
    pub(crate) hints: HintOptions,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { significance: None, lenses: true, hints: HintOptions::default() }
    }
}

const SIGNIFICANCE: &str = "timing.significance";
const TIGHT_SLACK: &str = "timing.tightSlack";

/// A key that is `true` or `false`, and its field.
type Switch = (&'static str, fn(&mut Settings) -> &mut bool);

const SWITCHES: [Switch; 5] = [
    ("codeLens.enable", |it| &mut it.lenses),
    ("inlayHints.responseTimes", |it| &mut it.hints.response_times),
    ("inlayHints.loads", |it| &mut it.hints.loads),
    ("inlayHints.programTimes", |it| &mut it.hints.program_times),
    ("inlayHints.values", |it| &mut it.hints.values),
];

/// Subsections that editors read themselves.
const OF_EDITORS: [&str; 3] = ["decorations", "server", "trace"];

impl Settings {
    /// Reads the client's settings, with or without the section around them; invalid and missing ones keep their
    /// values in `before`. Returns messages for the user about errors.
    pub(crate) fn read(given: &Value, before: Settings) -> (Settings, Vec<String>) {
        let given = given.get(SECTION).filter(|section| section.is_object()).unwrap_or(given);
        let mut settings = before;
        let mut problems = Vec::new();
        for (key, value) in leaves(given) {
            if OF_EDITORS.iter().any(|known| key == *known || is_below(&key, known)) {
                continue;
            }
            if let Err(problem) = settings.set(&key, value) {
                problems.push(format!("The setting `{SECTION}.{key}` {problem}."));
            }
        }
        (settings, problems)
    }

    fn set(&mut self, key: &str, value: &Value) -> Result<(), String> {
        if key == SIGNIFICANCE {
            let number = value.as_f64().or_else(|| value.as_str()?.trim().parse().ok());
            let level = number.and_then(Level::from_f64);
            if level.is_none() && !value.is_null() {
                return Err(format!("is {value}: expected a number between 0 and 1, such as 1e-4, or null"));
            }
            self.significance = level;
            return Ok(());
        }
        if key == TIGHT_SLACK {
            let percent =
                value.as_u64().and_then(|percent| u32::try_from(percent).ok()).filter(|it| *it <= 100);
            match percent {
                Some(percent) => self.hints.tight_slack = percent,
                None if value.is_null() => {}
                None => return Err(format!("is {value}: expected a whole number from 0 to 100")),
            }
            return Ok(());
        }
        let switch = SWITCHES.iter().find(|(known, _)| *known == key);
        match (switch, value.as_bool()) {
            _ if value.is_null() => Ok(()),
            (Some((_, switch)), Some(value)) => {
                *switch(self) = value;
                Ok(())
            }
            (Some(_), None) => Err(format!("is {value}: expected true or false")),
            (None, _) => {
                let keys = [SIGNIFICANCE, TIGHT_SLACK].into_iter().chain(SWITCHES.map(|(key, _)| key));
                let known = keys.clone().collect::<Vec<_>>().join(", ");
                let near = mauve_syntax::similar(key, keys);
                let near = near.map(|near| format!("; did you mean `{SECTION}.{near}`?")).unwrap_or_default();
                Err(format!("is unknown{near} (known: {known})"))
            }
        }
    }
}

fn is_below(key: &str, section: &str) -> bool {
    key.strip_prefix(section).is_some_and(|rest| rest.starts_with('.'))
}

/// Returns the values in `value` that are not objects, with their paths.
fn leaves(value: &Value) -> Vec<(String, &Value)> {
    let mut open = vec![(String::new(), value)];
    let mut found = Vec::new();
    while let Some((path, value)) = open.pop() {
        match value {
            Value::Object(fields) => open.extend(fields.iter().rev().map(|(name, value)| {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                (path, value)
            })),
            // A value that is not an object has no settings.
            _ if path.is_empty() => {}
            value => found.push((path, value)),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn read(given: Value) -> (Settings, Vec<String>) {
        Settings::read(&given, Settings::default())
    }

    #[test]
    fn with_and_without_the_section_nested_and_not() {
        let level = Level::from_f64(1e-5);
        for given in [
            json!({"timing": {"significance": 1e-5}}),
            json!({"mauve": {"timing": {"significance": "1e-5"}}}),
            json!({"timing.significance": 1e-5, "server": {"path": "x"}, "trace": {"server": "off"}}),
        ] {
            assert_eq!(read(given), (Settings { significance: level, ..Settings::default() }, vec![]));
        }
        for nothing in [
            json!(null),
            json!([]),
            json!({}),
            json!({"mauve": null}),
            json!({"timing": {"significance": null}}),
        ] {
            assert_eq!(read(nothing), (Settings::default(), vec![]));
        }
    }

    #[test]
    fn what_is_wrong_is_said_and_changes_nothing() {
        let (settings, problems) = read(json!({
            "timing": {"significence": 1e-5, "significance": 2}, "codeLens": {"enable": "no"},
        }));
        assert_eq!(settings, Settings::default());
        assert_eq!(
            problems,
            [
                "The setting `mauve.codeLens.enable` is \"no\": expected true or false.",
                "The setting `mauve.timing.significance` is 2: expected a number between 0 and 1, such as 1e-4, or null.",
                "The setting `mauve.timing.significence` is unknown; did you mean `mauve.timing.significance`? (known: timing.significance, timing.tightSlack, codeLens.enable, inlayHints.responseTimes, inlayHints.loads, inlayHints.programTimes, inlayHints.values).",
            ]
        );
    }

    #[test]
    fn tight_slack_is_a_percentage() {
        let (settings, problems) = read(json!({"timing": {"tightSlack": 25}}));
        assert_eq!((settings.hints.tight_slack, problems), (25, vec![]));
        for wrong in [json!(101), json!(-1), json!(2.5), json!("a tenth")] {
            let (settings, problems) = read(json!({"timing": {"tightSlack": wrong}}));
            assert_eq!((settings, problems.len()), (Settings::default(), 1));
        }
    }

    #[test]
    fn what_is_not_said_was_perhaps_said_before() {
        let (first, _) = read(json!({"timing": {"significance": 1e-5}}));
        let (second, _) = Settings::read(&json!({"codeLens": {"enable": false}}), first);
        assert_eq!(second, Settings { lenses: false, ..first });
        let (third, _) = Settings::read(&json!({"timing": {"significance": null}}), second);
        assert_eq!(third, Settings { significance: None, ..second });
    }
}
