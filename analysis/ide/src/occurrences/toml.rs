//! The names in timing tables and in `mauve.toml`, as parts of keys and strings.

use std::ops::Range;

use mauve_hir::item_tree::{Endpoint, Kind, NameRef, SourceId};
use mauve_hir::{
    Decl, File, Location, ModelDb, ProgramId, ProgramKey, Project, config_of, core, core_of, features_of,
    first_target_of, flat_of, names_of, section_with_tables, shell_of,
};
use mauve_syntax::TextRange;
use mauve_timing::TableSection;
use mauve_wcrt::{observed_files, observed_in, table, table_files};
use rustc_hash::FxHashSet;

use super::{
    Definition, FoundName, NameFinder, OccurrenceRole, each_once, kind_of, mention, range_of, unquoted,
};
use crate::document_symbols::SymbolKind;

#[derive(Debug, Default, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct InToml<'db> {
    /// Each name once, in no particular order.
    pub(crate) names: Vec<FoundName<'db>>,
    /// The names in strings with escapes, which a rename cannot replace.
    pub(crate) escaped: Vec<FoundName<'db>>,
}

#[salsa::tracked(returns(ref))]
pub(crate) fn in_toml<'db>(db: &'db dyn ModelDb, project: Project<'db>, file: File) -> InToml<'db> {
    let workspace = project.workspace(db);
    let mut reader = KeyReader { db, project, file, found: InToml::default(), known: FxHashSet::default() };
    if mauve_hir::config_file(db, workspace) == Some(file) {
        reader.config();
    } else if table_files(db, workspace).files.contains(&file) {
        reader.table();
    } else if observed_files(db, workspace).files.contains(&file) {
        reader.observed();
    }
    reader.found
}

struct KeyReader<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    found: InToml<'db>,
    known: FxHashSet<(TextRange, Definition<'db>)>,
}

impl<'db> KeyReader<'db> {
    /// Adds a name at `range`; if the text is escaped, the name is somewhere in `whole`.
    fn add(
        &mut self,
        range: Option<Range<usize>>,
        whole: &Range<usize>,
        definition: Definition<'db>,
        kind: SymbolKind,
    ) {
        let found = |range| mention(self.file, range, definition.clone(), kind);
        match range.map(|range| range_of(&range)) {
            Some(range) if self.known.insert((range, definition.clone())) => {
                self.found.names.push(found(range));
            }
            Some(_) => {}
            None => self.found.escaped.push(found(range_of(whole))),
        }
    }

    /// Returns where bytes of `text`, which is written at `span` with or without quotes, are written; `None` if it is escaped.
    fn pieces(
        &self,
        text: &str,
        span: &Range<usize>,
    ) -> impl Fn(Range<usize>) -> Option<Range<usize>> + use<> {
        let whole = self.file.text(self.db);
        let written = Range::<usize>::from(unquoted(whole, range_of(span)));
        let is_verbatim = whole.get(written.clone()) == Some(text);
        move |piece| is_verbatim.then_some(written.start + piece.start..written.start + piece.end)
    }

