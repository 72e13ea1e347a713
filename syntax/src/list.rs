//! The lists of items in a file.

use crate::SyntaxKind::{self, *};
use crate::keywords::{ARCHITECTURE_ITEMS, ActivityField, DECLARATIONS, DEPLOYMENT_ITEMS};

/// The kinds of list. The first tokens of an item determine its list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum List {
    File,
    Library,
    Shell,
    Core,
    StateMachine,
    State,
    Architecture,
    Deployment,
    Activity,
    Block,
}

impl List {
    /// Returns the kind of the list in a node of this kind.
    pub(crate) fn of(kind: SyntaxKind) -> Option<List> {
        match kind {
            SOURCE_FILE => Some(List::File),
            LIBRARY => Some(List::Library),
            SHELL => Some(List::Shell),
            CORE => Some(List::Core),
            STATE_MACHINE => Some(List::StateMachine),
            STATE => Some(List::State),
            ARCHITECTURE => Some(List::Architecture),
            DEPLOYMENT => Some(List::Deployment),
            ACTIVITY => Some(List::Activity),
            BLOCK => Some(List::Block),
            _ => None,
        }
    }

    /// Returns the keywords that begin an item, in the order of the message; none if items begin without a keyword.
    pub fn item_keywords(self) -> &'static [&'static str] {
        match self {
            List::File | List::Library => &DECLARATIONS,
            List::Shell => &["constant", "property", "input port", "output port", "require", "provide"],
            List::Core => &[
                "var",
                "handler",
                "provide",
                "configure",
                "start",
                "update",
                "statemachine",
                "stop",
                "cleanup",
            ],
            List::StateMachine => &["var", "state", "initial state"],
            List::State => &["entry", "run", "handle", "exit", "transition"],
            List::Architecture => &ARCHITECTURE_ITEMS,
            List::Deployment => &DEPLOYMENT_ITEMS,
            List::Activity => &ActivityField::KEYWORDS,
            List::Block => &[],
        }
    }
}
