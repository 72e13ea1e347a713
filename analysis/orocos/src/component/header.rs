//! The declaration of the class.

use std::collections::BTreeSet;

use mauve_hir::item_tree::{Expr, FeatureKind, HookKind, Variable};
use mauve_hir::{ProgramId, Type, VariableId};

use super::code::literal_text;
use super::expression::ExpressionWriter;
use super::layout::CodeText;
use super::{Class, ClassMember, LastCall};
use crate::generated_file::generated_from;

/// `<Component>-component.hpp`
pub(super) fn text(class: &Class<'_, '_>) -> String {
    let mut body = CodeText::default();
    shells(class, &mut body);
    core(class, &mut body);
    programs(class, &mut body);
    let mut text = CodeText::default();
    text.line(0, class.written_by());
    text.gap();
    text.line(0, "#pragma once");
    text.gap();
    if body.out.contains("std::numeric_limits<") {
        text.line(0, "#include <limits>");
    }
    text.line(0, "#include <string>");
    text.gap();
    for header in rtt_headers(class) {
        text.line(0, format!("#include <rtt/{header}.hpp>"));
    }
    text.gap();
    let (package, name) = (&class.model.library.package, &class.name);
    text.line(0, format!("#include <{package}/{package}-task.hpp>"));
    text.line(0, format!("#include <{package}/{package}-types.hpp>"));
    text.gap();
    text.line(0, format!("namespace {package} {{"));
    text.gap();
    text.line(0, format!("// {}", class.declared(class.component)));
    text.line(0, format!("class {name} : public MauveTask {{"));
    text.line(0, " public:");
    text.line(1, format!("explicit {name}(const std::string& {});", class.instance));
    text.gap();
    text.line(0, " protected:");
    for (result, hook) in class.hooks() {
        text.line(1, format!("{result} {hook}() override;"));
    }
    text.gap();
    text.line(0, " private:");
    text.out += &body.out;
    text.line(0, "};");
    text.gap();
    text.line(0, format!("}}  // namespace {package}"));
    text.out
}

fn rtt_headers(class: &Class<'_, '_>) -> BTreeSet<&'static str> {
    let mut headers = BTreeSet::new();
    for member in &class.members {
        match member.data.kind {
            FeatureKind::Input => headers.insert("InputPort"),
            FeatureKind::Output => headers.insert("OutputPort"),
            FeatureKind::Required => headers.insert("OperationCaller"),
            FeatureKind::Provided => headers.insert("Operation"),
            FeatureKind::Property | FeatureKind::Constant => headers.insert("Property"),
        };
        if member.status.is_some() {
            headers.insert("FlowStatus");
        }
    }
    if !class.data.handlers.is_empty() || class.last_calls().next().is_some() {
        headers.extend(["SendHandle", "SendStatus"]);
    }
    headers
}

fn shells(class: &Class<'_, '_>, text: &mut CodeText) {
    for members in class.members.chunk_by(|one, other| one.feature.shell == other.feature.shell) {
        let mut shown = members.iter().filter(|it| it.data.kind != FeatureKind::Provided).peekable();
        let Some(first) = shown.peek() else { continue };
        text.line(1, format!("// {}", class.declared(first.feature.shell)));
        shown.for_each(|member| feature(class, member, text));
        text.gap();
    }
}

fn feature(class: &Class<'_, '_>, member: &ClassMember<'_>, text: &mut CodeText) {
    text.line(
        1,
        format!("// {}: {}", class.shown(member), class.at(member.feature.shell, member.data.name.id)),
    );
    let (cpp, name) = (class.cpp(&member.ty), &member.name);
    match member.data.kind {
        FeatureKind::Property | FeatureKind::Constant => {
            let value = member.value.as_ref().map(|value| literal_text(value, &member.ty));
            let value = value.map_or_else(|| "{}".to_owned(), |value| format!(" = {value}"));
            text.line(1, format!("{cpp} {}{value};", member.property()));
            if member.property.is_some() {
                text.line(1, format!("{cpp} {name}{value};  // the value that configureHook() found"));
            }
        }
        FeatureKind::Input => {
            text.line(1, format!("RTT::InputPort<{cpp}> {name};"));
            if let Some(status) = &member.status {
                text.line(1, format!("RTT::FlowStatus {status} = RTT::NoData;  // of the last read"));
            }
        }
        FeatureKind::Output => text.line(1, format!("RTT::OutputPort<{cpp}> {name};")),
        FeatureKind::Required => {
            text.line(1, format!("RTT::OperationCaller<{}> {name};", class.signature(member)));
        }
        FeatureKind::Provided => {}
    }
}

fn core<'db>(class: &Class<'_, 'db>, text: &mut CodeText) {
    text.line(1, format!("// {}", class.declared(class.core)));
    let mut lines = variables(class, &class.data.variables);
    for handler in &class.data.handlers {
        let Some(index) = class.variable_at(handler.name.id) else { continue };
        let Some(name) = class.variables.get(&index) else { continue };
        let at = class.at(class.core, handler.name.id);
        lines.push((format!("{} {name};", class.cpp(&class.type_of_variable(index))), at));
    }
    text.commented(1, &lines);
    if !lines.is_empty() {
        text.gap();
    }
    if class.sent.iter().any(|operation| !operation.slots.is_empty()) {
        text.line(1, "// The results of operations that were sent, until they are collected.");
        for (_, ty, name) in class.sent.iter().flat_map(|operation| &operation.slots) {
            text.line(1, format!("{} {name}{{}};", class.cpp(ty)));
        }
        text.gap();
    }
    if class.last_calls().next().is_some() {
        text.line(
            1,
            "// Calls with inout arguments: the next call is sent only after the last one has ended.",
        );
        for (call, operation) in class.last_calls() {
            text.line(1, format!("RTT::SendHandle<{}> {};", class.signature(operation), call.handle));
        }
        text.gap();
    }
    let Some(machine) = &class.machine else { return };
    text.line(1, format!("// statemachine: {}", class.at(class.core, machine.data.id)));
    text.line(1, format!("enum class {} {{ {} }};", machine.states, machine.values.join(", ")));
    if let Some(initial) = machine.values.get(machine.initial) {
        text.line(1, format!("{0} {1} = {0}::{initial};", machine.states, machine.current));
    }
    text.commented(1, &variables(class, &machine.data.variables));
    text.gap();
}

