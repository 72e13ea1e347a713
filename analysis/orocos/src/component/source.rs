//! The definition of the class: constructor, hooks, state machine, programs.

use std::collections::BTreeSet;

use mauve_hir::item_tree::{Direction, FeatureKind, HookKind, MethodKind, Variable};
use mauve_hir::{Callee, Integer, ProgramId, Type, Value};

use super::expression::{Code, Line, Writer};
use super::layout::Text;
use super::obvious::MEANT;
use super::program::definition;
use super::{Class, Machine, Member, Routine};
use crate::cpp_name::script_name;
use crate::escape::cpp_string;

/// `<Component>-component.cpp`
pub(super) fn text(class: &Class<'_, '_>) -> String {
    let mut body = Text::default();
    constructor(class, &mut body);
    configure_hook(class, &mut body);
    start_hook(class, &mut body);
    update_hook(class, &mut body);
    for (kind, hook) in [(HookKind::Stop, "stopHook"), (HookKind::Cleanup, "cleanupHook")] {
        let mut lines =
            if kind == HookKind::Stop { vec![Line::new(1, "mauve_stopping();")] } else { Vec::new() };
        let program = class.program(&ProgramId::Hook(kind));
        lines.extend(program.map(|program| Line::new(1, format!("{}();", program.function))));
        if !lines.is_empty() {
            function(&mut body, &format!("void {}::{hook}()", class.name), &lines);
        }
    }
    set(class, &mut body);
    show(class, &mut body);
    for call in &class.last_calls {
        let Some(operation) = class.member(call.shell, call.index) else { continue };
        let lines = Writer::new(class).ask_for_last_call(call, operation);
        body.line(0, &format!("// Is the last call of {} under way?", operation.data.name.name));
        function(&mut body, &format!("bool {}::{}()", class.name, call.is_under_way), &lines);
    }
    for routine in &class.programs {
        let (head, lines) = definition(class, routine);
        body.line(0, &format!("// {}: {}", described(&routine.program), class.at(class.core, routine.at)));
        function(&mut body, &head, &lines);
        called(class, routine, &mut body);
    }
    let mut text = Text::default();
    includes(class, &body.out, &mut text);
    let package = &class.library.package;
    if class.is_obvious.get() {
        MEANT.iter().for_each(|line| text.line(0, line));
        text.gap();
    }
    text.line(0, &format!("namespace {package} {{"));
    text.gap();
    text.out += &body.out;
    text.line(0, &format!("}}  // namespace {package}"));
    text.gap();
    let create = match class.library.components.as_slice() {
        [_] => "ORO_CREATE_COMPONENT",
        _ => "ORO_LIST_COMPONENT_TYPE",
    };
    text.line(0, &format!("{create}({package}::{})", class.name));
    text.out
}

