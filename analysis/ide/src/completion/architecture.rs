//! Completion in an architecture: first connections of unconnected inputs, then instances, connections and values.

use std::collections::BTreeSet;

use mauve_hir::item_tree::{Feature, FeatureKind, Kind, Name};
use mauve_hir::{
    Decl, FeaturesByName, FlatInstance, Link, Type, architecture, flat_of, likely_declaration,
    likely_features_of, likely_shell_of, type_of,
};
use mauve_syntax::SyntaxKind::{self, *};

use super::{Completer, Completion, CompletionKind, Subject};
use crate::program::of_kind;

/// The maximal number of pairs of inputs and outputs that are compared during typing.
const MOST_PAIRS: usize = 50_000;

/// An instance of an architecture, whose text may be incomplete.
pub(super) struct OfInstance<'db> {
    pub(super) name: Name,
    /// The architecture that declares it.
    declared: Decl<'db>,
    component: Option<Decl<'db>>,
    pub(super) features: FeaturesByName<'db>,
}

impl<'db> Completer<'_, 'db> {
    pub(super) fn architecture_item(&mut self, kinds: &[SyntaxKind], path: &[&str]) {
        let Some(decl) = self.decl else { return };
        match kinds {
            [] if path.is_empty() => self.architecture_items(),
            [IMPORT_KW] => self.declared(Kind::Architecture, path),
            [INSTANCE_KW, _, COLON] => self.declared(Kind::Component, path),
            [CONNECTION_KW] => self.sources(decl, FeatureKind::Output, path),
            [OPERATION_KW] => self.sources(decl, FeatureKind::Provided, path),
            [CONNECTION_KW, .., ARROW] | [CONNECTION_KW, .., ARROW, L_BRACK, INT_NUMBER, R_BRACK] => {
                self.targets_of(decl, FeatureKind::Output, path);
            }
            [OPERATION_KW, .., ARROW] => self.targets_of(decl, FeatureKind::Provided, path),
            [PROPERTY_KW | CONSTANT_KW, ..] => self.setting(decl, kinds, path),
            _ => {}
        }
        if !kinds.is_empty() && self.at.may_begin {
            self.architecture_items();
        }
    }

    fn architecture_items(&mut self) {
        self.open_connections();
        self.skeleton("instance", "instance ${1:name}: ${2:Component}");
        self.skeleton("connection", "connection ${1:source.output} -> ${2:target.input}");
        self.skeleton("operation", "operation ${1:provider.operation} -> ${2:caller.operation}");
        self.skeleton("property", "property ${1:instance.name} = ${2:0}");
        self.skeleton("constant", "constant ${1:instance.name} = ${2:0}");
        self.skeleton("import", "import ${1:Architecture}");
    }

    pub(super) fn instances(&self, of: Decl<'db>) -> Vec<OfInstance<'db>> {
        let (db, project) = (self.db, self.project);
        let instances = flat_of(db, project, of).instances.iter();
        let instance = |it: &FlatInstance<'db>| {
            // Names of an incomplete text are offered, although they do not resolve.
            let (declared, index) = it.declared;
            let written = || architecture(db, declared)?.instances.get(index)?.component.as_ref();
            let component = it
                .component
                .or_else(|| likely_declaration(db, project, declared, Kind::Component, &written()?.path));
            let shell = component.and_then(|component| likely_shell_of(db, project, component));
            let features = shell.map(|shell| likely_features_of(db, project, shell)).unwrap_or_default();
            OfInstance { name: it.name.clone(), declared, component, features }
        };
        instances.map(instance).collect()
    }

    pub(super) fn of_instance(&self, it: &OfInstance<'db>) -> Completion {
        let detail = it.component.map_or_else(String::new, |it| format!(": {}", it.name(self.db)));
        let subject = Subject::of(self.db, it.declared, Some(it.name.clone()));
        Completion::new(CompletionKind::Instance, it.name.as_str()).detail(detail).subject(subject)
    }

    fn sources(&mut self, of: Decl<'db>, kind: FeatureKind, path: &[&str]) {
        for instance in self.instances(of) {
            let mut fitting = of_kind(&instance.features, kind).peekable();
            match path {
                [] if fitting.peek().is_some() || instance.features.is_empty() => {
                    self.add(self.of_instance(&instance));
                }
                [name] if instance.name == *name => {
                    for (name, shell, feature) in fitting {
                        self.add(self.of_feature(name, shell, feature));
                    }
                }
                _ => {}
            }
        }
    }

    /// Offers a connection for each unconnected input that has exactly one matching output of another instance.
    fn open_connections(&mut self) {
        let Some(of) = self.decl else { return };
        let all = self.instances(of);
        let connected = self.connected(of);
        let this = &*self;
        let ends = |kind| {
            let ends =
                all.iter().flat_map(move |it| of_kind(&it.features, kind).map(move |end| (&it.name, end)));
            ends.map(move |(name, (port, shell, feature))| (name, port, shell, this.shape(shell, feature)))
        };
        let outputs: Vec<_> = ends(FeatureKind::Output).collect();
        let is_open = |name: &Name, port: &Name| !connected.contains(&(name.clone(), port.clone()));
        let inputs = ends(FeatureKind::Input).filter(|(name, port, ..)| is_open(name, port));
        let inputs: Vec<_> = inputs.collect();
        if inputs.len() * outputs.len() > MOST_PAIRS {
            return;
        }
        for (name, port, shell, shape) in inputs {
            let mut fitting =
                outputs.iter().filter(|(source, _, _, it)| *source != name && are_alike(it, &shape));
            if let (Some((source, output, ..)), None) = (fitting.next(), fitting.next()) {
                let text = format!("connection {source}.{output} -> {name}.{port}");
                let subject = Subject::of(self.db, shell, Some(port.clone()));
                let item = Completion::new(CompletionKind::Skeleton, text.as_str()).note("not connected yet");
                self.add(item.rank(0).subject(subject));
            }
        }
    }

    /// Offers the targets of a connection from a feature of this kind: those of the same type, unconnected ones first.
    fn targets_of(&mut self, of: Decl<'db>, kind: FeatureKind, path: &[&str]) {
        let wanted = if kind == FeatureKind::Output { FeatureKind::Input } else { FeatureKind::Required };
        let all = self.instances(of);
        let at = self.at;
        let mut words = at.item.iter().filter(|token| token.kind().is_word()).skip(1);
        let [source, source_feature] = [words.next(), words.next()].map(|it| Some(it?.text()));
        let is_source = |it: &OfInstance<'db>| source == Some(it.name.as_str());
        let source_type = all.iter().find(|it| is_source(it)).and_then(|it| {
            let (shell, feature) = it.features.get(source_feature?)?;
            Some(self.shape(*shell, feature))
        });
        let connected = self.connected(of);
        for instance in &all {
            let name = &instance.name;
            let is_open = |port: &Name| !connected.contains(&(name.clone(), port.clone()));
            let fits = |shape: &[Type]| source_type.as_ref().is_none_or(|source| are_alike(source, shape));
            let fitting = of_kind(&instance.features, wanted);
            let fitting = fitting.filter(|(_, shell, feature)| fits(&self.shape(*shell, feature)));
            let fitting: Vec<_> = fitting.collect();
            match path {
                [] => {
                    for (port, shell, feature) in fitting.iter().filter(|(port, ..)| is_open(port)) {
                        let whole = self.of_feature(&format!("{name}.{port}"), *shell, feature);
                        self.add(whole.rank(u8::from(is_source(instance))));
                    }
                    if !fitting.is_empty() || instance.features.is_empty() {
                        self.add(self.of_instance(instance).rank(2));
                    }
                }
                [instance] if *name == *instance => {
                    for (port, shell, feature) in fitting {
                        let (rank, note) = if is_open(port) { (0, "") } else { (3, "connected already") };
                        self.add(self.of_feature(port, shell, feature).rank(rank).note(note));
                    }
                }
                _ => {}
            }
        }
    }

    /// Returns the types that both ends of a connection must have: of a port, or of the parameters and the result of an
    /// operation.
    fn shape(&self, of: Decl<'db>, feature: &Feature) -> Vec<Type> {
        let parameters = feature.parameters.iter().map(|it| it.ty.as_ref());
        let types = parameters.chain([feature.ty.as_ref()]);
        types.map(|ty| type_of(self.db, self.project, of, ty)).collect()
    }

    fn connected(&self, of: Decl<'db>) -> BTreeSet<(Name, Name)> {
        let is_here = |link: &Link<'db>| {
            link.at.file(self.db) == self.file
                && link.at.range(self.db).contains_inclusive(self.at.word.start())
        };
        let links = flat_of(self.db, self.project, of).links.iter();
        links.filter(|link| !is_here(link)).map(|link| link.target.clone()).collect()
    }

    /// Offers `property i.p = value` and `constant i.c = value`, in an architecture and in a deployment of `of`.
    pub(super) fn setting(&mut self, of: Decl<'db>, kinds: &[SyntaxKind], path: &[&str]) {
        let kind = match kinds.first() {
            Some(PROPERTY_KW) => FeatureKind::Property,
            _ => FeatureKind::Constant,
        };
        match (kinds, path) {
            ([_], []) => self.sources(of, kind, path),
            ([_], [instance]) => {
                let of_instance = self.instances(of).into_iter().find(|it| it.name == *instance);
                let features = of_instance.map(|it| it.features).unwrap_or_default();
                for (name, shell, feature) in of_kind(&features, kind) {
                    let (rank, note) = match (self.is_set(of, instance, name), &feature.value) {
                        (true, _) => (3, "has a value already"),
                        (false, Some(_)) => (1, ""),
                        (false, None) => (0, "has no value"),
                    };
                    let item = self.of_feature(name, shell, feature).rank(rank).note(note);
                    self.add(item.completed(self.at.right == EQ, format!("{name} = $0")));
                }
            }
            ([_, _, DOT, _, EQ], []) => {
                let words: Vec<&str> = self.at.item.iter().map(|token| token.text()).collect();
                let [_, instance, _, name, _] = words.as_slice() else { return };
                let of_instance = self.instances(of).into_iter().find(|it| it.name == *instance);
                let feature = of_instance.and_then(|it| it.features.get(*name).copied());
                let Some((shell, feature)) = feature else { return };
                self.value_of(Some(type_of(self.db, self.project, shell, feature.ty.as_ref())));
            }
            _ => {}
        }
    }

    pub(super) fn is_set(&self, of: Decl<'db>, instance: &str, name: &str) -> bool {
        let flat = flat_of(self.db, self.project, of);
        let here = self.at.list.children().filter(|node| {
            node.kind() == SETTING && !node.text_range().contains_inclusive(self.at.word.start())
        });
        let here = here.filter_map(|node| {
            let words = node.descendants().filter(|it| it.kind() == NAME_REF).map(|it| it.text().to_string());
            let words: Vec<String> = words.take(2).collect();
            Some((words.first()?.clone(), words.get(1)?.clone()))
        });
        let in_flat = || flat.settings.iter().any(|(of, it)| *of == *instance && *it == *name);
        let is_deployment = self.at.list.kind() == DEPLOYMENT;
        is_deployment && in_flat() || here.into_iter().any(|(of, it)| of == *instance && it == *name)
    }
}

