//! Connects an unconnected input or required operation to each output or operation that fits.

use mauve_diagnostics::Finding;
use mauve_hir::item_tree::{Direction, FeatureKind, Name};
use mauve_hir::{
    Decl, FeatureOf, Flat, FlatInstance, ModelDb, Project, Type, declaration_at, first_target_of, flat_of,
    type_of,
};
use mauve_syntax::ast::{self, AstNode as _};
use rustc_hash::{FxHashMap, FxHashSet};

use super::{Actions, put_into};

const MOST: usize = 12;

/// The outputs and operations of each architecture, for all its findings.
#[derive(Default)]
pub(super) struct KnownSources<'db>(FxHashMap<(Project<'db>, Decl<'db>, &'static str), LinkSources<'db>>);

pub(super) fn offer<'db>(
    actions: &mut Actions<'_, 'db>,
    finding: &Finding<'db>,
    known: &mut KnownSources<'db>,
) {
    let (db, file) = (actions.db, actions.question.file);
    let at = finding.diagnostic.at.range(db);
    let activity = actions.around::<ast::Activity>(at);
    let instance = activity.and_then(|it| it.name_ref()).filter(|it| it.syntax().text_range() == at);
    let of = declaration_at(db, file, at);
    let project = finding.only_in.or(actions.project);
    let (Some(instance), Some(of), Some(project)) = (instance, of, project) else { return };
    let Some(architecture) = first_target_of(db, project, of) else { return };
    let keyword =
        if finding.diagnostic.code.name == "unconnected-input" { "connection" } else { "operation" };
    let key = (project, architecture, keyword);
    let sources = known.0.entry(key).or_insert_with(|| LinkSources::of(db, project, architecture, keyword));
    for (source, target) in sources.connections(&instance.syntax().text().to_string()) {
        let title = format!("Connect `{source}` to `{target}`");
        actions.offer_fix(finding, title, || {
            put_into(db, architecture, &format!("{keyword} {source} -> {target}"))
        });
    }
}

/// The outputs or the operations of an architecture, by what they fit.
struct LinkSources<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    flat: &'db Flat<'db>,
    takes: FeatureKind,
    fitting: FxHashMap<EndSignature, Fitting<'db>>,
    connected: FxHashSet<&'db (Name, Name)>,
}

/// Sources with one signature: instances and features, in the order of the instances.
#[derive(Default)]
struct Fitting<'db> {
    all: Vec<(&'db Name, &'db Name)>,
    by_name: FxHashMap<&'db Name, Vec<&'db Name>>,
}

/// Two features fit if these are equal: the directions and types of the parameters and of the value or result, and the spelling
/// of unknown types.
type EndSignature = Vec<(Option<Direction>, Type, Option<Vec<Name>>)>;

impl<'db> LinkSources<'db> {
    fn of(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        architecture: Decl<'db>,
        keyword: &str,
    ) -> LinkSources<'db> {
        let (gives, takes) = match keyword {
            "connection" => (FeatureKind::Output, FeatureKind::Input),
            _ => (FeatureKind::Provided, FeatureKind::Required),
        };
        let flat = flat_of(db, project, architecture);
        let connected = flat.links.iter().map(|link| &link.target).collect();
        let mut sources = LinkSources { db, project, flat, takes, fitting: FxHashMap::default(), connected };
        for instance in &flat.instances {
            for (name, feature) in sources.features(instance, gives) {
                let Some(signature) = sources.signature(feature) else { continue };
                let fitting = sources.fitting.entry(signature).or_default();
                fitting.all.push((&instance.name, name));
                fitting.by_name.entry(name).or_default().push(&instance.name);
            }
        }
        sources
    }

    fn features(
        &self,
        instance: &FlatInstance<'db>,
        kind: FeatureKind,
    ) -> impl Iterator<Item = (&'db Name, &'db FeatureOf<'db>)> + use<'db> {
        let features = instance.features(self.db, self.project).into_iter().flat_map(|it| &it.by_name);
        let first = features.filter_map(|(name, features)| Some((name, features.first()?)));
        first.filter(move |(_, it)| it.kind == kind)
    }

    /// Returns `None` if a type is missing: nothing fits then.
    fn signature(&self, of: &FeatureOf<'db>) -> Option<EndSignature> {
        let data = of.data(self.db)?;
        let parameters = data.parameters.iter().map(|it| (Some(it.direction), it.ty.as_ref()));
        let all = parameters.chain([(None, data.ty.as_ref())]);
        let types = all.map(|(direction, written)| {
            let ty = type_of(self.db, self.project, of.shell, written);
            let path = match ty {
                Type::Unknown => Some(written?.path.clone()),
                _ => None,
            };
            Some((direction, ty, path))
        });
        types.collect()
    }

    /// Returns the possible connections of an instance's open ends, as pairs of `instance.feature`: for each end, first the
    /// sources of its name.
    fn connections(&self, instance: &str) -> Vec<(String, String)> {
        let Some(of) = self.flat.instance(instance) else { return Vec::new() };
        let mut found = Vec::new();
        for (name, input) in self.features(of, self.takes) {
            if self.connected.contains(&(of.name.clone(), name.clone())) {
                continue;
            }
            let Some(fitting) = self.signature(input).and_then(|it| self.fitting.get(&it)) else { continue };
            let same = fitting.by_name.get(name).into_iter().flatten().map(|other| (*other, name));
            let others = fitting.all.iter().copied().filter(|(_, output)| *output != name);
            let sources = same.chain(others).filter(|(other, _)| **other != of.name).take(MOST);
            found.extend(
                sources.map(|(other, output)| (format!("{other}.{output}"), format!("{}.{name}", of.name))),
            );
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::expect;

    const ROBOT: &str = r#"
include "parts.mal"
deployment D {
  architecture A
  activity laser { priority = 1 period = 100 }
  activity /* 🦀 é */ $0map { priority = 2 period = 100 }
}
//- /parts.mal
shell L { output port near: int  output port far: int  output port name: string  require wipe(in n: int): int }
shell M { input port far: int  provide clear(n: int): int  provide halt(): int }
core LC(L) { handler h: wipe update = { } }
core MC(M) { provide clear(n: int) = { return 1; } provide halt() = { return 1; } update = { } }
component Laser(L, LC)
component Map(M, MC)
architecture A { instance laser: Laser  instance map: Map
}
"#;

    #[test]
    fn from_each_output_that_fits() {
        check(
            ROBOT,
            "Connect ",
            expect![[r#"
            --- /parts.mal
              connection laser.far -> map.far
        "#]],
        );
        check(
            ROBOT,
            "Connect `laser.near`",
            expect![[r#"
            --- /parts.mal
              connection laser.near -> map.far
        "#]],
        );
        check(ROBOT, "Connect `laser.name`", expect!["not offered\n"]);
        let laser = ROBOT.replace("$0", "").replace("activity laser", "activity $0laser");
        check(
            &laser,
            "Connect ",
            expect![[r#"
            --- /parts.mal
              operation map.clear -> laser.wipe
        "#]],
        );
        check(&laser, "Connect `map.halt`", expect!["not offered\n"]);
        check(&ROBOT.replace("instance map: Map", "instance map: "), "Connect", expect!["not offered\n"]);
    }
}
