//! The values of properties and constants: those of shells, and those that architectures and deployments set.

use crate::flat::{Flat, deployed, flat_of};
use std::cell::LazyCell;
use std::collections::BTreeMap;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::completeness::Completeness;
use crate::fact::{Fact, FactKind, NotConstant};
use crate::features::{FeatureOf, features_of, shell_of};
use crate::graph::topological_order;
use crate::item_tree::{Endpoint, Expr, Feature, Name, Setting, Shell, SourceId};
use crate::project::Project;
use crate::source::{Decl, Location, architecture, deployment, shell};
use crate::types::{Type, Typed, Wrong, type_of, type_of_value};
use crate::values::Value;

/// What is wrong with the values in a shell.
pub(crate) fn check_shell<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<Fact<'db>> {
    let Some(data) = shell(db, of) else { return Vec::new() };
    let constants = Some(constants_of(db, project, of));
    let mut found = Vec::new();
    for feature in &data.features {
        let own = Some(&feature.name.name);
        let mut constants = Evaluator { of, constants, own, found: &mut found };
        let ty = type_of_value(db, project, of, feature.ty.as_ref());
        let interval = constants.interval(feature, &ty);
        if let Some(value) = &feature.value {
            let value = constants.value_for(&feature.name.name, &ty, value);
            if let (Some((value, id)), Some((low, high))) = (value, interval) {
                constants.inside(&feature.name.name, (&value, id), [&low, &high], None);
            }
        }
    }
    found
}

/// What is wrong with the values that an architecture or a deployment sets.
pub(crate) fn check_settings<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Fact<'db>> {
    let (flat, settings) = match (architecture(db, of), deployed(db, project, of)) {
        (Some(data), _) => (flat_of(db, project, of), &data.settings),
        (None, Some((flat, _))) => match deployment(db, of) {
            Some(data) => (flat, &data.settings),
            None => return Vec::new(),
        },
        (None, None) => return Vec::new(),
    };
    // Few intervals name a constant.
    let given = LazyCell::new(|| given(db, of, flat));
    let mut found = Vec::new();
    let mut seen: FxHashMap<(&Name, &Name), SourceId> = FxHashMap::default();
    for setting in settings {
        let Some(Endpoint { instance, feature: Some(name) }) = &setting.endpoint else { continue };
        let first = *seen.entry((&instance.name, &name.name)).or_insert(name.id);
        if first != name.id {
            let (at, first) = (Location::Source(of, name.id), Location::Source(of, first));
            let (instance, name) = (instance.name.clone(), name.name.clone());
            found.push(Fact::new(at, FactKind::DuplicateValue { instance, name, first }));
        }
        setting_value(db, project, of, (flat, &given), setting, &mut found);
    }
    found
}

fn setting_value<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    (flat, given): (&Flat<'db>, &LazyCell<Given<'db>, impl FnOnce() -> Given<'db>>),
    setting: &Setting,
    found: &mut Vec<Fact<'db>>,
) {
    let Some(Endpoint { instance, feature: Some(name) }) = &setting.endpoint else { return };
    let declared = flat.instance(&instance.name).and_then(|it| shell_of(db, project, it.component?));
    let feature = declared.and_then(|shell| features_of(db, project, shell).get(&name.name));
    let data = feature.and_then(|it| Some((it.shell, it.data(db)?)));
    let mut constants = Evaluator { of, constants: None, own: None, found };
    let Some((declared_in, data)) = data.filter(|(_, data)| data.kind.is_value()) else {
        // What it is set to may be wrong all the same.
        constants.evaluate(&setting.value);
        return;
    };
    let ty = type_of(db, project, declared_in, data.ty.as_ref());
    let value = constants.value_for(&name.name, &ty, &setting.value);
    // What is wrong in the interval is reported where it stands.
    let mut elsewhere = Vec::new();
    // Its ends may name constants that have other values here.
    let ends = data.interval.iter().flat_map(|it| [&it.low, &it.high]);
    let of_instance = declared.filter(|_| ends.clone().any(|end| !end.names().is_empty()));
    let of_instance = of_instance.and_then(|shell| Some((shell, given.get(&instance.name)?)));
    let here = of_instance.map(|(shell, given)| constants_with(db, project, shell, given));
    let known = Some(here.as_ref().unwrap_or_else(|| constants_of(db, project, declared_in)));
    let mut there = Evaluator { of: declared_in, constants: known, own: None, found: &mut elsewhere };
    let interval = there.interval(data, &ty);
    if let (Some((value, id)), Some((low, high))) = (value, interval) {
        let place = data.interval.as_ref().map(|it| Location::Source(declared_in, it.id));
        let mut constants = Evaluator { of, constants: None, own: None, found };
        constants.inside(&name.name, (&value, id), [&low, &high], place);
    }
}

