//! mauve-ide
