//! Lowers a syntax tree to an [`ItemTree`] and its source map.

use std::sync::Arc;

use mauve_syntax::ast::{self, AstNode};
use mauve_syntax::keywords::{ARCHITECTURE_ITEMS, ActivityField, DECLARATIONS, DEPLOYMENT_ITEMS, ITEMS};
use mauve_syntax::{
    GreenNode, SyntaxError, SyntaxErrorKind, SyntaxKind, SyntaxNode, SyntaxToken, TextRange, begins_line,
    is_whole, next_significant, significant_tokens, similar,
};
use rustc_hash::FxHashMap;

use crate::completeness::Completeness;
use crate::item_tree::*;
use crate::ranges::{DeclarationMap, SourceMap, SourceRun, Sources};

/// The lowered declarations, states and activities of a file, by the addresses of their green trees: an edit shares the trees
/// that it does not touch, and lowering reuses their results.
#[derive(Debug, Default)]
pub(crate) struct LoweredNodes {
    declarations: LoweredByTree<Data, Arc<[SourceRun]>>,
    states: LoweredByTree<State>,
    activities: LoweredByTree<Activity>,
}

/// Declarations or their items, by the addresses of their green trees.
type LoweredByTree<T, S = Arc<[TextRange]>> = FxHashMap<usize, Arc<LoweredNode<T, S>>>;

#[derive(Debug)]
struct LoweredNode<T, S> {
    /// Keeps the tree alive, so that no other tree has its address.
    green: GreenNode,
    data: Arc<T>,
    /// Its first source.
    first: u32,
    /// Its sources, relative to its start.
    sources: S,
    /// The addresses of the states or activities in it.
    shared: Vec<usize>,
}

/// Returns the previous result of lowering `node`, if its sources began at `first`.
fn lowered_before<T, S>(
    nodes: &LoweredByTree<T, S>,
    node: &SyntaxNode,
    first: u32,
) -> Option<Arc<LoweredNode<T, S>>> {
    let lowered = nodes.get(&address(node))?;
    (std::ptr::eq(&*lowered.green, node.green()) && lowered.first == first).then(|| lowered.clone())
}

/// Keeps the items of a declaration that was lowered before.
fn keep<T>(items: &[usize], previous: &LoweredByTree<T>, kept: &mut LoweredByTree<T>) {
    for item in items {
        if let Some(shared) = previous.get(item) {
            kept.entry(*item).or_insert_with(|| shared.clone());
        }
    }
}

fn address(node: &SyntaxNode) -> usize {
    std::ptr::from_ref(node.green()).cast::<()>().addr()
}

/// Lowers the tree of a file with these errors. `previous`: the results for the previous tree.
pub(crate) fn lower(
    file: &ast::SourceFile,
    errors: &[SyntaxError],
    previous: &LoweredNodes,
) -> (ItemTree, SourceMap, LoweredNodes) {
    let contained = errors.iter().filter_map(|error| match error.kind {
        SyntaxErrorKind::Conflict { is_contained, .. } => Some(Completeness::of(is_contained)),
        _ => None,
    });
    let mut lowering = Lowering {
        previous,
        has_conflicts: contained.clone().next().is_some(),
        outline: Outline::default(),
        data: Vec::new(),
        map: SourceMap::default(),
        lowered: LoweredNodes::default(),
        sources: Sources::default(),
        shared: Vec::new(),
    };
    lowering.items(file.items(), None);
    if !errors.is_empty() {
        lowering.possible_names(file.syntax(), None);
    }
    lowering.outline.completeness &= contained.collect();
    let tree = ItemTree { outline: Arc::new(lowering.outline), data: lowering.data };
    (tree, lowering.map, lowering.lowered)
}

/// Returns whether all items of the list `node`, and its end, are known.
///
/// In an architecture and a deployment, a line with only a prefix of a keyword hides no item: without the item, an
/// instance would lack its activity, an activity its instance, or an operation its connection
/// ([`Architecture::connection_completeness`]). Any other error may hide an item, or tokens of the previous item.
fn list_completeness(node: &SyntaxNode) -> Completeness {
    let keywords: &[&str] = match node.kind() {
        SyntaxKind::ARCHITECTURE => &ARCHITECTURE_ITEMS,
        SyntaxKind::DEPLOYMENT => &DEPLOYMENT_ITEMS,
        _ => return own_completeness(node),
    };
    let errors = node.children().filter(|child| child.kind() == SyntaxKind::ERROR);
    let is_keyword_prefix = |error: SyntaxNode| {
        let is_prefix = |word: &SyntaxToken| keywords.iter().any(|keyword| keyword.starts_with(word.text()));
        matches!(tokens_of(&error).as_slice(), [word] if begins_line(word) && is_prefix(word))
    };
    Completeness::of(errors.into_iter().all(is_keyword_prefix))
}

/// Returns whether an unterminated string in `node` contains a keyword of an item or a declaration.
fn has_item_in_unterminated_string(node: &SyntaxNode) -> bool {
    let tokens = node.descendants_with_tokens().filter_map(mauve_syntax::NodeOrToken::into_token);
    let mut texts = tokens.filter(|token| token.kind() == SyntaxKind::UNTERMINATED_STRING);
    let is_item = |word: &str| ITEMS.contains(&word) || DECLARATIONS.contains(&word);
    texts.any(|text| text.text().split(|letter: char| !letter.is_alphanumeric()).any(is_item))
}

