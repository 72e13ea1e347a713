; Indentation for Neovim.

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
] @indent.begin

"}" @indent.branch @indent.end

; A line in parentheses is aligned with the text after the open one, as `mauve fmt` does.
([(param_list) (argument_list) (paren_expr)] @indent.align
  (#set! indent.open_delimiter "(")
  (#set! indent.close_delimiter ")"))

(block_comment) @indent.auto
