//! # reserved-name
//!
//! The name is a word of C++, or one that generated components have a use of their own for: ports `state` and `tick`,
//! properties `period`, `priority`, `deadline`, `affinity`, `shell`, `core` and `statemachine`. Generated code gives it
//! another name.
//!
//! ```mauve
//! codel delete(in n: int): void   // hint
//! shell S {
//!   input port state: int   // hint
//!   property period: int = 1   // hint
//!   property state: int = 1
//! }
//! ```

use super::*;

code!(RESERVED_NAME, Hint, "reserved-name");

pub(crate) fn report<'db>(at: Place<'db>, name: &str, of: &str) -> Diagnostic<'db> {
    Diagnostic::new(&RESERVED_NAME, at, format!("`{name}` is {of}: in generated code this has another name"))
}

/// Is this a word of C++, and not of MAUVE's own types?
pub(crate) fn is_cpp(name: &str) -> bool {
    const WORDS: &[&str] = &[
        "alignas", "alignof", "and", "and_eq", "asm", "auto", "bitand", "bitor", "bool", "break", "case", "catch", "char",
        "char16_t", "char32_t", "class", "compl", "const", "const_cast", "constexpr", "continue", "decltype", "default",
        "delete", "do", "double", "dynamic_cast", "else", "enum", "explicit", "export", "extern", "false", "float", "for",
        "friend", "goto", "if", "inline", "int", "long", "mutable", "namespace", "new", "noexcept", "not", "not_eq",
        "nullptr", "operator", "or", "or_eq", "private", "protected", "public", "register", "reinterpret_cast", "return",
        "short", "signed", "sizeof", "static", "static_assert", "static_cast", "struct", "switch", "template", "this",
        "thread_local", "throw", "true", "try", "typedef", "typeid", "typename", "union", "unsigned", "using", "virtual",
        "void", "volatile", "wchar_t", "while", "xor", "xor_eq",
    ];
    WORDS.binary_search(&name).is_ok()
}
