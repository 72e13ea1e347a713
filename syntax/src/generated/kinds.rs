//! Made by `tests/generated.rs` from `mauve.ungram`: do not edit.
#![cfg_attr(rustfmt, rustfmt_skip)]

use logos::Logos;

/// What a token or a node of the syntax tree is.
#[allow(missing_docs, non_camel_case_types, clippy::upper_case_acronyms)]
#[derive(Logos, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum SyntaxKind {
    /// The end of the text: never in a tree.
    EOF,
    #[token("{")]
    L_CURLY,
    #[token("}")]
    R_CURLY,
    #[token("(")]
    L_PAREN,
    #[token(")")]
    R_PAREN,
    #[token("[")]
    L_BRACK,
    #[token("]")]
    R_BRACK,
    #[token(",")]
    COMMA,
    #[token(";")]
    SEMICOLON,
    #[token(":")]
    COLON,
    #[token("::")]
    COLON2,
    #[token(".")]
    DOT,
    #[token("->")]
    ARROW,
    #[token("=")]
    EQ,
    #[token("==")]
    EQ2,
    #[token("!=")]
    NEQ,
    #[token("<")]
    LT,
    #[token("<=")]
    LTEQ,
    #[token(">")]
    GT,
    #[token(">=")]
    GTEQ,
    #[token("+")]
    PLUS,
    #[token("-")]
    MINUS,
    #[token("*")]
    STAR,
    #[token("/")]
    SLASH,
    #[token("%")]
    PERCENT,
    #[token("!")]
    BANG,
    #[token("&&")]
    AMP2,
    #[token("||")]
    PIPE2,
    #[token("activity")]
    ACTIVITY_KW,
    #[token("affinity")]
    AFFINITY_KW,
    #[token("architecture")]
    ARCHITECTURE_KW,
    #[token("background")]
    BACKGROUND_KW,
    #[token("cleanup")]
    CLEANUP_KW,
    #[token("codel")]
    CODEL_KW,
    #[token("component")]
    COMPONENT_KW,
    #[token("configure")]
    CONFIGURE_KW,
    #[token("connection")]
    CONNECTION_KW,
    #[token("constant")]
    CONSTANT_KW,
    #[token("core")]
    CORE_KW,
    #[token("deadline")]
    DEADLINE_KW,
    #[token("deployment")]
    DEPLOYMENT_KW,
    #[token("else")]
    ELSE_KW,
    #[token("entry")]
    ENTRY_KW,
    #[token("exit")]
    EXIT_KW,
    #[token("extends")]
    EXTENDS_KW,
    #[token("failure")]
    FAILURE_KW,
    #[token("false")]
    FALSE_KW,
    #[token("handle")]
    HANDLE_KW,
    #[token("handler")]
    HANDLER_KW,
    #[token("if")]
    IF_KW,
    #[token("import")]
    IMPORT_KW,
    #[token("in")]
    IN_KW,
    #[token("include")]
    INCLUDE_KW,
    #[token("initial")]
    INITIAL_KW,
    #[token("inout")]
    INOUT_KW,
    #[token("input")]
    INPUT_KW,
    #[token("instance")]
    INSTANCE_KW,
    #[token("library")]
    LIBRARY_KW,
    #[token("new_data")]
    NEW_DATA_KW,
    #[token("no_data")]
    NO_DATA_KW,
    #[token("not_ready")]
    NOT_READY_KW,
    #[token("old_data")]
    OLD_DATA_KW,
    #[token("operation")]
    OPERATION_KW,
    #[token("out")]
    OUT_KW,
    #[token("output")]
    OUTPUT_KW,
    #[token("period")]
    PERIOD_KW,
    #[token("port")]
    PORT_KW,
    #[token("priority")]
    PRIORITY_KW,
    #[token("property")]
    PROPERTY_KW,
    #[token("provide")]
    PROVIDE_KW,
    #[token("require")]
    REQUIRE_KW,
    #[token("return")]
    RETURN_KW,
    #[token("run")]
    RUN_KW,
    #[token("shell")]
    SHELL_KW,
    #[token("start")]
    START_KW,
    #[token("state")]
    STATE_KW,
    #[token("statemachine")]
    STATEMACHINE_KW,
    #[token("stop")]
    STOP_KW,
    #[token("success")]
    SUCCESS_KW,
    #[token("then")]
    THEN_KW,
    #[token("to")]
    TO_KW,
    #[token("transition")]
    TRANSITION_KW,
    #[token("true")]
    TRUE_KW,
    #[token("update")]
    UPDATE_KW,
    #[token("use")]
    USE_KW,
    #[token("var")]
    VAR_KW,
    #[regex("[A-Za-z_][A-Za-z0-9_]*", priority = 3)]
    IDENT,
    #[regex("[0-9]+|0[xX][0-9a-fA-F]+", priority = 5)]
    INT_NUMBER,
    #[regex(r"[0-9]+\.[0-9]+([eE][+-]?[0-9]+)?|[0-9]+[eE][+-]?[0-9]+", priority = 6)]
    FLOAT_NUMBER,
    #[regex(r"[0-9][A-Za-z0-9_]*|[0-9]+\.[0-9]+[A-Za-z_][A-Za-z0-9_]*", priority = 4)]
    BAD_NUMBER,
    #[regex(r#""([^"\\\r\n]|\\[^\r\n])*""#)]
    STRING,
    #[regex(r#""([^"\\\r\n]|\\[^\r\n])*\\?"#, priority = 2)]
    UNTERMINATED_STRING,
    WHITESPACE,
    #[regex(r"//[^\r\n]*", allow_greedy = true)]
    LINE_COMMENT,
    #[token("/*", crate::lexer::block_comment)]
    BLOCK_COMMENT,
    ERROR_CHARACTERS,
    SOURCE_FILE,
    INCLUDE,
    LIBRARY,
    USE,
    CODEL,
    SHELL,
    CORE,
    COMPONENT,
    ARCHITECTURE,
    DEPLOYMENT,
    NAME,
    NAME_REF,
    TYPE,
    PARAM_LIST,
    PARAM,
    EXTENDS,
    PROPERTY,
    PORT,
    OPERATION_DECLARATION,
    INTERVAL,
    INITIALIZER,
    VAR,
    HANDLER,
    OPERATION_DEFINITION,
    HOOK,
    STATE_MACHINE,
    RESULT_TYPE,
    BLOCK,
    STATE,
    METHOD,
    TRANSITION,
    GUARD,
    IMPORT,
    INSTANCE,
    CONNECTION,
    OPERATION_CONNECTION,
    SETTING,
    ENDPOINT,
    BUFFER,
    TARGET,
    ACTIVITY,
    FIELD,
    IF_STATEMENT,
    BLOCK_STATEMENT,
    RETURN_STATEMENT,
    ASSIGN_STATEMENT,
    EXPR_STATEMENT,
    ELSE,
    LITERAL,
    NAME_EXPR,
    CALL_EXPR,
    PAREN_EXPR,
    UNARY_EXPR,
    BINARY_EXPR,
    ARGUMENT_LIST,
    /// Something is missing here, or these tokens fit nowhere.
    ERROR,
}

