//! Made by `tests/generated.rs` from `mauve.ungram`: do not edit.
#![cfg_attr(rustfmt, rustfmt_skip)]

syntax_kinds! {
    texts {
        L_CURLY "{";
        R_CURLY "}";
        L_PAREN "(";
        R_PAREN ")";
        L_BRACK "[";
        R_BRACK "]";
        COMMA ",";
        SEMICOLON ";";
        COLON ":";
        COLON2 "::";
        DOT ".";
        ARROW "->";
        EQ "=";
        EQ2 "==";
        NEQ "!=";
        LT "<";
        LTEQ "<=";
        GT ">";
        GTEQ ">=";
        PLUS "+";
        MINUS "-";
        STAR "*";
        SLASH "/";
        PERCENT "%";
        BANG "!";
        AMP2 "&&";
        PIPE2 "||";
        ACTIVITY_KW "activity";
        AFFINITY_KW "affinity";
        ARCHITECTURE_KW "architecture";
        BACKGROUND_KW "background";
        BURST_KW "burst";
        CLEANUP_KW "cleanup";
        CODEL_KW "codel";
        COMPONENT_KW "component";
        CONFIGURE_KW "configure";
        CONNECTION_KW "connection";
        CONSTANT_KW "constant";
        CORE_KW "core";
        CPUS_KW "cpus";
        DEADLINE_KW "deadline";
        DEPLOYMENT_KW "deployment";
        ELSE_KW "else";
        ENTRY_KW "entry";
        EXIT_KW "exit";
        EXTENDS_KW "extends";
        FAILURE_KW "failure";
        FALSE_KW "false";
        HANDLE_KW "handle";
        HANDLER_KW "handler";
        IF_KW "if";
        IMPORT_KW "import";
        IN_KW "in";
        INCLUDE_KW "include";
        INITIAL_KW "initial";
        INOUT_KW "inout";
        INPUT_KW "input";
        INSTANCE_KW "instance";
        INSTANCES_KW "instances";
        JITTER_KW "jitter";
        LEAST_KW "least";
        LIBRARY_KW "library";
        NEW_DATA_KW "new_data";
        NO_DATA_KW "no_data";
        NOT_READY_KW "not_ready";
        OFFSET_KW "offset";
        OLD_DATA_KW "old_data";
        OPERATION_KW "operation";
        ORDER_KW "order";
        OUT_KW "out";
        OUTPUT_KW "output";
        PERIOD_KW "period";
        PORT_KW "port";
        PREEMPTIVE_KW "preemptive";
        PRIORITY_KW "priority";
        PROPERTY_KW "property";
        PROVIDE_KW "provide";
        RATE_KW "rate";
        REQUIRE_KW "require";
        RETURN_KW "return";
        RUN_KW "run";
        SHELL_KW "shell";
        START_KW "start";
        STATE_KW "state";
        STATEMACHINE_KW "statemachine";
        STOP_KW "stop";
        SUCCESS_KW "success";
        THEN_KW "then";
        THREAD_KW "thread";
        TO_KW "to";
        TRANSITION_KW "transition";
        TRIGGER_KW "trigger";
        TRUE_KW "true";
        UPDATE_KW "update";
        USE_KW "use";
        VAR_KW "var";
    }
    others {
        #[regex("[A-Za-z_][A-Za-z0-9_]*", priority = 3)] IDENT;
        #[regex("[0-9]+|0[xX][0-9a-fA-F]+", priority = 5)] INT_NUMBER;
        #[regex(r"[0-9]+\.[0-9]+([eE][+-]?[0-9]+)?|[0-9]+[eE][+-]?[0-9]+", priority = 6)] FLOAT_NUMBER;
        #[regex(r"[0-9][A-Za-z0-9_]*|[0-9]+\.[0-9]+[A-Za-z_][A-Za-z0-9_]*", priority = 4)] BAD_NUMBER;
        #[regex(r#""([^"\\\r\n]|\\[^\r\n])*""#)] STRING;
        #[regex(r#""([^"\\\r\n]|\\[^\r\n])*\\?"#, priority = 2)] UNTERMINATED_STRING;
        WHITESPACE;
        #[regex(r"//[^\r\n]*", allow_greedy = true)] LINE_COMMENT;
        #[token("/*", crate::lexer::block_comment)] BLOCK_COMMENT;
        CONFLICT;
        ERROR_CHARACTERS;
        SOURCE_FILE;
        INCLUDE;
        LIBRARY;
        USE;
        CODEL;
        SHELL;
        CORE;
        COMPONENT;
        ARCHITECTURE;
        DEPLOYMENT;
        NAME;
        NAME_REF;
        TYPE;
        PARAM_LIST;
        PARAM;
        EXTENDS;
        PROPERTY;
        PORT;
        OPERATION_DECLARATION;
        INTERVAL;
        INITIALIZER;
        VAR;
        HANDLER;
        OPERATION_DEFINITION;
        HOOK;
        STATE_MACHINE;
        RESULT_TYPE;
        BLOCK;
        STATE;
        METHOD;
        TRANSITION;
        GUARD;
        IMPORT;
        INSTANCE;
        CONNECTION;
        OPERATION_CONNECTION;
        SETTING;
        ENDPOINT;
        BUFFER;
        TARGET;
        ACTIVITY;
        FIELD;
        VALUE_LIST;
        IF_STATEMENT;
        BLOCK_STATEMENT;
        RETURN_STATEMENT;
        ASSIGN_STATEMENT;
        EXPR_STATEMENT;
        ELSE;
        LITERAL;
        NAME_EXPR;
        CALL_EXPR;
        PAREN_EXPR;
        UNARY_EXPR;
        BINARY_EXPR;
        ARGUMENT_LIST;
        /// Something is missing here, or these tokens fit nowhere.
        ERROR;
    }
}

impl SyntaxKind {
    /// Is this a word, so that it can be a name?
    #[inline]
    pub fn is_word(self) -> bool {
        (SyntaxKind::ACTIVITY_KW..=SyntaxKind::IDENT).contains(&self)
    }

    /// White space, a comment, or a part of a conflict that is not parsed.
    #[inline]
    pub fn is_trivia(self) -> bool {
        matches!(self, SyntaxKind::WHITESPACE | SyntaxKind::LINE_COMMENT | SyntaxKind::BLOCK_COMMENT | SyntaxKind::CONFLICT)
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
}
