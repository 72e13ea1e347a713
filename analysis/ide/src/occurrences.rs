//! All names of a text with their definitions. Navigation, references, renames and colours use these results, so that they never
//! disagree. Names in timing tables and in `mauve.toml` are in `occurrences/toml.rs`.

mod in_file;
mod toml;

pub(crate) use in_file::{definition_of_type, names_at, names_in, names_of_definition};
pub(crate) use toml::in_toml;

use std::ops::Range;

pub(crate) use mauve_diagnostics::{each_once, grouped};
use mauve_hir::item_tree::{
    Architecture, Core, Data, Deployment, Direction, Endpoint, Expr, FeatureKind, Kind, Name, NameRef,
    Parameter, Setting, Shell, SourceId, Statement, Transition, TypeRef, Variable,
};
use mauve_hir::{
    Binding, Builtin, Callee, CoreInference, Decl, File, Location, ModelDb, Project, Type, VariableKind,
    data, declaration_map, features_of, first_target_of, flat_of, includes, inference_of_core, names_of,
    parse, resolve_type, shell_of, source_map, type_of,
};
use mauve_syntax::SyntaxKind::{CODEL, OPERATION_DECLARATION, PARAM, PORT, PROPERTY, RESULT_TYPE, VAR};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::keywords::ActivityField;
use mauve_syntax::{SyntaxNode, TextRange, TextSize};

use crate::document_symbols::SymbolKind;

/// The definition of a name: two names refer to the same definition if these are equal.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub(crate) enum Definition<'db> {
    Declaration(Decl<'db>),
    /// An item inside a declaration, by the location of its name.
    At(Location<'db>),
    /// A library, with all its blocks.
    Library(Name),
    Package(Name),
    Message(Name, Name),
    /// A built-in type, or a type from `mauve.toml`.
    Type(Name),
    File(File),
}

impl<'db> Definition<'db> {
    /// Returns the location of its name; none for libraries, which may have several, and for definitions outside models.
    pub(crate) fn place(&self) -> Option<Location<'db>> {
        match self {
            Definition::Declaration(decl) => Some(Location::name_of(*decl)),
            Definition::At(place) => Some(place.clone()),
            _ => None,
        }
    }

    /// Returns the declaration, if it is one of this kind.
    pub(crate) fn declaration(&self, db: &'db dyn ModelDb, kind: Kind) -> Option<Decl<'db>> {
        match self {
            Definition::Declaration(decl) if decl.kind(db) == kind => Some(*decl),
            _ => None,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum OccurrenceRole {
    Declaration,
    /// The definition of an operation in a core; the core's shell declares it.
    Definition,
    Read,
    Write,
    /// An `inout` argument.
    ReadWrite,
    Call,
    /// A mention without access.
    Mention,
}

/// A name of a declaration.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub(crate) struct Occurrence<'db> {
    pub(crate) id: SourceId,
    /// The index of the name within `library.Name`.
    pub(crate) segment: Option<usize>,
    pub(crate) definition: Definition<'db>,
    pub(crate) kind: SymbolKind,
    pub(crate) role: OccurrenceRole,
}

/// A name with its location.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub(crate) struct FoundName<'db> {
    pub(crate) file: File,
    pub(crate) of: Option<Decl<'db>>,
    /// Without quotes.
    pub(crate) range: TextRange,
    pub(crate) definition: Definition<'db>,
    pub(crate) kind: SymbolKind,
    pub(crate) role: OccurrenceRole,
}

pub(crate) fn in_declaration<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    decl: Decl<'db>,
) -> Vec<FoundName<'db>> {
    located(db, decl, occurrences_of(db, project, decl))
}

/// Returns the names of a declaration with their locations.
fn located<'a, 'db: 'a>(
    db: &'db dyn ModelDb,
    decl: Decl<'db>,
    names: impl IntoIterator<Item = &'a Occurrence<'db>>,
) -> Vec<FoundName<'db>> {
    let Some(map) = declaration_map(db, decl) else { return Vec::new() };
    let (file, text) = (decl.file(db), decl.file(db).text(db));
    let found = |it: &Occurrence<'db>| {
        let range = segment(text, map.range_of(it.id).unwrap_or(map.range), it.segment)?;
        let (definition, kind, role) = (it.definition.clone(), it.kind, it.role);
        Some(FoundName { file, of: Some(decl), range, definition, kind, role })
    };
    names.into_iter().filter_map(found).collect()
}