/// Returns the parts of conflicts in `node` that are not parsed.
fn conflicts_in(node: &SyntaxNode) -> impl Iterator<Item = SyntaxToken> + use<> {
    let tokens = node.descendants_with_tokens().filter_map(mauve_syntax::NodeOrToken::into_token);
    tokens.filter(|token| token.kind() == SyntaxKind::CONFLICT)
}

/// Returns whether the other text of a conflict in `node` contains a keyword of a declaration, or is between declarations.
fn may_declare(node: &SyntaxNode) -> bool {
    let is_declaration = |word: &str| DECLARATIONS.contains(&word);
    conflicts_in(node).any(|token| {
        let mut words = token.text().split(|letter: char| !letter.is_alphanumeric());
        !token.text().starts_with('<') && (node.kind() == SyntaxKind::ERROR || words.any(is_declaration))
    })
}

fn tokens_of(node: &SyntaxNode) -> Vec<SyntaxToken> {
    significant_tokens(node).collect()
}

/// Returns the words before the first brace of `word … { … }`, a section of another tool. Returns `None` if `word` is a
/// prefix or a misspelling of a keyword, or if the section may contain a declaration, an item or a statement of a model.
fn unknown_section(tokens: &[SyntaxToken]) -> Option<Vec<Name>> {
    let word = tokens.first().filter(|word| word.kind().is_word())?;
    let is_keyword_prefix = DECLARATIONS.iter().any(|keyword| keyword.starts_with(word.text()));
    if is_keyword_prefix || similar(word.text(), DECLARATIONS).is_some() {
        return None;
    }
    let mut open = 0;
    let closed = tokens.iter().position(|token| {
        open += i32::from(token.kind() == SyntaxKind::L_CURLY);
        open -= i32::from(token.kind() == SyntaxKind::R_CURLY);
        open == 0 && token.kind() == SyntaxKind::R_CURLY
    });
    let head = words(tokens.iter().take_while(|token| token.kind() != SyntaxKind::L_CURLY));
    let begins_item = |pair: &[SyntaxToken]| {
        let [before, word] = pair else { return false };
        use SyntaxKind::{L_CURLY, R_CURLY, SEMICOLON};
        let is_first = matches!(before.kind(), L_CURLY | R_CURLY | SEMICOLON) || begins_line(word);
        is_first && (ITEMS.contains(&word.text()) || ["include", "use", "library"].contains(&word.text()))
    };
    let is_include_path =
        |token: &SyntaxToken| token.kind() == SyntaxKind::STRING && token.text().ends_with(".mal\"");
    let is_statement = |token: &SyntaxToken| ["if", "then", "else", "return"].contains(&token.text());
    let is_call = |pair: &[SyntaxToken]| matches!(pair, [name, open] if name.kind().is_word() && open.kind() == SyntaxKind::L_PAREN);
    let may_be_of_model = ITEMS.contains(&word.text())
        || tokens.iter().any(is_statement)
        || tokens.iter().any(is_include_path)
        || tokens.windows(2).any(is_call)
        || head.iter().any(|word| *word == "extends")
        || tokens.windows(2).any(begins_item)
        || tokens.windows(3).any(begins_declaration);
    (closed? + 1 == tokens.len() && !may_be_of_model).then_some(head)
}

/// `codel f(`, `shell S {`, …
fn begins_declaration(tokens: &[SyntaxToken]) -> bool {
    let [keyword, name, next] = tokens else { return false };
    name.kind().is_word()
        && match keyword.text() {
            "codel" | "core" | "component" => next.kind() == SyntaxKind::L_PAREN,
            "shell" => next.kind() == SyntaxKind::L_CURLY || next.text() == "extends",
            "library" | "architecture" | "deployment" => next.kind() == SyntaxKind::L_CURLY,
            _ => false,
        }
}

fn words<'a>(tokens: impl Iterator<Item = &'a SyntaxToken>) -> Vec<Name> {
    tokens.filter(|token| token.kind().is_word()).map(|token| token.text().into()).collect()
}

/// Returns the names that a declaration within an error of `declaration` may declare: all words of an error that contains
/// a keyword of a declaration; any name (`None`) if the end of `declaration` is missing.
fn names_in_errors(declaration: &SyntaxNode) -> Vec<Option<Name>> {
    let closes = |child: mauve_syntax::SyntaxElement| child.kind() == SyntaxKind::R_CURLY;
    if !declaration.children_with_tokens().any(closes) {
        return vec![None];
    }
    // An item of another kind of declaration: the header of that declaration is missing.
    let begins = |error: &SyntaxNode| tokens_of(error).first().is_some_and(|it| ITEMS.contains(&it.text()));
    let mut own_errors = declaration.children().filter(|child| child.kind() == SyntaxKind::ERROR);
    if own_errors.any(|error| begins(&error)) {
        return vec![None];
    }
    let errors = declaration.descendants().filter(|node| node.kind() == SyntaxKind::ERROR);
    let is_declaration = |token: &SyntaxToken| DECLARATIONS.contains(&token.text());
    let hidden = errors.map(|error| tokens_of(&error)).filter(|tokens| tokens.iter().any(is_declaration));
    hidden.flat_map(|tokens| words(tokens.iter())).map(Some).collect()
}