/// Variables, and where the model declares them.
fn variables<'db>(class: &Class<'_, 'db>, all: &'db [Variable]) -> Vec<(String, String)> {
    let line = |(index, variable, name): (VariableId, &'db Variable, &str)| {
        let at = class.at(class.core, variable.name.id);
        if variable.value.is_none() && !class.named.contains(&index) {
            return (String::new(), format!("{name}: unused, {at}"));
        }
        let ty = class.type_of_variable(index);
        let value = variable.value.as_ref().and_then(|value| known(class, value, &ty));
        let value = value.map_or_else(|| "{}".to_owned(), |value| format!(" = {value}"));
        (format!("{} {name}{value};", class.cpp(&ty)), at)
    };
    class.variables_of(all).into_iter().map(line).collect()
}

/// A first value that is known beforehand.
fn known<'db>(class: &Class<'_, 'db>, value: &'db Expr, ty: &Type) -> Option<String> {
    let code = ExpressionWriter::new(class).value(value, ty);
    code.value.is_some().then_some(code.text)
}

fn programs(class: &Class<'_, '_>, text: &mut CodeText) {
    if !class.set_from_text().is_empty() {
        text.line(1, "bool mauve_set(const std::string& property, const std::string& text);");
    }
    if let Some(show) = class.machine.as_ref().and_then(|machine| machine.show.as_ref()) {
        text.line(1, format!("void {show}();"));
    }
    for (call, _) in class.last_calls() {
        text.line(1, format!("bool {}();", call.is_under_way));
    }
    for routine in &class.programs {
        class.model.db.unwind_if_revision_cancelled();
        let mut names = class.names.inner();
        let parameters = class.parameters(routine, &mut names);
        let result = class.cpp(&routine.result);
        let mut declare = |function: &str, parameters: Vec<&str>| {
            text.line(1, format!("{result} {function}({});", parameters.join(", ")));
        };
        declare(&routine.function, parameters.iter().map(|it| it.declared.as_str()).collect());
        if let Some(called) = &routine.called {
            declare(called, parameters.iter().map(|it| it.named.as_str()).collect());
        }
    }
}

impl<'db> Class<'_, 'db> {
    /// Returns the hooks of RTT that the class overrides, with their result types.
    pub(super) fn hooks(&self) -> Vec<(&'static str, &'static str)> {
        let has = |kind| self.program(&ProgramId::Hook(kind)).is_some();
        let mut variables = self.variables_of(&self.data.variables).into_iter();
        let mut members = self.members.iter();
        let configures = has(HookKind::Configure)
            || variables.any(|(index, variable, _)| variable.value.is_some() || self.named.contains(&index))
            || members.any(|it| it.data.interval.is_some() || it.property.is_some() || it.status.is_some())
            || !self.data.handlers.is_empty()
            || !self.samples.is_empty();
        let configure = configures.then_some(("bool", "configureHook"));
        let always = [("bool", "startHook"), ("void", "updateHook"), ("void", "stopHook")];
        let cleanup = has(HookKind::Cleanup).then_some(("void", "cleanupHook"));
        configure.into_iter().chain(always).chain(cleanup).collect()
    }

    /// The last calls of required operations, and these operations.
    pub(super) fn last_calls(&self) -> impl Iterator<Item = (&LastCall, &ClassMember<'db>)> {
        let calls = self.sent.iter();
        calls.filter_map(|it| Some((it.last_call.as_ref()?, self.member(it.feature)?)))
    }

    pub(super) fn written_by(&self) -> String {
        format!("// {}", generated_from(&self.model.library.package))
    }

    /// A feature as the model declares it: `property body_width: double [0.3; 1.0]`.
    pub(super) fn shown(&self, member: &ClassMember<'_>) -> String {
        let word = match member.data.kind {
            FeatureKind::Constant => "constant",
            FeatureKind::Property => "property",
            FeatureKind::Input => "input port",
            FeatureKind::Output => "output port",
            FeatureKind::Required => "require",
            FeatureKind::Provided => "provide",
        };
        let data = member.data;
        let parameters = data.parameters.iter().map(|parameter| {
            let ty = parameter.ty.as_ref().map_or_else(String::new, ToString::to_string);
            format!("{} {}: {ty}", parameter.direction.keyword(), parameter.name.name)
        });
        let parameters: Vec<String> = parameters.collect();
        let parameters =
            if data.kind.is_operation() { format!("({})", parameters.join(", ")) } else { String::new() };
        let ty = data.ty.as_ref().map_or_else(String::new, |ty| format!(": {ty}"));
        let interval = data.interval.as_ref().map(|it| self.source(member.feature.shell, it.id));
        let interval = interval.map_or_else(String::new, |interval| format!(" {interval}"));
        format!("{word} {}{parameters}{ty}{interval}", data.name.name)
    }
}
