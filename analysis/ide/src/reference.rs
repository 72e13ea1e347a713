//! What the name under the cursor means, as far as names are resolved: in declarations, in programs, in timing tables and
//! in `mauve.toml`.

use mauve_model::item_tree::{
    Architecture, Core, Data, Deployment, Endpoint, Expr, Kind, Name, NameRef, Parameter, Part, Program,
    State, Statement, Transition, TypeRef, Variable,
};
use mauve_model::{
    Decl, File, ModelDb, Place, Project, architecture, config_of, data, declarations, features_of, flat_of,
    includes, names_of, shell_of, source_map, table, table_files,
};
use mauve_syntax::{TextRange, TextSize};

/// What a name stands for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Meaning<'db> {
    /// A declaration.
    Declaration(Decl<'db>),
    /// Something in one.
    Part(Place<'db>),
    /// A library, all of whose blocks are meant.
    Library(Name),
    /// A file.
    File(File),
}

/// A name, where it stands, and what it stands for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Reference<'db> {
    pub(crate) range: TextRange,
    pub(crate) meanings: Vec<Meaning<'db>>,
}

/// The reference at `offset`, as `project` understands it.
pub(crate) fn reference_at<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    offset: TextSize,
) -> Option<Reference<'db>> {
    let map = source_map(db, file);
    let include = map.includes.iter().position(|range| range.contains_inclusive(offset));
    if let Some(index) = include {
        let target = (*includes(db, project.workspace(db), file).get(index)?)?;
        let range = *map.includes.get(index)?;
        return Some(Reference { range, meanings: vec![Meaning::File(target)] });
    }
    let declarations = declarations(db, file).all.iter().zip(&map.declarations);
    let (decl, map) = declarations.into_iter().find(|(_, map)| map.range.contains_inclusive(offset))?;
    // A name that ends here is meant rather than one that only surrounds it.
    let parts = map.parts().enumerate().filter(|(_, range)| range.contains_inclusive(offset));
    let (part, range) = parts.min_by_key(|(_, range)| range.len())?;
    let before = file.text(db).get(usize::from(range.start())..usize::from(offset)).unwrap_or_default();
    let finder = Finder { db, project, of: *decl, part: Part(part as u32), before };
    let meanings = finder.meanings()?;
    Some(Reference { range, meanings })
}

/// The reference at `offset` of a timing table, or of `mauve.toml`.
pub(crate) fn reference_in_toml<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    offset: TextSize,
) -> Option<Reference<'db>> {
    let offset = usize::from(offset);
    let at = |span: &std::ops::Range<usize>| span.start <= offset && offset <= span.end;
    let range =
        |span: &std::ops::Range<usize>| TextRange::new((span.start as u32).into(), (span.end as u32).into());
    let workspace = project.workspace(db);
    if mauve_model::config_file(db, workspace) == Some(file) {
        let (path, span) = config_of(db, workspace).roots.iter().find(|(_, span)| at(span))?;
        let root = mauve_model::normalised(&workspace.folder(db).join(path));
        let root = workspace.file(db, &root)?;
        return Some(Reference { range: range(span), meanings: vec![Meaning::File(root)] });
    }
    if !table_files(db, workspace).files.contains(&file) {
        return None;
    }
    let table = table(db, file);
    let sections = [
        (Kind::Codel, &table.codels),
        (Kind::Component, &table.programs),
        (Kind::Component, &table.components),
    ];
    let (kind, entry) = sections
        .into_iter()
        .find_map(|(kind, entries)| Some((kind, entries.iter().find(|entry| at(&entry.key_span))?)))?;
    let key = entry.key.split_once('/').map_or(entry.key.as_str(), |(component, _)| component);
    let found = names_of(db, project).by_key(kind, key);
    let meanings = found.iter().copied().map(Meaning::Declaration).collect();
    Some(Reference { range: range(&entry.key_span), meanings })
}

/// Looks for the meaning of one part of a declaration.
struct Finder<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    part: Part,
    /// The text of the part before the cursor.
    before: &'a str,
}

type Meanings<'db> = Option<Vec<Meaning<'db>>>;