/// See [`Lowering::shared`].
const STATE_ID_ALIGNMENT: u32 = 32;
/// See [`Lowering::shared`].
const ACTIVITY_ID_ALIGNMENT: u32 = 16;

/// Returns whether `node` has no syntax error.
fn completeness_of(node: &SyntaxNode) -> Completeness {
    Completeness::of(is_whole(node))
}

/// Returns whether `node` has no syntax error outside its child nodes.
fn own_completeness(node: &SyntaxNode) -> Completeness {
    Completeness::of(!has_error_child(node))
}

fn has_error_child(node: &SyntaxNode) -> bool {
    node.children().any(|child| child.kind() == SyntaxKind::ERROR)
}

/// Returns whether a declaration with a block has an error before the block: its name may be another word of the header.
fn has_error_in_header(declaration: &SyntaxNode) -> bool {
    use SyntaxKind::{ARCHITECTURE, CORE, DEPLOYMENT, ERROR, L_CURLY, SHELL};
    matches!(declaration.kind(), SHELL | CORE | ARCHITECTURE | DEPLOYMENT)
        && declaration
            .children_with_tokens()
            .take_while(|child| child.kind() != L_CURLY)
            .any(|child| child.kind() == ERROR)
}

struct Lowering<'a> {
    previous: &'a LoweredNodes,
    has_conflicts: bool,
    outline: Outline,
    data: Vec<Arc<Data>>,
    map: SourceMap,
    lowered: LoweredNodes,
    /// Those of the current declaration.
    sources: Sources,
    /// The addresses of the states or activities of the current declaration.
    shared: Vec<usize>,
}