fn includes(class: &Class<'_, '_>, body: &str, text: &mut Text) {
    let name = &class.name;
    text.line(0, &class.written_by());
    text.gap();
    text.line(0, &format!("#include \"{name}-component.hpp\""));
    text.gap();
    for (word, header) in [("std::max(", "algorithm"), ("std::numeric_limits<", "limits")] {
        if body.contains(word) {
            text.line(0, &format!("#include <{header}>"));
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
        text.line(0, &format!("#include <{package}/{package}-codels.hpp>"));
    }
    let package = &class.library.package;
    text.line(0, &format!("#include <{package}/{package}-trace.hpp>"));
    text.gap();
}

fn function(text: &mut Text, head: &str, lines: &[Line]) {
    text.line(0, &format!("{head} {{"));
    for line in lines {
        text.line(line.depth, &line.text);
    }
    text.line(0, "}");
    text.gap();
}

fn constructor(class: &Class<'_, '_>, text: &mut Text) {
    let instance = &class.instance;
    let mut first = vec![format!("MauveTask({instance})")];
    let required = class.members().filter(|member| member.data.kind == FeatureKind::Required);
    first.extend(required.map(|it| format!("{}({})", it.name, cpp_string(&script_name(&it.data.name.name)))));
    text.line(0, &format!("{0}::{0}(const std::string& {instance})", class.name));
    let last = first.len();
    for (index, first) in first.iter().enumerate() {
        let before = if index == 0 { "  : " } else { "    " };
        let behind = if index + 1 == last { " {" } else { "," };
        text.line(1, &format!("{before}{first}{behind}"));
    }
    let is_defined = |member: &&Member<'_>| {
        let mut defined = class.data.operations.iter();
        let name = &member.data.name.name;
        member.data.kind != FeatureKind::Provided || defined.any(|it| it.name.name == *name)
    };
    for member in class.members().filter(is_defined) {
        text.line(1, &added(class, member));
    }
    if !class.set_from_text().is_empty() {
        text.line(
            1,
            &format!(
                "addOperation(\"mauve_set\", &{}::mauve_set, this, RTT::ClientThread).doc(\"Sets what scripts cannot.\")\
                 .arg(\"property\", \"\").arg(\"text\", \"a whole number\");",
                class.name
            ),
        );
    }
    if class.introspection {
        let names: Vec<String> = class.members().map(|it| script_name(&it.data.name.name)).collect();
        let [state, period] = ports_of_introspection(&names);
        if let Some(machine) = class.data.machines.first() {
            let longest = machine.states.iter().map(|state| state.name.name.len()).max().unwrap_or_default();
            text.line(1, &format!("mauve_add_state_port({}, {longest});", cpp_string(state)));
        }
        text.line(1, &format!("mauve_add_period_port({});", cpp_string(period)));
    }
    text.line(0, "}");
    text.gap();
}

/// How RTT gets to know a feature.
fn added(class: &Class<'_, '_>, member: &Member<'_>) -> String {
    let (data, name) = (member.data, &member.name);
    let known = cpp_string(&script_name(&data.name.name));
    let doc = cpp_string(&class.shown(member));
    match data.kind {
        FeatureKind::Property | FeatureKind::Constant => {
            let property = class.property(member);
            format!("addProperty({known}, {property}).doc({doc});")
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
            let mut called = class.programs.iter().filter(|routine| routine.function == *name);
            let called = called.find_map(|routine| routine.called.as_ref()).unwrap_or(name);
            let function = format!("&{}::{called}", class.name);
            format!("addOperation({known}, {function}, this, RTT::OwnThread).doc({doc}){arguments};")
        }
    }
}

/// Checks what the component was given, and gives variables their first values.
fn configure_hook<'db>(class: &Class<'_, 'db>, text: &mut Text) {
    if !class.hooks().iter().any(|(_, hook)| *hook == "configureHook") {
        return;
    }
    let mut lines = Vec::new();
    class.members().for_each(|member| lines.extend(interval_check(class, member)));
    let frozen = class.members().filter_map(|member| Some((member, member.property.as_ref()?)));
    let frozen: Vec<Line> =
        frozen.map(|(member, property)| Line::new(1, format!("{} = {property};", member.name))).collect();
    if !frozen.is_empty() {
        lines.push(Line::new(1, "// Constants are from here on what they are now."));
    }
    lines.extend(frozen);
    let statuses = class.members().filter_map(|member| member.status.as_ref());
    lines.extend(statuses.map(|status| Line::new(1, format!("{status} = RTT::NoData;"))));
    lines.extend(first_values(class, &class.data.variables));
    for handler in &class.data.handlers {
        let name = class.variable_at(handler.name.id).and_then(|index| class.variables.get(&index));
        // RTT has an assignment that `{}` would mean, and that does not compile.
        lines.extend(name.map(|name| Line::new(1, format!("{name} = decltype({name})();"))));
    }
    lines.extend(agreed(class, HookKind::Configure));
    if !class.samples.is_empty() {
        lines.push(Line::new(
            1,
            "// Connections get room for values of these sizes: writing them allocates nothing.",
        ));
        lines.push(Line::new(1, "if (mauve_makes_room()) {"));
        for (port, variable) in &class.samples {
            let variable = class.variables.get(variable);
            lines.extend(variable.map(|it| Line::new(2, format!("{port}.setDataSample({it});"))));
        }
        lines.push(Line::new(1, "}"));
    }
    lines.push(Line::new(1, "return true;"));
    function(text, &format!("bool {}::configureHook()", class.name), &lines);
}