pub(crate) fn range_of(span: &Range<usize>) -> TextRange {
    TextRange::new((span.start as u32).into(), (span.end.max(span.start) as u32).into())
}

/// Returns the range of the name with this index in `whole`, a `library.Name` or `package::Message` of `text`, which may contain
/// comments. Without an index, the whole range.
pub(crate) fn segment(text: &str, whole: TextRange, index: Option<usize>) -> Option<TextRange> {
    let Some(index) = index else { return Some(whole) };
    let lexed = mauve_syntax::lex(text.get(Range::<usize>::from(whole))?);
    let range = (0..lexed.len())
        .filter(|&token| lexed.kind(token).is_word())
        .nth(index)
        .map(|token| lexed.range(token))?;
    Some(range_of(&range) + whole.start())
}

pub(crate) fn outside_declarations<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
) -> Vec<FoundName<'db>> {
    let targets = includes(db, project.workspace(db), file).iter();
    let mut found: Vec<FoundName<'db>> = targets
        .zip(&source_map(db, file).includes)
        .filter_map(|(target, &range)| {
            let range = unquoted(file.text(db), range);
            let definition = Definition::File((*target)?);
            Some(mention(file, range, definition, SymbolKind::File))
        })
        .collect();
    found.extend(libraries(db, file).into_iter().map(|(_, name)| {
        let definition = Definition::Library(name.text().to_string().into());
        let declared = mention(file, name.text_range(), definition, SymbolKind::Library);
        FoundName { role: OccurrenceRole::Declaration, ..declared }
    }));
    found
}

/// Returns the library blocks of a file that have a name, each with its name.
pub(crate) fn libraries(db: &dyn ModelDb, file: File) -> Vec<(ast::Library, SyntaxNode)> {
    let source = parse(db, file).file();
    let blocks = source.syntax().children().filter_map(ast::Library::cast);
    blocks.filter_map(|block| Some((block.clone(), block.name()?.syntax().clone()))).collect()
}

/// Returns whether a type is that of a value; other types name shells, cores, components, architectures and operations.
pub(crate) fn is_of_value(ty: &SyntaxNode) -> bool {
    ty.parent().is_some_and(|of| {
        matches!(of.kind(), PARAM | CODEL | PROPERTY | PORT | OPERATION_DECLARATION | VAR | RESULT_TYPE)
    })
}

fn mention(file: File, range: TextRange, definition: Definition<'_>, kind: SymbolKind) -> FoundName<'_> {
    FoundName { file, of: None, range, definition, kind, role: OccurrenceRole::Mention }
}

/// Returns the range of a string without its quotes.
pub(crate) fn unquoted(text: &str, range: TextRange) -> TextRange {
    let quoted = text.get(Range::<usize>::from(range)).filter(|quoted| quoted.len() >= 2);
    let is_quoted = quoted.is_some_and(|it| it.starts_with(['"', '\'']) && it.ends_with(['"', '\'']));
    let quote = TextSize::of('"');
    if is_quoted { TextRange::new(range.start() + quote, range.end() - quote) } else { range }
}

#[salsa::tracked(returns(ref))]
pub(crate) fn occurrences_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Occurrence<'db>> {
    let mut finder = NameFinder::new(db, project, of);
    if let Some(data) = data(db, of).as_deref() {
        finder.data(data);
    }
    finder.found.sort_by_key(|it| (it.id, it.segment));
    finder.found
}

struct NameFinder<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    found: Vec<Occurrence<'db>>,
}

impl<'db> NameFinder<'db> {
    fn new(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> NameFinder<'db> {
        NameFinder { db, project, of, found: Vec::new() }
    }

    fn add(&mut self, name: &NameRef, definition: Definition<'db>, kind: SymbolKind, role: OccurrenceRole) {
        if !name.name.is_empty() {
            self.found.push(Occurrence { id: name.id, segment: None, definition, kind, role });
        }
    }

