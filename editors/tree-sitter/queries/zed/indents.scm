; Indentation for Zed.

(_ "{" "}" @end) @indent

(_ "(" ")" @end) @indent