/// Calls a program that may refuse, and says so: Orocos itself does not say why.
fn agreed(class: &Class<'_, '_>, kind: HookKind) -> Vec<Line> {
    let Some(program) = class.program(&ProgramId::Hook(kind)) else { return Vec::new() };
    let said = cpp_string(&format!(": the program {} gives false", kind.keyword()));
    vec![
        Line::new(1, format!("if (!{}()) {{", program.function)),
        Line::new(2, format!("RTT::log(RTT::Error) << getName() << {said} << RTT::endlog();")),
        Line::new(2, "return false;"),
        Line::new(1, "}"),
    ]
}

/// Variables as they are before any program, also where one has been executed before.
fn first_values<'db>(class: &Class<'_, 'db>, variables: &'db [Variable]) -> Vec<Line> {
    let mut writer = Writer::new(class);
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
    writer.lines
}

/// That a property or constant lies in its interval.
fn interval_check<'db>(class: &Class<'_, 'db>, member: &Member<'db>) -> Vec<Line> {
    let Some(interval) = &member.data.interval else { return Vec::new() };
    let mut writer = Writer::of_shell(class);
    let (low, high) = (writer.value(&interval.low, &member.ty), writer.value(&interval.high, &member.ty));
    let value = class.property(member);
    let (least, greatest) = match &member.ty {
        Type::Integer(integer) => Some(integer.ends()).unzip(),
        _ => (None, None),
    };
    // Each value of the type is above its least one, as compilers know.
    let is = |end: &Code, limit: Option<i128>| limit.is_some() && end.whole() == limit;
    let low_check = (!is(&low, least)).then(|| format!("{value} >= {}", low.operand()));
    let high_check = (!is(&high, greatest)).then(|| format!("{value} <= {}", high.operand()));
    let checks: Vec<String> = low_check.into_iter().chain(high_check).collect();
    if checks.is_empty() {
        return Vec::new();
    }
    let streamed = |text: &str| match member.ty {
        // As a number, and not as a character.
        Type::Integer(Integer::Char | Integer::Int8 | Integer::Uint8) => format!("static_cast<int>({text})"),
        _ => text.to_owned(),
    };
    let end = |code: &Code| {
        let shown = code.value.as_ref().map(Value::text);
        shown.unwrap_or_else(|| format!("\" << {} << \"", streamed(&code.operand())))
    };
    let kind = if member.property.is_some() { "constant" } else { "property" };
    let what = cpp_string(&format!(": {kind} {} is ", member.data.name.name));
    let (shown, low, high) = (streamed(value), end(&low), end(&high));
    let log = format!(
        "RTT::log(RTT::Error) << getName() << {what} << {shown} << \", and must be in [{low}; {high}]\" << RTT::endlog();"
    );
    let at = class.at(member.shell, interval.id);
    vec![
        Line::new(1, format!("// {}: {at}", class.shown(member))),
        Line::new(1, format!("if (!({})) {{", checks.join(" && "))),
        Line::new(2, log),
        Line::new(2, "return false;"),
        Line::new(1, "}"),
    ]
}

