//! Made by `tests/generated.rs` from `mauve.ungram`: do not edit.
#![cfg_attr(rustfmt, rustfmt_skip)]

#![allow(missing_docs)]

use crate::SyntaxKind::{self, *};
use crate::ast::{AstNode, children, child, nth_child, token};
use crate::{SyntaxNode, SyntaxToken};

node!(SourceFile SOURCE_FILE {
    items: children Item;
});

one_of!(Item {
    Include INCLUDE;
    Library LIBRARY;
    Use USE;
    Codel CODEL;
    Shell SHELL;
    Core CORE;
    Component COMPONENT;
    Architecture ARCHITECTURE;
    Deployment DEPLOYMENT;
});

node!(Include INCLUDE {
    include_token: token INCLUDE_KW;
    string_token: token STRING;
});

node!(Library LIBRARY {
    library_token: token LIBRARY_KW;
    name: child Name;
    l_curly_token: token L_CURLY;
    items: children Item;
    r_curly_token: token R_CURLY;
});

node!(Use USE {
    use_token: token USE_KW;
    name_ref: child NameRef;
});

node!(Codel CODEL {
    codel_token: token CODEL_KW;
    name: child Name;
    param_list: child ParamList;
    colon_token: token COLON;
    ty: child Type;
});

node!(Shell SHELL {
    shell_token: token SHELL_KW;
    name: child Name;
    extends: child Extends;
    l_curly_token: token L_CURLY;
    shell_items: children ShellItem;
    r_curly_token: token R_CURLY;
});

node!(Core CORE {
    core_token: token CORE_KW;
    name: child Name;
    l_paren_token: token L_PAREN;
    ty: child Type;
    r_paren_token: token R_PAREN;
    colon_token: token COLON;
    l_curly_token: token L_CURLY;
    core_items: children CoreItem;
    r_curly_token: token R_CURLY;
});

node!(Component COMPONENT {
    component_token: token COMPONENT_KW;
    name: child Name;
    l_paren_token: token L_PAREN;
    shell: child Type;
    comma_token: token COMMA;
    core: child Type 1;
    r_paren_token: token R_PAREN;
});

node!(Architecture ARCHITECTURE {
    architecture_token: token ARCHITECTURE_KW;
    name: child Name;
    l_curly_token: token L_CURLY;
    architecture_items: children ArchitectureItem;
    r_curly_token: token R_CURLY;
});

node!(Deployment DEPLOYMENT {
    deployment_token: token DEPLOYMENT_KW;
    name: child Name;
    l_curly_token: token L_CURLY;
    target: child Target;
    deployment_items: children DeploymentItem;
    r_curly_token: token R_CURLY;
});

node!(Name NAME {
    ident_token: token IDENT;
});

node!(NameRef NAME_REF {
    ident_token: token IDENT;
});

node!(Type TYPE {
    name_refs: children NameRef;
    dot_token: token DOT;
    colon2_token: token COLON2;
});

node!(ParamList PARAM_LIST {
    l_paren_token: token L_PAREN;
    params: children Param;
    comma_token: token COMMA;
    r_paren_token: token R_PAREN;
});

node!(Param PARAM {
    in_token: token IN_KW;
    out_token: token OUT_KW;
    inout_token: token INOUT_KW;
    name: child Name;
    colon_token: token COLON;
    ty: child Type;
});

node!(Extends EXTENDS {
    extends_token: token EXTENDS_KW;
    tys: children Type;
    comma_token: token COMMA;
});

one_of!(ShellItem {
    Property PROPERTY;
    Port PORT;
    OperationDeclaration OPERATION_DECLARATION;
});

node!(Property PROPERTY {
    constant_token: token CONSTANT_KW;
    property_token: token PROPERTY_KW;
    name: child Name;
    colon_token: token COLON;
    ty: child Type;
    interval: child Interval;
    initializer: child Initializer;
});

node!(Port PORT {
    input_token: token INPUT_KW;
    output_token: token OUTPUT_KW;
    port_token: token PORT_KW;
    name: child Name;
    colon_token: token COLON;
    ty: child Type;
});

node!(OperationDeclaration OPERATION_DECLARATION {
    require_token: token REQUIRE_KW;
    provide_token: token PROVIDE_KW;
    name: child Name;
    param_list: child ParamList;
    colon_token: token COLON;
    ty: child Type;
});

