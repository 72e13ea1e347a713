//! The definition of the class: constructor, hooks, state machine, programs.

use std::collections::BTreeSet;

use mauve_hir::item_tree::{Direction, FeatureKind, HookKind, MethodKind, State, Variable};
use mauve_hir::{Callee, Integer, ProgramId, Type, Value};

use super::code::CppCode;
use super::expression::ExpressionWriter;
use super::layout::CodeText;
use super::obvious::MEANT;
use super::program::definition;
use super::{Class, ClassMachine, ClassMember, Routine};
use crate::cpp_name::script_name;
use crate::escape::cpp_string;

/// `<Component>-component.cpp`
pub(super) fn text(class: &Class<'_, '_>) -> String {
    let mut body = CodeText::default();
    constructor(class, &mut body);
    configure_hook(class, &mut body);
    start_hook(class, &mut body);
    update_hook(class, &mut body);
    body.function(&format!("void {}::stopHook()", class.name), |text| {
        text.line(1, "mauve_stopping();");
        call(class, &ProgramId::Hook(HookKind::Stop), 1, text);
    });
    if let Some(program) = class.program(&ProgramId::Hook(HookKind::Cleanup)) {
        body.function(&format!("void {}::cleanupHook()", class.name), |text| {
            text.line(1, format!("{}();", program.function));
        });
    }
    set(class, &mut body);
    show(class, &mut body);
    for (call, operation) in class.last_calls() {
        body.line(
            0,
            format!("// Returns true while the last call of {} is running.", operation.data.name.name),
        );
        let lines = ExpressionWriter::new(class).ask_for_last_call(call, operation);
        body.function(&format!("bool {}::{}()", class.name, call.is_under_way), |text| text.lines(&lines));
    }
    for routine in &class.programs {
        let (head, lines) = definition(class, routine);
        body.line(0, format!("// {}: {}", described(&routine.program), class.at(class.core, routine.at)));
        body.function(&head, |text| text.lines(&lines));
        called(class, routine, &mut body);
    }
    let mut text = CodeText::default();
    includes(class, &body.out, &mut text);
    let package = &class.model.library.package;
    if class.is_obvious.get() {
        MEANT.iter().for_each(|line| text.line(0, line));
        text.gap();
    }
    text.line(0, format!("namespace {package} {{"));
    text.gap();
    text.out += &body.out;
    text.line(0, format!("}}  // namespace {package}"));
    text.gap();
    let create = match class.model.library.components.as_slice() {
        [_] => "ORO_CREATE_COMPONENT",
        _ => "ORO_LIST_COMPONENT_TYPE",
    };
    text.line(0, format!("{create}({package}::{})", class.name));
    text.out
}

fn includes(class: &Class<'_, '_>, body: &str, text: &mut CodeText) {
    let name = &class.name;
    text.line(0, class.written_by());
    text.gap();
    text.line(0, format!("#include \"{name}-component.hpp\""));
    text.gap();
    for (word, header) in [("std::max(", "algorithm"), ("std::numeric_limits<", "limits")] {
        if body.contains(word) {
            text.line(0, format!("#include <{header}>"));
        }
    }
    if text.out.ends_with(">\n") {
        text.gap();
    }
    text.line(0, "#include <rtt/Component.hpp>");
    if body.contains("RTT::log(") {
        text.line(0, "#include <rtt/Logger.hpp>");
    }
    text.gap();
    let libraries = class.model.libraries;
    let codels = class.inference.callees().filter_map(|callee| match callee {
        Callee::Codel(codel) => Some(&libraries.of(codel)?.0.package),
        _ => None,
    });
    for package in codels.collect::<BTreeSet<_>>() {
        text.line(0, format!("#include <{package}/{package}-codels.hpp>"));
    }
    let package = &class.model.library.package;
    text.line(0, format!("#include <{package}/{package}-trace.hpp>"));
    text.gap();
}