/// The values that are given to properties and constants, by instance and name.
type Given<'db> = FxHashMap<&'db Name, FxHashMap<&'db Name, Typed>>;

/// What an architecture or a deployment gives, or what it imports or deploys: its own word counts first.
fn given<'db>(db: &'db dyn ModelDb, of: Decl<'db>, flat: &Flat<'db>) -> Given<'db> {
    let mut given = Given::default();
    for &of in std::iter::once(&of).chain(&flat.architectures) {
        let own = deployment(db, of).map(|data| &data.settings);
        for setting in own.or(architecture(db, of).map(|data| &data.settings)).into_iter().flatten() {
            let Some(Endpoint { instance, feature: Some(name) }) = &setting.endpoint else { continue };
            let mut elsewhere = Vec::new();
            let mut evaluator = Evaluator { of, constants: None, own: None, found: &mut elsewhere };
            let value = evaluator.evaluate(&setting.value).unwrap_or(Typed::UNKNOWN);
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
    /// What the shell says of it.
    pub declared: FeatureOf<'db>,
    /// The value that it has; none where nothing gives it one, or a wrong one.
    pub value: Option<Value>,
}

/// The properties and constants of the instances of an architecture, or of what a deployment runs, with the values that they
/// have there, by instance and name. What an architecture sets counts before the shell's own value, and what a deployment sets
/// before that.
#[salsa::tracked(returns(ref))]
pub fn values_in_effect<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> BTreeMap<Name, Vec<ValueInEffect<'db>>> {
    let flat = match (architecture(db, of), deployed(db, project, of)) {
        (Some(_), _) => flat_of(db, project, of),
        (None, Some((flat, _))) => flat,
        (None, None) => return BTreeMap::new(),
    };
    let given = given(db, of, flat);
    let nothing = FxHashMap::default();
    let mut found = BTreeMap::new();
    for instance in flat.instances.iter().filter(|instance| !instance.repeated) {
        let shell = instance.component.and_then(|component| shell_of(db, project, component));
        let Some(shell) = shell else { continue };
        let constants = constants_with(db, project, shell, given.get(&instance.name).unwrap_or(&nothing));
        let features = features_of(db, project, shell).by_name.iter();
        let features = features.filter_map(|(name, of)| Some((name, of.first()?)));
        let values = features.filter(|(_, of)| of.kind.is_value()).map(|(name, of)| {
            let value = constants.values.get(name).and_then(|it| it.as_ref()?.value.clone());
            ValueInEffect { name: name.clone(), declared: of.clone(), value }
        });
        found.insert(instance.name.clone(), values.collect());
    }
    found
}

/// The values that the properties and constants of a shell have by themselves, its own and those of the shells that it
/// extends; none for those that whoever deploys it must give one.
pub fn values_of_shell<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> BTreeMap<Name, Value> {
    let constants = constants_of(db, project, of).values.iter();
    constants.filter_map(|(name, found)| Some((name.clone(), found.as_ref()?.value.clone()?))).collect()
}

/// The constants and properties of a shell, its own and those of the shells that it extends, with their values.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Constants {
    /// By name; nothing where the value is wrong, which is reported where it stands.
    values: FxHashMap<Name, Option<Typed>>,
    /// Those whose value rests on itself.
    rings: FxHashSet<Name>,
    /// May a name that is not among them be one?
    completeness: Completeness,
}

#[salsa::tracked(returns(ref))]
fn constants_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Constants {
    constants_with(db, project, of, &FxHashMap::default())
}

