; Indentation for Helix.

[
  (library)
  (shell)
  (core)
  (state_machine)
  (state)
  (architecture)
  (deployment)
  (activity)
  (block)
  (param_list)
  (argument_list)
  (paren_expr)
] @indent

["}" ")"] @outdent
