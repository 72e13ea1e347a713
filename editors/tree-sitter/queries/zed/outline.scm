; The outline of a file for Zed.

(library "library" @context (name) @name) @item
(codel "codel" @context (name) @name) @item
(shell "shell" @context (name) @name) @item
(property ["property" "constant"] @context (name) @name) @item
(port ["input" "output"] @context "port" @context (name) @name) @item
(operation_declaration ["require" "provide"] @context (name) @name) @item
(core "core" @context (name) @name) @item
(operation_definition "provide" @context (name) @name) @item
(hook ["configure" "start" "update" "stop" "cleanup"] @name) @item
(component "component" @context (name) @name) @item
(state_machine "statemachine" @name) @item
(state "initial"? @context "state" @context (name) @name) @item
(transition "transition" @context (name) @name) @item
(architecture "architecture" @context (name) @name) @item
(instance "instance" @context (name) @name) @item
(deployment "deployment" @context (name) @name) @item
(activity "activity" @context (name_ref) @name) @item
