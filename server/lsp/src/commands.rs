//! The commands of the server, and those that a client may implement.

use mauve_ide::LensDrawing;

/// The command that sets the significance level.
pub(crate) const SET_SIGNIFICANCE: &str = "mauve.setSignificance";

/// The command that generates Orocos packages.
pub(crate) const GENERATE: &str = "mauve.generateOrocos";

/// The command that reads and analyses all files again.
pub(crate) const RELOAD: &str = "mauve.reload";

/// All commands.
pub(crate) const COMMANDS: &[&str] = &[SET_SIGNIFICANCE, GENERATE, RELOAD];

/// The client's command that shows locations.
pub(crate) const SHOW_REFERENCES: &str = "mauve.showReferences";

/// The client's command that lets the user choose a level.
pub(crate) const CHOOSE_SIGNIFICANCE: &str = "mauve.chooseSignificance";

/// The drawings that lenses show to every client that draws.
pub(crate) const LENS_DRAWINGS: [LensDrawing; 3] =
    [LensDrawing::Architecture, LensDrawing::Schedule, LensDrawing::StateMachine];

/// The client's command that shows a drawing.
pub(crate) fn drawing_command(drawing: LensDrawing) -> &'static str {
    match drawing {
        LensDrawing::Architecture => "mauve.showArchitecture",
        LensDrawing::Schedule => "mauve.showSchedule",
        LensDrawing::StateMachine => "mauve.showStateMachine",
        LensDrawing::Chains => "mauve.showChains",
        LensDrawing::WhatIf => "mauve.whatIf",
    }
}
