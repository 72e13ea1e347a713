//! The values of properties and constants: the defaults in shells, and the settings of architectures and deployments.

use crate::flat::{Flat, deployed, flat_of};
use std::cell::LazyCell;
use std::collections::BTreeMap;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::completeness::Completeness;
use crate::fact::{Checker, Fact, FactKind, NotConstant};
use crate::features::{FeatureOf, features_of};
use crate::graph::topological_order;
use crate::item_tree::{Endpoint, Expr, Feature, Kind, Name, Setting, Shell, SourceId};
use crate::project::Project;
use crate::source::{Decl, Location, architecture, deployment_interface, shell};
use crate::types::{OperatorError, Type, Typed, type_of_value};
use crate::values::Value;

impl<'db> Checker<'db> {
    /// Checks the values and intervals of a shell.
    pub(crate) fn values_of_shell(&mut self) {
        let (db, project, of) = (self.db, self.project, self.of);
        let Some(data) = shell(db, of) else { return };
        let constants = Some(constants_of(db, project, of));
        for feature in &data.features {
            let mut evaluator =
                ConstantEvaluator { own: Some(&feature.name.name), ..ConstantEvaluator::new(of, constants) };
            let ty = type_of_value(db, project, of, feature.ty.as_ref());
            let interval = evaluator.interval(feature, &ty);
            if let Some(value) = &feature.value {
                let value = evaluator.value_for(&feature.name.name, &ty, value);
                evaluator.inside(&feature.name.name, value, interval, None);
            }
            self.found.extend(evaluator.found);
        }
    }

    /// Checks the values that an architecture or a deployment sets.
    pub(crate) fn settings(&mut self) {
        let (db, of) = (self.db, self.of);
        let Some(flat) = flat_with_settings(db, self.project, of) else { return };
        // Lazy, because few intervals name a constant.
        let given = LazyCell::new(|| given(db, of, flat, |_| true));
        let mut seen: FxHashMap<(&Name, &Name), SourceId> = FxHashMap::default();
        for setting in settings_of(db, of) {
            let Some(Endpoint { instance, feature: Some(name) }) = &setting.endpoint else { continue };
            let first = *seen.entry((&instance.name, &name.name)).or_insert(name.id);
            if first != name.id {
                let (id, first) = (name.id, self.at(first));
                let (instance, name) = (instance.name.clone(), name.name.clone());
                self.report(id, FactKind::DuplicateValue { instance, name, first });
            }
            self.value(flat, &given, (&instance.name, &name.name), &setting.value);
        }
    }

    /// Checks a value that a property or constant of an instance gets.
    fn value(
        &mut self,
        flat: &Flat<'db>,
        given: &LazyCell<GivenValues<'db>, impl FnOnce() -> GivenValues<'db>>,
        (instance, name): (&Name, &Name),
        value: &Expr,
    ) {
        let (db, project) = (self.db, self.project);
        let shell = flat.instance(instance).and_then(|it| it.shell(db, project));
        let feature = shell.and_then(|shell| features_of(db, project, shell).get(name));
        let feature = feature.filter(|it| it.kind.is_value()).and_then(|it| Some((it, it.data(db)?)));
        let mut evaluator = ConstantEvaluator::new(self.of, None);
        if let Some((feature, data)) = feature {
            let (declared_in, ty) = (feature.shell, feature.ty(db, project));
            let value = evaluator.value_for(name, &ty, value);
            // The bounds of the interval may name constants that the instance sets.
            let mut ends = data.interval.iter().flat_map(|it| [&it.low, &it.high]);
            let of_instance = shell.filter(|_| ends.any(|end| !end.names().is_empty()));
            let of_instance =
                of_instance.and_then(|shell| Some(constants_with(db, project, shell, given.get(instance)?)));
            let constants = of_instance.as_ref().unwrap_or_else(|| constants_of(db, project, declared_in));
            // The check of the shell reports the errors in the interval.
            let interval = ConstantEvaluator::new(declared_in, Some(constants)).interval(data, &ty);
            let declared = data.interval.as_ref().map(|it| Location::Source(declared_in, it.id));
            evaluator.inside(name, value, interval, declared);
        } else {
            // The value of an unresolved setting is checked too.
            evaluator.evaluate(value);
        }
        self.found.extend(evaluator.found);
    }
}

/// Returns the flattened architecture that `of`, an architecture or a deployment, sets values of.
fn flat_with_settings<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Option<&'db Flat<'db>> {
    match of.kind(db) {
        Kind::Architecture => Some(flat_of(db, project, of)),
        _ => deployed(db, project, of).map(|(flat, _)| flat),
    }
}