node!(Interval INTERVAL {
    l_brack_token: token L_BRACK;
    low: child Expr;
    semicolon_token: token SEMICOLON;
    high: child Expr 1;
    r_brack_token: token R_BRACK;
});

node!(Initializer INITIALIZER {
    eq_token: token EQ;
    expr: child Expr;
});

one_of!(Expr {
    Literal LITERAL;
    NameExpr NAME_EXPR;
    CallExpr CALL_EXPR;
    ParenExpr PAREN_EXPR;
    UnaryExpr UNARY_EXPR;
    BinaryExpr BINARY_EXPR;
});

one_of!(CoreItem {
    Var VAR;
    Handler HANDLER;
    OperationDefinition OPERATION_DEFINITION;
    Hook HOOK;
    StateMachine STATE_MACHINE;
});

node!(Var VAR {
    var_token: token VAR_KW;
    name: child Name;
    colon_token: token COLON;
    ty: child Type;
    initializer: child Initializer;
});

node!(Handler HANDLER {
    handler_token: token HANDLER_KW;
    name: child Name;
    colon_token: token COLON;
    ty: child Type;
});

node!(OperationDefinition OPERATION_DEFINITION {
    provide_token: token PROVIDE_KW;
    name: child Name;
    param_list: child ParamList;
    result_type: child ResultType;
    eq_token: token EQ;
    block: child Block;
});

node!(Hook HOOK {
    configure_token: token CONFIGURE_KW;
    start_token: token START_KW;
    update_token: token UPDATE_KW;
    stop_token: token STOP_KW;
    cleanup_token: token CLEANUP_KW;
    eq_token: token EQ;
    block: child Block;
});

node!(StateMachine STATE_MACHINE {
    statemachine_token: token STATEMACHINE_KW;
    l_curly_token: token L_CURLY;
    state_machine_items: children StateMachineItem;
    r_curly_token: token R_CURLY;
});

node!(ResultType RESULT_TYPE {
    colon_token: token COLON;
    ty: child Type;
});

node!(Block BLOCK {
    l_curly_token: token L_CURLY;
    statements: children Statement;
    r_curly_token: token R_CURLY;
});

one_of!(StateMachineItem {
    Var VAR;
    State STATE;
});

node!(State STATE {
    initial_token: token INITIAL_KW;
    state_token: token STATE_KW;
    name: child Name;
    l_curly_token: token L_CURLY;
    state_items: children StateItem;
    r_curly_token: token R_CURLY;
});

one_of!(StateItem {
    Method METHOD;
    Transition TRANSITION;
});

node!(Method METHOD {
    entry_token: token ENTRY_KW;
    run_token: token RUN_KW;
    handle_token: token HANDLE_KW;
    exit_token: token EXIT_KW;
    eq_token: token EQ;
    block: child Block;
});

node!(Transition TRANSITION {
    transition_token: token TRANSITION_KW;
    name: child Name;
    guard: child Guard;
    to_token: token TO_KW;
    name_ref: child NameRef;
    block: child Block;
});

node!(Guard GUARD {
    if_token: token IF_KW;
    expr: child Expr;
});

one_of!(ArchitectureItem {
    Import IMPORT;
    Instance INSTANCE;
    Connection CONNECTION;
    OperationConnection OPERATION_CONNECTION;
    Setting SETTING;
});

node!(Import IMPORT {
    import_token: token IMPORT_KW;
    ty: child Type;
});

node!(Instance INSTANCE {
    instance_token: token INSTANCE_KW;
    name: child Name;
    colon_token: token COLON;
    ty: child Type;
});

node!(Connection CONNECTION {
    connection_token: token CONNECTION_KW;
    source: child Endpoint;
    arrow_token: token ARROW;
    buffer: child Buffer;
    target: child Endpoint 1;
});

node!(OperationConnection OPERATION_CONNECTION {
    operation_token: token OPERATION_KW;
    source: child Endpoint;
    arrow_token: token ARROW;
    target: child Endpoint 1;
});

