//! Signatures of callables, and the expected type at a half-typed token.

use mauve_hir::item_tree::{Direction, Feature, FeatureKind, Name, Parameter, TypeRef};
use mauve_hir::{
    Builtin, Decl, FeaturesByName, LikelyCallee, ModelDb, Project, Type, VariableKind, VariableOf,
    VisibleScope, codel, type_of,
};
use mauve_syntax::SyntaxKind::*;
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::keywords::{CallStatus, PortStatus, TruthValue};
use mauve_syntax::{SyntaxToken, TextRange, TextSize, previous_significant};

use crate::position::{Call, Position, behind, call_around};

/// The names in scope at the cursor, with their roles in calls and assignments.
pub(crate) struct CursorScope<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    pub(crate) visible: VisibleScope<'db>,
}

#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct WantedValue {
    pub(crate) ty: Option<Type>,
    /// A name that can be assigned.
    pub(crate) is_output: bool,
    /// A port or an operation of this kind.
    pub(crate) feature: Option<FeatureKind>,
    /// A handler.
    pub(crate) handler: bool,
    /// No further argument.
    pub(crate) nothing: bool,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Callable<'db> {
    pub(crate) name: String,
    pub(crate) parameters: Vec<CallParameter>,
    pub(crate) result: Type,
    pub(crate) result_text: String,
    /// Its declaration, and the name of the operation in it.
    pub(crate) declared: Option<(Decl<'db>, Option<Name>)>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct CallParameter {
    pub(crate) name: String,
    pub(crate) text: String,
    pub(crate) expected: WantedValue,
}

impl Callable<'_> {
    /// Returns `f(in a: int): bool`, and the range of each parameter in it.
    pub(crate) fn shown(&self) -> (String, Vec<TextRange>) {
        let mut label = format!("{}(", self.name);
        let mut ranges = Vec::new();
        for (index, parameter) in self.parameters.iter().enumerate() {
            if index > 0 {
                label += ", ";
            }
            ranges.push(TextRange::at(TextSize::of(&label), TextSize::of(&parameter.text)));
            label += &parameter.text;
        }
        label += ")";
        if !self.result_text.is_empty() {
            label += ": ";
            label += &self.result_text;
        }
        (label, ranges)
    }
}

/// Returns the features of this kind, each with the shell that declares it.
pub(crate) fn of_kind<'a, 'db>(
    features: &'a FeaturesByName<'db>,
    kind: FeatureKind,
) -> impl Iterator<Item = (&'a Name, Decl<'db>, &'db Feature)> {
    let all = features.iter().filter(move |(_, (_, feature))| feature.kind == kind);
    all.map(|(name, (shell, feature))| (name, *shell, *feature))
}

/// `(in a: int, b: int)`
pub(crate) fn parameters_text(parameters: &[Parameter]) -> String {
    let all: Vec<String> = parameters.iter().map(parameter_text).collect();
    format!("({})", all.join(", "))
}

fn parameter_text(parameter: &Parameter) -> String {
    let direction = parameter.direction.keyword();
    let ty = parameter.ty.as_ref().map_or_else(|| "?".to_owned(), ToString::to_string);
    format!("{direction} {}: {ty}", parameter.name.name)
}

/// `: bool`
pub(crate) fn result_text(result: Option<&TypeRef>) -> String {
    result.map_or_else(String::new, |result| format!(": {result}"))
}

/// Returns the type of a variable as text; for a handler, its operation.
pub(crate) fn written_type(variable: &VariableOf) -> String {
    variable.written.as_ref().map_or_else(String::new, ToString::to_string)
}

