//! What the programs of a core may name where the cursor is, and what is expected there. The text is half typed: what cannot
//! be told for sure elsewhere is guessed here.

use std::collections::{BTreeMap, BTreeSet};

use mauve_hir::item_tree::{Direction, Feature, FeatureKind, Kind, Name, Parameter, SourceId, TypeRef};
use mauve_hir::{
    CallError, Callee, Decl, ModelDb, Project, Semantics, Type, VariableKind, VisibleScope, codel, component,
    core, names_of, shell, type_of,
};
use mauve_syntax::SyntaxKind::*;
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::keywords::{CallStatus, PortStatus, TruthValue};
use mauve_syntax::{SyntaxToken, previous_significant};

use crate::completion::Subject;
use crate::completion::position::{Call, Position, behind, call_around};

/// What a name in a program may stand for.
pub(crate) struct Scope<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    /// The core around the cursor.
    pub(crate) core: Option<Decl<'db>>,
    /// The shell of that core.
    pub(crate) shell: Option<Decl<'db>>,
    /// Innermost first, each name once.
    pub(crate) variables: Vec<Variable>,
    /// The features of the shell, by name.
    pub(crate) features: BTreeMap<Name, (Decl<'db>, &'db Feature)>,
    /// The operations that the core defines.
    pub(crate) defined: BTreeSet<Name>,
    /// The type that the program around the cursor must give back; none outside programs.
    pub(crate) result: Option<Type>,
    /// What resolves calls in the core, and the variables that hide what is called.
    semantics: Option<(Semantics<'db>, VisibleScope<'db>)>,
}

/// A variable, a parameter or a handler.
pub(crate) struct Variable {
    pub(crate) name: Name,
    pub(crate) kind: VariableKind,
    pub(crate) ty: Type,
    /// The type as it is written; of a handler, its operation.
    pub(crate) text: String,
}

/// What is expected at a place in a program.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Expected {
    /// A value of this type, where that is known.
    pub(crate) ty: Option<Type>,
    /// Only something that can be assigned to.
    pub(crate) is_output: bool,
    /// A port or an operation of this kind, and no value.
    pub(crate) feature: Option<FeatureKind>,
    /// A handler, and no value.
    pub(crate) handler: bool,
    /// No further argument is taken.
    pub(crate) nothing: bool,
}

/// Something that can be called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Callable<'db> {
    pub(crate) name: String,
    pub(crate) parameters: Vec<CallParameter>,
    pub(crate) result: Type,
    /// The result as it is written.
    pub(crate) result_text: String,
    /// Where it is declared: the declaration, and the name of the operation in it.
    pub(crate) declared: Option<(Decl<'db>, Option<Name>)>,
}

/// What a call takes at a place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct CallParameter {
    pub(crate) name: String,
    /// All of it, as a signature shows it.
    pub(crate) text: String,
    pub(crate) expected: Expected,
}

impl Callable<'_> {
    /// `f(in a: int): bool`, and where in it each parameter stands, in bytes.
    pub(crate) fn shown(&self) -> (String, Vec<(usize, usize)>) {
        let mut label = format!("{}(", self.name);
        let mut places = Vec::new();
        for (index, parameter) in self.parameters.iter().enumerate() {
            if index > 0 {
                label += ", ";
            }
            let start = label.len();
            label += &parameter.text;
            places.push((start, label.len()));
        }
        label += ")";
        if !self.result_text.is_empty() {
            label += ": ";
            label += &self.result_text;
        }
        (label, places)
    }
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

/// What `path`, written in `from`, means. Where the text is damaged, what it most likely means.
pub(crate) fn resolved<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    from: Decl<'db>,
    kind: Kind,
    path: &[Name],
) -> Option<Decl<'db>> {
    let names = names_of(db, project);
    let library = from.library(db).as_ref();
    let found = names.resolve(db, library, kind, path);
    found.ok().or_else(|| match path {
        [name] => {
            let mut all = names.anywhere(kind, name).iter();
            let own = all.clone().find(|decl| decl.library(db).as_ref() == library);
            own.or_else(|| all.next()).copied()
        }
        [of, name] => names.in_library(Some(of), kind, name).first().copied(),
        _ => None,
    })
}

