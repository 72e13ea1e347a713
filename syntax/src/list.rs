//! The lists of items in a file.

use crate::SyntaxKind::{self, *};
use crate::keywords::{ARCHITECTURE_ITEMS, ActivityField, DECLARATIONS, DEPLOYMENT_ITEMS};

/// Returns the keywords that begin an item of the list in a node of this kind, in the order of the message: none if items begin
/// without a keyword. Returns `None` if the node has no list.
pub fn item_keywords(list: SyntaxKind) -> Option<&'static [&'static str]> {
    Some(match list {
        SOURCE_FILE | LIBRARY => &DECLARATIONS,
        SHELL => &["constant", "property", "input port", "output port", "require", "provide"],
        CORE => {
            &["var", "handler", "provide", "configure", "start", "update", "statemachine", "stop", "cleanup"]
        }
        STATE_MACHINE => &["var", "state", "initial state"],
        STATE => &["entry", "run", "handle", "exit", "transition"],
        ARCHITECTURE => &ARCHITECTURE_ITEMS,
        DEPLOYMENT => &DEPLOYMENT_ITEMS,
        ACTIVITY => &ActivityField::KEYWORDS,
        BLOCK => &[],
        _ => return None,
    })
}