fn settings_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> &'db [Setting] {
    match of.kind(db) {
        Kind::Architecture => architecture(db, of).map_or(&[] as &[Setting], |data| &data.settings),
        _ => deployment_interface(db, of).map_or(&[] as &[Setting], |data| &data.settings),
    }
}

/// The values that settings give to properties and constants, by instance and name.
type GivenValues<'db> = FxHashMap<&'db Name, FxHashMap<&'db Name, Typed>>;

/// Returns the values that an architecture or a deployment and its imports set for the wanted instances; its own settings take
/// precedence.
fn given<'db>(
    db: &'db dyn ModelDb,
    of: Decl<'db>,
    flat: &Flat<'db>,
    is_wanted: impl Fn(&Name) -> bool,
) -> GivenValues<'db> {
    let mut given = GivenValues::default();
    for &of in std::iter::once(&of).chain(&flat.architectures) {
        for setting in settings_of(db, of) {
            let Some(Endpoint { instance, feature: Some(name) }) = &setting.endpoint else { continue };
            if !is_wanted(&instance.name) {
                continue;
            }
            let value = ConstantEvaluator::new(of, None).evaluate(&setting.value).unwrap_or(Typed::UNKNOWN);
            given.entry(&instance.name).or_default().entry(&name.name).or_insert(value);
        }
    }
    given
}

/// A property or constant of an instance.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct ValueInEffect<'db> {
    /// Its name.
    pub name: Name,
    /// Its declaration.
    pub declared: FeatureOf<'db>,
    /// Its value; `None` if it is not set, or invalid.
    pub value: Option<Value>,
}

/// Returns the properties and constants of the instances of an architecture, or of the architecture of a deployment, with
/// their values, by instance and name. Settings of a deployment take precedence over settings of an architecture, and these
/// over the defaults of the shell.
#[salsa::tracked(returns(ref))]
pub fn values_in_effect<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> BTreeMap<Name, Vec<ValueInEffect<'db>>> {
    values_of_instances(db, project, of, |_| true)
}

/// [`values_in_effect`] of the instances that an architecture declares or sets values of, without its other imported instances.
pub fn values_in_architecture<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> &'db BTreeMap<Name, Vec<ValueInEffect<'db>>> {
    match flat_of(db, project, of).architectures.as_slice() {
        // Without imports, there are no others.
        [_] => values_in_effect(db, project, of),
        _ => values_of_own(db, project, of),
    }
}

#[salsa::tracked(returns(ref))]
fn values_of_own<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> BTreeMap<Name, Vec<ValueInEffect<'db>>> {
    let declared = architecture(db, of).into_iter().flat_map(|data| &data.instances).map(|it| &it.name.name);
    let set = settings_of(db, of).iter().filter_map(|it| Some(&it.endpoint.as_ref()?.instance.name));
    let own: FxHashSet<&Name> = declared.chain(set).collect();
    values_of_instances(db, project, of, |instance| own.contains(instance))
}

fn values_of_instances<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    is_wanted: impl Fn(&Name) -> bool,
) -> BTreeMap<Name, Vec<ValueInEffect<'db>>> {
    let Some(flat) = flat_with_settings(db, project, of) else { return BTreeMap::new() };
    let given = given(db, of, flat, &is_wanted);
    let mut found = BTreeMap::new();
    for instance in flat.instances.iter().filter(|it| !it.repeated && is_wanted(&it.name)) {
        let implementation = instance.implementation(db, project);
        let Some((shell, features)) = implementation.and_then(|it| it.shell.as_ref()) else { continue };
        let given = given.get(&instance.name);
        let of_instance = given.map(|given| constants_with(db, project, *shell, given));
        let constants = of_instance.as_ref().unwrap_or_else(|| constants_of(db, project, *shell));
        let features = features.by_name.iter().filter_map(|(name, of)| Some((name, of.first()?)));
        let values = features.filter(|(_, of)| of.kind.is_value()).map(|(name, of)| {
            let value = constants.values.get(name).and_then(|it| it.as_ref()?.value.clone());
            ValueInEffect { name: name.clone(), declared: *of, value }
        });
        found.insert(instance.name.clone(), values.collect());
    }
    found
}

/// Returns the default values of the own and inherited properties and constants of a shell, without those that have none.
pub fn values_of_shell<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> BTreeMap<Name, Value> {
    let constants = constants_of(db, project, of).values.iter();
    constants.filter_map(|(name, found)| Some((name.clone(), found.as_ref()?.value.clone()?))).collect()
}