    fn declares(&mut self, name: &NameRef, kind: SymbolKind) {
        self.add(name, Definition::At(Location::Source(self.of, name.id)), kind, OccurrenceRole::Declaration);
    }

    fn data(&mut self, data: &'db Data) {
        let name = NameRef { name: self.of.name(self.db).clone(), id: SourceId(0) };
        match data {
            Data::Use => {
                let (definition, kind) = self.library(&name.name);
                return self.add(&name, definition, kind, OccurrenceRole::Mention);
            }
            Data::Codel(_) => {}
            Data::Shell(shell) => self.shell(shell),
            Data::Core(data) => self.core(data),
            Data::Component(component) => {
                self.names_type(Kind::Shell, component.shell.as_ref());
                self.names_type(Kind::Core, component.core.as_ref());
            }
            Data::Architecture(data) => self.architecture(data),
            Data::Deployment(data) => self.deployment(data),
        }
        data.types().into_iter().for_each(|(ty, _)| self.value_type(ty));
        // An operation of a core is declared by its shell, an activity by its instance.
        let is_declared = |kind| !matches!(kind, SymbolKind::Operation | SymbolKind::Activity);
        for (kind, name) in name_spaces(data).into_iter().flatten() {
            if is_declared(kind) || matches!(data, Data::Shell(_)) {
                self.declares(name, kind);
            }
        }
        let kind = kind_of(self.of.kind(self.db));
        self.add(&name, Definition::Declaration(self.of), kind, OccurrenceRole::Declaration);
    }

    fn library(&self, name: &Name) -> (Definition<'db>, SymbolKind) {
        match names_of(self.db, self.project).has_library(name) {
            true => (Definition::Library(name.clone()), SymbolKind::Library),
            false => (Definition::Package(name.clone()), SymbolKind::Package),
        }
    }

    fn segment(&mut self, ty: &TypeRef, index: usize, definition: Definition<'db>, kind: SymbolKind) {
        if ty.path.get(index).is_some_and(|name| !name.is_empty()) {
            let segment = (ty.path.len() > 1).then_some(index);
            self.found.push(Occurrence {
                id: ty.id,
                segment,
                definition,
                kind,
                role: OccurrenceRole::Mention,
            });
        }
    }

    fn names_type(&mut self, kind: Kind, ty: Option<&TypeRef>) {
        let Some(ty) = ty else { return };
        if let [library, _] = ty.path.as_slice() {
            self.segment(ty, 0, Definition::Library(library.clone()), SymbolKind::Library);
        }
        let found = resolve_type(self.db, self.project, self.of, kind, Some(ty));
        if let Ok(decl) = found {
            self.segment(ty, ty.path.len().saturating_sub(1), Definition::Declaration(decl), kind_of(kind));
        }
    }

    fn value_type(&mut self, ty: &TypeRef) {
        let Some((name, before)) = ty.path.split_last() else { return };
        let last = before.len();
        match type_of(self.db, self.project, self.of, Some(ty)) {
            Type::Unknown => {}
            Type::Message(package, name) => {
                self.segment(ty, last, Definition::Message(package, name), SymbolKind::Message);
            }
            _ => self.segment(ty, last, Definition::Type(name.clone()), SymbolKind::Type),
        }
        if let Some(package) = before.first() {
            let (definition, kind) = self.library(package);
            self.segment(ty, 0, definition, kind);
        }
    }

    fn feature(&mut self, of: Decl<'db>, name: &NameRef, role: OccurrenceRole) {
        let found = features_of(self.db, self.project, of).get(&name.name);
        if let Some((feature, at)) = found.and_then(|found| Some((found, found.name(self.db)?))) {
            self.add(name, Definition::At(at), kind_of_feature(feature.kind), role);
        }
    }

    fn shell(&mut self, shell: &Shell) {
        for base in &shell.bases {
            self.names_type(Kind::Shell, Some(base));
        }
        for feature in &shell.features {
            let interval = feature.interval.iter().flat_map(|interval| [&interval.low, &interval.high]);
            for value in interval.chain(&feature.value) {
                // A name that is not a constant of the shell is an error.
                for expr in value.descendants() {
                    if let Expr::Name(name) = expr {
                        self.feature(self.of, name, OccurrenceRole::Read);
                    }
                }
            }
        }
    }