    fn config(&mut self) {
        let (db, project) = (self.db, self.project);
        let workspace = project.workspace(db);
        let config = config_of(db, workspace);
        for (path, span) in &config.roots {
            let root = workspace.file(db, &mauve_hir::normalised(&workspace.folder(db).join(path)));
            if let Some(root) = root {
                let written = unquoted(self.file.text(db), range_of(span));
                self.add(Some(written.into()), span, Definition::File(root), SymbolKind::File);
            }
        }
        for section in &config.deployment_tables {
            let key = section.name.as_str();
            // The section with the qualified name of a deployment comes before the one with its name.
            let has_it = |decl: Decl<'db>| section_with_tables(db, project, decl) == Some(key);
            self.deployment(key, &section.span, &has_it);
        }
        // Deployments may share an architecture.
        let deployed = |key: Option<&str>| {
            let named = names_of(db, project).of_kind(db, Kind::Deployment);
            let named = named.filter(|it| key.is_none_or(|key| it.is_called(db, key)));
            each_once(named.filter_map(|of| first_target_of(db, project, of)))
        };
        for section in &config.deployments {
            let key = section.name.as_str();
            self.deployment(key, &section.span, &|_| true);
            for accepted in &section.accepted {
                self.endpoint(&deployed(Some(key)), &accepted.instance, &accepted.span);
            }
        }
        let all = deployed(None);
        let chains = || config.chains.iter();
        let ends = || chains().flat_map(|it| it.ends().chain(&it.answers));
        let topics = config.ros2.iter().flat_map(|it| &it.topics).map(|it| &it.port);
        let on_hosts = config.hosts.iter().flat_map(|it| &it.activities);
        let on_clocks = config.on_clocks().map(|(_, it)| it);
        for (end, span) in on_clocks.chain(on_hosts).chain(topics).chain(ends()) {
            self.endpoint(&all, end, span);
        }
        for (end, span) in ends() {
            self.quoted_key(TableSection::Codel, end, span);
        }
        for (state, span) in chains().flat_map(|it| &it.states) {
            self.state(&all, state, span);
        }
        for (key, span) in config.locks.iter().flat_map(|lock| &lock.codels) {
            self.quoted_key(TableSection::Codel, key, span);
        }
    }