/// The own and inherited constants and properties of a shell, with their values.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Constants {
    /// By name; `None` for an invalid value, which another fact reports.
    values: FxHashMap<Name, Option<Typed>>,
    /// The names whose value depends on itself.
    cyclic: FxHashSet<Name>,
    /// Whether all constants and properties are known.
    completeness: Completeness,
}

#[salsa::tracked(returns(ref))]
fn constants_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Constants {
    constants_with(db, project, of, &FxHashMap::default())
}

/// [`constants_of`], with the values in `given` instead of the defaults.
fn constants_with<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    given: &FxHashMap<&Name, Typed>,
) -> Constants {
    let features = features_of(db, project, of);
    let values = features.by_name.iter().filter_map(|(name, found)| {
        let feature = found.first().filter(|feature| feature.kind.is_value())?;
        Some((name, feature, feature.data(db)?))
    });
    let all: Vec<_> = values.collect();
    let index: FxHashMap<&Name, usize> =
        all.iter().enumerate().map(|(index, (name, ..))| (*name, index)).collect();
    let named = all.iter().map(|(name, _, data)| {
        let value = data.value.as_ref().filter(|_| !given.contains_key(name));
        let names = value.map_or_else(Vec::new, Expr::names);
        names.into_iter().filter_map(|name| index.get(name).copied()).collect()
    });
    let named: Vec<Vec<usize>> = named.collect();
    let (order, in_cycle) = topological_order(&named);
    let cyclic = all.iter().zip(in_cycle).filter(|(_, in_cycle)| *in_cycle);
    let mut constants = Constants {
        values: all.iter().map(|(name, ..)| ((*name).clone(), None)).collect(),
        cyclic: cyclic.map(|((name, ..), _)| (*name).clone()).collect(),
        completeness: features.completeness,
    };
    for index in order {
        let Some((name, feature, data)) = all.get(index) else { continue };
        let ty = feature.ty(db, project);
        let found = match (given.get(*name), &data.value) {
            (Some(given), _) => Some(given.clone()),
            (None, Some(value)) => ConstantEvaluator::new(feature.shell, Some(&constants)).evaluate(value),
            // A deployment sets the value.
            (None, None) => Some(Typed::of(ty.clone())),
        };
        let found = found.filter(|found| found.ty.fits(found.value.as_ref(), &ty));
        // An integer for a floating-point constant is converted.
        let converted = found.map(|found| match (&ty, found.value) {
            (Type::Double | Type::Float, Some(Value::Int(value))) => {
                Typed { ty, value: Some(Value::Double(f64::from(value))) }
            }
            (_, value) => Typed { ty, value },
        });
        constants.values.insert((*name).clone(), converted);
    }
    constants
}

/// Returns the names in the values and intervals of a shell.
pub(crate) fn names_in_values(data: &Shell) -> Vec<&Name> {
    let values = data.features.iter().flat_map(|it| &it.value);
    let ends = data.features.iter().flat_map(|it| &it.interval).flat_map(|it| [&it.low, &it.high]);
    values.chain(ends).flat_map(Expr::names).collect()
}

/// Evaluates constant expressions in a declaration, and collects their errors.
struct ConstantEvaluator<'a, 'db> {
    of: Decl<'db>,
    /// The constants that expressions may name; `None` if they may name none.
    constants: Option<&'a Constants>,
    /// The feature whose value is evaluated.
    own: Option<&'a Name>,
    found: Vec<Fact<'db>>,
}

impl<'a, 'db> ConstantEvaluator<'a, 'db> {
    fn new(of: Decl<'db>, constants: Option<&'a Constants>) -> ConstantEvaluator<'a, 'db> {
        ConstantEvaluator { of, constants, own: None, found: Vec::new() }
    }

    fn report(&mut self, id: SourceId, kind: FactKind<'db>) {
        self.found.push(Fact::new(Location::Source(self.of, id), kind));
    }

    /// Returns the bounds of a feature's interval, if it has a valid one.
    fn interval(&mut self, feature: &Feature, ty: &Type) -> Option<[Value; 2]> {
        let interval = feature.interval.as_ref()?;
        if !ty.is_number() && *ty != Type::Unknown {
            let at = feature.ty.as_ref().map_or(interval.id, |ty| ty.id);
            self.report(at, FactKind::IntervalType { found: ty.clone() });
            return None;
        }
        let low = self.value_for(&feature.name.name, ty, &interval.low);
        let high = self.value_for(&feature.name.name, ty, &interval.high);
        let ((low, _), (high, _)) = (low?, high?);
        if low.number()? > high.number()? {
            self.report(interval.id, FactKind::EmptyInterval { ends: [low, high] });
            return None;
        }
        Some([low, high])
    }

