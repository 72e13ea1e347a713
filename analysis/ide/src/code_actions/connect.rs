//! Connects an unconnected input or required operation to each output or operation that fits.

use mauve_diagnostics::Finding;
use mauve_hir::item_tree::{Feature, FeatureKind, Name};
use mauve_hir::{
    Decl, FeatureOf, FlatInstance, ModelDb, Project, Type, declaration_at, first_target_of, flat_of, type_of,
};
use mauve_syntax::ast::{self, AstNode as _};

use super::{Actions, put_into};

const MOST: usize = 12;

pub(super) fn offer<'db>(actions: &mut Actions<'_, 'db>, finding: &Finding<'db>) {
    let (db, file) = (actions.db, actions.question.file);
    let at = finding.diagnostic.at.range(db);
    let activity = actions.around::<ast::Activity>(at);
    let instance = activity.and_then(|it| it.name_ref()).filter(|it| it.syntax().text_range() == at);
    let of = declaration_at(db, file, at);
    let project = finding.only_in.or_else(|| actions.projects.first().copied());
    let (Some(instance), Some(of), Some(project)) = (instance, of, project) else { return };
    let Some(architecture) = first_target_of(db, project, of) else { return };
    let keyword =
        if finding.diagnostic.code.name == "unconnected-input" { "connection" } else { "operation" };
    for (source, target) in
        connections(db, project, architecture, &instance.syntax().text().to_string(), keyword)
    {
        let title = format!("Connect `{source}` to `{target}`");
        actions.offer_fix(finding, title, || {
            put_into(db, architecture, &format!("{keyword} {source} -> {target}"))
        });
    }
}

/// Returns the possible connections of an instance's open ends, as pairs of `instance.feature`.
fn connections<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    architecture: Decl<'db>,
    instance: &str,
    keyword: &str,
) -> Vec<(String, String)> {
    let (gives, takes) = match keyword {
        "connection" => (FeatureKind::Output, FeatureKind::Input),
        _ => (FeatureKind::Provided, FeatureKind::Required),
    };
    let flat = flat_of(db, project, architecture);
    let Some(of) = flat.instance(instance) else { return Vec::new() };
    let is_open = |name: &Name| !flat.links.iter().any(|link| link.target == (of.name.clone(), name.clone()));
    let mut found = Vec::new();
    let features = |instance: &FlatInstance<'db>, kind: FeatureKind| {
        let features = instance.features(db, project).into_iter().flat_map(|it| &it.by_name);
        let first = features.filter_map(|(name, features)| Some((name, features.first()?)));
        first.filter(move |(_, it)| it.kind == kind)
    };
    for (name, input) in features(of, takes).filter(|(name, _)| is_open(name)) {
        let mut sources = Vec::new();
        for other in flat.instances.iter().filter(|other| other.name != of.name) {
            for (output, feature) in features(other, gives) {
                if fit(db, project, feature, input) {
                    sources.push((output != name, format!("{}.{output}", other.name)));
                }
            }
        }
        sources.sort_by_key(|(is_another_name, _)| *is_another_name);
        let sources = sources.into_iter().take(MOST);
        found.extend(sources.map(|(_, source)| (source, format!("{}.{name}", of.name))));
    }
    found
}

/// Returns whether two features fit. If a type is unknown, only features of the same name fit.
fn fit<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    one: &FeatureOf<'db>,
    other: &FeatureOf<'db>,
) -> bool {
    let (Some(a), Some(b)) = (one.data(db), other.data(db)) else { return false };
    let types = |of: &FeatureOf<'db>, data: &'db Feature| {
        let parameters = data.parameters.iter().map(|it| (Some(it.direction), it.ty.as_ref()));
        let all = parameters.chain([(None, data.ty.as_ref())]);
        all.map(|(direction, ty)| (direction, ty, type_of(db, project, of.shell, ty))).collect::<Vec<_>>()
    };
    let (a, b) = (types(one, a), types(other, b));
    a.len() == b.len()
        && a.iter().zip(&b).all(|((d, path, ty), (e, other_path, other))| {
            let path = path.map(|it| &it.path);
            d == e
                && ty == other
                && (*ty != Type::Unknown || path.is_some() && path == other_path.map(|it| &it.path))
        })
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