impl<'db> Finder<'_, 'db> {
    fn meanings(&self) -> Meanings<'db> {
        let data = data(self.db, self.of).as_deref()?;
        if self.part == Part(0) {
            return match data {
                Data::Use => Some(vec![Meaning::Library(self.of.name(self.db).clone())]),
                _ => Some(vec![Meaning::Declaration(self.of)]),
            };
        }
        match data {
            Data::Use => None,
            Data::Codel(codel) => self.parameters(&codel.parameters),
            Data::Shell(shell) => self.type_among(Kind::Shell, &shell.bases).or_else(|| {
                let features = shell.features.iter();
                self.itself(features.clone().map(|feature| &feature.name))
                    .or_else(|| features.into_iter().find_map(|feature| self.parameters(&feature.parameters)))
            }),
            Data::Core(core) => self.core(core),
            Data::Component(component) => self
                .type_among(Kind::Shell, &component.shell)
                .or_else(|| self.type_among(Kind::Core, &component.core)),
            Data::Architecture(data) => self.architecture(data),
            Data::Deployment(data) => self.deployment(data),
        }
    }

    fn is_here(&self, name: &NameRef) -> bool {
        name.part == self.part
    }

    fn here(&self) -> Meanings<'db> {
        Some(vec![Meaning::Part(Place::Part(self.of, self.part))])
    }

    fn at(&self, of: Decl<'db>, name: &NameRef) -> Meanings<'db> {
        Some(vec![Meaning::Part(Place::Part(of, name.part))])
    }

    /// A name that declares something means itself.
    fn itself<'a>(&self, mut names: impl Iterator<Item = &'a NameRef>) -> Meanings<'db> {
        names.any(|name| self.is_here(name)).then(|| self.here())?
    }

    fn parameters(&self, parameters: &[Parameter]) -> Meanings<'db> {
        self.itself(parameters.iter().map(|parameter| &parameter.name))
    }

    fn type_among<'a>(&self, kind: Kind, types: impl IntoIterator<Item = &'a TypeRef>) -> Meanings<'db> {
        let ty = types.into_iter().find(|ty| ty.part == self.part)?;
        // In `library.Name`, the cursor may be on either.
        if let [library, _] = ty.path.as_slice()
            && !self.before.contains(['.', ':'])
        {
            return Some(vec![Meaning::Library(library.clone())]);
        }
        let found = names_of(self.db, self.project).resolve_type(self.db, self.of, kind, Some(ty));
        found.ok().map(|decl| vec![Meaning::Declaration(decl)])
    }

    fn architecture(&self, data: &Architecture) -> Meanings<'db> {
        let components = data.instances.iter().filter_map(|instance| instance.component.as_ref());
        let links = data.connections.iter().chain(&data.operations);
        let ends = links.flat_map(|link| [&link.source, &link.target]).flatten();
        let settings = data.settings.iter().filter_map(|setting| setting.endpoint.as_ref());
        self.type_among(Kind::Architecture, data.imports.iter().flatten())
            .or_else(|| self.type_among(Kind::Component, components))
            .or_else(|| self.itself(data.instances.iter().map(|instance| &instance.name)))
            .or_else(|| ends.chain(settings).find_map(|end| self.endpoint(self.of, end)))
    }

    fn deployment(&self, data: &Deployment) -> Meanings<'db> {
        if let found @ Some(_) = self.type_among(Kind::Architecture, &data.targets) {
            return found;
        }
        let names = names_of(self.db, self.project);
        let target = names.resolve_type(self.db, self.of, Kind::Architecture, data.targets.first()).ok()?;
        if let Some(activity) = data.activities.iter().find(|activity| self.is_here(&activity.instance)) {
            return self.instance(target, &activity.instance);
        }
        let mut settings = data.settings.iter().filter_map(|setting| setting.endpoint.as_ref());
        settings.find_map(|end| self.endpoint(target, end))
    }

    fn instance(&self, of: Decl<'db>, name: &NameRef) -> Meanings<'db> {
        let (declared, index) = flat_of(self.db, self.project, of).instance(&name.name)?.declared;
        let instance = architecture(self.db, declared)?.instances.get(index)?;
        self.at(declared, &instance.name)
    }

    /// `instance.feature` of an architecture.
    fn endpoint(&self, of: Decl<'db>, end: &Endpoint) -> Meanings<'db> {
        if self.is_here(&end.instance) {
            return self.instance(of, &end.instance);
        }
        let feature = end.feature.as_ref().filter(|feature| self.is_here(feature))?;
        let instance = flat_of(self.db, self.project, of).instance(&end.instance.name)?;
        let shell = shell_of(self.db, self.project, instance.component?)?;
        self.feature(shell, &feature.name)
    }

    fn feature(&self, of: Decl<'db>, name: &str) -> Meanings<'db> {
        let found = features_of(self.db, self.project, of).get(name)?;
        let declared = found.data(self.db)?;
        self.at(found.shell, &declared.name)
    }

    fn core(&self, core: &Core) -> Meanings<'db> {
        let names = names_of(self.db, self.project);
        let shell = names.resolve_type(self.db, self.of, Kind::Shell, core.shell.as_ref()).ok();
        let core_scope: Vec<&NameRef> =
            core.variables.iter().map(|it| &it.name).chain(core.handlers.iter().map(|it| &it.name)).collect();
        let of_machines = core.machines.iter().flat_map(|machine| &machine.variables).map(|it| &it.name);
        let programs = Programs { finder: self, shell, core };
        if let found @ Some(_) = self.type_among(Kind::Shell, &core.shell) {
            return found;
        }
        if let found @ Some(_) = self.itself(core_scope.iter().copied().chain(of_machines)) {
            return found;
        }
        for operation in &core.operations {
            if self.is_here(&operation.name) {
                // What a core provides is declared by its shell.
                return shell
                    .and_then(|shell| self.feature(shell, &operation.name.name))
                    .or_else(|| self.here());
            }
            let parameters = operation.parameters.iter().map(|parameter| &parameter.name);
            if let found @ Some(_) = self.itself(parameters.clone()) {
                return found;
            }
            let mut scope: Vec<&NameRef> = core_scope.iter().copied().chain(parameters).collect();
            if let found @ Some(_) = programs.program(&operation.program, &mut scope) {
                return found;
            }
        }
        let mut scope = core_scope.clone();
        let values = core.variables.iter().filter_map(|variable| variable.value.as_ref());
        if let found @ Some(_) = values.into_iter().find_map(|value| programs.expr(value, &scope)) {
            return found;
        }
        if let found @ Some(_) =
            core.hooks.iter().find_map(|hook| programs.program(&hook.program, &mut scope))
        {
            return found;
        }
        core.machines.iter().find_map(|machine| {
            let own = machine.variables.iter().map(|variable| &variable.name);
            let mut scope: Vec<&NameRef> = core_scope.iter().copied().chain(own).collect();
            let mut values = machine.variables.iter().filter_map(|variable| variable.value.as_ref());
            if let found @ Some(_) = values.find_map(|value| programs.expr(value, &scope)) {
                return found;
            }
            self.itself(machine.states.iter().map(|state| &state.name))
                .or_else(|| machine.states.iter().find_map(|state| programs.state(state, &mut scope)))
        })
    }
}

/// Looks through the programs of a core, with the variables that are seen where it is.
#[derive(Clone, Copy)]
struct Programs<'a, 'db> {
    finder: &'a Finder<'a, 'db>,
    shell: Option<Decl<'db>>,
    core: &'a Core,
}

impl<'a, 'db> Programs<'a, 'db> {
    fn state(&self, state: &'a State, scope: &mut Vec<&'a NameRef>) -> Meanings<'db> {
        let of_methods = state.methods.iter().find_map(|method| self.program(&method.program, scope));
        of_methods.or_else(|| state.transitions.iter().find_map(|it| self.transition(it, scope)))
    }

    fn transition(&self, transition: &'a Transition, scope: &mut Vec<&'a NameRef>) -> Meanings<'db> {
        if self.finder.is_here(&transition.name) {
            return self.finder.here();
        }
        if let Some(target) = transition.target.as_ref().filter(|target| self.finder.is_here(target)) {
            let mut states = self.core.machines.iter().flat_map(|machine| &machine.states);
            let state = states.find(|state| state.name.name == target.name)?;
            return self.finder.at(self.finder.of, &state.name);
        }
        let of_guard = transition.guard.as_ref().and_then(|guard| self.expr(&guard.condition, scope));
        of_guard.or_else(|| transition.effect.as_ref().and_then(|effect| self.program(effect, scope)))
    }

    fn program(&self, program: &'a Program, scope: &mut Vec<&'a NameRef>) -> Meanings<'db> {
        self.block(&program.statements, scope)
    }

    fn block(&self, statements: &'a [Statement], scope: &mut Vec<&'a NameRef>) -> Meanings<'db> {
        let depth = scope.len();
        let found = statements.iter().find_map(|statement| self.statement(statement, scope));
        scope.truncate(depth);
        found
    }

    fn statement(&self, statement: &'a Statement, scope: &mut Vec<&'a NameRef>) -> Meanings<'db> {
        match statement {
            Statement::Variable(Variable { name, value, .. }) => {
                let found = value.as_ref().and_then(|value| self.expr(value, scope));
                scope.push(name);
                found.or_else(|| self.finder.itself(std::iter::once(name)))
            }
            Statement::If { condition, then, otherwise, .. } => self
                .expr(condition, scope)
                .or_else(|| self.block(then, scope))
                .or_else(|| self.block(otherwise.as_deref()?, scope)),
            Statement::Block(statements) => self.block(statements, scope),
            Statement::Return(_, value) => self.expr(value.as_ref()?, scope),
            Statement::Assign(target, value) => {
                if self.finder.is_here(target) {
                    return self.value(target, scope);
                }
                self.expr(value, scope)
            }
            Statement::Expr(value) => self.expr(value, scope),
        }
    }

    fn expr(&self, expr: &Expr, scope: &[&'a NameRef]) -> Meanings<'db> {
        // Sums are left-deep and may be long: no recursion to the left.
        let mut open = vec![expr];
        while let Some(expr) = open.pop() {
            match expr {
                Expr::Missing | Expr::Literal(..) => {}
                Expr::Name(name) if self.finder.is_here(name) => return self.value(name, scope),
                Expr::Name(_) => {}
                Expr::Lost(inner) | Expr::Unary(_, inner, _) => open.push(inner),
                Expr::Binary(_, lhs, rhs, _) => open.extend([rhs.as_ref(), lhs.as_ref()]),
                Expr::Call { callee, arguments, .. } => {
                    // The port, operation or handler of a built-in function is no value.
                    let first = arguments.first().and_then(|first| match first {
                        Expr::Name(first) => {
                            self.operand(&callee.name, first).map(|meanings| (first, meanings))
                        }
                        _ => None,
                    });
                    match first {
                        Some(_) if self.finder.is_here(callee) => return None,
                        Some((first, meanings)) if self.finder.is_here(first) => return Some(meanings),
                        _ if self.finder.is_here(callee) => return self.callee(callee),
                        _ => open.extend(arguments),
                    }
                }
            }
        }
        None
    }

    /// A variable, or a feature of the shell.
    fn value(&self, name: &NameRef, scope: &[&'a NameRef]) -> Meanings<'db> {
        match scope.iter().rev().find(|known| known.name == name.name) {
            Some(known) => self.finder.at(self.finder.of, known),
            None => self.finder.feature(self.shell?, &name.name),
        }
    }

    /// What the first argument of `read`, `write`, `status`, `send` and `collect` stands for; nothing where it is no call
    /// of one of these.
    fn operand(&self, callee: &str, first: &NameRef) -> Option<Vec<Meaning<'db>>> {
        if callee == "collect" {
            let handler = self.core.handlers.iter().find(|handler| handler.name.name == first.name)?;
            return self.finder.at(self.finder.of, &handler.name);
        }
        let feature = features_of(self.finder.db, self.finder.project, self.shell?).get(&first.name)?;
        feature.kind.is_operand_of(callee).then(|| self.finder.feature(self.shell?, &first.name))?
    }

    /// An operation, or a codel.
    fn callee(&self, name: &NameRef) -> Meanings<'db> {
        if let found @ Some(_) = self.shell.and_then(|shell| self.finder.feature(shell, &name.name)) {
            let defined = self.core.operations.iter().find(|operation| operation.name.name == name.name);
            // What is executed is said first.
            let defined = defined.and_then(|operation| self.finder.at(self.finder.of, &operation.name));
            return defined.or(found);
        }
        let finder = self.finder;
        let library = finder.of.library(finder.db).as_ref();
        let names = names_of(finder.db, finder.project);
        let path = std::slice::from_ref(&name.name);
        let codel = names.resolve(finder.db, library, Kind::Codel, path).ok()?;
        Some(vec![Meaning::Declaration(codel)])
    }
}