node!(Setting SETTING {
    property_token: token PROPERTY_KW;
    constant_token: token CONSTANT_KW;
    endpoint: child Endpoint;
    eq_token: token EQ;
    expr: child Expr;
});

node!(Endpoint ENDPOINT {
    instance: child NameRef;
    dot_token: token DOT;
    feature: child NameRef 1;
});

node!(Buffer BUFFER {
    l_brack_token: token L_BRACK;
    int_number_token: token INT_NUMBER;
    r_brack_token: token R_BRACK;
});

node!(Target TARGET {
    architecture_token: token ARCHITECTURE_KW;
    ty: child Type;
});

one_of!(DeploymentItem {
    Activity ACTIVITY;
    Setting SETTING;
});

node!(Activity ACTIVITY {
    activity_token: token ACTIVITY_KW;
    name_ref: child NameRef;
    l_curly_token: token L_CURLY;
    fields: children Field;
    r_curly_token: token R_CURLY;
});

node!(Field FIELD {
    name_ref: child NameRef;
    eq_token: token EQ;
    expr: child Expr;
    value_list: child ValueList;
});

node!(ValueList VALUE_LIST {
    l_brack_token: token L_BRACK;
    exprs: children Expr;
    comma_token: token COMMA;
    r_brack_token: token R_BRACK;
});

one_of!(Statement {
    Var VAR;
    IfStatement IF_STATEMENT;
    BlockStatement BLOCK_STATEMENT;
    ReturnStatement RETURN_STATEMENT;
    AssignStatement ASSIGN_STATEMENT;
    ExprStatement EXPR_STATEMENT;
});

node!(IfStatement IF_STATEMENT {
    if_token: token IF_KW;
    condition: child Expr;
    then_token: token THEN_KW;
    then_block: child Block;
    else_branch: child Else;
});

node!(BlockStatement BLOCK_STATEMENT {
    block: child Block;
});

node!(ReturnStatement RETURN_STATEMENT {
    return_token: token RETURN_KW;
    expr: child Expr;
    semicolon_token: token SEMICOLON;
});

node!(AssignStatement ASSIGN_STATEMENT {
    name_ref: child NameRef;
    eq_token: token EQ;
    expr: child Expr;
    semicolon_token: token SEMICOLON;
});

node!(ExprStatement EXPR_STATEMENT {
    expr: child Expr;
    semicolon_token: token SEMICOLON;
});

node!(Else ELSE {
    else_token: token ELSE_KW;
    block: child Block;
    if_statement: child IfStatement;
});

node!(Literal LITERAL {
    int_number_token: token INT_NUMBER;
    float_number_token: token FLOAT_NUMBER;
    string_token: token STRING;
    true_token: token TRUE_KW;
    false_token: token FALSE_KW;
    new_data_token: token NEW_DATA_KW;
    old_data_token: token OLD_DATA_KW;
    no_data_token: token NO_DATA_KW;
    success_token: token SUCCESS_KW;
    not_ready_token: token NOT_READY_KW;
    failure_token: token FAILURE_KW;
});

node!(NameExpr NAME_EXPR {
    name_ref: child NameRef;
});

node!(CallExpr CALL_EXPR {
    name_ref: child NameRef;
    argument_list: child ArgumentList;
});

node!(ParenExpr PAREN_EXPR {
    l_paren_token: token L_PAREN;
    expr: child Expr;
    r_paren_token: token R_PAREN;
});

node!(UnaryExpr UNARY_EXPR {
    bang_token: token BANG;
    minus_token: token MINUS;
    expr: child Expr;
});

node!(BinaryExpr BINARY_EXPR {
    lhs: child Expr;
    pipe2_token: token PIPE2;
    amp2_token: token AMP2;
    eq2_token: token EQ2;
    neq_token: token NEQ;
    lt_token: token LT;
    lteq_token: token LTEQ;
    gt_token: token GT;
    gteq_token: token GTEQ;
    plus_token: token PLUS;
    minus_token: token MINUS;
    star_token: token STAR;
    slash_token: token SLASH;
    percent_token: token PERCENT;
    rhs: child Expr 1;
});

node!(ArgumentList ARGUMENT_LIST {
    l_paren_token: token L_PAREN;
    exprs: children Expr;
    comma_token: token COMMA;
    r_paren_token: token R_PAREN;
});