/// Starts the state machine.
fn start_hook(class: &Class<'_, '_>, text: &mut Text) {
    let head = format!("bool {}::startHook()", class.name);
    let mut lines = vec![Line::new(1, "if (!mauve_may_start()) return false;")];
    lines.extend(class.data.machines.iter().take(1).flat_map(|it| first_values(class, &it.variables)));
    lines.extend(agreed(class, HookKind::Start));
    if let Some(machine) = &class.machine
        && let Some(initial) = machine.values.get(machine.initial)
    {
        lines.push(Line::new(1, format!("{} = {}::{initial};", machine.current, machine.states)));
        let state = class.data.machines.first().and_then(|it| it.states.get(machine.initial));
        let entry = state.and_then(|state| {
            let state = state.name.name.clone();
            class.program(&ProgramId::Method { state, kind: MethodKind::Entry })
        });
        lines.extend(entry.map(|entry| Line::new(1, format!("{}();", entry.function))));
        lines.extend(machine.show.as_ref().map(|show| Line::new(1, format!("{show}();"))));
    }
    lines.extend(["mauve_started();", "return true;"].map(|line| Line::new(1, line)));
    function(text, &head, &lines);
}

/// The ports that show the state and the periods of a component whose features have these names: no feature is called `state`
/// in scripts.
pub(crate) fn ports_of_introspection(names: &[String]) -> [&'static str; 2] {
    ["state", if names.iter().any(|name| name == "period") { "mauve_period" } else { "period" }]
}

/// Shows the state on its port.
fn show(class: &Class<'_, '_>, text: &mut Text) {
    let Some(machine) = &class.machine else { return };
    let (Some(show), Some(data)) = (&machine.show, class.data.machines.first()) else { return };
    let names: Vec<String> = data.states.iter().map(|state| cpp_string(&state.name.name)).collect();
    let lines = [
        Line::new(1, format!("static const char* const names[]{{{}}};", names.join(", "))),
        Line::new(1, format!("mauve_show_state(names[static_cast<int>({})]);", machine.current)),
    ];
    function(text, &format!("void {}::{show}()", class.name), &lines);
}

/// Sets the properties that scripts cannot.
fn set(class: &Class<'_, '_>, text: &mut Text) {
    let members = class.set_from_text();
    if members.is_empty() {
        return;
    }
    let set = |member: &&Member<'_>| {
        let known = cpp_string(&script_name(&member.data.name.name));
        let name = class.property(member);
        Line::new(
            1,
            format!(
                "if (property == {known} && !isRunning() && mauve_parse(text, this->{name})) return true;"
            ),
        )
    };
    let mut lines: Vec<Line> = members.iter().map(set).collect();
    lines.push(Line::new(
        1,
        "RTT::log(RTT::Error) << getName() << \": no property \" << property << \" can be \" << text << RTT::endlog();",
    ));
    lines.push(Line::new(1, "return false;"));
    let head =
        format!("bool {}::mauve_set(const std::string& property, const std::string& text)", class.name);
    function(text, &head, &lines);
}

/// An operation as other components call it.
fn called<'db>(class: &Class<'_, 'db>, routine: &Routine<'db>, text: &mut Text) {
    let Some(called) = &routine.called else { return };
    let mut names = class.names.clone();
    let parameters = class.parameters(routine, &mut names);
    let call = names.declare("call");
    let declared: Vec<&str> = parameters.iter().map(|it| it.named.as_str()).collect();
    // What is no number would be copied once more.
    let given = parameters.iter().zip(routine.parameters).map(|(it, of)| match it.is_large {
        true if of.direction == Direction::In => format!("std::move({})", it.name),
        _ => it.name.clone(),
    });
    let given: Vec<String> = given.collect();
    let lines = [
        Line::new(1, format!("const MauveCall {call}(*this);")),
        Line::new(1, format!("return {}({});", routine.function, given.join(", "))),
    ];
    text.line(0, &format!("// {}, as other components call it", described(&routine.program)));
    let head = format!("{} {}::{called}({})", class.cpp(&routine.gives), class.name, declared.join(", "));
    function(text, &head, &lines);
}

/// What a program is in the model, for a comment: `state Waiting, run`.
fn described(program: &ProgramId) -> String {
    match program {
        ProgramId::Hook(kind) => kind.keyword().to_owned(),
        ProgramId::Operation(name) => format!("provide {name}"),
        ProgramId::Method { state, kind } => format!("state {state}, {}", kind.keyword()),
        ProgramId::Guard { state, transition } => format!("state {state}, transition {transition}, guard"),
        ProgramId::Effect { state, transition } => format!("state {state}, transition {transition}, effect"),
    }
}