impl Lowering<'_> {
    fn items(&mut self, items: impl Iterator<Item = ast::Item>, library: Option<&Name>) {
        for item in items {
            match item {
                ast::Item::Include(it) => self.include(&it),
                ast::Item::Library(it) => {
                    let name = name_of_library(&it);
                    self.outline.libraries.push(name.clone());
                    self.items(it.items(), Some(&name));
                }
                ast::Item::Use(it) => self.declare(&it, Kind::Use, library, |_, _| (), |()| Data::Use),
                ast::Item::Codel(it) => self.declare(&it, Kind::Codel, library, Self::codel, Data::Codel),
                ast::Item::Shell(it) => self.declare(&it, Kind::Shell, library, Self::shell, Data::Shell),
                ast::Item::Core(it) => self.declare(&it, Kind::Core, library, Self::core, Data::Core),
                ast::Item::Component(it) => {
                    self.declare(&it, Kind::Component, library, Self::component, Data::Component);
                }
                ast::Item::Architecture(it) => {
                    self.declare(&it, Kind::Architecture, library, Self::architecture, Data::Architecture);
                }
                ast::Item::Deployment(it) => {
                    self.declare(&it, Kind::Deployment, library, Self::deployment, Data::Deployment);
                }
            }
        }
    }

    /// [`list_completeness`], where a conflict anywhere in the list may hide an item: its other text may end one.
    fn list_completeness(&self, node: &SyntaxNode) -> Completeness {
        let has_conflict = self.has_conflicts && conflicts_in(node).next().is_some();
        list_completeness(node) & Completeness::of(!has_conflict)
    }

    /// Collects the names that the syntax errors in a file or a library may declare.
    fn possible_names(&mut self, list: &SyntaxNode, library: Option<&Name>) {
        let mut found: Vec<Option<Name>> = Vec::new();
        for child in list.children() {
            // An incorrect line with a string may be an `include`.
            if matches!(child.kind(), SyntaxKind::ERROR | SyntaxKind::USE)
                && tokens_of(&child).iter().any(|token| token.kind() == SyntaxKind::STRING)
            {
                self.outline.include_completeness = Completeness::Incomplete;
            }
            if self.has_conflicts && child.kind() != SyntaxKind::LIBRARY && may_declare(&child) {
                found.push(None);
            }
            match child.kind() {
                SyntaxKind::ERROR if conflicts_in(&child).next().is_some() => {}
                SyntaxKind::ERROR => match tokens_of(&child).as_slice() {
                    [] => self.outline.completeness = Completeness::Incomplete,
                    [word, ..] if !begins_line(word) => self.outline.completeness = Completeness::Incomplete,
                    // An incomplete line: its name is unknown.
                    [word] if DECLARATIONS.iter().any(|keyword| keyword.starts_with(word.text())) => {
                        let is_include =
                            ["include", "library"].iter().any(|keyword| keyword.starts_with(word.text()));
                        self.outline.include_completeness &= Completeness::of(!is_include);
                        found.push(None);
                    }
                    tokens => match unknown_section(tokens) {
                        Some(names) => found.extend(names.into_iter().map(Some)),
                        None => self.outline.completeness = Completeness::Incomplete,
                    },
                },
                SyntaxKind::LIBRARY => {
                    let name = ast::Library::cast(child.clone()).map(|it| name_of_library(&it));
                    self.possible_names(&child, name.as_ref());
                }
                // The error may contain the next declaration of the line.
                SyntaxKind::USE | SyntaxKind::CODEL | SyntaxKind::COMPONENT if !is_whole(&child) => {
                    found.push(None);
                }
                SyntaxKind::SHELL | SyntaxKind::CORE | SyntaxKind::ARCHITECTURE | SyntaxKind::DEPLOYMENT => {
                    found.extend(names_in_errors(&child))
                }
                _ => {}
            }
        }
        found.sort();
        found.dedup();
        self.outline.possible_names.extend(found.into_iter().map(|name| (library.cloned(), name)));
    }

    fn include(&mut self, include: &ast::Include) {
        self.outline.includes.push(include.path());
        let range = include.string_token().map_or(include.syntax().text_range(), |token| token.text_range());
        self.map.includes.push(range);
    }

    fn declare<N: AstNode, T>(
        &mut self,
        declaration: &N,
        kind: Kind,
        library: Option<&Name>,
        lower: impl FnOnce(&mut Self, &N) -> T,
        data: impl FnOnce(T) -> Data,
    ) {
        let node = declaration.syntax();
        let range = node.text_range();
        // A `use` has the name of a library or a package.
        let is_name = |child: &SyntaxNode| matches!(child.kind(), SyntaxKind::NAME | SyntaxKind::NAME_REF);
        let name = node.children().find(is_name);
        let lowered = lowered_before(&self.previous.declarations, node, 0).unwrap_or_else(|| {
            let keyword = node.first_token().map_or(range, |token| token.text_range());
            self.sources = Sources::of_declaration(range.start());
            self.sources.add(name.as_ref().map_or(keyword, SyntaxNode::text_range));
            let data = Arc::new(data(lower(self, declaration)));
            let (sources, shared) = (self.sources.end(), std::mem::take(&mut self.shared));
            Arc::new(LoweredNode { green: node.green().to_owned(), data, first: 0, sources, shared })
        });
        keep(&lowered.shared, &self.previous.states, &mut self.lowered.states);
        keep(&lowered.shared, &self.previous.activities, &mut self.lowered.activities);
        // Two cores have merged: the name of the second is unknown.
        if matches!(&*lowered.data, Data::Core(core) if core.is_double()) {
            self.outline.possible_names.push((library.cloned(), None));
        }
        if name.is_none() || has_error_in_header(node) {
            self.outline.unnamed.push((library.cloned(), kind));
        }
        self.outline.declarations.push(Declaration {
            library: library.cloned(),
            name: name.as_ref().map(text_of).unwrap_or_default(),
            kind,
            expansion: Expansion::of(&lowered.data),
        });
        self.data.push(lowered.data.clone());
        self.map.declarations.push(DeclarationMap::new(range, lowered.sources.clone()));
        self.lowered.declarations.insert(address(node), lowered);
    }

    fn id(&mut self, range: TextRange) -> SourceId {
        self.sources.add(range)
    }

    /// Lowers `name`; a missing name is empty and has the range of `around`.
    fn name(&mut self, name: Option<impl AstNode>, around: &SyntaxNode) -> NameRef {
        match name {
            Some(name) => self.name_ref(&name),
            None => NameRef { name: Name::default(), id: self.id(around.text_range()) },
        }
    }

    fn name_ref(&mut self, name: &impl AstNode) -> NameRef {
        NameRef { name: text_of(name.syntax()), id: self.id(name.syntax().text_range()) }
    }

    fn type_ref(&mut self, ty: &ast::Type) -> TypeRef {
        let mut path: Vec<Name> = ty.name_refs().map(|segment| text_of(segment.syntax())).collect();
        // The segment after the last dot is missing: the path without it would resolve to something else.
        if has_error_child(ty.syntax()) {
            path.push(Name::default());
        }
        TypeRef { path, id: self.id(ty.syntax().text_range()) }
    }

    fn component(&mut self, component: &ast::Component) -> Component {
        let shell = component.shell().map(|ty| self.type_ref(&ty));
        let core = component.core().map(|ty| self.type_ref(&ty));
        Component { shell, core, completeness: completeness_of(component.syntax()) }
    }

    fn codel(&mut self, codel: &ast::Codel) -> Codel {
        let parameters = self.parameters(codel.param_list());
        let result = codel.ty().map(|ty| self.type_ref(&ty));
        Codel { parameters, result, completeness: completeness_of(codel.syntax()) }
    }

    fn parameters(&mut self, list: Option<ast::ParamList>) -> Vec<Parameter> {
        let parameters = list.into_iter().flat_map(|list| list.params().collect::<Vec<_>>());
        parameters
            .map(|parameter| Parameter {
                direction: parameter.direction(),
                name: self.name(parameter.name(), parameter.syntax()),
                ty: parameter.ty().map(|ty| self.type_ref(&ty)),
            })
            .collect()
    }

    fn shell(&mut self, shell: &ast::Shell) -> Shell {
        let bases = shell.extends().into_iter().flat_map(|extends| extends.tys().collect::<Vec<_>>());
        let bases = bases.map(|ty| self.type_ref(&ty)).collect();
        let features = shell.shell_items().map(|item| self.feature(item)).collect();
        let extends = shell.extends().map(|extends| completeness_of(extends.syntax()));
        let completeness = self.list_completeness(shell.syntax()) & extends.unwrap_or_default();
        Shell { bases, features, completeness }
    }

    fn feature(&mut self, item: ast::ShellItem) -> Feature {
        let either =
            |token: Option<SyntaxToken>, present, absent| if token.is_some() { present } else { absent };
        let (kind, name, ty, parameters) = match &item {
            ast::ShellItem::Property(it) => {
                let kind = either(it.constant_token(), FeatureKind::Constant, FeatureKind::Property);
                (kind, it.name(), it.ty(), None)
            }
            ast::ShellItem::Port(it) => {
                let kind = either(it.input_token(), FeatureKind::Input, FeatureKind::Output);
                (kind, it.name(), it.ty(), None)
            }
            ast::ShellItem::OperationDeclaration(it) => {
                let kind = either(it.require_token(), FeatureKind::Required, FeatureKind::Provided);
                (kind, it.name(), it.ty(), it.param_list())
            }
        };
        let name = self.name(name, item.syntax());
        let parameters = self.parameters(parameters);
        let ty = ty.map(|ty| self.type_ref(&ty));
        let (mut interval, mut value) = (None, None);
        if let ast::ShellItem::Property(it) = &item {
            interval = it.interval().map(|interval| Interval {
                low: self.expr(interval.low()),
                high: self.expr(interval.high()),
                id: self.id(interval.syntax().text_range()),
            });
            value = it.initializer().map(|it| self.expr(it.expr()));
        }
        let signature =
            if kind.is_operation() { completeness_of(item.syntax()) } else { Completeness::Complete };
        let completeness = signature & Completeness::of(!name.name.is_empty());
        Feature { kind, name, ty, parameters, interval, value, completeness }
    }

    fn core(&mut self, core: &ast::Core) -> Core {
        let mut lowered = Core {
            shell: core.ty().map(|ty| self.type_ref(&ty)),
            colon: core.colon_token().map(|colon| self.id(colon.text_range())),
            completeness: self.list_completeness(core.syntax()),
            ..Core::default()
        };
        for item in core.core_items() {
            match item {
                ast::CoreItem::Var(it) => lowered.variables.push(self.variable(&it)),
                ast::CoreItem::Handler(it) => {
                    let name = self.name(it.name(), it.syntax());
                    let operation = it.ty().map(|ty| self.type_ref(&ty));
                    lowered.handlers.push(Handler { name, operation });
                }
                ast::CoreItem::OperationDefinition(it) => {
                    let name = self.name(it.name(), it.syntax());
                    let parameters = self.parameters(it.param_list());
                    let result = it.result_type().and_then(|it| it.ty()).map(|ty| self.type_ref(&ty));
                    let lists = [
                        it.param_list().map(|it| it.syntax().clone()),
                        it.result_type().map(|it| it.syntax().clone()),
                    ];
                    let lists = || lists.iter().flatten();
                    let end = TextRange::empty(it.syntax().text_range().end());
                    let all = lists().map(SyntaxNode::text_range).reduce(TextRange::cover);
                    let signature = self.id(all.unwrap_or(end));
                    let signature_completeness =
                        own_completeness(it.syntax()) & lists().map(completeness_of).collect();
                    let mut program = self.program(it.block(), it.syntax());
                    program.completeness &= signature_completeness;
                    let operation =
                        Operation { name, parameters, result, signature, signature_completeness, program };
                    lowered.operations.push(Arc::new(operation));
                }
                ast::CoreItem::Hook(it) => {
                    let Some(keyword) = it.own_token() else { continue };
                    let Some(kind) = HookKind::from_keyword(keyword.text()) else { continue };
                    let id = self.id(keyword.text_range());
                    let program = self.program(it.block(), it.syntax());
                    lowered.hooks.push(Arc::new(Hook { kind, id, program }));
                }
                ast::CoreItem::StateMachine(it) => lowered.machines.push(self.machine(&it)),
            }
        }
        lowered
    }

    fn variable(&mut self, variable: &ast::Var) -> Variable {
        Variable {
            name: self.name(variable.name(), variable.syntax()),
            ty: variable.ty().map(|ty| self.type_ref(&ty)),
            value: variable.initializer().map(|it| self.expr(it.expr())),
            continued: continued(variable)
                .map(|(token, white)| (self.id(token), white.map(|white| self.id(white)))),
        }
    }

    fn machine(&mut self, machine: &ast::StateMachine) -> Machine {
        let keyword = machine.statemachine_token();
        let id =
            self.id(keyword.map_or(machine.syntax().text_range(), |token: SyntaxToken| token.text_range()));
        let mut variables = Vec::new();
        let mut states = Vec::new();
        for item in machine.state_machine_items() {
            match item {
                ast::StateMachineItem::Var(it) => variables.push(self.variable(&it)),
                ast::StateMachineItem::State(it) => states.push(self.shared_state(&it)),
            }
        }
        let are_named = states.iter().all(|state: &Arc<State>| !state.name.name.is_empty());
        let completeness = list_completeness(machine.syntax()) & Completeness::of(are_named);
        Machine { id, variables, states, completeness }
    }

    fn shared_state(&mut self, state: &ast::State) -> Arc<State> {
        let lowered =
            self.shared(state.syntax(), STATE_ID_ALIGNMENT, &self.previous.states, |it| it.state(state));
        self.lowered.states.insert(address(state.syntax()), lowered.clone());
        lowered.data.clone()
    }

    fn shared_activity(&mut self, activity: &ast::Activity) -> Arc<Activity> {
        let previous = &self.previous.activities;
        let lowered =
            self.shared(activity.syntax(), ACTIVITY_ID_ALIGNMENT, previous, |it| it.activity(activity));
        self.lowered.activities.insert(address(activity.syntax()), lowered.clone());
        lowered.data.clone()
    }

    /// Lowers a state or an activity, or returns the previous result: state machines and deployments are long, and an edit
    /// touches one of their items. The sources of each item start at a multiple of `alignment`, so that an additional source
    /// in one item seldom renumbers the items after it.
    fn shared<T>(
        &mut self,
        node: &SyntaxNode,
        alignment: u32,
        previous: &LoweredByTree<T>,
        lower: impl FnOnce(&mut Self) -> T,
    ) -> Arc<LoweredNode<T, Arc<[TextRange]>>> {
        let range = node.text_range();
        let first = self.sources.next().next_multiple_of(alignment);
        self.sources.begin_at(first);
        self.shared.push(address(node));
        if let Some(lowered) = lowered_before(previous, node, first) {
            self.sources.add_run(range, lowered.sources.clone());
            return lowered;
        }
        let data = Arc::new(lower(self));
        let (green, sources) = (node.green().to_owned(), self.sources.end_run(range));
        Arc::new(LoweredNode { green, data, first, sources, shared: Vec::new() })
    }

    fn state(&mut self, state: &ast::State) -> State {
        let begin = state.syntax().text_range().start();
        let keyword = state.state_token().map_or(begin, |keyword| keyword.text_range().start());
        let start = self.id(TextRange::new(begin, keyword.max(begin)));
        let name = self.name(state.name(), state.syntax());
        let mut methods = Vec::new();
        let mut transitions = Vec::new();
        for item in state.state_items() {
            match item {
                ast::StateItem::Method(it) => {
                    let Some(keyword) = it.own_token() else { continue };
                    let Some(kind) = MethodKind::from_keyword(keyword.text()) else { continue };
                    let id = self.id(keyword.text_range());
                    methods.push(StateMethod { kind, id, program: self.program(it.block(), it.syntax()) });
                }
                ast::StateItem::Transition(it) => transitions.push(self.transition(&it)),
            }
        }
        State {
            name,
            initial: state.initial_token().is_some(),
            start,
            methods: methods.into(),
            transitions: transitions.into(),
            completeness: list_completeness(state.syntax()),
        }
    }

    fn transition(&mut self, transition: &ast::Transition) -> Transition {
        let name = self.name(transition.name(), transition.syntax());
        let guard = transition.guard().map(|guard| Guard {
            condition: self.expr(guard.expr()),
            completeness: completeness_of(guard.syntax()),
        });
        Transition {
            name,
            guard,
            target: transition.name_ref().map(|name| self.name_ref(&name)),
            effect: transition.block().map(|block| self.program(Some(block), transition.syntax())),
            completeness: own_completeness(transition.syntax()),
        }
    }

    /// Lowers the program in `block`. The own errors of its parent `owner` (a missing `=` or block) make it incomplete.
    fn program(&mut self, block: Option<ast::Block>, owner: &SyntaxNode) -> Program {
        let own = block.as_ref().map_or(Completeness::Incomplete, |block| completeness_of(block.syntax()));
        let completeness = own_completeness(owner) & own;
        let statements = block.map_or_else(Box::default, |block| self.block(&block));
        let declares = Statement::declare(&statements);
        Program { statements, declares, completeness }
    }

    fn block(&mut self, block: &ast::Block) -> Box<[Statement]> {
        block.statements().map(|statement| self.statement(statement)).collect()
    }

    fn statement(&mut self, statement: ast::Statement) -> Statement {
        match statement {
            ast::Statement::Var(it) => Statement::Variable(self.variable(&it)),
            ast::Statement::IfStatement(it) => self.if_statement(&it),
            ast::Statement::BlockStatement(it) => {
                Statement::Block(it.block().map_or_else(Box::default, |block| self.block(&block)))
            }
            ast::Statement::ReturnStatement(it) => {
                let id = self.first_token(it.syntax());
                Statement::Return(id, it.expr().map(|value| self.expr(Some(value))))
            }
            ast::Statement::AssignStatement(it) => {
                let target = self.name(it.name_ref(), it.syntax());
                Statement::Assign(target, self.expr(it.expr()))
            }
            ast::Statement::ExprStatement(it) => Statement::Expr(self.expr(it.expr())),
        }
    }

    fn if_statement(&mut self, it: &ast::IfStatement) -> Statement {
        let id = self.first_token(it.syntax());
        let condition = self.expr(it.condition());
        let then = it.then_block().map_or_else(Box::default, |block| self.block(&block));
        let end = it.then_block().map_or(it.syntax().text_range(), |block| block.syntax().text_range());
        let end = self.id(TextRange::empty(end.end()));
        let otherwise = it.else_branch().map(|branch| match (branch.block(), branch.if_statement()) {
            (Some(block), _) => self.block(&block),
            (None, Some(nested)) => Box::new([self.if_statement(&nested)]),
            (None, None) => Box::default(),
        });
        Statement::If { id, condition, then, end, otherwise }
    }

    fn first_token(&mut self, node: &SyntaxNode) -> SourceId {
        self.id(node.first_token().map_or(node.text_range(), |token| token.text_range()))
    }

    fn expr(&mut self, expr: Option<ast::Expr>) -> Expr {
        let Some(expr) = expr else { return Expr::Missing };
        let in_arguments = |node: &SyntaxNode| {
            node.children().any(|child| child.kind() == SyntaxKind::ARGUMENT_LIST && has_error_child(&child))
        };
        let is_incomplete = has_error_child(expr.syntax()) || in_arguments(expr.syntax());
        let lowered = self.complete_expr(expr);
        if is_incomplete { Expr::Incomplete(Box::new(lowered)) } else { lowered }
    }

    fn complete_expr(&mut self, expr: ast::Expr) -> Expr {
        match expr {
            ast::Expr::Literal(it) => self.literal(&it),
            ast::Expr::NameExpr(it) => match it.name_ref() {
                Some(name) => Expr::Name(self.name_ref(&name)),
                None => Expr::Missing,
            },
            ast::Expr::CallExpr(it) => {
                let Some(callee) = it.name_ref() else { return Expr::Missing };
                let callee = self.name_ref(&callee);
                let arguments =
                    it.argument_list().into_iter().flat_map(|list| list.exprs().collect::<Vec<_>>());
                Expr::Call {
                    callee,
                    arguments: arguments.map(|argument| self.expr(Some(argument))).collect(),
                    id: self.id(it.syntax().text_range()),
                }
            }
            ast::Expr::ParenExpr(it) => self.expr(it.expr()),
            ast::Expr::UnaryExpr(it) => {
                let operator = match it.own_token().map(|token| token.kind()) {
                    Some(SyntaxKind::BANG) => UnaryOperator::Not,
                    _ => UnaryOperator::Minus,
                };
                let inner = Box::new(self.expr(it.expr()));
                Expr::Unary(operator, inner, self.id(it.syntax().text_range()))
            }
            ast::Expr::BinaryExpr(it) => {
                let lhs = Box::new(self.expr(it.lhs()));
                let rhs = Box::new(self.expr(it.rhs()));
                match it.own_token().and_then(|token| BinaryOperator::from_kind(token.kind())) {
                    Some(operator) => Expr::Binary(operator, lhs, rhs, self.id(it.syntax().text_range())),
                    None => Expr::Missing,
                }
            }
        }
    }

    fn literal(&mut self, literal: &ast::Literal) -> Expr {
        let Some(token) = literal.own_token() else { return Expr::Missing };
        let value = match token.kind() {
            SyntaxKind::INT_NUMBER => Literal::Int(token.text().into()),
            SyntaxKind::FLOAT_NUMBER => Literal::Float(token.text().into()),
            SyntaxKind::STRING => Literal::String(ast::unescape(token.text()).into()),
            SyntaxKind::TRUE_KW => Literal::Bool(true),
            SyntaxKind::FALSE_KW => Literal::Bool(false),
            kind => {
                let port = PortStatus::from_kind(kind).map(Literal::PortStatus);
                match port.or_else(|| CallStatus::from_kind(kind).map(Literal::CallStatus)) {
                    Some(status) => status,
                    None => return Expr::Missing,
                }
            }
        };
        Expr::Literal(value, self.id(token.text_range()))
    }

    fn architecture(&mut self, architecture: &ast::Architecture) -> Architecture {
        let mut lowered = Architecture {
            completeness: self.list_completeness(architecture.syntax()),
            connection_completeness: own_completeness(architecture.syntax()),
            ..Architecture::default()
        };
        for item in architecture.architecture_items() {
            match item {
                ast::ArchitectureItem::Import(it) => {
                    lowered.completeness &= completeness_of(it.syntax());
                    lowered.imports.push(it.ty().map(|ty| self.type_ref(&ty)));
                }
                ast::ArchitectureItem::Instance(it) => {
                    let name = self.name(it.name(), it.syntax());
                    let component = it.ty().map(|ty| self.type_ref(&ty));
                    lowered.completeness &= Completeness::of(!name.name.is_empty());
                    lowered.instances.push(Instance { name, component });
                }
                ast::ArchitectureItem::Connection(it) => {
                    lowered.connection_completeness &= completeness_of(it.syntax());
                    lowered.connections.push(self.connection(it.source(), it.target(), it.buffer()));
                }
                ast::ArchitectureItem::OperationConnection(it) => {
                    lowered.connection_completeness &= completeness_of(it.syntax());
                    lowered.operations.push(self.connection(it.source(), it.target(), None));
                }
                ast::ArchitectureItem::Setting(it) => {
                    // The error may hide a connection; an unterminated string may hide any item.
                    lowered.connection_completeness &= completeness_of(it.syntax());
                    lowered.completeness &= Completeness::of(!has_item_in_unterminated_string(it.syntax()));
                    lowered.settings.push(self.setting(&it));
                }
            }
        }
        lowered
    }

    fn connection(
        &mut self,
        source: Option<ast::Endpoint>,
        target: Option<ast::Endpoint>,
        buffer: Option<ast::Buffer>,
    ) -> Connection {
        let size = buffer.and_then(|buffer| buffer.int_number_token());
        Connection {
            source: source.map(|endpoint| self.endpoint(&endpoint)),
            target: target.map(|endpoint| self.endpoint(&endpoint)),
            buffer: size.map(|size| (size.text().into(), self.id(size.text_range()))),
        }
    }

    fn endpoint(&mut self, endpoint: &ast::Endpoint) -> Endpoint {
        let instance = self.name(endpoint.instance(), endpoint.syntax());
        Endpoint { instance, feature: endpoint.feature().map(|name| self.name_ref(&name)) }
    }

    fn setting(&mut self, setting: &ast::Setting) -> Setting {
        Setting {
            endpoint: setting.endpoint().map(|endpoint| self.endpoint(&endpoint)),
            value: self.expr(setting.expr()),
        }
    }

    fn deployment(&mut self, deployment: &ast::Deployment) -> Deployment {
        let mut lowered =
            Deployment { completeness: self.list_completeness(deployment.syntax()), ..Deployment::default() };
        for target in deployment.syntax().children().filter_map(ast::Target::cast) {
            lowered.completeness &= Completeness::of(target.ty().is_some());
            lowered.targets.extend(target.ty().map(|ty| self.type_ref(&ty)));
        }
        for item in deployment.deployment_items() {
            match item {
                ast::DeploymentItem::Activity(it) => {
                    let activity = self.shared_activity(&it);
                    lowered.completeness &= Completeness::of(!activity.name.name.is_empty());
                    lowered.activities.push(activity);
                }
                ast::DeploymentItem::Setting(it) => {
                    lowered.completeness &= Completeness::of(!has_item_in_unterminated_string(it.syntax()));
                    lowered.settings.push(self.setting(&it));
                }
            }
        }
        lowered
    }

    fn activity(&mut self, activity: &ast::Activity) -> Activity {
        let name = self.name(activity.name_ref(), activity.syntax());
        let mut fields = Vec::new();
        let mut listed: Option<Vec<NameRef>> = None;
        for field in activity.fields() {
            // Unrecognised tokens after a value may belong to it: `priority = 1 9`, `priority = 1 e1`. If a brace is
            // missing there, the value may be incomplete.
            let has_stray_tokens = field.syntax().next_sibling().is_some_and(|next| match next.kind() {
                SyntaxKind::FIELD => ast::Field::cast(next).is_some_and(|next| next.eq_token().is_none()),
                kind => kind == SyntaxKind::ERROR,
            });
            let Some(name) = field.name_ref() else { continue };
            let name = self.name_ref(&name);
            let value_id = self.id(field.value_range().unwrap_or(field.syntax().text_range()));
            let is_complete = is_whole(field.syntax()) && !has_stray_tokens;
            let value = if is_complete { self.expr(field.expr()) } else { Expr::Missing };
            let elements = field.value_list().map(|it| it.exprs().map(|it| self.expr(Some(it))).collect());
            if field.field() == Some(ActivityField::Instances) {
                // Also those of an incomplete list: none of them has another activity.
                let names = elements.iter().flatten().filter_map(|it: &Expr| it.as_name());
                listed.get_or_insert_default().extend(names.cloned());
            }
            let word = field.value_list().and_then(|it| it.word()).map(|it| it.text().into());
            fields.push(Field { name, value, list: elements.filter(|_| is_complete), word, value_id });
        }
        let is_named = !name.name.is_empty();
        let instances = listed.unwrap_or_else(|| is_named.then(|| name.clone()).into_iter().collect());
        Activity { name, instances, fields, completeness: own_completeness(activity.syntax()) }
    }
}

