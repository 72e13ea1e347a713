//! Renders facts as diagnostics: the arm of a fact calls the module of its code.

use super::*;
use mauve_hir::fact::{Fact, FactKind as K, OperatorError};

/// Writes [`render`]: for each kind of fact, the function that reports it.
macro_rules! reports {
    ($db:ident, $project:ident, $at:ident: $($fact:pat => $report:expr;)*) => {
        /// Returns the diagnostic of a fact in `project`: its code, message, related locations and fixes.
        pub fn render<'db>(
            $db: &'db dyn ModelDb,
            $project: Project<'db>,
            fact: &Fact<'db>,
        ) -> Diagnostic<'db> {
            let $at = fact.at.clone();
            let found = match &fact.kind {
                $($fact => $report,)*
            };
            // The analysis decides by the fact which errors refuse it.
            debug_assert_eq!(fact.is_error(), found.code.severity == Severity::Error, "{}", found.code.name);
            found
        }
    };
}

reports! { db, project, at:
    K::AmbiguousName { kind, name } => ambiguous_name::report(at, *kind, name);
    K::ArgumentCount { callee, takes, found } => argument_count::report(db, at, callee, takes, *found);
    K::ArgumentType { callee, parameter, expected, found } =>
        argument_type::report(at, callee, parameter, expected, found);
    K::AssignmentType { name, expected, found } => assignment_type::report(at, name, expected, found);
    K::BlockingCall { name, send } => blocking_call::report(at, name, send.as_ref());
    K::BufferSize { size } => buffer_size::report(at, size);
    K::ConditionType { found } => condition_type::report(at, found);
    K::ConnectionType { ends } => connection_type::report(at, ends);
    K::ContinuedLine { name, white } => continued_line::report(at, *white, name);
    K::CoreBeforeShell { core } => unresolved_shell::swapped(db, at, core);
    K::DuplicateDefinition { what, name, first } => duplicate_definition::report(at, *what, name, first);
    K::DuplicateHook(kind) => duplicate_hook::report(at, kind.keyword());
    K::DuplicateMethod(kind) => duplicate_hook::report(at, kind.keyword());
    K::DuplicateValue { instance, name, first } => duplicate_definition::value(at, instance, name, first);
    K::EmptyInterval { ends } => empty_interval::report(at, ends);
    K::HeaderColon => header_colon::report(at);
    K::ImportCycle { architecture } => import_cycle::report(at, architecture);
    K::InheritanceCycle { shell } => inheritance_cycle::report(at, shell);
    K::IntervalType { found } => invalid_type::interval(at, found);
    K::LostWrite { port } => lost_write::report(at, port);
    K::MissingElse { end } => missing_else::report(at, *end);
    K::MissingReturn { name, expected } => return_type::missing(at, name, expected);
    K::MissingValue { instance, kind, name, declared } => missing_value::report(at, instance, *kind, name, declared);
    K::NeverTaken { name, first, first_at } => never_taken::report(at, (name, first), first_at);
    K::NoBehaviour => update_or_statemachine::neither(at);
    K::NoEffect => no_effect::report(db, at);
    K::NoInitialState { first } => initial_state::none(at, first.as_ref());
    K::NotAssignable { name, is } => not_assignable::report(db, at, name, *is);
    K::NotBuiltin { function, first, swapped, instead } =>
        unresolved_codel::built_in(at, *function, first.as_ref(), swapped.as_ref(), instead.as_ref());
    K::NotCallable { name, is, hides } => unresolved_codel::not_callable(at, name, *is, *hides);
    K::NotCalled { name, is_operation, takes_nothing } =>
        unresolved_variable::not_called(at, name, *is_operation, *takes_nothing);
    K::NotConstant(why) => constant_expression::not_constant(at, why);
    K::NotInDeployment { deployment, instance, near } => {
        let message = format!("deployment `{deployment}` has no instance `{instance}`");
        unresolved_instance::in_config(at, message, near.clone())
    };
    K::NotDeployed { instance, near } =>
        unresolved_instance::in_config(at, format!("no deployment has an instance `{instance}`"), near.clone());
    K::NotStronglyConnected { initial, states } => not_strongly_connected::report(at, initial, states);
    K::Operation(error) => match error {
        OperatorError::Unary(operator, operand) => operator_type::unary(at, *operator, operand),
        OperatorError::Binary(operator, operands) => operator_type::binary(at, *operator, operands),
        OperatorError::NoValue(why) => constant_expression::no_value(at, *why),
    };
    K::OperationDefinition { name, declared, defined, declared_at, fixed } => {
        let signatures = [declared, defined].map(|it| types::signature(name, it));
        operation_definition::report(at, &signatures, declared_at, fixed.as_ref())
    };
    K::OperationSignature { provided, required } => operation_signature::report(
        at,
        &[provided, required].map(|(name, it)| types::signature(name, it)),
    );
    K::OtherFeature { expected, name, instance, found, shell } =>
        unresolved_feature::another_kind(at, *expected, name, instance, (*found, shell));
    K::OutArgument { callee, parameter } => out_argument::report(at, callee, parameter);
    K::OutsideInterval { name, value, interval, declared } =>
        outside_interval::report(at, name, value, interval, declared.as_ref());
    K::PortAsValue { name, kind, is_status } => unresolved_variable::port(db, at, name, *kind, *is_status);
    K::PortDirection { function, port, is } => port_direction::report(at, *function, port, *is);
    K::ReadBeforeAssignment { name, declared } => read_before_assignment::report(at, name, declared);
    K::RecursiveOperation { name } => recursive_operation::report(at, name);
    K::ReservedName { name, is } => reserved_name::report(at, name, *is);
    K::ReturnType { of, expected, found } => return_type::report(at, of, expected, found);
    K::Ros2(fact) => invalid_topic::report(at, fact);
    K::SeveralInitialStates { first, second, all } => initial_state::several(at, first, second, all);
    K::SwappedEnds { kind, source, target } => connection_direction::swapped(db, at, *kind, source, target);
    K::TooLarge { with } => too_large::report(db, *with);
    K::TwoBehaviours { machines } => update_or_statemachine::both(at, *machines);
    K::TwoWriters { of, first, second } => two_writers::report(at, *of, first, second);
    K::UnconnectedInput { instance, ports } => unconnected_input::report(at, instance, ports);
    K::UnconnectedOperation { instance, name, declared } =>
        unconnected_operation::report(at, instance, name, declared);
    K::UndeclaredOperation { name } => undeclared_operation::report(at, name);
    K::UndefinedOperation { core, name, declared } => undefined_operation::report(db, at, *core, name, declared);
    K::UnknownPackage { name } => unknown_package::report(db, project, at, name);
    K::UnknownType { of, ty } => unknown_type::report(Scope { db, project, of: *of }, at, ty);
    K::UnreachableCode(why) => unreachable_code::report(at, why);
    K::UnreachableState { name } => unreachable_state::report(at, name);
    K::UnresolvedCodel { core, name, arguments, builtin } =>
        unresolved_codel::report(Scope { db, project, of: *core }, at, (name, *arguments), *builtin);
    K::AmbiguousDeployment { name, candidates } => {
        let candidates: Vec<String> = candidates.iter().map(|name| format!("`{name}`")).collect();
        let candidates = enumerated(&candidates);
        let message = format!(
            "deployment `{name}` is ambiguous, {candidates}: name each in a library with the library before it"
        );
        invalid_configuration::report(at, message)
    };
    K::SecondTables { deployment } => invalid_configuration::report(
        at,
        format!(
            "deployment `{deployment}` has its timing tables in a section by its qualified name: delete this one"
        ),
    );
    K::UnresolvedDeployment { name, near } =>
        invalid_configuration::report(at, format!("no deployment `{name}`")).did_you_mean(near.clone());
    K::UnresolvedFeature { expected, name, instance, shell, near } =>
        unresolved_feature::report(at, *expected, name, instance, shell, near.clone());
    K::UnresolvedInstance { name, architecture, near } =>
        unresolved_instance::report(at, name, architecture, near.clone());
    K::UnresolvedOperand { function, name, near } => unresolved_variable::operand(at, *function, name, near.clone());
    K::UnresolvedOperation { name, shell, near } => unresolved_operation::report(at, name, shell, near.clone());
    K::UnresolvedEnd { name, near } =>
        unresolved_instance::in_config(at, format!("no codel or instance `{name}`"), near.clone());
    K::UnresolvedState { name, instance, near } =>
        unresolved_state::report(at, name, instance.as_ref(), near.clone());
    K::UnresolvedType { of, kind, ty } => unresolved_type(Scope { db, project, of: *of }, at, *kind, ty);
    K::UnresolvedVariable { name, near } => unresolved_variable::report(at, name, near.clone());
    K::UnusedCodel { codel } => unused_codel::report(db, project, *codel);
    K::UnusedDeclaration { kind, name } => unused_declaration::report(at, *kind, name);
    K::UnusedProperty { kind, name } => unused_property::report(at, *kind, name);
    K::UnusedVariable { is_handler, name, is_removable } =>
        unused_variable::report(at, *is_handler, name, *is_removable);
    K::VoidValue => invalid_type::void(at);
    K::WrongEnd { kind, is_source, instance, name } =>
        connection_direction::one_end(at, *kind, *is_source, instance, name);
    K::WrongShell { core, shell } => wrong_shell::report(db, project, at, *core, *shell);
}