    /// Returns the value of an expression that is assigned to a feature of this type, and its source.
    fn value_for(&mut self, name: &Name, ty: &Type, expr: &Expr) -> Option<(Value, SourceId)> {
        let found = self.evaluate(expr)?;
        let id = expr.id()?;
        if !found.ty.fits(found.value.as_ref(), ty) {
            let (name, expected) = (name.clone(), ty.clone());
            self.report(id, FactKind::AssignmentType { name, expected, found: found.ty });
            return None;
        }
        Some((found.value?, id))
    }

    /// Reports a value outside the interval of its property or constant.
    fn inside(
        &mut self,
        name: &Name,
        value: Option<(Value, SourceId)>,
        interval: Option<[Value; 2]>,
        declared: Option<Location<'db>>,
    ) {
        let (Some((value, id)), Some(interval)) = (value, interval) else { return };
        let [low, high] = &interval;
        if let (Some(number), Some(low), Some(high)) = (value.number(), low.number(), high.number())
            && (number < low || number > high)
        {
            self.report(id, FactKind::OutsideInterval { name: name.clone(), value, interval, declared });
        }
    }

    /// Returns the type of an expression, and its value if it is known; reports an error and returns `None` if invalid.
    fn evaluate(&mut self, expr: &Expr) -> Option<Typed> {
        match expr {
            Expr::Missing | Expr::Incomplete(_) => None,
            Expr::Literal(literal, id) => self.reported(Typed::literal(literal), *id),
            Expr::Name(name) => self.constant(&name.name, name.id),
            Expr::Unary(operator, inner, id) => match Typed::least(*operator, inner) {
                Some(least) => Some(least),
                None => {
                    let inner = self.evaluate(inner)?;
                    self.reported(inner.unary(*operator), *id)
                }
            },
            Expr::Binary(operator, lhs, rhs, id) => {
                let (lhs, rhs) = (self.evaluate(lhs), self.evaluate(rhs));
                let (lhs, rhs) = (lhs?, rhs?);
                self.reported(lhs.binary(*operator, &rhs), *id)
            }
            Expr::Call { callee, .. } => {
                let kind = FactKind::NotConstant(NotConstant::Call(callee.name.clone()));
                self.report(callee.id, kind);
                None
            }
        }
    }

    fn reported(&mut self, found: Result<Typed, OperatorError>, id: SourceId) -> Option<Typed> {
        found.map_err(|error| self.report(id, FactKind::Operation(error))).ok()
    }

    fn constant(&mut self, name: &Name, id: SourceId) -> Option<Typed> {
        let Some(constants) = self.constants else {
            self.report(id, FactKind::NotConstant(NotConstant::NotNameable(name.clone())));
            return None;
        };
        let is_cyclic = |name: &Name| constants.cyclic.contains(name);
        match constants.values.get(name) {
            Some(Some(found)) => return Some(found.clone()),
            // Reported for the members of the cycle, not for other constants that name them.
            Some(None) if self.own.is_some_and(is_cyclic) && is_cyclic(name) => {
                let own = self.own.cloned().unwrap_or_default();
                self.report(id, FactKind::NotConstant(NotConstant::Cycle(own)));
            }
            Some(None) => {}
            None if constants.completeness.is_incomplete() => {}
            None => self.report(id, FactKind::NotConstant(NotConstant::NotOfShell(name.clone()))),
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::names::names_of;
    use crate::{Database, Workspace, projects};

    #[test]
    fn an_architecture_shows_the_values_of_its_own_instances() {
        let db = Database::default();
        let text = "shell S { property p: int = 1 }\ncore C(S) { update = { } }\ncomponent K(S, C)\n\
                    architecture X { instance x: K }\narchitecture Y { import X  instance y: K  property x.p = 2 }\n\
                    architecture Z { import Y  instance z: K }\n";
        let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text.to_owned())]);
        let project = projects(&db, workspace)[0];
        let architectures = names_of(&db, project).all.iter().filter(|it| it.kind(&db) == Kind::Architecture);
        let shown = architectures.map(|&of| {
            let all = values_in_effect(&db, project, of);
            let own = values_in_architecture(&db, project, of);
            assert!(own.iter().all(|(instance, values)| all.get(instance) == Some(values)));
            (own.keys().map(Name::as_str).collect(), all.len())
        });
        let shown: Vec<(Vec<&str>, usize)> = shown.collect();
        assert_eq!(shown, [(vec!["x"], 1), (vec!["x", "y"], 2), (vec!["z"], 3)]);
    }
}