/// The features of a shell and of those that it extends, by name, as far as they are understood.
pub(crate) fn features<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> BTreeMap<Name, (Decl<'db>, &'db Feature)> {
    let mut found = BTreeMap::new();
    let (mut all, mut next) = (vec![of], 0);
    while let Some(&current) = all.get(next) {
        next += 1;
        let Some(data) = shell(db, current) else { continue };
        for feature in data.features.iter().filter(|it| !it.name.name.is_empty()) {
            found.entry(feature.name.name.clone()).or_insert((current, feature));
        }
        for base in &data.bases {
            if let Some(base) = resolved(db, project, current, Kind::Shell, &base.path)
                && !all.contains(&base)
            {
                all.push(base);
            }
        }
    }
    found
}

/// The shell of a component, as far as it is understood.
pub(crate) fn shell_of_component<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Option<Decl<'db>> {
    resolved(db, project, of, Kind::Shell, &component(db, of)?.shell.as_ref()?.path)
}

impl<'db> Scope<'db> {
    /// What is seen at a position in `decl`.
    pub(crate) fn at(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        decl: Option<Decl<'db>>,
        at: &Position,
    ) -> Scope<'db> {
        let core_decl = decl.filter(|decl| decl.kind(db) == Kind::Core);
        let data = core_decl.and_then(|of| core(db, of));
        let of_core =
            core_decl.and_then(|of| resolved(db, project, of, Kind::Shell, &data?.shell.as_ref()?.path));
        let shell = of_core.or(decl.filter(|decl| decl.kind(db) == Kind::Shell));
        let defined = data.into_iter().flat_map(|data| &data.operations);
        let semantics = core_decl.and_then(|of| Semantics::of_core(db, project, of));
        // A declaration does not see itself: it begins where the statement does that is typed.
        let end = at.item.first().map_or(at.word.start(), |token| token.text_range().start());
        let visible = semantics.as_ref().map(|semantics| semantics.scope_in(&at.list, end));
        let variables = visible.iter().flat_map(|visible| &visible.variables);
        let variables = variables.map(|(_, it)| Variable {
            name: it.name.name.clone(),
            kind: it.kind,
            ty: it.ty.clone(),
            text: it.written.as_ref().map_or_else(String::new, ToString::to_string),
        });
        Scope {
            db,
            project,
            core: core_decl,
            shell,
            variables: variables.collect(),
            features: shell.map_or_else(BTreeMap::new, |shell| features(db, project, shell)),
            defined: defined.map(|operation| operation.name.name.clone()).collect(),
            result: semantics.as_ref().and_then(|semantics| semantics.result_in(&at.list)),
            semantics: semantics.zip(visible),
        }
    }

    /// What a written type refers to.
    fn type_of(&self, of: Decl<'db>, ty: Option<&ast::Type>) -> Type {
        let Some(ty) = ty else { return Type::Unknown };
        let path = ty.segments().map(|it| it.syntax().text().to_string().into()).collect();
        type_of(self.db, self.project, of, Some(&TypeRef { path, id: SourceId(0) }))
    }

    /// The type of a variable, or of a property, a constant or a port.
    pub(crate) fn type_of_name(&self, name: &str) -> Option<Type> {
        let variable = self.variables.iter().find(|variable| variable.name == *name);
        variable.map(|variable| variable.ty.clone()).or_else(|| {
            let (shell, feature) = self.features.get(name)?;
            Some(type_of(self.db, self.project, *shell, feature.ty.as_ref()))
        })
    }

    /// What a call of `name` with this first argument calls; where the text is damaged, what it most likely calls.
    pub(crate) fn callable(&self, name: &str, first: Option<&str>) -> Option<Callable<'db>> {
        let (semantics, visible) = self.semantics.as_ref()?;
        match semantics.resolve_call(visible, &name.into(), first.map(Name::from).as_ref())?.callee {
            Ok(Callee::Codel(of)) => return self.codel(of),
            Ok(Callee::Builtin(_)) | Err(CallError::UnresolvedOperand(_)) => {
                return self.built_in(name, first);
            }
            Err(CallError::NotCallable(_)) => return None,
            Ok(Callee::Operation(_)) | Err(_) => {}
        }
        if let Some(found) = self.operation(name) {
            return Some(found);
        }
        let codel = self.core.and_then(|of| {
            let found = resolved(self.db, self.project, of, Kind::Codel, &[name.into()])?;
            self.codel(found)
        });
        codel.or_else(|| self.built_in(name, first))
    }

    /// One's own operation.
    pub(crate) fn operation(&self, name: &str) -> Option<Callable<'db>> {
        let (shell, feature) = self.features.get(name)?;
        if feature.kind != FeatureKind::Provided {
            return None;
        }
        let parameters = self.parameters(*shell, &feature.parameters);
        let declared = self.core.filter(|_| self.defined.contains(name)).unwrap_or(*shell);
        Some(Callable {
            name: name.to_owned(),
            parameters,
            result: type_of(self.db, self.project, *shell, feature.ty.as_ref()),
            result_text: feature.ty.as_ref().map_or_else(String::new, ToString::to_string),
            declared: Some((declared, Some(name.into()))),
        })
    }

    /// A codel.
    pub(crate) fn codel(&self, of: Decl<'db>) -> Option<Callable<'db>> {
        let data = codel(self.db, of)?;
        Some(Callable {
            name: of.name(self.db).to_string(),
            parameters: self.parameters(of, &data.parameters),
            result: type_of(self.db, self.project, of, data.result.as_ref()),
            result_text: data.result.as_ref().map_or_else(String::new, ToString::to_string),
            declared: Some((of, None)),
        })
    }

    fn parameters(&self, of: Decl<'db>, parameters: &[Parameter]) -> Vec<CallParameter> {
        let parameter = |it: &Parameter| CallParameter {
            name: it.name.name.to_string(),
            text: parameter_text(it),
            expected: Expected {
                ty: Some(type_of(self.db, self.project, of, it.ty.as_ref())),
                is_output: it.direction != Direction::In,
                ..Expected::default()
            },
        };
        parameters.iter().map(parameter).collect()
    }

    /// `read`, `write`, `status`, `send` and `collect`, with the types of the port or operation that `first` is.
    pub(crate) fn built_in(&self, name: &str, first: Option<&str>) -> Option<Callable<'db>> {
        let feature = |kind: FeatureKind, what: &str| {
            let found = first.and_then(|first| self.features.get_key_value(first));
            let found = found.filter(|(_, (_, feature))| feature.kind == kind);
            let expected = Expected { feature: Some(kind), ..Expected::default() };
            let ty = found.and_then(|(_, (_, feature))| feature.ty.as_ref());
            let text = match (found, ty) {
                (Some((name, _)), Some(ty)) if kind.is_port() => format!("{name}: {what} {ty}"),
                (Some((name, _)), _) => format!("{name}: {what}"),
                (None, _) => what.to_owned(),
            };
            let parameter =
                CallParameter { name: what.rsplit(' ').next().unwrap_or(what).to_owned(), text, expected };
            (parameter, found.map(|(name, (shell, feature))| (name, *shell, *feature)))
        };
        let value = |found: Option<(&Name, Decl<'db>, &Feature)>, name: &str, is_output: bool| {
            let ty = found.and_then(|(_, _, feature)| feature.ty.as_ref());
            let text = ty.map_or_else(|| name.to_owned(), |ty| format!("{name}: {ty}"));
            let ty = found.map(|(_, shell, _)| type_of(self.db, self.project, shell, ty));
            let text = if is_output { format!("out {text}") } else { text };
            let expected = Expected { ty, is_output, ..Expected::default() };
            CallParameter { name: name.to_owned(), text, expected }
        };
        let mut declared = None;
        let (parameters, result, result_text) = match name {
            "read" => {
                let (port, found) = feature(FeatureKind::Input, "input port");
                declared = found.map(|(name, shell, _)| (shell, Some(name.clone())));
                (vec![port, value(found, "variable", true)], Type::PortStatus, "port status")
            }
            "write" => {
                let (port, found) = feature(FeatureKind::Output, "output port");
                declared = found.map(|(name, shell, _)| (shell, Some(name.clone())));
                (vec![port, value(found, "value", false)], Type::Void, "void")
            }
            "status" => {
                let (port, found) = feature(FeatureKind::Input, "input port");
                declared = found.map(|(name, shell, _)| (shell, Some(name.clone())));
                (vec![port], Type::PortStatus, "port status")
            }
            "send" => {
                let (operation, found) = feature(FeatureKind::Required, "required operation");
                declared = found.map(|(name, shell, _)| (shell, Some(name.clone())));
                let mut parameters = vec![operation];
                if let Some((_, shell, feature)) = found {
                    let all = feature.parameters.iter().zip(self.parameters(shell, &feature.parameters));
                    // What comes back, `collect` gives.
                    let goes = all.filter(|(it, _)| it.direction != Direction::Out);
                    parameters.extend(goes.map(|(_, mut parameter)| {
                        parameter.expected.is_output = false;
                        parameter
                    }));
                }
                let of = first.map_or_else(Name::default, Name::from);
                (parameters, Type::Handle(of), "handler")
            }
            "collect" => {
                let handler = self.variables.iter().find(|variable| {
                    variable.kind == VariableKind::Handler && first == Some(variable.name.as_str())
                });
                let found = handler.and_then(|handler| self.features.get_key_value(handler.text.as_str()));
                let text = match handler {
                    Some(handler) => format!("{}: handler of {}", handler.name, handler.text),
                    None => "handler".to_owned(),
                };
                let expected = Expected { handler: true, ..Expected::default() };
                let mut parameters = vec![CallParameter { name: "handler".to_owned(), text, expected }];
                if let Some((name, (shell, feature))) = found {
                    declared = Some((*shell, Some(name.clone())));
                    let found = Some((name, *shell, *feature));
                    if type_of(self.db, self.project, *shell, feature.ty.as_ref()) != Type::Void {
                        parameters.push(value(found, "result", true));
                    }
                    let all = feature.parameters.iter().zip(self.parameters(*shell, &feature.parameters));
                    let comes = all.filter(|(it, _)| it.direction != Direction::In);
                    parameters.extend(comes.map(|(_, parameter)| parameter));
                }
                (parameters, Type::CallStatus, "call status")
            }
            _ => return None,
        };
        let (name, result_text) = (name.to_owned(), result_text.to_owned());
        Some(Callable { name, parameters, result, result_text, declared })
    }

    /// What the call around the cursor is of.
    pub(crate) fn called(&self, call: &Call) -> Option<Callable<'db>> {
        let brace = call.arguments.first_token();
        let first = brace.and_then(|brace| behind(brace.clone(), brace.text_range().end()));
        let first = first.filter(|first| first.kind().is_word());
        self.callable(call.callee.text(), first.as_ref().map(SyntaxToken::text))
    }

    /// What is expected behind `left`, in an expression; none where no operand may stand there.
    pub(crate) fn expected(&self, left: &SyntaxToken) -> Option<Expected> {
        let of = |ty: Option<Type>| Some(Expected { ty, ..Expected::default() });
        let previous = || previous_significant(left);
        match left.kind() {
            EQ => of(self.assigned_at(left)),
            RETURN_KW => of(self.result.clone()),
            IF_KW | BANG | AMP2 | PIPE2 => of(Some(Type::Bool)),
            L_PAREN | COMMA => {
                let list = left.parent()?;
                match list.kind() {
                    PAREN_EXPR => self.expected(&previous()?).or_else(Expected::any),
                    _ => {
                        let call = call_around(left)?;
                        let Some(called) = self.called(&call) else { return Expected::any() };
                        let parameter = called.parameters.into_iter().nth(call.index);
                        let nothing = Expected { nothing: true, ..Expected::default() };
                        Some(parameter.map_or(nothing, |parameter| parameter.expected))
                    }
                }
            }
            EQ2 | NEQ => of(previous().and_then(|operand| self.type_of_operand(&operand))),
            LT | LTEQ | GT | GTEQ | PLUS | MINUS | STAR | SLASH | PERCENT => {
                let ty = previous().and_then(|operand| self.type_of_operand(&operand));
                of(ty.or(Some(Type::Double)))
            }
            // The ends of an interval.
            L_BRACK | SEMICOLON if left.parent().is_some_and(|it| it.kind() == INTERVAL) => Expected::any(),
            _ => None,
        }
    }

    fn assigned_at(&self, equals: &SyntaxToken) -> Option<Type> {
        let parent = equals.parent()?;
        match parent.kind() {
            ASSIGN_STATEMENT => {
                let name = ast::AssignStatement::cast(parent)?.name_ref()?;
                self.type_of_name(&name.syntax().text().to_string())
            }
            INITIALIZER => {
                let ty = parent.parent()?.children().find_map(ast::Type::cast);
                Some(self.type_of(self.core.or(self.shell)?, ty.as_ref()))
            }
            _ => None,
        }
    }

    /// The type of the operand that ends with this token.
    fn type_of_operand(&self, last: &SyntaxToken) -> Option<Type> {
        match last.kind() {
            IDENT => self.type_of_name(last.text()),
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

impl Expected {
    /// Any value.
    fn any() -> Option<Expected> {
        Some(Expected::default())
    }

    /// Would a value of this type fit? Also where nobody knows.
    pub(crate) fn takes(&self, ty: &Type) -> bool {
        self.ty.as_ref().is_none_or(|wanted| ty.fits(None, wanted))
    }
}

/// What the place where something is declared is called.
pub(crate) fn subject<'db>(db: &'db dyn ModelDb, callable: &Callable<'db>) -> Option<Subject> {
    callable.declared.as_ref().map(|(decl, member)| Subject::of(db, *decl, member.clone()))
}
