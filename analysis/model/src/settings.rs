//! The values of properties and constants: those of shells, and those that architectures and deployments set.

use rustc_hash::FxHashSet;

use crate::ModelDb;
use crate::diagnostics::{self, Diagnostic};
use crate::flat::{Flat, flat_of};
use crate::item_tree::{Endpoint, Expr, Feature, Kind, Literal, Name, Part, Setting, UnaryOperator};
use crate::names::{FeatureOf, Features, features_of, names_of};
use crate::project::Project;
use crate::psm::shell_of;
use crate::source::{Decl, Place, architecture, deployment, shell};
use crate::types::{Type, type_of};
use crate::typing::literal_type;
use crate::values::Value;

/// What is wrong with the values in a shell.
pub(crate) fn check_shell<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Diagnostic<'db>> {
    let Some(data) = shell(db, of) else { return Vec::new() };
    let features = features_of(db, project, of);
    let mut found = Vec::new();
    for feature in &data.features {
        let own = Some(&feature.name.name);
        let mut constants =
            Constants { db, project, of, scope: Some(features), own, ring: false, found: &mut found };
        let ty = type_of(db, project, of, feature.ty.as_ref());
        let interval = constants.interval(feature, &ty);
        if let Some(value) = &feature.value {
            let value = constants.value_for(&feature.name.name, &ty, value);
            if let (Some((value, part)), Some((low, high))) = (value, interval) {
                constants.inside(&feature.name.name, (&value, part), [&low, &high], None);
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
) -> Vec<Diagnostic<'db>> {
    let (flat, settings) = match (architecture(db, of), deployed(db, project, of)) {
        (Some(data), _) => (flat_of(db, project, of), &data.settings),
        (None, Some((flat, _))) => match deployment(db, of) {
            Some(data) => (flat, &data.settings),
            None => return Vec::new(),
        },
        (None, None) => return Vec::new(),
    };
    let mut found = Vec::new();
    let mut seen = rustc_hash::FxHashMap::default();
    for setting in settings {
        let Some(Endpoint { instance, feature: Some(name) }) = &setting.endpoint else { continue };
        if let Some(first) = seen.insert((&instance.name, &name.name), name.part) {
            let (at, first) = (Place::Part(of, name.part), Place::Part(of, first));
            let whole = format!("{}.{}", instance.name, name.name);
            found.push(diagnostics::duplicate_definition::value(at, &whole, first));
        }
        setting_value(db, project, of, flat, setting, &mut found);
    }
    found
}

fn setting_value<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flat: &Flat<'db>,
    setting: &Setting,
    found: &mut Vec<Diagnostic<'db>>,
) {
    let Some(Endpoint { instance, feature: Some(name) }) = &setting.endpoint else { return };
    let declared = flat.instance(&instance.name).and_then(|it| shell_of(db, project, it.component?));
    let feature = declared.and_then(|shell| features_of(db, project, shell).get(&name.name));
    let data = feature.and_then(|it| Some((it.shell, shell(db, it.shell)?.features.get(it.index)?)));
    let mut constants = Constants::new(db, project, of, found);
    let Some((declared_in, data)) = data.filter(|(_, data)| data.kind.is_value()) else {
        // What it is set to may be wrong all the same.
        constants.evaluate(&setting.value);
        return;
    };
    let ty = type_of(db, project, declared_in, data.ty.as_ref());
    let value = constants.value_for(&name.name, &ty, &setting.value);
    // What is wrong in the interval is reported where it stands.
    let mut elsewhere = Vec::new();
    let mut there = Constants::new(db, project, declared_in, &mut elsewhere);
    there.scope = Some(features_of(db, project, declared_in));
    let interval = there.interval(data, &ty);
    if let (Some((value, part)), Some((low, high))) = (value, interval) {
        let place = data.interval.as_ref().map(|it| Place::Part(declared_in, it.part));
        let mut constants = Constants::new(db, project, of, found);
        constants.inside(&name.name, (&value, part), [&low, &high], place);
    }
}

