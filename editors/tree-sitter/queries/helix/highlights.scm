; Highlights for Helix: the patterns of ../highlights.scm, with the names of Helix.

; Keywords

["include" "use" "import"] @keyword.control.import

["library" "shell" "core" "component" "architecture" "deployment" "statemachine"] @keyword.storage.type

["codel" "require" "provide" "handler"] @keyword.function

["extends" "initial" "in" "out" "inout" "input" "output"] @keyword.storage.modifier

["if" "then" "else"] @keyword.control.conditional

"return" @keyword.control.return

[
  "property" "constant" "port" "var" "state" "transition" "to"
  "configure" "start" "update" "stop" "cleanup"
  "entry" "run" "handle" "exit"
  "instance" "connection" "operation" "activity"
] @keyword

(field
  .
  (name_ref) @variable.other.member
  (#any-of? @variable.other.member "instances" "thread" "order" "affinity" "cpus" "priority" "preemptive" "trigger" "least" "period" "rate" "burst" "deadline" "jitter" "offset"))

; Names

(library (name) @namespace)
(use (name_ref) @namespace)

[
  (shell (name) @type)
  (core (name) @type)
  (component (name) @type)
  (architecture (name) @type)
  (deployment (name) @type)
]

(type package: (name_ref) @namespace)

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
  (property (name) @variable.other.member)
  (port (name) @variable.other.member)
  (endpoint feature: (name_ref) @variable.other.member)
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
  (name_ref) @function
  (#not-any-of? @function "read" "write" "status" "send" "collect"))

(call_expr
  (name_ref) @function.builtin
  (#any-of? @function.builtin "read" "write" "status" "send" "collect"))

["true" "false"] @constant.builtin.boolean

["new_data" "old_data" "no_data" "success" "not_ready" "failure"] @constant.builtin

(int_number) @constant.numeric.integer
(float_number) @constant.numeric.float
(string) @string

; Signs

["=" "->" "||" "&&" "==" "!=" "<" "<=" ">" ">=" "+" "-" "*" "/" "%" "!"] @operator

["{" "}" "(" ")" "[" "]"] @punctuation.bracket

["," ";" ":" "::" "."] @punctuation.delimiter

(line_comment) @comment.line
(block_comment) @comment.block