/// Reports an unresolved name of a shell, core, component or architecture.
fn unresolved_type<'db>(scope: Scope<'db>, at: Location<'db>, kind: Kind, ty: &TypeRef) -> Diagnostic<'db> {
    let Scope { db, project, of } = scope;
    let code = match kind {
        Kind::Core => &UNRESOLVED_CORE,
        Kind::Component => &UNRESOLVED_COMPONENT,
        Kind::Architecture => &UNRESOLVED_ARCHITECTURE,
        _ => &UNRESOLVED_SHELL,
    };
    let found = Diagnostic::new(code, at, format!("no {kind} `{ty}`"));
    if let Some((other, near)) = scope.of_another_kind(kind, &ty.path) {
        let article = if other == Kind::Architecture { "an" } else { "a" };
        let message = format!(
            "`{ty}` is {article} {other}, not {} {kind}",
            if kind == Kind::Architecture { "an" } else { "a" }
        );
        return Diagnostic { message, ..found }.did_you_mean(near);
    }
    let near = names_of(db, project).similar(db, of.library(db).as_ref(), kind, &ty.path);
    let near = near.or_else(|| scope.in_right_library(kind, &ty.path));
    // A shell that extends itself and an architecture that imports itself are the next mistake.
    let near = near.filter(|near| of.kind(db) != kind || near != of.name(db));
    found.look_elsewhere(scope, (kind, &ty.path), near)
}