/// The architecture that a deployment runs, flattened; nothing where it is not known, or something in it is lost.
pub(crate) fn deployed<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Option<(&'db Flat<'db>, Decl<'db>)> {
    let target = target_of(db, project, of)?;
    let flat = flat_of(db, project, target);
    (flat.lost.is_empty() && !flat.cycle).then_some((flat, target))
}

/// The architecture that a deployment runs.
#[salsa::tracked(returns(copy))]
pub(crate) fn target_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Option<Decl<'db>> {
    let [target] = deployment(db, of)?.targets.as_slice() else { return None };
    names_of(db, project).resolve_type(db, of, Kind::Architecture, Some(target)).ok()
}

/// Evaluates constant expressions, and reports what is wrong in them.
struct Constants<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    /// The features whose constants may be named.
    scope: Option<&'a Features<'db>>,
    /// The feature whose value it is.
    own: Option<&'a Name>,
    /// Does that rest on itself?
    ring: bool,
    found: &'a mut Vec<Diagnostic<'db>>,
}

impl<'a, 'db> Constants<'a, 'db> {
    fn new(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        of: Decl<'db>,
        found: &'a mut Vec<Diagnostic<'db>>,
    ) -> Constants<'a, 'db> {
        Constants { db, project, of, scope: None, own: None, ring: false, found }
    }
    fn report(&mut self, part: Part, why: impl Into<String>) {
        self.found.push(diagnostics::constant_expression::report(Place::Part(self.of, part), why));
    }

    /// The ends of a feature's interval, where it has one that is right.
    fn interval(&mut self, feature: &Feature, ty: &Type) -> Option<(Value, Value)> {
        let interval = feature.interval.as_ref()?;
        if !ty.is_number() && *ty != Type::Unknown {
            let at = feature.ty.as_ref().map_or(interval.part, |ty| ty.part);
            self.found.push(diagnostics::invalid_type::interval(Place::Part(self.of, at), ty));
            return None;
        }
        let low = self.value_for(&feature.name.name, ty, &interval.low);
        let high = self.value_for(&feature.name.name, ty, &interval.high);
        let ((low, _), (high, _)) = (low?, high?);
        if low.number()? > high.number()? {
            let at = Place::Part(self.of, interval.part);
            self.found.push(diagnostics::empty_interval::report(at, [&low, &high]));
            return None;
        }
        Some((low, high))
    }

    /// The value of an expression that is for a feature of this type, and where it stands.
    fn value_for(&mut self, name: &str, ty: &Type, expr: &Expr) -> Option<(Value, Part)> {
        let (found, value) = self.evaluate(expr)?;
        let part = expr.part()?;
        if !found.fits(value.as_ref(), ty) {
            let at = Place::Part(self.of, part);
            self.found.push(diagnostics::assignment_type::report(at, name, ty, &found));
            return None;
        }
        Some((value?, part))
    }

    fn inside(
        &mut self,
        name: &str,
        (value, part): (&Value, Part),
        [low, high]: [&Value; 2],
        declared: Option<Place<'db>>,
    ) {
        let (Some(number), Some(least), Some(greatest)) = (value.number(), low.number(), high.number())
        else {
            return;
        };
        if number < least || number > greatest {
            let at = Place::Part(self.of, part);
            self.found.push(diagnostics::outside_interval::report(at, name, value, [low, high], declared));
        }
    }

    /// The type of an expression, and its value where it has one; nothing where something in it is wrong, which is reported.
    fn evaluate(&mut self, expr: &Expr) -> Option<(Type, Option<Value>)> {
        let mut open: FxHashSet<Name> = self.own.into_iter().cloned().collect();
        self.evaluated(expr, &mut open)
    }