fn constructor(class: &Class<'_, '_>, text: &mut CodeText) {
    let instance = &class.instance;
    let mut bases = vec![format!("MauveTask({instance})")];
    let required = class.members.iter().filter(|member| member.data.kind == FeatureKind::Required);
    bases.extend(required.map(|it| format!("{}({})", it.name, cpp_string(&script_name(&it.data.name.name)))));
    text.line(0, format!("{0}::{0}(const std::string& {instance})", class.name));
    let last = bases.len();
    for (index, base) in bases.iter().enumerate() {
        let before = if index == 0 { "  : " } else { "    " };
        let behind = if index + 1 == last { " {" } else { "," };
        text.line(1, format!("{before}{base}{behind}"));
    }
    for member in &class.members {
        text.line(1, added(class, member));
    }
    if !class.set_from_text().is_empty() {
        text.line(
            1,
            format!(
                "addOperation(\"mauve_set\", &{}::mauve_set, this, RTT::ClientThread).doc(\"Sets properties \
                 of types that scripts cannot set.\")\
                 .arg(\"property\", \"\").arg(\"text\", \"a whole number\");",
                class.name
            ),
        );
    }
    if class.introspection {
        let names: Vec<String> = class.members.iter().map(|it| script_name(&it.data.name.name)).collect();
        let [state, period] = ports_of_introspection(&names);
        if let Some(machine) = &class.machine {
            let longest =
                machine.data.states.iter().map(|state| state.name.name.len()).max().unwrap_or_default();
            text.line(1, format!("mauve_add_state_port({}, {longest});", cpp_string(state)));
        }
        text.line(1, format!("mauve_add_period_port({});", cpp_string(period)));
    }
    text.line(0, "}");
    text.gap();
}

/// The statement that makes a feature known to RTT.
fn added(class: &Class<'_, '_>, member: &ClassMember<'_>) -> String {
    let (data, name) = (member.data, &member.name);
    let known = cpp_string(&script_name(&data.name.name));
    let doc = cpp_string(&class.shown(member));
    match data.kind {
        FeatureKind::Property | FeatureKind::Constant => {
            format!("addProperty({known}, {}).doc({doc});", member.property())
        }
        FeatureKind::Input | FeatureKind::Output => format!("addPort({known}, {name}).doc({doc});"),
        FeatureKind::Required => format!("this->requires()->addOperationCaller({name});"),
        FeatureKind::Provided => {
            let arguments = data.parameters.iter().map(|parameter| {
                let ty = parameter.ty.as_ref().map_or_else(String::new, ToString::to_string);
                let (name, doc) = (&parameter.name.name, format!("{} {ty}", parameter.direction.keyword()));
                format!(".arg({}, {})", cpp_string(name), cpp_string(&doc))
            });
            let arguments: String = arguments.collect();
            let routine = class.program(&ProgramId::Operation(data.name.name.clone()));
            let called = routine.and_then(|routine| routine.called.as_ref()).unwrap_or(name);
            let function = format!("&{}::{called}", class.name);
            format!("addOperation({known}, {function}, this, RTT::OwnThread).doc({doc}){arguments};")
        }
    }
}

/// Checks the values of properties, and gives variables their first values.
fn configure_hook(class: &Class<'_, '_>, text: &mut CodeText) {
    if !class.hooks().iter().any(|(_, hook)| *hook == "configureHook") {
        return;
    }
    text.function(&format!("bool {}::configureHook()", class.name), |text| {
        class.members.iter().for_each(|member| interval_check(class, member, text));
        let constants = class.members.iter().filter_map(|it| Some((&it.name, it.property.as_ref()?)));
        for (index, (name, property)) in constants.enumerate() {
            if index == 0 {
                text.line(1, "// Constants keep their present values from here on.");
            }
            text.line(1, format!("{name} = {property};"));
        }
        for status in class.members.iter().filter_map(|member| member.status.as_ref()) {
            text.line(1, format!("{status} = RTT::NoData;"));
        }
        first_values(class, &class.data.variables, text);
        for handler in &class.data.handlers {
            let name = class.variable_at(handler.name.id).and_then(|index| class.variables.get(&index));
            // RTT has an assignment that `{}` would mean, and that does not compile.
            name.into_iter().for_each(|name| text.line(1, format!("{name} = decltype({name})();")));
        }
        agreed(class, HookKind::Configure, text);
        if !class.samples.is_empty() {
            text.line(
                1,
                "// Reserves space in connections for values of these sizes, so that writing them does not \
                 allocate.",
            );
            text.line(1, "if (mauve_makes_room()) {");
            for (port, variable) in &class.samples {
                let variable = class.variables.get(variable).into_iter();
                variable.for_each(|it| text.line(2, format!("{port}.setDataSample({it});")));
            }
            text.line(1, "}");
        }
        text.line(1, "return true;");
    });
}