/// One period.
fn update_hook(class: &Class<'_, '_>, text: &mut Text) {
    let mut lines =
        vec![Line::new(1, "if (!mauve_begin()) return;"), Line::new(1, "MAUVE_TRACE_COMPONENT(getName());")];
    if let Some(update) = class.program(&ProgramId::UPDATE) {
        lines.push(Line::new(1, format!("{}();", update.function)));
    }
    if let Some(machine) = &class.machine {
        lines.push(Line::new(1, format!("switch ({}) {{", machine.current)));
        for (number, value) in machine.values.iter().enumerate() {
            lines.push(Line::new(2, format!("case {}::{value}:", machine.states)));
            lines.extend(state(class, machine, number));
            lines.push(Line::new(3, "break;"));
        }
        lines.push(Line::new(1, "}"));
        lines.extend(machine.show.as_ref().map(|show| Line::new(1, format!("{show}();"))));
    }
    if class.introspection {
        lines.push(Line::new(1, "mauve_end();"));
    }
    function(text, &format!("void {}::updateHook()", class.name), &lines);
}

/// What a period that begins in a state executes.
fn state(class: &Class<'_, '_>, machine: &Machine, number: usize) -> Vec<Line> {
    let states = class.data.machines.first().map_or(&[] as &[_], |machine| &machine.states);
    let Some(data) = states.get(number) else { return Vec::new() };
    let name = || data.name.name.clone();
    let call = |id, depth| class.program(&id).map(|it| Line::new(depth, format!("{}();", it.function)));
    let method = |kind, depth| call(ProgramId::Method { state: name(), kind }, depth);
    let mut lines: Vec<Line> = method(MethodKind::Run, 3).into_iter().collect();
    // The first of them that is taken.
    let always = data.transitions.iter().position(|transition| transition.guard.is_none());
    let taken = always.map_or(data.transitions.len(), |always| always + 1);
    let mut before = "";
    for transition in data.transitions.iter().take(taken) {
        let own = || transition.name.name.clone();
        let guard = class.program(&ProgramId::Guard { state: name(), transition: own() });
        let depth = match guard {
            Some(guard) => {
                lines.push(Line::new(3, format!("{before}if ({}()) {{", guard.function)));
                4
            }
            None if before.is_empty() => 3,
            None => {
                lines.push(Line::new(3, "} else {"));
                4
            }
        };
        let target = transition.target.as_ref();
        let target = target.and_then(|target| states.iter().position(|it| it.name.name == target.name));
        let target = target.unwrap_or(number);
        lines.extend(method(MethodKind::Exit, depth));
        lines.extend(call(ProgramId::Effect { state: name(), transition: own() }, depth));
        if let Some(value) = machine.values.get(target) {
            lines.push(Line::new(depth, format!("{} = {}::{value};", machine.current, machine.states)));
        }
        lines.extend(states.get(target).and_then(|target| {
            let state = target.name.name.clone();
            call(ProgramId::Method { state, kind: MethodKind::Entry }, depth)
        }));
        if guard.is_some() {
            before = "} else ";
        }
    }
    match always {
        Some(_) => {}
        None if before.is_empty() => lines.extend(method(MethodKind::Handle, 3)),
        None => {
            if let Some(handle) = method(MethodKind::Handle, 4) {
                lines.extend([Line::new(3, "} else {"), handle]);
            }
        }
    }
    if !before.is_empty() {
        lines.push(Line::new(3, "}"));
    }
    // The text of the model has them, and no period executes them.
    for transition in data.transitions.iter().skip(taken) {
        let (name, at) = (&transition.name.name, class.at(class.core, transition.name.id));
        lines.push(Line::new(3, format!("// transition {name} is never taken: {at}")));
    }
    lines
}