    /// Adds an instance of these architectures, and its port behind a dot.
    fn endpoint(&mut self, architectures: &[Decl<'db>], end: &str, span: &Range<usize>) {
        let piece = self.pieces(end, span);
        let (instance, port) = end.split_once('.').map_or((end, None), |(of, port)| (of, Some(port)));
        for &target in architectures {
            let mut finder = NameFinder::new(self.db, self.project, target);
            let name = |name: &str| NameRef { name: name.into(), id: SourceId(0) };
            let endpoint = Endpoint { instance: name(instance), feature: port.map(name) };
            finder.endpoint(target, &endpoint, OccurrenceRole::Mention);
            for it in finder.found {
                let range = match it.kind {
                    SymbolKind::Instance => piece(0..instance.len()),
                    _ => piece(end.len() - port.map_or(0, str::len)..end.len()),
                };
                self.add(range, span, it.definition, it.kind);
            }
        }
    }

    /// Adds an instance of these architectures, and its state behind a dot.
    fn state(&mut self, architectures: &[Decl<'db>], written: &str, span: &Range<usize>) {
        let (db, project) = (self.db, self.project);
        let Some((instance, name)) = written.split_once('.') else { return };
        self.endpoint(architectures, written, span);
        let piece = self.pieces(written, span);
        for &target in architectures {
            let component = flat_of(db, project, target).instance(instance).and_then(|it| it.component);
            let Some(of) = component.and_then(|it| core_of(db, project, it)) else { continue };
            if let Some(state) = core(db, of).and_then(|core| core.state(name)) {
                let definition = Definition::At(Location::Source(of, state.name.id));
                let range = piece(instance.len() + 1..written.len());
                self.add(range, span, definition, SymbolKind::State);
            }
        }
    }

    /// Adds the deployments that a section of `mauve.toml` names with their libraries or without.
    fn deployment(&mut self, key: &str, span: &Range<usize>, is_meant: &dyn Fn(Decl<'db>) -> bool) {
        let db = self.db;
        let piece = self.pieces(key, span);
        let named =
            names_of(db, self.project).of_kind(db, Kind::Deployment).filter(|it| it.is_called(db, key));
        for decl in named.filter(|it| is_meant(*it)) {
            let name = key.len() - decl.name(db).len();
            let kind = kind_of(Kind::Deployment);
            self.add(piece(name..key.len()), span, Definition::Declaration(decl), kind);
            if let Some(library) = key.get(..name.saturating_sub(1)).filter(|library| !library.is_empty()) {
                let definition = Definition::Library(library.into());
                self.add(piece(0..library.len()), span, definition, SymbolKind::Library);
            }
        }
    }

    fn table(&mut self) {
        let table = table(self.db, self.file);
        for (of, entry) in
            table.sections().into_iter().flat_map(|(of, all)| all.iter().map(move |it| (of, it)))
        {
            self.key(of, &entry.key, &entry.key_span, &|range| entry.written(range));
        }
    }

    /// Adds the names in the keys of a file of `[timing] observed`: without them, what was observed would be forgotten.
    fn observed(&mut self) {
        let observed = &observed_in(self.db, self.file).0;
        let codels = observed.codels.iter().map(|(key, it)| (TableSection::Codel, key, &it.span));
        let programs = observed.programs.iter().map(|(key, it)| (TableSection::Program, key, &it.span));
        let accesses = observed.accesses.iter().map(|(key, it)| (TableSection::Access, key, &it.span));
        let locks = observed.locks.iter().map(|((_, key), it)| (TableSection::Codel, key, &it.span));
        for (of, key, span) in codels.chain(programs).chain(accesses).chain(locks) {
            self.quoted_key(of, key, span);
        }
    }

    /// [`KeyReader::key`] in a string.
    fn quoted_key(&mut self, of: TableSection, key: &str, span: &Range<usize>) {
        let piece = self.pieces(key, span);
        self.key(of, key, span, &piece);
    }

    /// Adds the names in a key of a timing table; `piece` returns where these bytes of the key are written.
    fn key(
        &mut self,
        of: TableSection,
        whole: &str,
        span: &Range<usize>,
        piece: &dyn Fn(Range<usize>) -> Option<Range<usize>>,
    ) {
        let (db, project) = (self.db, self.project);
        let (key, program, port) = match (of, ProgramKey::parse(whole)) {
            (TableSection::Access, _) => match whole.rsplit_once('.') {
                Some((component, port)) => (component, None, Some(port)),
                None => return,
            },
            (_, Some(ProgramKey { component, program })) => (component, Some(program), None),
            (_, None) => (whole, None, None),
        };
        let is_codel = matches!(of, TableSection::Codel | TableSection::Wait);
        let kind = if is_codel { Kind::Codel } else { Kind::Component };
        let (library, name) = key.rsplit_once('.').map_or((None, key), |(of, name)| (Some(of), name));
        for &decl in names_of(db, project).by_key(kind, key) {
            let mut add =
                |range: Range<usize>, definition, kind| self.add(piece(range), span, definition, kind);
            add(key.len() - name.len()..key.len(), Definition::Declaration(decl), kind_of(kind));
            if let Some(library) = library {
                add(0..library.len(), Definition::Library(library.into()), SymbolKind::Library);
            }
            let start = key.len() + 1;
            let of_port = port.and_then(|port| {
                let shell = shell_of(db, project, decl)?;
                let declared = features_of(db, project, shell).get(port)?.name(db)?;
                Some((0..port.len(), Definition::At(declared), SymbolKind::Port))
            });
            let of_program = program.iter().flat_map(|program| in_program(db, project, decl, program));
            for (Range { start: from, end }, definition, kind) in of_program.chain(of_port) {
                add(start + from..start + end, definition, kind);
            }
        }
    }
}

/// Returns the names in the key of a program of `component` with their byte ranges: `state.method`, `state.transition.effect`,
/// `operation`; also `state.transition`, which is not a program.
fn in_program<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
    program: &ProgramId,
) -> Vec<(Range<usize>, Definition<'db>, SymbolKind)> {
    let Some(of) = core_of(db, project, component) else { return Vec::new() };
    let Some(data) = core(db, of) else { return Vec::new() };
    let id = |name: &NameRef| Definition::At(Location::Source(of, name.id));
    let key = program.to_string();
    let Some((name, rest)) = key.split_once('.') else {
        let shell = shell_of(db, project, component);
        let declared = shell.and_then(|shell| features_of(db, project, shell).get(&key)?.name(db));
        let own = || data.operation(&key).map(|own| id(&own.name));
        let operation = declared.map(Definition::At).or_else(own);
        let hook = data.hooks.iter().find(|hook| *program == ProgramId::Hook(hook.kind));
        let hook = hook.map(|hook| (Definition::At(Location::Source(of, hook.id)), SymbolKind::Hook));
        let found = hook.or_else(|| operation.map(|it| (it, SymbolKind::Operation)));
        return found.map(|(definition, kind)| (0..key.len(), definition, kind)).into_iter().collect();
    };
    let Some(state) = data.state(name) else { return Vec::new() };
    let mut found = vec![(0..name.len(), id(&state.name), SymbolKind::State)];
    let start = name.len() + 1;
    if let Some((transition, _)) = rest.split_once('.')
        && let Some(it) = state.transitions.iter().find(|it| *it.name.name == *transition)
    {
        found.push((start..start + transition.len(), id(&it.name), SymbolKind::Transition));
    } else if let ProgramId::Method { kind, .. } = program
        && let Some(method) = state.methods.iter().find(|method| method.kind == *kind)
    {
        found.push((start..key.len(), Definition::At(Location::Source(of, method.id)), SymbolKind::Hook));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check, of};
    use expect_test::expect;

    #[test]
    fn deployments_of_sections() {
        check(
            "//- /a.mal\nshell S { }\narchitecture A { }\nlibrary l { deployment D { architecture A } }\n\
             deployment E { architecture A } deployment F { architecture A }\n\
             //- /mauve.toml\nproject.root = 'a.mal'\n$0[timing.deployment.\"l.D\"]\ntables = []\n\
             [timing.deployment.E]\ntables = []\n[timing.deployment.\"\\u0046\"]\ntables = []\n\
             [deployment.D]\naccept = { }\n",
            expect![[r#"
                1: a.mal Mention File: /a.mal
                2: l Mention Library: Library("l")
                2: D Mention Deployment: deployment D
                4: E Mention Deployment: deployment E
                8: D Mention Deployment: deployment D
            "#]],
        );
    }

    #[test]
    fn in_tables_and_configurations() {
        of(
            "/mauve.toml",
            expect![[r#"
            1: robot.mal Mention File: /robot.mal
            3: laser Mention Instance: /robot.mal:2 laser
            4: laser Mention Instance: /robot.mal:2 laser
            4: scan Mention Port: /parts.mal:4 scan
            4: map Mention Instance: /robot.mal:5 map
            4: scan Mention Port: /parts.mal:5 scan
        "#]],
        );
        of(
            "/t.toml",
            expect![[r#"
            1: parts Mention Library: Library("parts")
            2: shoot Mention Codel: codel shoot
            4: parts Mention Library: Library("parts")
            4: Laser Mention Component: component Laser
            4: update Mention Hook: /parts.mal:9 update
            5: Mapper Mention Component: component Mapper
            5: Idle Mention State: /parts.mal:15 Idle
            5: run Mention Hook: /parts.mal:15 run
            6: Mapper Mention Component: component Mapper
            6: Idle Mention State: /parts.mal:15 Idle
            6: go Mention Transition: /parts.mal:15 go
            7: Mapper Mention Component: component Mapper
            7: clear Mention Operation: /parts.mal:5 clear
            9: parts Mention Library: Library("parts")
            9: Laser Mention Component: component Laser
        "#]],
        );
        check(
            "//- /a.mal\nlibrary l { codel f(): int codel g(): int } codel f(): int\n\
             //- /mauve.toml\nproject.root = 'a.mal'\ntiming.tables = ['t.toml']\n\
             //- /t.toml\n$0codel.l.f = 1\ncodel . l . 'g' = 1\ncodel.f = 2\ncodel.\"l.\\u0066\" = 3\n",
            expect![[r#"
                1: l Mention Library: Library("l")
                1: f Mention Codel: codel f
                2: l Mention Library: Library("l")
                2: g Mention Codel: codel g
                3: f Mention Codel: codel f
            "#]],
        );
    }

    #[test]
    fn names_of_chains() {
        check(
            "//- /a.mal\nlibrary l { codel f(): bool  shell S { input port q: int output port p: int }\n\
             core K(S) { statemachine { initial state Go { transition on to Go } } } component C(S, K)\n\
             architecture A { instance a: C  instance b: C } deployment D { architecture A } }\n\
             //- /mauve.toml\n$0[chains.c]\nfrom = 'l.f'\nto = 'b'\nthrough = ['a.p']\nwhile = ['a.Go', '\\u0061.Go', 'a.No']\n\
             answers = ['f', 'b.q']\n",
            expect![[r#"
                2: l Mention Library: Library("l")
                2: f Mention Codel: codel f
                3: b Mention Instance: /a.mal:3 b
                4: a Mention Instance: /a.mal:3 a
                4: p Mention Port: /a.mal:1 p
                5: a Mention Instance: /a.mal:3 a
                5: Go Mention State: /a.mal:2 Go
                5: a Mention Instance: /a.mal:3 a
                6: f Mention Codel: codel f
                6: b Mention Instance: /a.mal:3 b
                6: q Mention Port: /a.mal:1 q
            "#]],
        );
    }

    #[test]
    fn waits_accesses_locks_and_what_was_observed() {
        const MODEL: &str = "//- /a.mal\nlibrary l { codel f(): int  shell S { output port p: int }\n\
             core K(S) { update = { write(p, f()); } } component C(S, K) }\n\
             //- /mauve.toml\n$Mtiming.tables = ['t.toml']\ntiming.observed = 'o.toml'\n[locks.bus]\n\
             codels = ['l.f']\nprotocol = 'none'\n\
             //- /t.toml\n$T[wait]\nl.f = 1\n[access]\n'l.C.p' = 1\n\
             //- /o.toml\n$O[codel.'l.f']\nexecutions = 1\ngreatest = 1\n[access.'C.p']\nexecutions = 1\ngreatest = 1\n\
             [lock.bus.'l.f']\nexecutions = 1\nheld = 1\n";
        let at = |cursor: &str| {
            let marked = MODEL.replace(cursor, "$0");
            ["$M", "$T", "$O"].iter().fold(marked, |text, other| text.replace(other, ""))
        };
        check(
            &at("$M"),
            expect![[r#"
                4: l Mention Library: Library("l")
                4: f Mention Codel: codel f
            "#]],
        );
        check(
            &at("$T"),
            expect![[r#"
                2: l Mention Library: Library("l")
                2: f Mention Codel: codel f
                4: l Mention Library: Library("l")
                4: C Mention Component: component C
                4: p Mention Port: /a.mal:1 p
            "#]],
        );
        check(
            &at("$O"),
            expect![[r#"
                1: l Mention Library: Library("l")
                1: f Mention Codel: codel f
                4: C Mention Component: component C
                4: p Mention Port: /a.mal:1 p
                7: l Mention Library: Library("l")
                7: f Mention Codel: codel f
            "#]],
        );
    }

    #[test]
    fn a_part_of_a_key_stands_where_it_is_written_and_not_where_its_letters_are() {
        check(
            "//- /a.mal\nlibrary l { codel f(): int codel g(): int } component C(S, C)\n\
             //- /mauve.toml\nproject.root = 'a.mal'\ntiming.tables = ['t.toml']\n\
             //- /t.toml\n$0levels = [1e-4]\n[codel.l]  # of l, not of l\nf = 1 # l.g\n\
             x = [\n[1],\n]\ng = [\n3] # l\n",
            expect![[r#"
                2: l Mention Library: Library("l")
                3: f Mention Codel: codel f
                7: g Mention Codel: codel g
            "#]],
        );
    }
}