/// Calls a program that may return false, and reports that: Orocos itself does not say why.
fn agreed(class: &Class<'_, '_>, kind: HookKind, text: &mut CodeText) {
    let Some(program) = class.program(&ProgramId::Hook(kind)) else { return };
    let said = cpp_string(&format!(": the program {} returned false", kind.keyword()));
    text.line(1, format!("if (!{}()) {{", program.function));
    refuse(2, &said, text);
    text.line(1, "}");
}

/// Logs an error, whose text is the operands of `<<`, and returns false.
fn refuse(depth: usize, error: &str, text: &mut CodeText) {
    text.line(depth, format!("RTT::log(RTT::Error) << getName() << {error} << RTT::endlog();"));
    text.line(depth, "return false;");
}

/// Gives variables their first values again: a program may have run before.
fn first_values<'db>(class: &Class<'_, 'db>, variables: &'db [Variable], text: &mut CodeText) {
    let mut writer = ExpressionWriter::new(class);
    for (index, variable, name) in class.variables_of(variables) {
        match &variable.value {
            Some(value) => {
                let value = writer.value(value, &class.type_of_variable(index));
                if value.text != name {
                    writer.line(format!("{name} = {};", value.text));
                }
            }
            None if class.named.contains(&index) => writer.line(format!("{name} = {{}};")),
            None => {}
        }
    }
    text.lines(&writer.lines);
}

/// Checks that a property or constant lies in its interval.
fn interval_check<'db>(class: &Class<'_, 'db>, member: &ClassMember<'db>, text: &mut CodeText) {
    let Some(interval) = &member.data.interval else { return };
    let mut writer = ExpressionWriter::of_shell(class);
    let (low, high) = (writer.value(&interval.low, &member.ty), writer.value(&interval.high, &member.ty));
    let value = member.property();
    let (least, greatest) = match &member.ty {
        Type::Integer(integer) => Some(integer.ends()).unzip(),
        _ => (None, None),
    };
    // Compilers warn of a comparison that is true for every value of the type.
    let is = |end: &CppCode, limit: Option<i128>| match end.value {
        Some(Value::Int(value)) => limit == Some(value.into()),
        _ => false,
    };
    let low_check = (!is(&low, least)).then(|| format!("{value} >= {}", low.operand()));
    let high_check = (!is(&high, greatest)).then(|| format!("{value} <= {}", high.operand()));
    let checks: Vec<String> = low_check.into_iter().chain(high_check).collect();
    if checks.is_empty() {
        return;
    }
    let streamed = |text: &str| match member.ty {
        // As a number, and not as a character.
        Type::Integer(Integer::Char | Integer::Int8 | Integer::Uint8) => format!("static_cast<int>({text})"),
        _ => text.to_owned(),
    };
    let end = |code: &CppCode| {
        let shown = code.value.as_ref().map(Value::text);
        shown.unwrap_or_else(|| format!("\" << {} << \"", streamed(&code.operand())))
    };
    let kind = if member.property.is_some() { "constant" } else { "property" };
    let what = cpp_string(&format!(": {kind} {} is ", member.data.name.name));
    let (shown, low, high) = (streamed(value), end(&low), end(&high));
    text.line(1, format!("// {}: {}", class.shown(member), class.at(member.feature.shell, interval.id)));
    text.line(1, format!("if (!({})) {{", checks.join(" && ")));
    refuse(2, &format!("{what} << {shown} << \", and must be in [{low}; {high}]\""), text);
    text.line(1, "}");
}