    fn architecture(&mut self, data: &Architecture) {
        for import in &data.imports {
            self.names_type(Kind::Architecture, import.as_ref());
        }
        for instance in &data.instances {
            self.names_type(Kind::Component, instance.component.as_ref());
        }
        for link in data.connections.iter().chain(&data.operations) {
            for end in [&link.source, &link.target].into_iter().flatten() {
                self.endpoint(self.of, end, OccurrenceRole::Mention);
            }
        }
        self.settings(self.of, &data.settings);
    }

    fn deployment(&mut self, data: &Deployment) {
        for target in &data.targets {
            self.names_type(Kind::Architecture, Some(target));
        }
        let Some(target) = first_target_of(self.db, self.project, self.of) else { return };
        for activity in &data.activities {
            activity.instances.iter().for_each(|instance| self.instance(target, instance));
            let ports = activity.field(ActivityField::Trigger).into_iter().flat_map(|it| it.names());
            for (port, instance) in ports.zip(activity.instances.first().into_iter().cycle()) {
                self.feature_of_instance(target, instance, port, OccurrenceRole::Read);
            }
        }
        self.settings(target, &data.settings);
    }

    fn settings(&mut self, of: Decl<'db>, settings: &[Setting]) {
        for end in settings.iter().filter_map(|setting| setting.endpoint.as_ref()) {
            self.endpoint(of, end, OccurrenceRole::Write);
        }
    }

    fn instance(&mut self, of: Decl<'db>, name: &NameRef) {
        let instance = flat_of(self.db, self.project, of).instance(&name.name);
        if let Some(at) = instance.and_then(|it| it.declaration(self.db)) {
            self.add(name, Definition::At(at), SymbolKind::Instance, OccurrenceRole::Mention);
        }
    }

    /// `instance.feature` of an architecture.
    fn endpoint(&mut self, of: Decl<'db>, end: &Endpoint, role: OccurrenceRole) {
        self.instance(of, &end.instance);
        end.feature.iter().for_each(|feature| self.feature_of_instance(of, &end.instance, feature, role));
    }

    fn feature_of_instance(
        &mut self,
        of: Decl<'db>,
        instance: &NameRef,
        feature: &NameRef,
        role: OccurrenceRole,
    ) {
        let instance = flat_of(self.db, self.project, of).instance(&instance.name);
        let shell = instance.and_then(|it| shell_of(self.db, self.project, it.component?));
        shell.into_iter().for_each(|shell| self.feature(shell, feature, role));
    }

    fn core(&mut self, data: &'db Core) {
        self.names_type(Kind::Shell, data.shell.as_ref());
        let shell = shell_of(self.db, self.project, self.of);
        let inference = inference_of_core(self.db, self.project, self.of);
        let mut programs = NamesInPrograms { finder: self, core: data, shell, inference };
        programs.core();
    }
}

struct NamesInPrograms<'a, 'db> {
    finder: &'a mut NameFinder<'db>,
    core: &'db Core,
    shell: Option<Decl<'db>>,
    inference: CoreInference<'db>,
}

