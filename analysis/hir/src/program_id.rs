//! The identity of a program of a component, and its key in a timing table.

use std::fmt;

use crate::item_tree::{HookKind, MethodKind, Name};

/// A program that a timing table can give an execution time.
///
/// `Display` writes the key after `Component/`, and `From` reads it. `From` accepts any text: a text in no other form, such as
/// `Idle.leave`, becomes an [`Operation`](ProgramId::Operation) that no core can define, so that `Display` restores the text.
///
/// Names can be keywords: an operation `update` has the key of the hook, and `From` reads that key as the hook.
///
/// ```
/// use mauve_hir::ProgramId;
/// use mauve_hir::item_tree::MethodKind;
///
/// let run = ProgramId::Method { state: "Idle".into(), kind: MethodKind::Run };
/// assert_eq!(run.to_string(), "Idle.run");
/// assert_eq!(ProgramId::from("Idle.run"), run);
///
/// let guard = ProgramId::Guard { state: "Idle".into(), transition: "go".into() };
/// assert_eq!(ProgramId::from("Idle.go.guard"), guard);
/// assert_eq!(ProgramId::from("update"), ProgramId::UPDATE);
/// assert_eq!(ProgramId::from("reset"), ProgramId::Operation("reset".into()));
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum ProgramId {
    /// `update`; or `configure`, `start`, `stop` or `cleanup`, which no period executes.
    Hook(HookKind),
    /// `operation`: an operation that the core defines.
    Operation(Name),
    /// `state.run`, `state.entry`, `state.handle` or `state.exit`.
    Method { state: Name, kind: MethodKind },
    /// `state.transition.guard`: `state` is the source of the transition.
    Guard { state: Name, transition: Name },
    /// `state.transition.effect`: `state` is the source of the transition.
    Effect { state: Name, transition: Name },
}

impl ProgramId {
    /// The program of a core without a state machine.
    pub const UPDATE: ProgramId = ProgramId::Hook(HookKind::Update);

    /// Returns the program that a timing table names with this key: the hook, for an operation with the name of a hook.
    pub fn in_table(&self) -> ProgramId {
        match self {
            ProgramId::Operation(name) => ProgramId::from(name.as_str()),
            _ => self.clone(),
        }
    }

    /// Returns the state that declares the program.
    pub fn state(&self) -> Option<&Name> {
        match self {
            ProgramId::Hook(_) | ProgramId::Operation(_) => None,
            ProgramId::Method { state, .. }
            | ProgramId::Guard { state, .. }
            | ProgramId::Effect { state, .. } => Some(state),
        }
    }

    /// Returns the transition that declares the program.
    pub fn transition(&self) -> Option<&Name> {
        match self {
            ProgramId::Hook(_) | ProgramId::Operation(_) | ProgramId::Method { .. } => None,
            ProgramId::Guard { transition, .. } | ProgramId::Effect { transition, .. } => Some(transition),
        }
    }
}

impl fmt::Display for ProgramId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ProgramId::Hook(kind) => f.write_str(kind.keyword()),
            ProgramId::Operation(name) => f.write_str(name),
            ProgramId::Method { state, kind } => write!(f, "{state}.{}", kind.keyword()),
            ProgramId::Guard { state, transition } => write!(f, "{state}.{transition}.guard"),
            ProgramId::Effect { state, transition } => write!(f, "{state}.{transition}.effect"),
        }
    }
}

impl From<&str> for ProgramId {
    fn from(key: &str) -> ProgramId {
        let mut words = key.split('.');
        let found = match [words.next(), words.next(), words.next(), words.next()] {
            [Some(word), None, ..] => HookKind::from_keyword(word).map(ProgramId::Hook),
            [Some(state), Some(word), None, _] => {
                MethodKind::from_keyword(word).map(|kind| ProgramId::Method { state: state.into(), kind })
            }
            [Some(state), Some(transition), Some("guard"), None] => {
                Some(ProgramId::Guard { state: state.into(), transition: transition.into() })
            }
            [Some(state), Some(transition), Some("effect"), None] => {
                Some(ProgramId::Effect { state: state.into(), transition: transition.into() })
            }
            _ => None,
        };
        found.unwrap_or_else(|| ProgramId::Operation(key.into()))
    }
}

/// A key under `[program]` of a timing table.
///
/// ```
/// use mauve_hir::{ProgramId, ProgramKey};
///
/// let key = ProgramKey { component: "nav.Pilot", program: ProgramId::UPDATE };
/// assert_eq!(key.to_string(), "nav.Pilot/update");
/// assert_eq!(ProgramKey::parse("nav.Pilot/update"), Some(key));
/// assert_eq!(ProgramKey::parse("nav.Pilot"), None);
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProgramKey<'a> {
    /// The component, with or without its library.
    pub component: &'a str,
    /// Its program.
    pub program: ProgramId,
}

impl<'a> ProgramKey<'a> {
    /// Splits a key at its first `/`. Returns `None` without a `/`.
    pub fn parse(key: &'a str) -> Option<ProgramKey<'a>> {
        let (component, program) = key.split_once('/')?;
        Some(ProgramKey { component, program: program.into() })
    }
}

impl fmt::Display for ProgramKey<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.component, self.program)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A name, which can be a keyword; or an empty text, the name of an incomplete declaration.
    fn name() -> impl Strategy<Value = Name> {
        "([a-zA-Z_][a-zA-Z0-9_]{0,6}|update|stop|run|exit|guard|effect)?".prop_map(Name::from)
    }

    fn program() -> impl Strategy<Value = ProgramId> {
        let method = |(state, kind)| ProgramId::Method { state, kind };
        let guard = |(state, transition)| ProgramId::Guard { state, transition };
        let effect = |(state, transition)| ProgramId::Effect { state, transition };
        prop_oneof![
            proptest::sample::select(&HookKind::ALL[..]).prop_map(ProgramId::Hook),
            name().prop_map(ProgramId::Operation),
            (name(), proptest::sample::select(&MethodKind::ALL[..])).prop_map(method),
            (name(), name()).prop_map(guard),
            (name(), name()).prop_map(effect),
        ]
    }

    proptest! {
        #[test]
        fn a_key_names_its_program(program in program()) {
            let read = ProgramId::from(program.to_string().as_str());
            prop_assert_eq!(&read, &program.in_table());
            let is_hook = |name: &Name| HookKind::from_keyword(name).is_some();
            if !matches!(&program, ProgramId::Operation(name) if is_hook(name)) {
                prop_assert_eq!(read, program);
            }
        }

        #[test]
        fn a_key_with_its_component_is_split_into_both(component in "[a-zA-Z.]{0,8}", program in program()) {
            let key = ProgramKey { component: &component, program }.to_string();
            prop_assert_eq!(ProgramKey::parse(&key).map(|key| key.to_string()), Some(key.clone()));
            prop_assert_eq!(ProgramKey::parse(&key).map(|key| key.component.to_owned()), Some(component));
        }

        #[test]
        fn every_text_is_kept(
            text in prop_oneof![
                any::<String>(),
                "((update|stop|run|exit|guard|effect|a|/|\\.)\\.?){0,5}",
            ],
        ) {
            prop_assert_eq!(ProgramId::from(text.as_str()).to_string(), text);
        }
    }

    #[test]
    fn a_text_that_is_the_key_of_no_program_has_neither_state_nor_transition() {
        for text in ["", ".", "Idle.", "Idle.update", "Idle.go", "Idle.go.run", "a.Idle.go.guard", "run"] {
            assert_eq!(ProgramId::from(text), ProgramId::Operation(text.into()), "{text}");
        }
    }
}
