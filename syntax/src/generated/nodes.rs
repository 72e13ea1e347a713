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
    string_token: token STRING;
});

node!(Library LIBRARY {
    name: child Name;
    l_curly_token: token L_CURLY;
    items: children Item;
});

node!(Use USE {
    name_ref: child NameRef;
});

node!(Codel CODEL {
    name: child Name;
    param_list: child ParamList;
    ty: child Type;
});

node!(Shell SHELL {
    name: child Name;
    extends: child Extends;
    l_curly_token: token L_CURLY;
    shell_items: children ShellItem;
});

node!(Core CORE {
    name: child Name;
    ty: child Type;
    colon_token: token COLON;
    l_curly_token: token L_CURLY;
    core_items: children CoreItem;
});

node!(Component COMPONENT {
    name: child Name;
    shell: child Type;
    core: child Type 1;
});

node!(Architecture ARCHITECTURE {
    name: child Name;
    architecture_items: children ArchitectureItem;
});

node!(Deployment DEPLOYMENT {
    name: child Name;
    target: child Target;
    deployment_items: children DeploymentItem;
});

node!(Name NAME {
});

node!(NameRef NAME_REF {
});

node!(Type TYPE {
    name_refs: children NameRef;
});

node!(ParamList PARAM_LIST {
    params: children Param;
});

node!(Param PARAM {
    name: child Name;
    ty: child Type;
});

node!(Extends EXTENDS {
    tys: children Type;
});

one_of!(ShellItem {
    Property PROPERTY;
    Port PORT;
    OperationDeclaration OPERATION_DECLARATION;
});

node!(Property PROPERTY {
    constant_token: token CONSTANT_KW;
    name: child Name;
    ty: child Type;
    interval: child Interval;
    initializer: child Initializer;
});

node!(Port PORT {
    input_token: token INPUT_KW;
    name: child Name;
    ty: child Type;
});

node!(OperationDeclaration OPERATION_DECLARATION {
    require_token: token REQUIRE_KW;
    name: child Name;
    param_list: child ParamList;
    ty: child Type;
});

node!(Interval INTERVAL {
    low: child Expr;
    high: child Expr 1;
});

node!(Initializer INITIALIZER {
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
    name: child Name;
    ty: child Type;
    initializer: child Initializer;
});

node!(Handler HANDLER {
    name: child Name;
    ty: child Type;
});

node!(OperationDefinition OPERATION_DEFINITION {
    name: child Name;
    param_list: child ParamList;
    result_type: child ResultType;
    block: child Block;
});

node!(Hook HOOK {
    update_token: token UPDATE_KW;
    block: child Block;
});

node!(StateMachine STATE_MACHINE {
    statemachine_token: token STATEMACHINE_KW;
    state_machine_items: children StateMachineItem;
});

node!(ResultType RESULT_TYPE {
    ty: child Type;
});

node!(Block BLOCK {
    l_curly_token: token L_CURLY;
    statements: children Statement;
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
});

one_of!(StateItem {
    Method METHOD;
    Transition TRANSITION;
});

node!(Method METHOD {
    entry_token: token ENTRY_KW;
    exit_token: token EXIT_KW;
    block: child Block;
});

node!(Transition TRANSITION {
    name: child Name;
    guard: child Guard;
    name_ref: child NameRef;
    block: child Block;
});

node!(Guard GUARD {
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
    ty: child Type;
});

node!(Instance INSTANCE {
    name: child Name;
    ty: child Type;
});

node!(Connection CONNECTION {
    source: child Endpoint;
    buffer: child Buffer;
    target: child Endpoint 1;
});

node!(OperationConnection OPERATION_CONNECTION {
    source: child Endpoint;
    target: child Endpoint 1;
});

node!(Setting SETTING {
    endpoint: child Endpoint;
    expr: child Expr;
});

node!(Endpoint ENDPOINT {
    instance: child NameRef;
    feature: child NameRef 1;
});

node!(Buffer BUFFER {
    int_number_token: token INT_NUMBER;
});

node!(Target TARGET {
    ty: child Type;
});

one_of!(DeploymentItem {
    Activity ACTIVITY;
    Setting SETTING;
});

node!(Activity ACTIVITY {
    name_ref: child NameRef;
    fields: children Field;
});

node!(Field FIELD {
    name_ref: child NameRef;
    eq_token: token EQ;
    expr: child Expr;
    value_list: child ValueList;
});

node!(ValueList VALUE_LIST {
    exprs: children Expr;
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
    condition: child Expr;
    then_block: child Block;
    else_branch: child Else;
});

node!(BlockStatement BLOCK_STATEMENT {
    block: child Block;
});

node!(ReturnStatement RETURN_STATEMENT {
    expr: child Expr;
});

node!(AssignStatement ASSIGN_STATEMENT {
    name_ref: child NameRef;
    expr: child Expr;
});

node!(ExprStatement EXPR_STATEMENT {
    expr: child Expr;
});

node!(Else ELSE {
    block: child Block;
    if_statement: child IfStatement;
});

node!(Literal LITERAL {
});

node!(NameExpr NAME_EXPR {
    name_ref: child NameRef;
});

node!(CallExpr CALL_EXPR {
    name_ref: child NameRef;
    argument_list: child ArgumentList;
});

node!(ParenExpr PAREN_EXPR {
    expr: child Expr;
});

node!(UnaryExpr UNARY_EXPR {
    expr: child Expr;
});

node!(BinaryExpr BINARY_EXPR {
    lhs: child Expr;
    rhs: child Expr 1;
});

node!(ArgumentList ARGUMENT_LIST {
    exprs: children Expr;
});