fn start_hook(class: &Class<'_, '_>, text: &mut CodeText) {
    text.function(&format!("bool {}::startHook()", class.name), |text| {
        text.line(1, "if (!mauve_may_start()) return false;");
        for input in class.members.iter().filter(|it| it.data.kind == FeatureKind::Input) {
            let known = cpp_string(&script_name(&input.data.name.name));
            text.line(1, format!("if (mauve_is_buffered({known})) {}.clear();", input.name));
        }
        class.machine.iter().for_each(|it| first_values(class, &it.data.variables, text));
        agreed(class, HookKind::Start, text);
        if let Some(machine) = &class.machine
            && let Some(initial) = machine.values.get(machine.initial)
        {
            text.line(1, format!("{} = {}::{initial};", machine.current, machine.states));
            let state = machine.data.states.get(machine.initial).into_iter();
            state.for_each(|state| call_method(class, state, MethodKind::Entry, 1, text));
            machine.show.iter().for_each(|show| text.line(1, format!("{show}();")));
        }
        text.line(1, "mauve_started();");
        text.line(1, "return true;");
    });
}

/// Calls a program of the component, where there is one.
fn call(class: &Class<'_, '_>, id: &ProgramId, depth: usize, text: &mut CodeText) {
    if let Some(program) = class.program(id) {
        text.line(depth, format!("{}();", program.function));
    }
}

fn call_method(class: &Class<'_, '_>, state: &State, kind: MethodKind, depth: usize, text: &mut CodeText) {
    call(class, &ProgramId::Method { state: state.name.name.clone(), kind }, depth, text);
}

/// The ports that show the state and the periods of a component whose features have these names: no feature is called `state`
/// in scripts.
pub(crate) fn ports_of_introspection(names: &[String]) -> [&'static str; 2] {
    ["state", if names.iter().any(|name| name == "period") { "mauve_period" } else { "period" }]
}

fn show(class: &Class<'_, '_>, text: &mut CodeText) {
    let Some(machine) = &class.machine else { return };
    let Some(show) = &machine.show else { return };
    let names: Vec<String> = machine.data.states.iter().map(|state| cpp_string(&state.name.name)).collect();
    text.function(&format!("void {}::{show}()", class.name), |text| {
        text.line(1, format!("static const char* const names[]{{{}}};", names.join(", ")));
        text.line(1, format!("mauve_show_state(names[static_cast<int>({})]);", machine.current));
    });
}

/// Sets the properties that scripts cannot.
fn set(class: &Class<'_, '_>, text: &mut CodeText) {
    let members = class.set_from_text();
    if members.is_empty() {
        return;
    }
    let head =
        format!("bool {}::mauve_set(const std::string& property, const std::string& text)", class.name);
    text.function(&head, |text| {
        for member in members {
            let (known, name) = (cpp_string(&script_name(&member.data.name.name)), member.property());
            let condition = format!("property == {known} && !isRunning() && mauve_parse(text, this->{name})");
            text.line(1, format!("if ({condition}) return true;"));
        }
        refuse(1, "\": no property \" << property << \" can be \" << text", text);
    });
}

/// An operation as other components call it.
fn called<'db>(class: &Class<'_, 'db>, routine: &Routine<'db>, text: &mut CodeText) {
    let Some(called) = &routine.called else { return };
    let mut names = class.names.inner();
    let parameters = class.parameters(routine, &mut names);
    let call = names.declare("call");
    let declared: Vec<&str> = parameters.iter().map(|it| it.named.as_str()).collect();
    // A large value would be copied once more.
    let given = parameters.iter().zip(routine.parameters).map(|(it, of)| match it.is_large {
        true if of.direction == Direction::In => format!("std::move({})", it.name),
        _ => it.name.clone(),
    });
    let given: Vec<String> = given.collect();
    text.line(0, format!("// {}, as called by other components", described(&routine.program)));
    let head = format!("{} {}::{called}({})", class.cpp(&routine.result), class.name, declared.join(", "));
    text.function(&head, |text| {
        text.line(1, format!("const MauveCall {call}(*this);"));
        text.line(1, format!("return {}({});", routine.function, given.join(", ")));
    });
}