impl<'db> NamesInPrograms<'_, 'db> {
    fn core(&mut self) {
        let core = self.core;
        for handler in &core.handlers {
            if let (Some(shell), Some(operation)) = (self.shell, &handler.operation)
                && let [name] = operation.path.as_slice()
            {
                let name = NameRef { name: name.clone(), id: operation.id };
                self.finder.feature(shell, &name, OccurrenceRole::Mention);
            }
        }
        for operation in &core.operations {
            self.operation(&operation.name, OccurrenceRole::Definition);
        }
        core.states().flat_map(|state| &state.transitions).for_each(|it| self.transition(it));
        for statement in core.statements() {
            match statement {
                Statement::Assign(target, _) => self.value(target, OccurrenceRole::Write),
                Statement::Variable(it) => self.finder.declares(&it.name, SymbolKind::Variable),
                _ => {}
            }
        }
        core.expressions().for_each(|value| self.expr(value));
    }

    /// A provided operation is declared by the shell; another operation, by the core.
    fn operation(&mut self, name: &NameRef, role: OccurrenceRole) {
        let before = self.finder.found.len();
        if let Some(shell) = self.shell {
            self.finder.feature(shell, name, role);
        }
        if self.finder.found.len() == before {
            let role = if role == OccurrenceRole::Definition { OccurrenceRole::Declaration } else { role };
            if let Some(own) = self.core.operation(&name.name) {
                let definition = Definition::At(Location::Source(self.finder.of, own.name.id));
                self.finder.add(name, definition, SymbolKind::Operation, role);
            }
        }
    }

    fn transition(&mut self, transition: &Transition) {
        if let Some(target) = &transition.target
            && let Some(state) = self.core.state(&target.name)
        {
            let definition = Definition::At(Location::Source(self.finder.of, state.name.id));
            self.finder.add(target, definition, SymbolKind::State, OccurrenceRole::Mention);
        }
    }

    fn expr(&mut self, expr: &'db Expr) {
        // Output arguments of calls, which are visited after their call.
        let mut written: Vec<(SourceId, OccurrenceRole)> = Vec::new();
        for expr in expr.descendants() {
            match expr {
                Expr::Call { callee, arguments, .. } => {
                    let roles = self.callee(callee, arguments);
                    let arguments = arguments.iter().zip(roles);
                    written.extend(arguments.filter_map(|(argument, role)| match argument {
                        Expr::Name(name) => Some((name.id, role)),
                        _ => None,
                    }));
                }
                Expr::Name(name) => {
                    let role = written.iter().find(|(id, _)| *id == name.id);
                    self.value(name, role.map_or(OccurrenceRole::Read, |(_, role)| *role));
                }
                _ => {}
            }
        }
    }

    /// Adds the callee; returns the role of each argument.
    fn callee(&mut self, callee: &NameRef, arguments: &[Expr]) -> Vec<OccurrenceRole> {
        match self.inference.callee(callee.id) {
            Some(Callee::Codel(of)) => {
                self.finder.add(callee, Definition::Declaration(of), SymbolKind::Codel, OccurrenceRole::Call);
            }
            Some(Callee::Operation(_)) => self.operation(callee, OccurrenceRole::Call),
            Some(Callee::Builtin(_)) => {}
            // A variable hides an operation of the same name, but a misused operation still resolves.
            None if self.inference.binding(callee.id).is_some() => self.value(callee, OccurrenceRole::Read),
            None => self.operation(callee, OccurrenceRole::Call),
        }
        let role = |direction: Direction| match direction {
            Direction::In => OccurrenceRole::Read,
            Direction::Out => OccurrenceRole::Write,
            Direction::InOut => OccurrenceRole::ReadWrite,
        };
        let Some(found) = self.inference.callee(callee.id) else { return Vec::new() };
        let directions = self.inference.directions(self.finder.db, found, arguments.len());
        let mut roles: Vec<OccurrenceRole> = directions.into_iter().map(role).collect();
        // The operand of a built-in function.
        let operand = match found {
            Callee::Builtin(Builtin::Write) => OccurrenceRole::Write,
            Callee::Builtin(Builtin::Send) => OccurrenceRole::Call,
            _ => return roles,
        };
        roles.first_mut().into_iter().for_each(|first| *first = operand);
        roles
    }

    fn value(&mut self, name: &NameRef, role: OccurrenceRole) {
        match self.inference.binding(name.id) {
            Some(Binding::Variable(id)) => {
                let Some(variable) = self.inference.variable(id) else { return };
                let kind = match variable.kind {
                    VariableKind::Core | VariableKind::Machine | VariableKind::Local => SymbolKind::Variable,
                    VariableKind::Parameter(_) => SymbolKind::Parameter,
                    VariableKind::Handler => SymbolKind::Handler,
                };
                let definition = Definition::At(Location::Source(self.finder.of, variable.name.id));
                self.finder.add(name, definition, kind, role);
            }
            Some(Binding::Feature(feature)) => self.finder.feature(feature.shell, name, role),
            None => {}
        }
    }
}