impl SyntaxKind {
    const LAST: u16 = SyntaxKind::ERROR as u16;

    /// All kinds, in the order of their numbers.
    pub(crate) const ALL: [SyntaxKind; SyntaxKind::LAST as usize + 1] = [
        SyntaxKind::EOF,
        SyntaxKind::L_CURLY,
        SyntaxKind::R_CURLY,
        SyntaxKind::L_PAREN,
        SyntaxKind::R_PAREN,
        SyntaxKind::L_BRACK,
        SyntaxKind::R_BRACK,
        SyntaxKind::COMMA,
        SyntaxKind::SEMICOLON,
        SyntaxKind::COLON,
        SyntaxKind::COLON2,
        SyntaxKind::DOT,
        SyntaxKind::ARROW,
        SyntaxKind::EQ,
        SyntaxKind::EQ2,
        SyntaxKind::NEQ,
        SyntaxKind::LT,
        SyntaxKind::LTEQ,
        SyntaxKind::GT,
        SyntaxKind::GTEQ,
        SyntaxKind::PLUS,
        SyntaxKind::MINUS,
        SyntaxKind::STAR,
        SyntaxKind::SLASH,
        SyntaxKind::PERCENT,
        SyntaxKind::BANG,
        SyntaxKind::AMP2,
        SyntaxKind::PIPE2,
        SyntaxKind::ACTIVITY_KW,
        SyntaxKind::AFFINITY_KW,
        SyntaxKind::ARCHITECTURE_KW,
        SyntaxKind::BACKGROUND_KW,
        SyntaxKind::CLEANUP_KW,
        SyntaxKind::CODEL_KW,
        SyntaxKind::COMPONENT_KW,
        SyntaxKind::CONFIGURE_KW,
        SyntaxKind::CONNECTION_KW,
        SyntaxKind::CONSTANT_KW,
        SyntaxKind::CORE_KW,
        SyntaxKind::DEADLINE_KW,
        SyntaxKind::DEPLOYMENT_KW,
        SyntaxKind::ELSE_KW,
        SyntaxKind::ENTRY_KW,
        SyntaxKind::EXIT_KW,
        SyntaxKind::EXTENDS_KW,
        SyntaxKind::FAILURE_KW,
        SyntaxKind::FALSE_KW,
        SyntaxKind::HANDLE_KW,
        SyntaxKind::HANDLER_KW,
        SyntaxKind::IF_KW,
        SyntaxKind::IMPORT_KW,
        SyntaxKind::IN_KW,
        SyntaxKind::INCLUDE_KW,
        SyntaxKind::INITIAL_KW,
        SyntaxKind::INOUT_KW,
        SyntaxKind::INPUT_KW,
        SyntaxKind::INSTANCE_KW,
        SyntaxKind::LIBRARY_KW,
        SyntaxKind::NEW_DATA_KW,
        SyntaxKind::NO_DATA_KW,
        SyntaxKind::NOT_READY_KW,
        SyntaxKind::OLD_DATA_KW,
        SyntaxKind::OPERATION_KW,
        SyntaxKind::OUT_KW,
        SyntaxKind::OUTPUT_KW,
        SyntaxKind::PERIOD_KW,
        SyntaxKind::PORT_KW,
        SyntaxKind::PRIORITY_KW,
        SyntaxKind::PROPERTY_KW,
        SyntaxKind::PROVIDE_KW,
        SyntaxKind::REQUIRE_KW,
        SyntaxKind::RETURN_KW,
        SyntaxKind::RUN_KW,
        SyntaxKind::SHELL_KW,
        SyntaxKind::START_KW,
        SyntaxKind::STATE_KW,
        SyntaxKind::STATEMACHINE_KW,
        SyntaxKind::STOP_KW,
        SyntaxKind::SUCCESS_KW,
        SyntaxKind::THEN_KW,
        SyntaxKind::TO_KW,
        SyntaxKind::TRANSITION_KW,
        SyntaxKind::TRUE_KW,
        SyntaxKind::UPDATE_KW,
        SyntaxKind::USE_KW,
        SyntaxKind::VAR_KW,
        SyntaxKind::IDENT,
        SyntaxKind::INT_NUMBER,
        SyntaxKind::FLOAT_NUMBER,
        SyntaxKind::BAD_NUMBER,
        SyntaxKind::STRING,
        SyntaxKind::UNTERMINATED_STRING,
        SyntaxKind::WHITESPACE,
        SyntaxKind::LINE_COMMENT,
        SyntaxKind::BLOCK_COMMENT,
        SyntaxKind::ERROR_CHARACTERS,
        SyntaxKind::SOURCE_FILE,
        SyntaxKind::INCLUDE,
        SyntaxKind::LIBRARY,
        SyntaxKind::USE,
        SyntaxKind::CODEL,
        SyntaxKind::SHELL,
        SyntaxKind::CORE,
        SyntaxKind::COMPONENT,
        SyntaxKind::ARCHITECTURE,
        SyntaxKind::DEPLOYMENT,
        SyntaxKind::NAME,
        SyntaxKind::NAME_REF,
        SyntaxKind::TYPE,
        SyntaxKind::PARAM_LIST,
        SyntaxKind::PARAM,
        SyntaxKind::EXTENDS,
        SyntaxKind::PROPERTY,
        SyntaxKind::PORT,
        SyntaxKind::OPERATION_DECLARATION,
        SyntaxKind::INTERVAL,
        SyntaxKind::INITIALIZER,
        SyntaxKind::VAR,
        SyntaxKind::HANDLER,
        SyntaxKind::OPERATION_DEFINITION,
        SyntaxKind::HOOK,
        SyntaxKind::STATE_MACHINE,
        SyntaxKind::RESULT_TYPE,
        SyntaxKind::BLOCK,
        SyntaxKind::STATE,
        SyntaxKind::METHOD,
        SyntaxKind::TRANSITION,
        SyntaxKind::GUARD,
        SyntaxKind::IMPORT,
        SyntaxKind::INSTANCE,
        SyntaxKind::CONNECTION,
        SyntaxKind::OPERATION_CONNECTION,
        SyntaxKind::SETTING,
        SyntaxKind::ENDPOINT,
        SyntaxKind::BUFFER,
        SyntaxKind::TARGET,
        SyntaxKind::ACTIVITY,
        SyntaxKind::FIELD,
        SyntaxKind::IF_STATEMENT,
        SyntaxKind::BLOCK_STATEMENT,
        SyntaxKind::RETURN_STATEMENT,
        SyntaxKind::ASSIGN_STATEMENT,
        SyntaxKind::EXPR_STATEMENT,
        SyntaxKind::ELSE,
        SyntaxKind::LITERAL,
        SyntaxKind::NAME_EXPR,
        SyntaxKind::CALL_EXPR,
        SyntaxKind::PAREN_EXPR,
        SyntaxKind::UNARY_EXPR,
        SyntaxKind::BINARY_EXPR,
        SyntaxKind::ARGUMENT_LIST,
        SyntaxKind::ERROR,
    ];