fn are_alike(one: &[Type], other: &[Type]) -> bool {
    one.len() == other.len() && one.iter().zip(other).all(|(one, other)| one.is(other))
}

#[cfg(test)]
mod tests {
    use super::super::testing::{labels, offered};
    use expect_test::{Expect, expect};

    fn check(item: &str, expected: Expect) {
        let text = format!(
            "
library a {{
  shell Laser {{
    property device: string  property rate: int = 10  constant angle: double
    output port scan: int  output port power: bool
    provide reset(): void
  }}
  shell Drive {{
    property wheel: double
    input port left: int  input port right: int  input port power: bool  output port speed: int
    require reset(): void  require go(in way: int): void
  }}
  core L(Laser) {{}} core D(Drive) {{}}
  component LaserOf(Laser, L)
  component DriveOf(Drive, D)
  architecture Base {{ instance laser: LaserOf }}
  architecture Robot {{
    import Base
    instance drive: DriveOf
    connection laser.scan -> drive.left
    property laser.device = \"/dev/a\"
    {item}
  }}
}}
"
        );
        expected.assert_eq(&offered(&text, 9));
    }

    #[test]
    fn items_of_architectures_are_offered() {
        check(
            "co$0",
            expect![[r#"
                0 connection laser.power -> drive.power (not connected yet)
                0 connection laser.scan -> drive.right (not connected yet)
                1 instance (instance name: Component) ⇒ "instance ${1:name}: ${2:Component}"
                1 connection (connection source.output -> target.input) ⇒ "connection ${1:source.output} -> ${2:target.input}"
                1 operation (operation provider.operation -> caller.operation) ⇒ "operation ${1:provider.operation} -> ${2:caller.operation}"
                1 property (property instance.name = 0) ⇒ "property ${1:instance.name} = ${2:0}"
                1 constant (constant instance.name = 0) ⇒ "constant ${1:instance.name} = ${2:0}"
                1 import (import Architecture) ⇒ "import ${1:Architecture}"
            "#]],
        );
        check(
            "instance other: $0",
            expect![[r#"
            1 LaserOf(Laser, L)
            1 DriveOf(Drive, D)
        "#]],
        );
        check(
            "import $0",
            expect![[r#"
            1 Base
        "#]],
        );
    }

    #[test]
    fn a_connection_goes_from_outputs_to_inputs_of_their_type() {
        check(
            "connection $0",
            expect![[r#"
            1 laser: LaserOf
            1 drive: DriveOf
        "#]],
        );
        check(
            "connection laser.$0",
            expect![[r#"
            1 power: bool
            1 scan: int
        "#]],
        );
        check(
            "connection laser.scan -> $0",
            expect![[r#"
            0 drive.right: int
            2 drive: DriveOf
        "#]],
        );
        check(
            "connection laser.scan -> [4] drive.$0",
            expect![[r#"
            0 right: int
            3 left: int (connected already)
        "#]],
        );
        check(
            "connection laser.power -> drive.$0\n    instance x: LaserOf",
            expect![[r#"
            0 power: bool
        "#]],
        );
    }

    #[test]
    fn an_operation_goes_from_the_provider_to_the_caller() {
        check(
            "operation $0",
            expect![[r#"
            1 laser: LaserOf
        "#]],
        );
        check(
            "operation laser.$0",
            expect![[r#"
            1 reset(): void
        "#]],
        );
        check(
            "operation laser.reset -> $0",
            expect![[r#"
            0 drive.reset(): void
            2 drive: DriveOf
        "#]],
        );
    }

    #[test]
    fn what_has_no_value_is_set_first() {
        check(
            "property $0",
            expect![[r#"
            1 laser: LaserOf
            1 drive: DriveOf
        "#]],
        );
        check(
            "property laser.$0",
            expect![[r#"
            1 rate: int ⇒ "rate = $0"
            3 device: string (has a value already) ⇒ "device = $0"
        "#]],
        );
        check(
            "constant laser.$0 = 1.0",
            expect![[r#"
            0 angle: double (has no value)
        "#]],
        );
        check("property drive.wheel = $0", expect![[""]]);
    }

    #[test]
    fn where_a_name_is_to_be_made_up() {
        assert_eq!(labels("architecture A { instance $0 }"), [] as [&str; 0]);
    }
}