/// Returns the names that a declaration declares inside, but not in its programs, by namespace: within each, names must differ.
pub(crate) fn name_spaces(data: &Data) -> Vec<Vec<(SymbolKind, &NameRef)>> {
    fn all<'a, T: 'a>(
        kind: SymbolKind,
        items: impl IntoIterator<Item = &'a T>,
        name: fn(&T) -> &NameRef,
    ) -> Vec<(SymbolKind, &'a NameRef)> {
        items.into_iter().map(|it| (kind, name(it))).collect()
    }
    let parameters = |list| all(SymbolKind::Parameter, list, |it: &Parameter| &it.name);
    let variables = |list| all(SymbolKind::Variable, list, |it: &Variable| &it.name);
    match data {
        Data::Use | Data::Component(_) => Vec::new(),
        Data::Codel(codel) => vec![parameters(&codel.parameters)],
        Data::Shell(Shell { features, .. }) => {
            let own = features.iter().map(|it| (kind_of_feature(it.kind), &it.name)).collect();
            std::iter::once(own).chain(features.iter().map(|it| parameters(&it.parameters))).collect()
        }
        Data::Core(core) => {
            let handlers = all(SymbolKind::Handler, &core.handlers, |it| &it.name);
            let operations = all(SymbolKind::Operation, &core.operations, |it| &it.name);
            let mut spaces = vec![[variables(&core.variables), handlers].concat(), operations];
            spaces.extend(core.operations.iter().map(|it| parameters(&it.parameters)));
            for machine in &core.machines {
                spaces.push(variables(&machine.variables));
                spaces.push(all(SymbolKind::State, &machine.states, |it| &it.name));
                let transitions = machine.states.iter().map(|it| &it.transitions);
                spaces.extend(transitions.map(|it| all(SymbolKind::Transition, it, |it| &it.name)));
            }
            spaces
        }
        Data::Architecture(data) => vec![all(SymbolKind::Instance, &data.instances, |it| &it.name)],
        Data::Deployment(data) => vec![all(SymbolKind::Activity, &data.activities, |it| &it.name)],
    }
}

pub(crate) fn kind_of(kind: Kind) -> SymbolKind {
    match kind {
        Kind::Use => SymbolKind::Library,
        Kind::Codel => SymbolKind::Codel,
        Kind::Shell => SymbolKind::Shell,
        Kind::Core => SymbolKind::Core,
        Kind::Component => SymbolKind::Component,
        Kind::Architecture => SymbolKind::Architecture,
        Kind::Deployment => SymbolKind::Deployment,
    }
}