    fn evaluated(&mut self, expr: &Expr, open: &mut FxHashSet<Name>) -> Option<(Type, Option<Value>)> {
        match expr {
            Expr::Missing | Expr::Lost(_) => None,
            Expr::Literal(literal, part) => match Value::of_literal(literal) {
                Ok(value) => Some((literal_type(literal), value)),
                Err(why) => {
                    self.report(*part, why);
                    None
                }
            },
            Expr::Name(name) => self.constant(&name.name, name.part, open),
            Expr::Unary(UnaryOperator::Minus, inner, _) if matches!(inner.as_ref(), Expr::Literal(Literal::Int(text), _) if Value::of_negated(text).is_some()) => {
                Some((Type::INT, Some(Value::Int(i32::MIN))))
            }
            Expr::Unary(operator, inner, part) => {
                let (ty, value) = self.evaluated(inner, open)?;
                match ty.unary(*operator) {
                    Ok(result) => self.value(result, value.map(|value| value.unary(*operator)), *part),
                    Err(takes) => {
                        let at = Place::Part(self.of, *part);
                        self.found.push(diagnostics::operator_type::unary(at, *operator, takes, &ty));
                        None
                    }
                }
            }
            Expr::Binary(operator, lhs, rhs, part) => {
                let (left, right) = (self.evaluated(lhs, open), self.evaluated(rhs, open));
                let ((left, a), (right, b)) = (left?, right?);
                match left.binary(*operator, &right) {
                    Ok(result) => self.value(result, a.zip(b).map(|(a, b)| a.binary(*operator, &b)), *part),
                    Err(takes) => {
                        let at = Place::Part(self.of, *part);
                        self.found.push(diagnostics::operator_type::binary(
                            at,
                            *operator,
                            takes,
                            [&left, &right],
                        ));
                        None
                    }
                }
            }
            Expr::Call { callee, .. } => {
                self.report(
                    callee.part,
                    format!("`{}` is called when the robot runs: this value is there before", callee.name),
                );
                None
            }
        }
    }

    fn value(
        &mut self,
        ty: Type,
        value: Option<Result<Option<Value>, &'static str>>,
        part: Part,
    ) -> Option<(Type, Option<Value>)> {
        match value {
            None => Some((ty, None)),
            Some(Ok(value)) => Some((ty, value)),
            Some(Err(why)) => {
                self.report(part, why);
                None
            }
        }
    }

    /// The value of a constant of the shell that a value names.
    fn constant(
        &mut self,
        name: &Name,
        part: Part,
        open: &mut FxHashSet<Name>,
    ) -> Option<(Type, Option<Value>)> {
        let Some(features) = self.scope else {
            self.report(part, format!("`{name}` has no value here: write a number, a text, true or false"));
            return None;
        };
        let feature: Option<&FeatureOf<'db>> = features.get(name).filter(|feature| feature.kind.is_value());
        let Some(feature) = feature else {
            if !features.lost {
                self.report(part, format!("`{name}` is no constant of this shell"));
            }
            return None;
        };
        let data = shell(self.db, feature.shell)?.features.get(feature.index)?;
        let ty = type_of(self.db, self.project, feature.shell, data.ty.as_ref());
        let Some(value) = &data.value else {
            self.report(part, format!("`{name}` has no value of its own"));
            return None;
        };
        if !open.insert(name.clone()) {
            // Said of each that is part of the ring, and of none that only names one of them.
            if Some(name) == self.own && !std::mem::replace(&mut self.ring, true) {
                self.report(part, format!("the value of `{name}` rests on itself"));
            }
            return None;
        }
        // What is wrong in it is reported where it stands.
        let mut elsewhere = Vec::new();
        let mut there = Constants::new(self.db, self.project, feature.shell, &mut elsewhere);
        (there.scope, there.own, there.ring) = (self.scope, self.own, self.ring);
        let found = there.evaluated(value, open);
        let ring = there.ring;
        open.remove(name);
        if ring && !std::mem::replace(&mut self.ring, true) {
            self.report(
                part,
                format!("the value of `{}` rests on itself", self.own.map_or("", Name::as_str)),
            );
        }
        let (of, value) = found?;
        // As it is kept there.
        match (of.fits(value.as_ref(), &ty), &ty, value) {
            (false, ..) => None,
            (true, Type::Double | Type::Float, Some(Value::Int(value))) => {
                Some((ty, Some(Value::Double(f64::from(value)))))
            }
            (true, _, value) => Some((ty, value)),
        }
    }
}