/// [`constants_of`], where some are given other values than the shell's.
fn constants_with<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    given: &FxHashMap<&Name, Typed>,
) -> Constants {
    let features = features_of(db, project, of);
    let values = features.by_name.iter().filter_map(|(name, found)| {
        let feature = found.first().filter(|feature| feature.kind.is_value())?;
        Some((name, feature.shell, feature.data(db)?))
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
    let (order, in_ring) = topological_order(&named);
    let rings =
        all.iter().zip(in_ring).filter(|(_, in_ring)| *in_ring).map(|((name, ..), _)| (*name).clone());
    let mut constants = Constants {
        values: FxHashMap::default(),
        rings: rings.collect(),
        completeness: features.completeness,
    };
    constants.values.extend(all.iter().map(|(name, ..)| ((*name).clone(), None)));
    for index in order {
        let Some((name, declared, data)) = all.get(index) else { continue };
        let mut elsewhere = Vec::new();
        let mut evaluator =
            Evaluator { of: *declared, constants: Some(&constants), own: None, found: &mut elsewhere };
        let ty = type_of(db, project, *declared, data.ty.as_ref());
        let found = match (given.get(*name), &data.value) {
            (Some(given), _) => Some(given.clone()),
            (None, Some(value)) => evaluator.evaluate(value),
            // Whoever deploys it gives it one.
            (None, None) => Some(Typed::of(ty.clone())),
        };
        let found = found.filter(|found| found.ty.fits(found.value.as_ref(), &ty));
        // As it is kept there.
        let kept = found.map(|found| match (&ty, found.value) {
            (Type::Double | Type::Float, Some(Value::Int(value))) => {
                Typed { ty, value: Some(Value::Double(f64::from(value))) }
            }
            (_, value) => Typed { ty, value },
        });
        constants.values.insert((*name).clone(), kept);
    }
    constants
}

/// The names in the values and intervals of a shell.
pub(crate) fn names_in_values(data: &Shell) -> Vec<&Name> {
    let values = data.features.iter().flat_map(|it| &it.value);
    let ends = data.features.iter().flat_map(|it| &it.interval).flat_map(|it| [&it.low, &it.high]);
    values.chain(ends).flat_map(Expr::names).collect()
}

/// Evaluates constant expressions in a declaration, and reports what is wrong in them.
struct Evaluator<'a, 'db> {
    of: Decl<'db>,
    /// The constants that may be named.
    constants: Option<&'a Constants>,
    /// The feature whose value it is.
    own: Option<&'a Name>,
    found: &'a mut Vec<Fact<'db>>,
}

impl<'db> Evaluator<'_, 'db> {
    fn report(&mut self, id: SourceId, kind: FactKind<'db>) {
        self.found.push(Fact::new(Location::Source(self.of, id), kind));
    }

    /// The ends of a feature's interval, where it has one that is right.
    fn interval(&mut self, feature: &Feature, ty: &Type) -> Option<(Value, Value)> {
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
        Some((low, high))
    }

    /// The value of an expression that is for a feature of this type, and where it stands.
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

    fn inside(
        &mut self,
        name: &Name,
        (value, id): (&Value, SourceId),
        [low, high]: [&Value; 2],
        declared: Option<Location<'db>>,
    ) {
        let (Some(number), Some(least), Some(greatest)) = (value.number(), low.number(), high.number())
        else {
            return;
        };
        if number < least || number > greatest {
            let interval = [low.clone(), high.clone()];
            let (name, value) = (name.clone(), value.clone());
            self.report(id, FactKind::OutsideInterval { name, value, interval, declared });
        }
    }

    /// The type of an expression, and its value where it has one; nothing where something in it is wrong, which is reported.
    fn evaluate(&mut self, expr: &Expr) -> Option<Typed> {
        match expr {
            Expr::Missing | Expr::Incomplete(_) => None,
            Expr::Literal(literal, id) => self.given(Typed::literal(literal), *id),
            Expr::Name(name) => self.constant(&name.name, name.id),
            Expr::Unary(operator, inner, id) => match Typed::least(*operator, inner) {
                Some(least) => Some(least),
                None => {
                    let inner = self.evaluate(inner)?;
                    self.given(inner.unary(*operator), *id)
                }
            },
            Expr::Binary(operator, lhs, rhs, id) => {
                let (lhs, rhs) = (self.evaluate(lhs), self.evaluate(rhs));
                let (lhs, rhs) = (lhs?, rhs?);
                self.given(lhs.binary(*operator, &rhs), *id)
            }
            Expr::Call { callee, .. } => {
                let kind = FactKind::NotConstant(NotConstant::Call(callee.name.clone()));
                self.report(callee.id, kind);
                None
            }
        }
    }

    fn given(&mut self, given: Result<Typed, Wrong>, id: SourceId) -> Option<Typed> {
        given.map_err(|wrong| self.report(id, wrong.into())).ok()
    }

    /// The value of a constant that a value names.
    fn constant(&mut self, name: &Name, id: SourceId) -> Option<Typed> {
        let Some(constants) = self.constants else {
            self.report(id, FactKind::NotConstant(NotConstant::NotNameable(name.clone())));
            return None;
        };
        let rests_on_itself = |name: &Name| constants.rings.contains(name);
        match constants.values.get(name) {
            Some(Some(found)) => return Some(found.clone()),
            // Said of each that is part of the ring, and of none that only names one of them.
            Some(None) if self.own.is_some_and(rests_on_itself) && rests_on_itself(name) => {
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