pub(crate) fn kind_of_feature(kind: FeatureKind) -> SymbolKind {
    match kind {
        FeatureKind::Constant => SymbolKind::Constant,
        FeatureKind::Property => SymbolKind::Property,
        FeatureKind::Input | FeatureKind::Output => SymbolKind::Port,
        FeatureKind::Required | FeatureKind::Provided => SymbolKind::Operation,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use crate::project::projects_with;
    use expect_test::{Expect, expect};

    /// Each name of the file with the cursor: its line, what it does, what it is, and where that is declared.
    pub(super) fn check(fixture: &str, expected: Expect) {
        let Fixture { db, workspace, file, .. } = Fixture::new(fixture);
        let mut shown = String::new();
        let line = |file: File, offset: TextSize| file.text(&db)[..offset.into()].matches('\n').count() + 1;
        for project in projects_with(&db, &[workspace], file) {
            for name in names_in(&db, project, file) {
                let means = match &name.definition {
                    Definition::Declaration(decl) => format!("{} {}", decl.kind(&db), decl.name(&db)),
                    Definition::At(place) => {
                        let (file, range) = (place.file(&db), place.range(&db));
                        let path = file.path(&db).display();
                        format!("{path}:{} {}", line(file, range.start()), &file.text(&db)[range])
                    }
                    Definition::File(file) => file.path(&db).display().to_string(),
                    other => format!("{other:?}"),
                };
                let text = &file.text(&db)[name.range];
                let (kind, role) = (name.kind, name.role);
                shown += &format!("{}: {text} {role:?} {kind:?}: {means}\n", line(file, name.range.start()));
            }
        }
        expected.assert_eq(&shown);
    }

    const ROBOT: &str = r#"
//- /robot.mal
include "parts.mal"
architecture Base { instance laser: parts . /* 🦀 */ Laser }
architecture A {
  import Base
  instance map: Mapper
  connection laser.scan -> map.scan
  property laser.rate = 5
}
deployment D { architecture A  activity laser { priority = 1 period = 100 } }
//- /parts.mal
library parts {
  use std_msgs
  codel shoot(in a: int, out n: int, inout m: String): ctypes.uint8
  shell Laser { constant k: int = 2 property rate: int = k * 2 output port scan: int require wipe(out n: int): int }
  shell Map { input port scan: std_msgs.Int32 provide clear(i: int): int }
  core Laser(Laser) {
    var n: int var s: string
    handler h: wipe
    update = { shoot(n, n, s); write(scan, n + rate); h = send(wipe); collect(h, n, n); unknown(n); }
  }
  component Laser(Laser, Laser)
  core Map(Map) {
    provide clear(i: int): int = { return i; }
    statemachine {
      initial state Idle { run = { status(scan); } transition go if read(scan, v) == new_data to Busy { clear(v); } }
      state Busy { transition back to Idle }
      var v: int
    }
  }
}
component Mapper(parts.Map, parts.Map)
//- /mauve.toml
project.root = "robot.mal"
timing.tables = ["t.toml"]
clocks.synchronised = ["laser", "nobody"]
chains.c = { from = "laser.scan", to = "map.scan" }
//- /t.toml
[codel.parts]
shoot = 1
[program]
"parts.Laser/update" = 2
"Mapper/Idle.run" = 1
"Mapper/Idle.go.guard" = 3
"Mapper/clear" = 4
[component]
parts.Laser = 9
"#;

    pub(super) fn of(path: &str, expected: Expect) {
        let header = format!("//- {path}\n");
        assert!(ROBOT.contains(&header));
        check(&ROBOT.replace(&header, &format!("{header}$0")), expected);
    }

    #[test]
    fn in_architectures_and_deployments() {
        of(
            "/robot.mal",
            expect![[r#"
            1: parts.mal Mention File: /parts.mal
            2: Base Declaration Architecture: architecture Base
            2: laser Declaration Instance: /robot.mal:2 laser
            2: parts Mention Library: Library("parts")
            2: Laser Mention Component: component Laser
            3: A Declaration Architecture: architecture A
            4: Base Mention Architecture: architecture Base
            5: map Declaration Instance: /robot.mal:5 map
            5: Mapper Mention Component: component Mapper
            6: laser Mention Instance: /robot.mal:2 laser
            6: scan Mention Port: /parts.mal:4 scan
            6: map Mention Instance: /robot.mal:5 map
            6: scan Mention Port: /parts.mal:5 scan
            7: laser Mention Instance: /robot.mal:2 laser
            7: rate Write Property: /parts.mal:4 rate
            9: D Declaration Deployment: deployment D
            9: A Mention Architecture: architecture A
            9: laser Mention Instance: /robot.mal:2 laser
        "#]],
        );
    }

    #[test]
    fn occurrences_in_libraries() {
        of(
            "/parts.mal",
            expect![[r#"
                1: parts Declaration Library: Library("parts")
                2: std_msgs Mention Package: Package("std_msgs")
                3: shoot Declaration Codel: codel shoot
                3: a Declaration Parameter: /parts.mal:3 a
                3: int Mention Type: Type("int")
                3: n Declaration Parameter: /parts.mal:3 n
                3: int Mention Type: Type("int")
                3: m Declaration Parameter: /parts.mal:3 m
                3: String Mention Message: Message("std_msgs", "String")
                3: ctypes Mention Package: Package("ctypes")
                3: uint8 Mention Type: Type("uint8")
                4: Laser Declaration Shell: shell Laser
                4: k Declaration Constant: /parts.mal:4 k
                4: int Mention Type: Type("int")
                4: rate Declaration Property: /parts.mal:4 rate
                4: int Mention Type: Type("int")
                4: k Read Constant: /parts.mal:4 k
                4: scan Declaration Port: /parts.mal:4 scan
                4: int Mention Type: Type("int")
                4: wipe Declaration Operation: /parts.mal:4 wipe
                4: n Declaration Parameter: /parts.mal:4 n
                4: int Mention Type: Type("int")
                4: int Mention Type: Type("int")
                5: Map Declaration Shell: shell Map
                5: scan Declaration Port: /parts.mal:5 scan
                5: std_msgs Mention Package: Package("std_msgs")
                5: Int32 Mention Message: Message("std_msgs", "Int32")
                5: clear Declaration Operation: /parts.mal:5 clear
                5: i Declaration Parameter: /parts.mal:5 i
                5: int Mention Type: Type("int")
                5: int Mention Type: Type("int")
                6: Laser Declaration Core: core Laser
                6: Laser Mention Shell: shell Laser
                7: n Declaration Variable: /parts.mal:7 n
                7: int Mention Type: Type("int")
                7: s Declaration Variable: /parts.mal:7 s
                7: string Mention Type: Type("string")
                8: h Declaration Handler: /parts.mal:8 h
                8: wipe Mention Operation: /parts.mal:4 wipe
                9: shoot Call Codel: codel shoot
                9: n Read Variable: /parts.mal:7 n
                9: n Write Variable: /parts.mal:7 n
                9: s ReadWrite Variable: /parts.mal:7 s
                9: scan Write Port: /parts.mal:4 scan
                9: n Read Variable: /parts.mal:7 n
                9: rate Read Property: /parts.mal:4 rate
                9: h Write Handler: /parts.mal:8 h
                9: wipe Call Operation: /parts.mal:4 wipe
                9: h Read Handler: /parts.mal:8 h
                9: n Write Variable: /parts.mal:7 n
                9: n Write Variable: /parts.mal:7 n
                9: n Read Variable: /parts.mal:7 n
                11: Laser Declaration Component: component Laser
                11: Laser Mention Shell: shell Laser
                11: Laser Mention Core: core Laser
                12: Map Declaration Core: core Map
                12: Map Mention Shell: shell Map
                13: clear Definition Operation: /parts.mal:5 clear
                13: i Declaration Parameter: /parts.mal:13 i
                13: int Mention Type: Type("int")
                13: int Mention Type: Type("int")
                13: i Read Parameter: /parts.mal:13 i
                15: Idle Declaration State: /parts.mal:15 Idle
                15: scan Read Port: /parts.mal:5 scan
                15: go Declaration Transition: /parts.mal:15 go
                15: scan Read Port: /parts.mal:5 scan
                15: v Write Variable: /parts.mal:17 v
                15: Busy Mention State: /parts.mal:16 Busy
                15: clear Call Operation: /parts.mal:5 clear
                15: v Read Variable: /parts.mal:17 v
                16: Busy Declaration State: /parts.mal:16 Busy
                16: back Declaration Transition: /parts.mal:16 back
                16: Idle Mention State: /parts.mal:15 Idle
                17: v Declaration Variable: /parts.mal:17 v
                17: int Mention Type: Type("int")
                21: Mapper Declaration Component: component Mapper
                21: parts Mention Library: Library("parts")
                21: Map Mention Shell: shell Map
                21: parts Mention Library: Library("parts")
                21: Map Mention Core: core Map
            "#]],
        );
    }

    #[test]
    fn in_broken_text() {
        check(
            "$0core C(S) { update = { f(g(x, read(p",
            expect![[r#"
            1: C Declaration Core: core C
        "#]],
        );
        check(
            "$0codel f(out n: int): int shell S { input port p: int } core C(S) { var n: int update = { f(n  if (read(p, n",
            expect![[r#"
                1: f Declaration Codel: codel f
                1: n Declaration Parameter: /model.mal:1 n
                1: int Mention Type: Type("int")
                1: int Mention Type: Type("int")
                1: S Declaration Shell: shell S
                1: p Declaration Port: /model.mal:1 p
                1: int Mention Type: Type("int")
                1: C Declaration Core: core C
                1: S Mention Shell: shell S
                1: n Declaration Variable: /model.mal:1 n
                1: int Mention Type: Type("int")
                1: f Call Codel: codel f
                1: n Write Variable: /model.mal:1 n
                1: p Read Port: /model.mal:1 p
                1: n Write Variable: /model.mal:1 n
            "#]],
        );
        check(
            "$0architecture { instance a: connection a. -> .b } component C(l.)",
            expect![[r#"
            1: a Declaration Instance: /model.mal:1 a
            1: C Declaration Component: component C
            1: l Mention Library: Library("l")
        "#]],
        );
    }
}