impl<'db> CursorScope<'db> {
    pub(crate) fn at(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        decl: Option<Decl<'db>>,
        at: &Position,
    ) -> CursorScope<'db> {
        // A declaration is not in its own scope: the scope ends at the start of the half-typed statement.
        let end = at.item.first().map_or(at.word.start(), |token| token.text_range().start());
        CursorScope { db, project, visible: VisibleScope::at(db, project, decl, &at.list, end) }
    }

    pub(crate) fn variables(&self) -> impl Iterator<Item = &'db VariableOf> {
        self.visible.variables.iter().map(|(_, variable)| *variable)
    }

    pub(crate) fn features(
        &self,
        kind: FeatureKind,
    ) -> impl Iterator<Item = (&Name, Decl<'db>, &'db Feature)> {
        of_kind(&self.visible.features, kind)
    }

    pub(crate) fn handlers(&self) -> impl Iterator<Item = &'db VariableOf> {
        self.variables().filter(|it| it.kind == VariableKind::Handler)
    }

    fn type_of(&self, of: Decl<'db>, ty: Option<&TypeRef>) -> Type {
        type_of(self.db, self.project, of, ty)
    }

    fn callable(&self, name: &str, first: Option<&str>) -> Option<Callable<'db>> {
        match self.visible.resolve_call(name, first)? {
            LikelyCallee::Codel(of) => self.codel(of),
            LikelyCallee::Provided(shell, feature) => Some(self.operation(shell, feature)),
            LikelyCallee::Builtin(builtin) => Some(self.built_in(builtin, first)),
        }
    }

    pub(crate) fn operation(&self, shell: Decl<'db>, feature: &Feature) -> Callable<'db> {
        let name = &feature.name.name;
        let declared = self.visible.definer_of(name).unwrap_or(shell);
        self.declared(shell, &feature.parameters, feature.ty.as_ref(), (declared, Some(name.clone())))
    }

    pub(crate) fn codel(&self, of: Decl<'db>) -> Option<Callable<'db>> {
        let data = codel(self.db, of)?;
        Some(self.declared(of, &data.parameters, data.result.as_ref(), (of, None)))
    }

    /// Returns the callable of a codel or an operation that `of` declares.
    fn declared(
        &self,
        of: Decl<'db>,
        parameters: &[Parameter],
        result: Option<&TypeRef>,
        declared: (Decl<'db>, Option<Name>),
    ) -> Callable<'db> {
        Callable {
            name: declared.1.as_ref().unwrap_or(of.name(self.db)).to_string(),
            parameters: self.parameters(of, parameters),
            result: self.type_of(of, result),
            result_text: result.map_or_else(String::new, ToString::to_string),
            declared: Some(declared),
        }
    }

    fn parameters(&self, of: Decl<'db>, parameters: &[Parameter]) -> Vec<CallParameter> {
        let parameter = |it: &Parameter| CallParameter {
            name: it.name.name.to_string(),
            text: parameter_text(it),
            expected: WantedValue {
                ty: Some(self.type_of(of, it.ty.as_ref())),
                is_output: it.direction != Direction::In,
                ..WantedValue::default()
            },
        };
        parameters.iter().map(parameter).collect()
    }

    /// Returns the signature of a built-in function, with the types of the port or the operation in `first`.
    pub(crate) fn built_in(&self, builtin: Builtin, first: Option<&str>) -> Callable<'db> {
        let (kind, what, result, result_text) = match builtin {
            Builtin::Read => (Some(FeatureKind::Input), "input port", Type::PortStatus, "port status"),
            Builtin::Write => (Some(FeatureKind::Output), "output port", Type::Void, "void"),
            Builtin::Status => (Some(FeatureKind::Input), "input port", Type::PortStatus, "port status"),
            Builtin::Send => {
                let handle = Type::Handle(first.map_or_else(Name::default, Name::from));
                (Some(FeatureKind::Required), "required operation", handle, "handler")
            }
            Builtin::Collect => (None, "handler", Type::CallStatus, "call status"),
        };
        let handler = self.handlers().find(|it| kind.is_none() && first == Some(it.name.name.as_str()));
        let operation = handler.map(written_type);
        let found = operation.as_deref().or(first).and_then(|name| self.visible.features.get_key_value(name));
        let found = found.map(|(name, (shell, feature))| (name, *shell, *feature));
        let found = match kind {
            Some(kind) => found.filter(|(_, _, feature)| feature.kind == kind),
            None => found.filter(|_| handler.is_some()),
        };
        let text = match (handler, found) {
            (Some(handler), _) => format!("{}: handler of {}", handler.name.name, written_type(handler)),
            (None, Some((name, _, Feature { ty: Some(ty), kind, .. }))) if kind.is_port() => {
                format!("{name}: {what} {ty}")
            }
            (None, Some((name, ..))) => format!("{name}: {what}"),
            (None, None) => what.to_owned(),
        };
        let name = what.rsplit(' ').next().unwrap_or(what).to_owned();
        let expected = WantedValue { feature: kind, handler: kind.is_none(), ..WantedValue::default() };
        let mut parameters = vec![CallParameter { name, text, expected }];
        let value = |name: &str, is_output: bool| {
            let written = found.and_then(|(_, _, feature)| feature.ty.as_ref());
            let text = written.map_or_else(|| name.to_owned(), |ty| format!("{name}: {ty}"));
            let text = if is_output { format!("out {text}") } else { text };
            let ty = found.map(|(_, shell, _)| self.type_of(shell, written));
            let expected = WantedValue { ty, is_output, ..WantedValue::default() };
            CallParameter { name: name.to_owned(), text, expected }
        };
        // The parameters of the operation without those of the other direction.
        let without = |direction: Direction| {
            let (_, shell, feature) = found?;
            let all = feature.parameters.iter().zip(self.parameters(shell, &feature.parameters));
            Some(all.filter(move |(it, _)| it.direction != direction).map(|(_, parameter)| parameter))
        };
        match builtin {
            Builtin::Read => parameters.push(value("variable", true)),
            Builtin::Write => parameters.push(value("value", false)),
            Builtin::Status => {}
            Builtin::Send => {
                parameters.extend(without(Direction::Out).into_iter().flatten().map(|mut parameter| {
                    parameter.expected.is_output = false;
                    parameter
                }));
            }
            Builtin::Collect => {
                let is_void = |(_, shell, feature): (_, _, &Feature)| {
                    self.type_of(shell, feature.ty.as_ref()) == Type::Void
                };
                parameters.extend(found.filter(|it| !is_void(*it)).map(|_| value("result", true)));
                parameters.extend(without(Direction::In).into_iter().flatten());
            }
        }
        let declared = found.map(|(name, shell, _)| (shell, Some(name.clone())));
        let (name, result_text) = (builtin.name().to_owned(), result_text.to_owned());
        Callable { name, parameters, result, result_text, declared }
    }

    pub(crate) fn called(&self, call: &Call) -> Option<Callable<'db>> {
        let brace = call.arguments.first_token();
        let first = brace.and_then(|brace| behind(brace.clone(), brace.text_range().end()));
        let first = first.filter(|first| first.kind().is_word());
        self.callable(call.callee.text(), first.as_ref().map(SyntaxToken::text))
    }

    /// Returns the expected operand after `left` in an expression, or `None` if no operand is allowed.
    pub(crate) fn expected(&self, left: &SyntaxToken) -> Option<WantedValue> {
        let of = |ty: Option<Type>| Some(WantedValue { ty, ..WantedValue::default() });
        let previous = || previous_significant(left);
        match left.kind() {
            EQ => of(self.assigned_at(left)),
            RETURN_KW => of(self.visible.result.clone()),
            IF_KW | BANG | AMP2 | PIPE2 => of(Some(Type::Bool)),
            L_PAREN | COMMA => {
                let list = left.parent()?;
                match list.kind() {
                    PAREN_EXPR => self.expected(&previous()?).or_else(WantedValue::any),
                    _ => {
                        let call = call_around(left)?;
                        let Some(called) = self.called(&call) else { return WantedValue::any() };
                        let parameter = called.parameters.into_iter().nth(call.index);
                        let nothing = WantedValue { nothing: true, ..WantedValue::default() };
                        Some(parameter.map_or(nothing, |parameter| parameter.expected))
                    }
                }
            }
            EQ2 | NEQ => of(previous().and_then(|operand| self.type_of_operand(&operand))),
            LT | LTEQ | GT | GTEQ | PLUS | MINUS | STAR | SLASH | PERCENT => {
                let ty = previous().and_then(|operand| self.type_of_operand(&operand));
                of(ty.or(Some(Type::Double)))
            }
            // The bounds of an interval.
            L_BRACK | SEMICOLON if left.parent().is_some_and(|it| it.kind() == INTERVAL) => {
                WantedValue::any()
            }
            _ => None,
        }
    }

    fn assigned_at(&self, equals: &SyntaxToken) -> Option<Type> {
        let parent = equals.parent()?;
        match parent.kind() {
            ASSIGN_STATEMENT => {
                let name = ast::AssignStatement::cast(parent)?.name_ref()?;
                self.visible.type_of_name(&name.syntax().text().to_string())
            }
            INITIALIZER => {
                self.visible.type_of_written(&parent.parent()?.children().find_map(ast::Type::cast)?)
            }
            _ => None,
        }
    }

    fn type_of_operand(&self, last: &SyntaxToken) -> Option<Type> {
        match last.kind() {
            IDENT => self.visible.type_of_name(last.text()),
            R_PAREN => {
                let list = last.parent().filter(|list| list.kind() == ARGUMENT_LIST)?;
                let open = list.first_token()?;
                let callee = previous_significant(&open)?;
                let call = Call { callee, arguments: list, index: 0 };
                Some(self.called(&call)?.result)
            }
            INT_NUMBER => Some(Type::INT),
            FLOAT_NUMBER => Some(Type::Double),
            STRING => Some(Type::String),
            kind if TruthValue::from_kind(kind).is_some() => Some(Type::Bool),
            kind if PortStatus::from_kind(kind).is_some() => Some(Type::PortStatus),
            kind if CallStatus::from_kind(kind).is_some() => Some(Type::CallStatus),
            _ => None,
        }
    }
}

impl WantedValue {
    fn any() -> Option<WantedValue> {
        Some(WantedValue::default())
    }

    /// Returns whether a value of this type fits; also if a type is unknown.
    pub(crate) fn takes(&self, ty: &Type) -> bool {
        self.ty.as_ref().is_none_or(|wanted| ty.fits(None, wanted))
    }
}
