; Folds for Neovim. Helix has no folds, and Zed folds by indentation.

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
  (block_comment)
] @fold