    /// Is this a word, so that it can be a name?
    #[inline]
    pub fn is_word(self) -> bool {
        (SyntaxKind::ACTIVITY_KW..=SyntaxKind::IDENT).contains(&self)
    }

    /// White space or a comment.
    #[inline]
    pub fn is_trivia(self) -> bool {
        matches!(self, SyntaxKind::WHITESPACE | SyntaxKind::LINE_COMMENT | SyntaxKind::BLOCK_COMMENT)
    }

    /// A comment.
    #[inline]
    pub fn is_comment(self) -> bool {
        matches!(self, SyntaxKind::LINE_COMMENT | SyntaxKind::BLOCK_COMMENT)
    }

    /// A keyword that is a literal.
    #[inline]
    pub fn is_literal_keyword(self) -> bool {
        matches!(self, SyntaxKind::TRUE_KW | SyntaxKind::FALSE_KW | SyntaxKind::NEW_DATA_KW | SyntaxKind::OLD_DATA_KW | SyntaxKind::NO_DATA_KW | SyntaxKind::SUCCESS_KW | SyntaxKind::NOT_READY_KW | SyntaxKind::FAILURE_KW)
    }

    /// Returns the text of a token that always has the same one.
    pub fn text(self) -> Option<&'static str> {
        Some(match self {
            SyntaxKind::L_CURLY => "{",
            SyntaxKind::R_CURLY => "}",
            SyntaxKind::L_PAREN => "(",
            SyntaxKind::R_PAREN => ")",
            SyntaxKind::L_BRACK => "[",
            SyntaxKind::R_BRACK => "]",
            SyntaxKind::COMMA => ",",
            SyntaxKind::SEMICOLON => ";",
            SyntaxKind::COLON => ":",
            SyntaxKind::COLON2 => "::",
            SyntaxKind::DOT => ".",
            SyntaxKind::ARROW => "->",
            SyntaxKind::EQ => "=",
            SyntaxKind::EQ2 => "==",
            SyntaxKind::NEQ => "!=",
            SyntaxKind::LT => "<",
            SyntaxKind::LTEQ => "<=",
            SyntaxKind::GT => ">",
            SyntaxKind::GTEQ => ">=",
            SyntaxKind::PLUS => "+",
            SyntaxKind::MINUS => "-",
            SyntaxKind::STAR => "*",
            SyntaxKind::SLASH => "/",
            SyntaxKind::PERCENT => "%",
            SyntaxKind::BANG => "!",
            SyntaxKind::AMP2 => "&&",
            SyntaxKind::PIPE2 => "||",
            SyntaxKind::ACTIVITY_KW => "activity",
            SyntaxKind::AFFINITY_KW => "affinity",
            SyntaxKind::ARCHITECTURE_KW => "architecture",
            SyntaxKind::BACKGROUND_KW => "background",
            SyntaxKind::CLEANUP_KW => "cleanup",
            SyntaxKind::CODEL_KW => "codel",
            SyntaxKind::COMPONENT_KW => "component",
            SyntaxKind::CONFIGURE_KW => "configure",
            SyntaxKind::CONNECTION_KW => "connection",
            SyntaxKind::CONSTANT_KW => "constant",
            SyntaxKind::CORE_KW => "core",
            SyntaxKind::DEADLINE_KW => "deadline",
            SyntaxKind::DEPLOYMENT_KW => "deployment",
            SyntaxKind::ELSE_KW => "else",
            SyntaxKind::ENTRY_KW => "entry",
            SyntaxKind::EXIT_KW => "exit",
            SyntaxKind::EXTENDS_KW => "extends",
            SyntaxKind::FAILURE_KW => "failure",
            SyntaxKind::FALSE_KW => "false",
            SyntaxKind::HANDLE_KW => "handle",
            SyntaxKind::HANDLER_KW => "handler",
            SyntaxKind::IF_KW => "if",
            SyntaxKind::IMPORT_KW => "import",
            SyntaxKind::IN_KW => "in",
            SyntaxKind::INCLUDE_KW => "include",
            SyntaxKind::INITIAL_KW => "initial",
            SyntaxKind::INOUT_KW => "inout",
            SyntaxKind::INPUT_KW => "input",
            SyntaxKind::INSTANCE_KW => "instance",
            SyntaxKind::LIBRARY_KW => "library",
            SyntaxKind::NEW_DATA_KW => "new_data",
            SyntaxKind::NO_DATA_KW => "no_data",
            SyntaxKind::NOT_READY_KW => "not_ready",
            SyntaxKind::OLD_DATA_KW => "old_data",
            SyntaxKind::OPERATION_KW => "operation",
            SyntaxKind::OUT_KW => "out",
            SyntaxKind::OUTPUT_KW => "output",
            SyntaxKind::PERIOD_KW => "period",
            SyntaxKind::PORT_KW => "port",
            SyntaxKind::PRIORITY_KW => "priority",
            SyntaxKind::PROPERTY_KW => "property",
            SyntaxKind::PROVIDE_KW => "provide",
            SyntaxKind::REQUIRE_KW => "require",
            SyntaxKind::RETURN_KW => "return",
            SyntaxKind::RUN_KW => "run",
            SyntaxKind::SHELL_KW => "shell",
            SyntaxKind::START_KW => "start",
            SyntaxKind::STATE_KW => "state",
            SyntaxKind::STATEMACHINE_KW => "statemachine",
            SyntaxKind::STOP_KW => "stop",
            SyntaxKind::SUCCESS_KW => "success",
            SyntaxKind::THEN_KW => "then",
            SyntaxKind::TO_KW => "to",
            SyntaxKind::TRANSITION_KW => "transition",
            SyntaxKind::TRUE_KW => "true",
            SyntaxKind::UPDATE_KW => "update",
            SyntaxKind::USE_KW => "use",
            SyntaxKind::VAR_KW => "var",
            _ => return None,
        })
    }
}
