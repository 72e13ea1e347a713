; Highlights for Neovim and Zed. The themes of Zed find `@keyword.import` as `keyword`; Helix has other names (helix/).
;
; No two patterns match the same node, because editors disagree on which of them takes precedence.

; Keywords

["include" "use" "import"] @keyword.import

["library" "shell" "core" "component" "architecture" "deployment" "statemachine"] @keyword.type

["codel" "require" "provide" "handler"] @keyword.function

["extends" "initial" "in" "out" "inout" "input" "output"] @keyword.modifier

["if" "then" "else"] @keyword.conditional

"return" @keyword.return

[
  "property" "constant" "port" "var" "state" "transition" "to"
  "configure" "start" "update" "stop" "cleanup"
  "entry" "run" "handle" "exit"
  "instance" "connection" "operation" "activity"
] @keyword

(field
  .
  (name_ref) @property
  (#any-of? @property "instances" "thread" "order" "affinity" "cpus" "priority" "preemptive" "trigger" "least" "period" "rate" "burst" "deadline" "jitter" "offset"))

; Names

(library (name) @module)
(use (name_ref) @module)

[
  (shell (name) @type)
  (core (name) @type)
  (component (name) @type)
  (architecture (name) @type)
  (deployment (name) @type)
]

(type package: (name_ref) @module)

(type
  name: (name_ref) @type
  (#not-any-of? @type
    "bool" "int" "double" "float" "string" "void"
    "int8" "int16" "int32" "int64" "uint8" "uint16" "uint32" "uint64"))

(type
  name: (name_ref) @type.builtin
  (#any-of? @type.builtin
    "bool" "int" "double" "float" "string" "void"
    "int8" "int16" "int32" "int64" "uint8" "uint16" "uint32" "uint64"))

[
  (codel (name) @function)
  (operation_declaration (name) @function)
  (operation_definition (name) @function)
]

(param (name) @variable.parameter)

[
  (property (name) @variable.member)
  (port (name) @variable.member)
  (endpoint feature: (name_ref) @variable.member)
]

[
  (var (name) @variable)
  (handler (name) @variable)
  (instance (name) @variable)
  (endpoint instance: (name_ref) @variable)
  (activity (name_ref) @variable)
  (assign_statement (name_ref) @variable)
]

[
  (state (name) @label)
  (transition (name) @label)
  (transition (name_ref) @label)
]

; Expressions

(name_expr
  (name_ref) @variable
  (#not-eq? @variable "background"))

(name_expr
  (name_ref) @constant.builtin
  (#eq? @constant.builtin "background"))

(call_expr
  (name_ref) @function.call
  (#not-any-of? @function.call "read" "write" "status" "send" "collect"))

(call_expr
  (name_ref) @function.builtin
  (#any-of? @function.builtin "read" "write" "status" "send" "collect"))

["true" "false"] @boolean

["new_data" "old_data" "no_data" "success" "not_ready" "failure"] @constant.builtin

(int_number) @number
(float_number) @number.float
(string) @string

; Signs

["=" "->" "||" "&&" "==" "!=" "<" "<=" ">" ">=" "+" "-" "*" "/" "%" "!"] @operator

["{" "}" "(" ")" "[" "]"] @punctuation.bracket

["," ";" ":" "::" "."] @punctuation.delimiter

[(line_comment) (block_comment)] @comment @spell