/// Returns the `(` or `-` at the beginning of a line in the value of a variable without a final `;`, where the user may
/// have intended a new statement; and the white space before it, unless there is a comment.
///
/// The token after `variable` decides, but results are reused per state and per declaration: the `;` is in the same list,
/// so in the same state or declaration.
fn continued(variable: &ast::Var) -> Option<(TextRange, Option<TextRange>)> {
    let value = variable.initializer()?;
    let last = value.syntax().last_token()?;
    if next_significant(&last).is_some_and(|token| token.kind() == SyntaxKind::SEMICOLON) {
        return None;
    }
    let goes_on =
        |node: &SyntaxNode| matches!(node.kind(), SyntaxKind::BINARY_EXPR | SyntaxKind::ARGUMENT_LIST);
    let nodes = value.syntax().descendants().filter(goes_on);
    let token = nodes.flat_map(|node| significant_tokens(&node)).find(|token| {
        matches!(token.kind(), SyntaxKind::L_PAREN | SyntaxKind::MINUS) && begins_line(token)
    })?;
    let white = token.prev_token().filter(|white| white.kind() == SyntaxKind::WHITESPACE);
    let white = white.filter(|white| white.prev_token().is_some_and(|before| !before.kind().is_trivia()));
    Some((token.text_range(), white.map(|white| white.text_range())))
}

fn name_of_library(library: &ast::Library) -> Name {
    library.name().map(|name| text_of(name.syntax())).unwrap_or_default()
}

fn text_of(name: &SyntaxNode) -> Name {
    name.first_token().map_or_else(Name::default, |token| token.text().into())
}

/// Returns, for each declaration of the tree, the number of earlier declarations with its kind, library and name.
pub(crate) fn occurrences(outline: &Outline) -> Vec<u32> {
    let mut seen: FxHashMap<(Kind, Option<&Name>, &Name), u32> = FxHashMap::default();
    let declarations = outline.declarations.iter();
    declarations
        .map(|it| {
            let count = seen.entry((it.kind, it.library.as_ref(), &it.name)).or_default();
            *count += 1;
            *count - 1
        })
        .collect()
}
