//! Made by `tests/generated.rs` from `mauve.ungram`: do not edit.
#![cfg_attr(rustfmt, rustfmt_skip)]

#![allow(missing_docs)]

use crate::SyntaxKind::{self, *};
use crate::ast::{AstNode, children, child, nth_child, token};
use crate::{SyntaxNode, SyntaxToken};

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct SourceFile(pub(crate) SyntaxNode);

impl AstNode for SourceFile {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == SOURCE_FILE
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(SourceFile(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl SourceFile {
    pub fn items(&self) -> impl Iterator<Item = Item> {
        children(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Item {
    Include(Include),
    Library(Library),
    Use(Use),
    Codel(Codel),
    Shell(Shell),
    Core(Core),
    Component(Component),
    Architecture(Architecture),
    Deployment(Deployment),
}

impl AstNode for Item {
    fn can_cast(kind: SyntaxKind) -> bool {
        matches!(kind, INCLUDE | LIBRARY | USE | CODEL | SHELL | CORE | COMPONENT | ARCHITECTURE | DEPLOYMENT)
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Some(match node.kind() {
            INCLUDE => Item::Include(Include(node)),
            LIBRARY => Item::Library(Library(node)),
            USE => Item::Use(Use(node)),
            CODEL => Item::Codel(Codel(node)),
            SHELL => Item::Shell(Shell(node)),
            CORE => Item::Core(Core(node)),
            COMPONENT => Item::Component(Component(node)),
            ARCHITECTURE => Item::Architecture(Architecture(node)),
            DEPLOYMENT => Item::Deployment(Deployment(node)),
            _ => return None,
        })
    }

    fn syntax(&self) -> &SyntaxNode {
        match self {
            Item::Include(it) => it.syntax(),
            Item::Library(it) => it.syntax(),
            Item::Use(it) => it.syntax(),
            Item::Codel(it) => it.syntax(),
            Item::Shell(it) => it.syntax(),
            Item::Core(it) => it.syntax(),
            Item::Component(it) => it.syntax(),
            Item::Architecture(it) => it.syntax(),
            Item::Deployment(it) => it.syntax(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Include(pub(crate) SyntaxNode);

impl AstNode for Include {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == INCLUDE
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Include(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Include {
    pub fn include_token(&self) -> Option<SyntaxToken> {
        token(&self.0, INCLUDE_KW)
    }

    pub fn string_token(&self) -> Option<SyntaxToken> {
        token(&self.0, STRING)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Library(pub(crate) SyntaxNode);

impl AstNode for Library {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == LIBRARY
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Library(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Library {
    pub fn library_token(&self) -> Option<SyntaxToken> {
        token(&self.0, LIBRARY_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn l_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_CURLY)
    }

    pub fn items(&self) -> impl Iterator<Item = Item> {
        children(&self.0)
    }

    pub fn r_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_CURLY)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Use(pub(crate) SyntaxNode);

impl AstNode for Use {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == USE
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Use(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Use {
    pub fn use_token(&self) -> Option<SyntaxToken> {
        token(&self.0, USE_KW)
    }

    pub fn name_ref(&self) -> Option<NameRef> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Codel(pub(crate) SyntaxNode);

impl AstNode for Codel {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == CODEL
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Codel(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Codel {
    pub fn codel_token(&self) -> Option<SyntaxToken> {
        token(&self.0, CODEL_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn param_list(&self) -> Option<ParamList> {
        child(&self.0)
    }

    pub fn colon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COLON)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Shell(pub(crate) SyntaxNode);

impl AstNode for Shell {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == SHELL
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Shell(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Shell {
    pub fn shell_token(&self) -> Option<SyntaxToken> {
        token(&self.0, SHELL_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn extends(&self) -> Option<Extends> {
        child(&self.0)
    }

    pub fn l_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_CURLY)
    }

    pub fn shell_items(&self) -> impl Iterator<Item = ShellItem> {
        children(&self.0)
    }

    pub fn r_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_CURLY)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Core(pub(crate) SyntaxNode);

impl AstNode for Core {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == CORE
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Core(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Core {
    pub fn core_token(&self) -> Option<SyntaxToken> {
        token(&self.0, CORE_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn l_paren_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_PAREN)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }

    pub fn r_paren_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_PAREN)
    }

    pub fn colon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COLON)
    }

    pub fn l_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_CURLY)
    }

    pub fn core_items(&self) -> impl Iterator<Item = CoreItem> {
        children(&self.0)
    }

    pub fn r_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_CURLY)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Component(pub(crate) SyntaxNode);

impl AstNode for Component {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == COMPONENT
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Component(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Component {
    pub fn component_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COMPONENT_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn l_paren_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_PAREN)
    }

    pub fn shell(&self) -> Option<Type> {
        child(&self.0)
    }

    pub fn comma_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COMMA)
    }

    pub fn core(&self) -> Option<Type> {
        nth_child(&self.0, 1)
    }

    pub fn r_paren_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_PAREN)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Architecture(pub(crate) SyntaxNode);

impl AstNode for Architecture {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == ARCHITECTURE
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Architecture(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Architecture {
    pub fn architecture_token(&self) -> Option<SyntaxToken> {
        token(&self.0, ARCHITECTURE_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn l_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_CURLY)
    }

    pub fn architecture_items(&self) -> impl Iterator<Item = ArchitectureItem> {
        children(&self.0)
    }

    pub fn r_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_CURLY)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Deployment(pub(crate) SyntaxNode);

impl AstNode for Deployment {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == DEPLOYMENT
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Deployment(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Deployment {
    pub fn deployment_token(&self) -> Option<SyntaxToken> {
        token(&self.0, DEPLOYMENT_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn l_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_CURLY)
    }

    pub fn target(&self) -> Option<Target> {
        child(&self.0)
    }

    pub fn deployment_items(&self) -> impl Iterator<Item = DeploymentItem> {
        children(&self.0)
    }

    pub fn r_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_CURLY)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Name(pub(crate) SyntaxNode);

impl AstNode for Name {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == NAME
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Name(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Name {
    pub fn ident_token(&self) -> Option<SyntaxToken> {
        token(&self.0, IDENT)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct NameRef(pub(crate) SyntaxNode);

impl AstNode for NameRef {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == NAME_REF
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(NameRef(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl NameRef {
    pub fn ident_token(&self) -> Option<SyntaxToken> {
        token(&self.0, IDENT)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Type(pub(crate) SyntaxNode);

impl AstNode for Type {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == TYPE
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Type(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Type {
    pub fn name_refs(&self) -> impl Iterator<Item = NameRef> {
        children(&self.0)
    }

    pub fn dot_token(&self) -> Option<SyntaxToken> {
        token(&self.0, DOT)
    }

    pub fn colon2_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COLON2)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ParamList(pub(crate) SyntaxNode);

impl AstNode for ParamList {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == PARAM_LIST
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(ParamList(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl ParamList {
    pub fn l_paren_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_PAREN)
    }

    pub fn params(&self) -> impl Iterator<Item = Param> {
        children(&self.0)
    }

    pub fn comma_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COMMA)
    }

    pub fn r_paren_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_PAREN)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Param(pub(crate) SyntaxNode);

impl AstNode for Param {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == PARAM
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Param(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Param {
    pub fn in_token(&self) -> Option<SyntaxToken> {
        token(&self.0, IN_KW)
    }

    pub fn out_token(&self) -> Option<SyntaxToken> {
        token(&self.0, OUT_KW)
    }

    pub fn inout_token(&self) -> Option<SyntaxToken> {
        token(&self.0, INOUT_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn colon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COLON)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Extends(pub(crate) SyntaxNode);

impl AstNode for Extends {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == EXTENDS
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Extends(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Extends {
    pub fn extends_token(&self) -> Option<SyntaxToken> {
        token(&self.0, EXTENDS_KW)
    }

    pub fn tys(&self) -> impl Iterator<Item = Type> {
        children(&self.0)
    }

    pub fn comma_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COMMA)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum ShellItem {
    Property(Property),
    Port(Port),
    OperationDeclaration(OperationDeclaration),
}

impl AstNode for ShellItem {
    fn can_cast(kind: SyntaxKind) -> bool {
        matches!(kind, PROPERTY | PORT | OPERATION_DECLARATION)
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Some(match node.kind() {
            PROPERTY => ShellItem::Property(Property(node)),
            PORT => ShellItem::Port(Port(node)),
            OPERATION_DECLARATION => ShellItem::OperationDeclaration(OperationDeclaration(node)),
            _ => return None,
        })
    }

    fn syntax(&self) -> &SyntaxNode {
        match self {
            ShellItem::Property(it) => it.syntax(),
            ShellItem::Port(it) => it.syntax(),
            ShellItem::OperationDeclaration(it) => it.syntax(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Property(pub(crate) SyntaxNode);

impl AstNode for Property {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == PROPERTY
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Property(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Property {
    pub fn constant_token(&self) -> Option<SyntaxToken> {
        token(&self.0, CONSTANT_KW)
    }

    pub fn property_token(&self) -> Option<SyntaxToken> {
        token(&self.0, PROPERTY_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn colon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COLON)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }

    pub fn interval(&self) -> Option<Interval> {
        child(&self.0)
    }

    pub fn initializer(&self) -> Option<Initializer> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Port(pub(crate) SyntaxNode);

impl AstNode for Port {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == PORT
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Port(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Port {
    pub fn input_token(&self) -> Option<SyntaxToken> {
        token(&self.0, INPUT_KW)
    }

    pub fn output_token(&self) -> Option<SyntaxToken> {
        token(&self.0, OUTPUT_KW)
    }

    pub fn port_token(&self) -> Option<SyntaxToken> {
        token(&self.0, PORT_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn colon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COLON)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct OperationDeclaration(pub(crate) SyntaxNode);

impl AstNode for OperationDeclaration {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == OPERATION_DECLARATION
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(OperationDeclaration(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl OperationDeclaration {
    pub fn require_token(&self) -> Option<SyntaxToken> {
        token(&self.0, REQUIRE_KW)
    }

    pub fn provide_token(&self) -> Option<SyntaxToken> {
        token(&self.0, PROVIDE_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn param_list(&self) -> Option<ParamList> {
        child(&self.0)
    }

    pub fn colon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COLON)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Interval(pub(crate) SyntaxNode);

impl AstNode for Interval {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == INTERVAL
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Interval(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Interval {
    pub fn l_brack_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_BRACK)
    }

    pub fn low(&self) -> Option<Expr> {
        child(&self.0)
    }

    pub fn semicolon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, SEMICOLON)
    }

    pub fn high(&self) -> Option<Expr> {
        nth_child(&self.0, 1)
    }

    pub fn r_brack_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_BRACK)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Initializer(pub(crate) SyntaxNode);

impl AstNode for Initializer {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == INITIALIZER
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Initializer(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Initializer {
    pub fn eq_token(&self) -> Option<SyntaxToken> {
        token(&self.0, EQ)
    }

    pub fn expr(&self) -> Option<Expr> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Expr {
    Literal(Literal),
    NameExpr(NameExpr),
    CallExpr(CallExpr),
    ParenExpr(ParenExpr),
    UnaryExpr(UnaryExpr),
    BinaryExpr(BinaryExpr),
}

impl AstNode for Expr {
    fn can_cast(kind: SyntaxKind) -> bool {
        matches!(kind, LITERAL | NAME_EXPR | CALL_EXPR | PAREN_EXPR | UNARY_EXPR | BINARY_EXPR)
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Some(match node.kind() {
            LITERAL => Expr::Literal(Literal(node)),
            NAME_EXPR => Expr::NameExpr(NameExpr(node)),
            CALL_EXPR => Expr::CallExpr(CallExpr(node)),
            PAREN_EXPR => Expr::ParenExpr(ParenExpr(node)),
            UNARY_EXPR => Expr::UnaryExpr(UnaryExpr(node)),
            BINARY_EXPR => Expr::BinaryExpr(BinaryExpr(node)),
            _ => return None,
        })
    }

    fn syntax(&self) -> &SyntaxNode {
        match self {
            Expr::Literal(it) => it.syntax(),
            Expr::NameExpr(it) => it.syntax(),
            Expr::CallExpr(it) => it.syntax(),
            Expr::ParenExpr(it) => it.syntax(),
            Expr::UnaryExpr(it) => it.syntax(),
            Expr::BinaryExpr(it) => it.syntax(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum CoreItem {
    Var(Var),
    Handler(Handler),
    OperationDefinition(OperationDefinition),
    Hook(Hook),
    StateMachine(StateMachine),
}

impl AstNode for CoreItem {
    fn can_cast(kind: SyntaxKind) -> bool {
        matches!(kind, VAR | HANDLER | OPERATION_DEFINITION | HOOK | STATE_MACHINE)
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Some(match node.kind() {
            VAR => CoreItem::Var(Var(node)),
            HANDLER => CoreItem::Handler(Handler(node)),
            OPERATION_DEFINITION => CoreItem::OperationDefinition(OperationDefinition(node)),
            HOOK => CoreItem::Hook(Hook(node)),
            STATE_MACHINE => CoreItem::StateMachine(StateMachine(node)),
            _ => return None,
        })
    }

    fn syntax(&self) -> &SyntaxNode {
        match self {
            CoreItem::Var(it) => it.syntax(),
            CoreItem::Handler(it) => it.syntax(),
            CoreItem::OperationDefinition(it) => it.syntax(),
            CoreItem::Hook(it) => it.syntax(),
            CoreItem::StateMachine(it) => it.syntax(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Var(pub(crate) SyntaxNode);

impl AstNode for Var {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == VAR
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Var(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Var {
    pub fn var_token(&self) -> Option<SyntaxToken> {
        token(&self.0, VAR_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn colon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COLON)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }

    pub fn initializer(&self) -> Option<Initializer> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Handler(pub(crate) SyntaxNode);

impl AstNode for Handler {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == HANDLER
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Handler(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Handler {
    pub fn handler_token(&self) -> Option<SyntaxToken> {
        token(&self.0, HANDLER_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn colon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COLON)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct OperationDefinition(pub(crate) SyntaxNode);

impl AstNode for OperationDefinition {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == OPERATION_DEFINITION
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(OperationDefinition(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl OperationDefinition {
    pub fn provide_token(&self) -> Option<SyntaxToken> {
        token(&self.0, PROVIDE_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn param_list(&self) -> Option<ParamList> {
        child(&self.0)
    }

    pub fn result_type(&self) -> Option<ResultType> {
        child(&self.0)
    }

    pub fn eq_token(&self) -> Option<SyntaxToken> {
        token(&self.0, EQ)
    }

    pub fn block(&self) -> Option<Block> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Hook(pub(crate) SyntaxNode);

impl AstNode for Hook {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == HOOK
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Hook(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Hook {
    pub fn configure_token(&self) -> Option<SyntaxToken> {
        token(&self.0, CONFIGURE_KW)
    }

    pub fn start_token(&self) -> Option<SyntaxToken> {
        token(&self.0, START_KW)
    }

    pub fn update_token(&self) -> Option<SyntaxToken> {
        token(&self.0, UPDATE_KW)
    }

    pub fn stop_token(&self) -> Option<SyntaxToken> {
        token(&self.0, STOP_KW)
    }

    pub fn cleanup_token(&self) -> Option<SyntaxToken> {
        token(&self.0, CLEANUP_KW)
    }

    pub fn eq_token(&self) -> Option<SyntaxToken> {
        token(&self.0, EQ)
    }

    pub fn block(&self) -> Option<Block> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct StateMachine(pub(crate) SyntaxNode);

impl AstNode for StateMachine {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == STATE_MACHINE
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(StateMachine(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl StateMachine {
    pub fn statemachine_token(&self) -> Option<SyntaxToken> {
        token(&self.0, STATEMACHINE_KW)
    }

    pub fn l_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_CURLY)
    }

    pub fn state_machine_items(&self) -> impl Iterator<Item = StateMachineItem> {
        children(&self.0)
    }

    pub fn r_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_CURLY)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ResultType(pub(crate) SyntaxNode);

impl AstNode for ResultType {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == RESULT_TYPE
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(ResultType(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl ResultType {
    pub fn colon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COLON)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Block(pub(crate) SyntaxNode);

impl AstNode for Block {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == BLOCK
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Block(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Block {
    pub fn l_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_CURLY)
    }

    pub fn statements(&self) -> impl Iterator<Item = Statement> {
        children(&self.0)
    }

    pub fn r_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_CURLY)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum StateMachineItem {
    Var(Var),
    State(State),
}

impl AstNode for StateMachineItem {
    fn can_cast(kind: SyntaxKind) -> bool {
        matches!(kind, VAR | STATE)
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Some(match node.kind() {
            VAR => StateMachineItem::Var(Var(node)),
            STATE => StateMachineItem::State(State(node)),
            _ => return None,
        })
    }

    fn syntax(&self) -> &SyntaxNode {
        match self {
            StateMachineItem::Var(it) => it.syntax(),
            StateMachineItem::State(it) => it.syntax(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct State(pub(crate) SyntaxNode);

impl AstNode for State {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == STATE
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(State(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl State {
    pub fn initial_token(&self) -> Option<SyntaxToken> {
        token(&self.0, INITIAL_KW)
    }

    pub fn state_token(&self) -> Option<SyntaxToken> {
        token(&self.0, STATE_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn l_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_CURLY)
    }

    pub fn state_items(&self) -> impl Iterator<Item = StateItem> {
        children(&self.0)
    }

    pub fn r_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_CURLY)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum StateItem {
    Method(Method),
    Transition(Transition),
}

impl AstNode for StateItem {
    fn can_cast(kind: SyntaxKind) -> bool {
        matches!(kind, METHOD | TRANSITION)
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Some(match node.kind() {
            METHOD => StateItem::Method(Method(node)),
            TRANSITION => StateItem::Transition(Transition(node)),
            _ => return None,
        })
    }

    fn syntax(&self) -> &SyntaxNode {
        match self {
            StateItem::Method(it) => it.syntax(),
            StateItem::Transition(it) => it.syntax(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Method(pub(crate) SyntaxNode);

impl AstNode for Method {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == METHOD
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Method(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Method {
    pub fn entry_token(&self) -> Option<SyntaxToken> {
        token(&self.0, ENTRY_KW)
    }

    pub fn run_token(&self) -> Option<SyntaxToken> {
        token(&self.0, RUN_KW)
    }

    pub fn handle_token(&self) -> Option<SyntaxToken> {
        token(&self.0, HANDLE_KW)
    }

    pub fn exit_token(&self) -> Option<SyntaxToken> {
        token(&self.0, EXIT_KW)
    }

    pub fn eq_token(&self) -> Option<SyntaxToken> {
        token(&self.0, EQ)
    }

    pub fn block(&self) -> Option<Block> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Transition(pub(crate) SyntaxNode);

impl AstNode for Transition {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == TRANSITION
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Transition(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Transition {
    pub fn transition_token(&self) -> Option<SyntaxToken> {
        token(&self.0, TRANSITION_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn guard(&self) -> Option<Guard> {
        child(&self.0)
    }

    pub fn to_token(&self) -> Option<SyntaxToken> {
        token(&self.0, TO_KW)
    }

    pub fn name_ref(&self) -> Option<NameRef> {
        child(&self.0)
    }

    pub fn block(&self) -> Option<Block> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Guard(pub(crate) SyntaxNode);

impl AstNode for Guard {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == GUARD
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Guard(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Guard {
    pub fn if_token(&self) -> Option<SyntaxToken> {
        token(&self.0, IF_KW)
    }

    pub fn expr(&self) -> Option<Expr> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum ArchitectureItem {
    Import(Import),
    Instance(Instance),
    Connection(Connection),
    OperationConnection(OperationConnection),
    Setting(Setting),
}

impl AstNode for ArchitectureItem {
    fn can_cast(kind: SyntaxKind) -> bool {
        matches!(kind, IMPORT | INSTANCE | CONNECTION | OPERATION_CONNECTION | SETTING)
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Some(match node.kind() {
            IMPORT => ArchitectureItem::Import(Import(node)),
            INSTANCE => ArchitectureItem::Instance(Instance(node)),
            CONNECTION => ArchitectureItem::Connection(Connection(node)),
            OPERATION_CONNECTION => ArchitectureItem::OperationConnection(OperationConnection(node)),
            SETTING => ArchitectureItem::Setting(Setting(node)),
            _ => return None,
        })
    }

    fn syntax(&self) -> &SyntaxNode {
        match self {
            ArchitectureItem::Import(it) => it.syntax(),
            ArchitectureItem::Instance(it) => it.syntax(),
            ArchitectureItem::Connection(it) => it.syntax(),
            ArchitectureItem::OperationConnection(it) => it.syntax(),
            ArchitectureItem::Setting(it) => it.syntax(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Import(pub(crate) SyntaxNode);

impl AstNode for Import {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == IMPORT
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Import(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Import {
    pub fn import_token(&self) -> Option<SyntaxToken> {
        token(&self.0, IMPORT_KW)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Instance(pub(crate) SyntaxNode);

impl AstNode for Instance {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == INSTANCE
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Instance(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Instance {
    pub fn instance_token(&self) -> Option<SyntaxToken> {
        token(&self.0, INSTANCE_KW)
    }

    pub fn name(&self) -> Option<Name> {
        child(&self.0)
    }

    pub fn colon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COLON)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Connection(pub(crate) SyntaxNode);

impl AstNode for Connection {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == CONNECTION
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Connection(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Connection {
    pub fn connection_token(&self) -> Option<SyntaxToken> {
        token(&self.0, CONNECTION_KW)
    }

    pub fn source(&self) -> Option<Endpoint> {
        child(&self.0)
    }

    pub fn arrow_token(&self) -> Option<SyntaxToken> {
        token(&self.0, ARROW)
    }

    pub fn buffer(&self) -> Option<Buffer> {
        child(&self.0)
    }

    pub fn target(&self) -> Option<Endpoint> {
        nth_child(&self.0, 1)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct OperationConnection(pub(crate) SyntaxNode);

impl AstNode for OperationConnection {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == OPERATION_CONNECTION
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(OperationConnection(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl OperationConnection {
    pub fn operation_token(&self) -> Option<SyntaxToken> {
        token(&self.0, OPERATION_KW)
    }

    pub fn source(&self) -> Option<Endpoint> {
        child(&self.0)
    }

    pub fn arrow_token(&self) -> Option<SyntaxToken> {
        token(&self.0, ARROW)
    }

    pub fn target(&self) -> Option<Endpoint> {
        nth_child(&self.0, 1)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Setting(pub(crate) SyntaxNode);

impl AstNode for Setting {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == SETTING
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Setting(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Setting {
    pub fn property_token(&self) -> Option<SyntaxToken> {
        token(&self.0, PROPERTY_KW)
    }

    pub fn constant_token(&self) -> Option<SyntaxToken> {
        token(&self.0, CONSTANT_KW)
    }

    pub fn endpoint(&self) -> Option<Endpoint> {
        child(&self.0)
    }

    pub fn eq_token(&self) -> Option<SyntaxToken> {
        token(&self.0, EQ)
    }

    pub fn expr(&self) -> Option<Expr> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Endpoint(pub(crate) SyntaxNode);

impl AstNode for Endpoint {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == ENDPOINT
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Endpoint(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Endpoint {
    pub fn instance(&self) -> Option<NameRef> {
        child(&self.0)
    }

    pub fn dot_token(&self) -> Option<SyntaxToken> {
        token(&self.0, DOT)
    }

    pub fn feature(&self) -> Option<NameRef> {
        nth_child(&self.0, 1)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Buffer(pub(crate) SyntaxNode);

impl AstNode for Buffer {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == BUFFER
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Buffer(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Buffer {
    pub fn l_brack_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_BRACK)
    }

    pub fn int_number_token(&self) -> Option<SyntaxToken> {
        token(&self.0, INT_NUMBER)
    }

    pub fn r_brack_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_BRACK)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Target(pub(crate) SyntaxNode);

impl AstNode for Target {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == TARGET
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Target(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Target {
    pub fn architecture_token(&self) -> Option<SyntaxToken> {
        token(&self.0, ARCHITECTURE_KW)
    }

    pub fn ty(&self) -> Option<Type> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum DeploymentItem {
    Activity(Activity),
    Setting(Setting),
}

impl AstNode for DeploymentItem {
    fn can_cast(kind: SyntaxKind) -> bool {
        matches!(kind, ACTIVITY | SETTING)
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Some(match node.kind() {
            ACTIVITY => DeploymentItem::Activity(Activity(node)),
            SETTING => DeploymentItem::Setting(Setting(node)),
            _ => return None,
        })
    }

    fn syntax(&self) -> &SyntaxNode {
        match self {
            DeploymentItem::Activity(it) => it.syntax(),
            DeploymentItem::Setting(it) => it.syntax(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Activity(pub(crate) SyntaxNode);

impl AstNode for Activity {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == ACTIVITY
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Activity(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Activity {
    pub fn activity_token(&self) -> Option<SyntaxToken> {
        token(&self.0, ACTIVITY_KW)
    }

    pub fn name_ref(&self) -> Option<NameRef> {
        child(&self.0)
    }

    pub fn l_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_CURLY)
    }

    pub fn fields(&self) -> impl Iterator<Item = Field> {
        children(&self.0)
    }

    pub fn r_curly_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_CURLY)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Field(pub(crate) SyntaxNode);

impl AstNode for Field {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == FIELD
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Field(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Field {
    pub fn name_ref(&self) -> Option<NameRef> {
        child(&self.0)
    }

    pub fn eq_token(&self) -> Option<SyntaxToken> {
        token(&self.0, EQ)
    }

    pub fn expr(&self) -> Option<Expr> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Statement {
    Var(Var),
    IfStatement(IfStatement),
    BlockStatement(BlockStatement),
    ReturnStatement(ReturnStatement),
    AssignStatement(AssignStatement),
    ExprStatement(ExprStatement),
}

impl AstNode for Statement {
    fn can_cast(kind: SyntaxKind) -> bool {
        matches!(kind, VAR | IF_STATEMENT | BLOCK_STATEMENT | RETURN_STATEMENT | ASSIGN_STATEMENT | EXPR_STATEMENT)
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Some(match node.kind() {
            VAR => Statement::Var(Var(node)),
            IF_STATEMENT => Statement::IfStatement(IfStatement(node)),
            BLOCK_STATEMENT => Statement::BlockStatement(BlockStatement(node)),
            RETURN_STATEMENT => Statement::ReturnStatement(ReturnStatement(node)),
            ASSIGN_STATEMENT => Statement::AssignStatement(AssignStatement(node)),
            EXPR_STATEMENT => Statement::ExprStatement(ExprStatement(node)),
            _ => return None,
        })
    }

    fn syntax(&self) -> &SyntaxNode {
        match self {
            Statement::Var(it) => it.syntax(),
            Statement::IfStatement(it) => it.syntax(),
            Statement::BlockStatement(it) => it.syntax(),
            Statement::ReturnStatement(it) => it.syntax(),
            Statement::AssignStatement(it) => it.syntax(),
            Statement::ExprStatement(it) => it.syntax(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct IfStatement(pub(crate) SyntaxNode);

impl AstNode for IfStatement {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == IF_STATEMENT
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(IfStatement(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl IfStatement {
    pub fn if_token(&self) -> Option<SyntaxToken> {
        token(&self.0, IF_KW)
    }

    pub fn condition(&self) -> Option<Expr> {
        child(&self.0)
    }

    pub fn then_token(&self) -> Option<SyntaxToken> {
        token(&self.0, THEN_KW)
    }

    pub fn then_block(&self) -> Option<Block> {
        child(&self.0)
    }

    pub fn else_branch(&self) -> Option<Else> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct BlockStatement(pub(crate) SyntaxNode);

impl AstNode for BlockStatement {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == BLOCK_STATEMENT
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(BlockStatement(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl BlockStatement {
    pub fn block(&self) -> Option<Block> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ReturnStatement(pub(crate) SyntaxNode);

impl AstNode for ReturnStatement {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == RETURN_STATEMENT
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(ReturnStatement(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl ReturnStatement {
    pub fn return_token(&self) -> Option<SyntaxToken> {
        token(&self.0, RETURN_KW)
    }

    pub fn expr(&self) -> Option<Expr> {
        child(&self.0)
    }

    pub fn semicolon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, SEMICOLON)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct AssignStatement(pub(crate) SyntaxNode);

impl AstNode for AssignStatement {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == ASSIGN_STATEMENT
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(AssignStatement(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl AssignStatement {
    pub fn name_ref(&self) -> Option<NameRef> {
        child(&self.0)
    }

    pub fn eq_token(&self) -> Option<SyntaxToken> {
        token(&self.0, EQ)
    }

    pub fn expr(&self) -> Option<Expr> {
        child(&self.0)
    }

    pub fn semicolon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, SEMICOLON)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ExprStatement(pub(crate) SyntaxNode);

impl AstNode for ExprStatement {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == EXPR_STATEMENT
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(ExprStatement(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl ExprStatement {
    pub fn expr(&self) -> Option<Expr> {
        child(&self.0)
    }

    pub fn semicolon_token(&self) -> Option<SyntaxToken> {
        token(&self.0, SEMICOLON)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Else(pub(crate) SyntaxNode);

impl AstNode for Else {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == ELSE
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Else(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Else {
    pub fn else_token(&self) -> Option<SyntaxToken> {
        token(&self.0, ELSE_KW)
    }

    pub fn block(&self) -> Option<Block> {
        child(&self.0)
    }

    pub fn if_statement(&self) -> Option<IfStatement> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Literal(pub(crate) SyntaxNode);

impl AstNode for Literal {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == LITERAL
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(Literal(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl Literal {
    pub fn int_number_token(&self) -> Option<SyntaxToken> {
        token(&self.0, INT_NUMBER)
    }

    pub fn float_number_token(&self) -> Option<SyntaxToken> {
        token(&self.0, FLOAT_NUMBER)
    }

    pub fn string_token(&self) -> Option<SyntaxToken> {
        token(&self.0, STRING)
    }

    pub fn true_token(&self) -> Option<SyntaxToken> {
        token(&self.0, TRUE_KW)
    }

    pub fn false_token(&self) -> Option<SyntaxToken> {
        token(&self.0, FALSE_KW)
    }

    pub fn new_data_token(&self) -> Option<SyntaxToken> {
        token(&self.0, NEW_DATA_KW)
    }

    pub fn old_data_token(&self) -> Option<SyntaxToken> {
        token(&self.0, OLD_DATA_KW)
    }

    pub fn no_data_token(&self) -> Option<SyntaxToken> {
        token(&self.0, NO_DATA_KW)
    }

    pub fn success_token(&self) -> Option<SyntaxToken> {
        token(&self.0, SUCCESS_KW)
    }

    pub fn not_ready_token(&self) -> Option<SyntaxToken> {
        token(&self.0, NOT_READY_KW)
    }

    pub fn failure_token(&self) -> Option<SyntaxToken> {
        token(&self.0, FAILURE_KW)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct NameExpr(pub(crate) SyntaxNode);

impl AstNode for NameExpr {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == NAME_EXPR
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(NameExpr(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl NameExpr {
    pub fn name_ref(&self) -> Option<NameRef> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct CallExpr(pub(crate) SyntaxNode);

impl AstNode for CallExpr {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == CALL_EXPR
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(CallExpr(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl CallExpr {
    pub fn name_ref(&self) -> Option<NameRef> {
        child(&self.0)
    }

    pub fn argument_list(&self) -> Option<ArgumentList> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ParenExpr(pub(crate) SyntaxNode);

impl AstNode for ParenExpr {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == PAREN_EXPR
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(ParenExpr(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl ParenExpr {
    pub fn l_paren_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_PAREN)
    }

    pub fn expr(&self) -> Option<Expr> {
        child(&self.0)
    }

    pub fn r_paren_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_PAREN)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct UnaryExpr(pub(crate) SyntaxNode);

impl AstNode for UnaryExpr {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == UNARY_EXPR
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(UnaryExpr(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl UnaryExpr {
    pub fn bang_token(&self) -> Option<SyntaxToken> {
        token(&self.0, BANG)
    }

    pub fn minus_token(&self) -> Option<SyntaxToken> {
        token(&self.0, MINUS)
    }

    pub fn expr(&self) -> Option<Expr> {
        child(&self.0)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct BinaryExpr(pub(crate) SyntaxNode);

impl AstNode for BinaryExpr {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == BINARY_EXPR
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(BinaryExpr(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl BinaryExpr {
    pub fn lhs(&self) -> Option<Expr> {
        child(&self.0)
    }

    pub fn pipe2_token(&self) -> Option<SyntaxToken> {
        token(&self.0, PIPE2)
    }

    pub fn amp2_token(&self) -> Option<SyntaxToken> {
        token(&self.0, AMP2)
    }

    pub fn eq2_token(&self) -> Option<SyntaxToken> {
        token(&self.0, EQ2)
    }

    pub fn neq_token(&self) -> Option<SyntaxToken> {
        token(&self.0, NEQ)
    }

    pub fn lt_token(&self) -> Option<SyntaxToken> {
        token(&self.0, LT)
    }

    pub fn lteq_token(&self) -> Option<SyntaxToken> {
        token(&self.0, LTEQ)
    }

    pub fn gt_token(&self) -> Option<SyntaxToken> {
        token(&self.0, GT)
    }

    pub fn gteq_token(&self) -> Option<SyntaxToken> {
        token(&self.0, GTEQ)
    }

    pub fn plus_token(&self) -> Option<SyntaxToken> {
        token(&self.0, PLUS)
    }

    pub fn minus_token(&self) -> Option<SyntaxToken> {
        token(&self.0, MINUS)
    }

    pub fn star_token(&self) -> Option<SyntaxToken> {
        token(&self.0, STAR)
    }

    pub fn slash_token(&self) -> Option<SyntaxToken> {
        token(&self.0, SLASH)
    }

    pub fn percent_token(&self) -> Option<SyntaxToken> {
        token(&self.0, PERCENT)
    }

    pub fn rhs(&self) -> Option<Expr> {
        nth_child(&self.0, 1)
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ArgumentList(pub(crate) SyntaxNode);

impl AstNode for ArgumentList {
    fn can_cast(kind: SyntaxKind) -> bool {
        kind == ARGUMENT_LIST
    }

    fn cast(node: SyntaxNode) -> Option<Self> {
        Self::can_cast(node.kind()).then_some(ArgumentList(node))
    }

    fn syntax(&self) -> &SyntaxNode {
        &self.0
    }
}

impl ArgumentList {
    pub fn l_paren_token(&self) -> Option<SyntaxToken> {
        token(&self.0, L_PAREN)
    }

    pub fn exprs(&self) -> impl Iterator<Item = Expr> {
        children(&self.0)
    }

    pub fn comma_token(&self) -> Option<SyntaxToken> {
        token(&self.0, COMMA)
    }

    pub fn r_paren_token(&self) -> Option<SyntaxToken> {
        token(&self.0, R_PAREN)
    }
}