/// Returns the description of a program for a comment: `state Waiting, run`.
fn described(program: &ProgramId) -> String {
    match program {
        ProgramId::Hook(kind) => kind.keyword().to_owned(),
        ProgramId::Operation(name) => format!("provide {name}"),
        ProgramId::Method { state, kind } => format!("state {state}, {}", kind.keyword()),
        ProgramId::Guard { state, transition } => format!("state {state}, transition {transition}, guard"),
        ProgramId::Effect { state, transition } => format!("state {state}, transition {transition}, effect"),
    }
}

fn update_hook(class: &Class<'_, '_>, text: &mut CodeText) {
    text.function(&format!("void {}::updateHook()", class.name), |text| {
        text.line(1, "if (!mauve_begin()) return;");
        text.line(1, "MAUVE_TRACE_COMPONENT(getName());");
        call(class, &ProgramId::UPDATE, 1, text);
        if let Some(machine) = &class.machine {
            text.line(1, format!("switch ({}) {{", machine.current));
            for (number, value) in machine.values.iter().enumerate() {
                text.line(2, format!("case {}::{value}:", machine.states));
                state(class, machine, number, text);
                text.line(3, "break;");
            }
            text.line(1, "}");
            machine.show.iter().for_each(|show| text.line(1, format!("{show}();")));
        }
        text.line(1, "mauve_end();");
    });
}

/// The statements of a period that begins in a state.
fn state(class: &Class<'_, '_>, machine: &ClassMachine<'_>, number: usize, text: &mut CodeText) {
    let states = &machine.data.states;
    let Some(data) = states.get(number) else { return };
    let name = || data.name.name.clone();
    call_method(class, data, MethodKind::Run, 3, text);
    // The first transition without a guard is always taken, and those after it never are.
    let always = data.transitions.iter().position(|transition| transition.guard.is_none());
    let (taken, never) = data.transitions.split_at(always.map_or(data.transitions.len(), |it| it + 1));
    let mut before = "";
    for transition in taken {
        let own = || transition.name.name.clone();
        let guard = class.program(&ProgramId::Guard { state: name(), transition: own() });
        match guard {
            Some(guard) => text.line(3, format!("{before}if ({}()) {{", guard.function)),
            None if before.is_empty() => {}
            None => text.line(3, "} else {"),
        }
        let depth = if guard.is_none() && before.is_empty() { 3 } else { 4 };
        let target = transition.target.as_ref();
        let target = target.and_then(|target| machine.numbers.get(&target.name)).copied().unwrap_or(number);
        call_method(class, data, MethodKind::Exit, depth, text);
        call(class, &ProgramId::Effect { state: name(), transition: own() }, depth, text);
        if let Some(value) = machine.values.get(target) {
            text.line(depth, format!("{} = {}::{value};", machine.current, machine.states));
        }
        states.get(target).into_iter().for_each(|it| call_method(class, it, MethodKind::Entry, depth, text));
        if guard.is_some() {
            before = "} else ";
        }
    }
    if always.is_none() && before.is_empty() {
        call_method(class, data, MethodKind::Handle, 3, text);
    } else if always.is_none() && data.method(MethodKind::Handle).is_some() {
        text.line(3, "} else {");
        call_method(class, data, MethodKind::Handle, 4, text);
    }
    if !before.is_empty() {
        text.line(3, "}");
    }
    for transition in never {
        let (name, at) = (&transition.name.name, class.at(class.core, transition.name.id));
        text.line(3, format!("// transition {name} is never taken: {at}"));
    }
}
