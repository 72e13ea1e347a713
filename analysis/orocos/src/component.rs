//! The C++ class of a component: `<Component>/<Component>-component.hpp` and `.cpp`.
//!
//! ```text
//! component Guidance(GuidanceShell, GuidanceCore)
//!     → class Guidance : public RTT::TaskContext, with a member for each feature of the shell and each variable of the core,
//!       and a private member function for each program: run_Steering(), guard_Steering_boxed_in(), …
//! ```
//!
//! | file | makes |
//! |---|---|
//! | `component.rs` | what the class has, and how it is called in C++ |
//! | `component/read.rs` | what a component has, for that |
//! | `component/files.rs` | the files of all classes |
//! | `component/header.rs` | the declaration of the class |
//! | `component/source.rs` | its constructor, its hooks, its state machine |
//! | `component/program.rs` | the statements of its programs |
//! | `component/expression.rs` | expressions, evaluated as MAUVE says |
//! | `component/code.rs` | the text of an expression, with its type and its value |
//! | `component/obvious.rs` | what compilers would warn of, and is meant |
//! | `component/layout.rs` | lines that are not too long |

mod code;
mod expression;
mod files;
mod header;
mod layout;
mod obvious;
mod program;
mod read;
mod source;

use std::cell::Cell;

use mauve_hir::item_tree::{
    Core, Direction, Expr, Feature, Machine, Name, Parameter, Program, SourceId, Variable,
};
use mauve_hir::{
    Binding, CoreInference, Decl, FeatureOf, Integer, Location, ProgramId, Type, Value, VariableId,
};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::cpp_name::CppNames;
use crate::cpp_type::{cpp_type, is_large, operation_parameter_type};
use crate::escape::comment;
use crate::library::Model;
use crate::origin::origin;

pub(crate) use files::component_files;
pub(crate) use source::ports_of_introspection;

/// A component as a class, with the names that its features and variables have in C++.
struct Class<'a, 'db> {
    model: Model<'a, 'db>,
    component: Decl<'db>,
    core: Decl<'db>,
    data: &'db Core,
    inference: CoreInference<'db>,
    name: String,
    /// The features, those of extended shells first.
    members: Vec<ClassMember<'db>>,
    /// The numbers of the features in `members`, by their place in the model, and of the first one of each name.
    by_feature: FxHashMap<FeatureOf<'db>, usize>,
    by_name: FxHashMap<&'db Name, usize>,
    /// The names of the variables and handlers of the core and of its machine.
    variables: FxHashMap<VariableId, String>,
    sent: Vec<SentOperation<'db>>,
    /// The numbers of these, by the handler and the operation.
    sent_numbers: FxHashMap<(Option<VariableId>, FeatureOf<'db>), usize>,
    programs: Vec<Routine<'db>>,
    by_id: FxHashMap<ProgramId, usize>,
    machine: Option<ClassMachine<'db>>,
    /// Whether ports show its state and its execution times.
    introspection: bool,
    /// The output ports whose values vary in size, each with a variable of the core that is written to it.
    samples: Vec<(String, VariableId)>,
    instance: String,
    /// Variables that a program reads, or passes by reference.
    read: FxHashSet<VariableId>,
    named: FxHashSet<VariableId>,
    by_source: FxHashMap<SourceId, VariableId>,
    names: CppNames<'static>,
    /// Whether a condition is always true, or never.
    is_obvious: Cell<bool>,
}

/// A feature of the shell.
struct ClassMember<'db> {
    feature: FeatureOf<'db>,
    data: &'db Feature,
    name: String,
    /// The type of its value; for an operation, the type of the result.
    ty: Type,
    /// For a constant: the property from which its value is frozen.
    property: Option<String>,
    /// For an input port: the variable for the status of its last `read`, if a program uses it.
    status: Option<String>,
    parameters: Vec<(Direction, Type)>,
    /// For a property or a constant: its default.
    value: Option<Value>,
}

impl ClassMember<'_> {
    /// Returns the name of the property that scripts set.
    fn property(&self) -> &str {
        self.property.as_ref().unwrap_or(&self.name)
    }
}

/// A required operation that a program sends, with one handler or without any.
struct SentOperation<'db> {
    /// `None` if the result is discarded.
    handler: Option<VariableId>,
    feature: FeatureOf<'db>,
    /// The variables that the owner of the operation writes its `out` and `inout` parameters to, with the numbers of these
    /// parameters. They live as long as a call may be running.
    ///
    /// Of two calls with the same slots, the owner writes those of the second one after all of the first one, since it
    /// executes calls in order. Nothing reads them before the second one has ended, as its handle has replaced the first
    /// one's.
    slots: Vec<(usize, Type, String)>,
    /// The last call, if the operation has `inout` parameters.
    last_call: Option<LastCall>,
}

/// The last call with the slots of an `inout` parameter. While it is running, the provider may read and write them,
/// so no other call is sent with them. A handler cannot track this: it may be reassigned, and there may be none.
struct LastCall {
    handle: String,
    /// The function that returns whether it is running.
    is_under_way: String,
}

struct ClassMachine<'db> {
    data: &'db Machine,
    /// The index of the first state of each name.
    numbers: FxHashMap<&'db Name, usize>,
    /// The enumeration of its states.
    states: String,
    /// Its values, in the order of the states.
    values: Vec<String>,
    /// The variable that holds the current state.
    current: String,
    /// The function that writes it to the state port, if there is one.
    show: Option<String>,
    initial: usize,
}

/// A program as a member function.
struct Routine<'db> {
    function: String,
    /// For a provided operation: the function that other components call.
    called: Option<String>,
    program: ProgramId,
    at: SourceId,
    result: Type,
    parameters: &'db [Parameter],
    body: RoutineBody<'db>,
}

struct RoutineParameter {
    /// `None` if no program uses it.
    index: Option<VariableId>,
    name: String,
    /// Its type and, where a program uses it, its name.
    declared: String,
    /// Its type and its name.
    named: String,
    is_large: bool,
}

enum RoutineBody<'db> {
    Program(&'db Program),
    Guard(&'db Expr),
}

impl<'db> Class<'_, 'db> {
    /// Returns the feature that the first argument of a built-in function names.
    fn feature_in(&self, arguments: &[Expr]) -> Option<FeatureOf<'db>> {
        match self.inference.binding(arguments.first()?.id()?)? {
            Binding::Feature(feature) => Some(feature),
            Binding::Variable(_) => None,
        }
    }

    fn member_in(&self, arguments: &[Expr]) -> Option<&ClassMember<'db>> {
        self.member(self.feature_in(arguments)?)
    }

    fn member(&self, feature: FeatureOf<'db>) -> Option<&ClassMember<'db>> {
        self.members.get(*self.by_feature.get(&feature)?)
    }

    /// Returns what a `send` of an operation needs, with this handler or without any.
    fn sent_by(
        &self,
        handler: Option<VariableId>,
        operation: &ClassMember<'db>,
    ) -> Option<&SentOperation<'db>> {
        self.sent.get(*self.sent_numbers.get(&(handler, operation.feature))?)
    }

    fn named_member(&self, name: &Name) -> Option<&ClassMember<'db>> {
        self.members.get(*self.by_name.get(name)?)
    }

    fn member_of_handle(&self, ty: &Type) -> Option<&ClassMember<'db>> {
        match ty {
            Type::Handle(operation) => self.named_member(operation),
            _ => None,
        }
    }

    /// Records that a condition may be constant.
    fn note(&self, is_obvious: bool) {
        self.is_obvious.set(self.is_obvious.get() || is_obvious);
    }

    fn set_from_text(&self) -> Vec<&ClassMember<'db>> {
        self.members.iter().filter(|it| it.data.kind.is_value() && is_set_from_text(&it.ty)).collect()
    }

    fn program(&self, id: &ProgramId) -> Option<&Routine<'db>> {
        self.by_id.get(id).and_then(|index| self.programs.get(*index))
    }

    /// Returns a type in C++. All types are known: models with unknown types are refused before.
    fn cpp(&self, ty: &Type) -> String {
        match ty {
            Type::Handle(_) => {
                let signature = self.member_of_handle(ty).map(|it| self.signature(it));
                format!("RTT::SendHandle<{}>", signature.unwrap_or_default())
            }
            ty => cpp_type(self.model.db, self.model.workspace(), ty).unwrap_or_else(|| "void*".to_owned()),
        }
    }

    /// The type of an operation: `bool(double, ::nav_msgs::Path&)`.
    fn signature(&self, operation: &ClassMember<'db>) -> String {
        let parameter =
            |(direction, ty): &(Direction, Type)| operation_parameter_type(&self.cpp(ty), *direction);
        let parameters: Vec<String> = operation.parameters.iter().map(parameter).collect();
        format!("{}({})", self.cpp(&operation.ty), parameters.join(", "))
    }

    /// Returns the parameters of a program, and declares their names.
    fn parameters(&self, of: &Routine<'db>, names: &mut CppNames<'_>) -> Vec<RoutineParameter> {
        let types = self.model.parameters(self.core, of.parameters);
        let parameter = |(it, (direction, ty)): (&Parameter, (Direction, Type))| {
            let cpp = operation_parameter_type(&self.cpp(&ty), direction);
            let index = self.variable_at(it.name.id).filter(|index| self.named.contains(index));
            let name = names.declare(&it.name.name);
            let named = format!("{cpp} {name}");
            // Compilers warn about unused named parameters.
            let declared = if index.is_some() { named.clone() } else { format!("{cpp} /*{name}*/") };
            RoutineParameter { index, name, declared, named, is_large: is_large(&ty) }
        };
        of.parameters.iter().zip(types).map(parameter).collect()
    }

    fn variable_at(&self, id: SourceId) -> Option<VariableId> {
        self.by_source.get(&id).copied()
    }

    /// Returns a location as comments show it: `components/guidance.mal:25`.
    fn at(&self, of: Decl<'db>, id: SourceId) -> String {
        origin(self.model.db, self.model.workspace(), &Location::Source(of, id))
    }

    /// Returns the text of the model at a location.
    fn source(&self, of: Decl<'db>, id: SourceId) -> String {
        let db = self.model.db;
        let range = Location::Source(of, id).range(db);
        comment(of.file(db).text(db).get(std::ops::Range::<usize>::from(range)).unwrap_or_default())
    }

    /// `core GuidanceCore: components/guidance.mal:33`
    fn declared(&self, of: Decl<'db>) -> String {
        let db = self.model.db;
        format!("{} {}: {}", of.kind(db), of.name(db), self.at(of, SourceId(0)))
    }

    /// The variables of the core or of its machine, with their numbers and names in C++.
    fn variables_of(&self, all: &'db [Variable]) -> Vec<(VariableId, &'db Variable, &str)> {
        let found = all.iter().filter_map(|variable| {
            let index = self.variable_at(variable.name.id)?;
            Some((index, variable, self.variables.get(&index)?.as_str()))
        });
        found.collect()
    }

    fn type_of_variable(&self, id: VariableId) -> Type {
        self.inference.variable(id).map_or(Type::Unknown, |variable| variable.ty.clone())
    }
}

/// Returns whether RTT's scripts cannot set a property of this type: the only integers they know are `int` and `uint`.
pub(crate) fn is_set_from_text(ty: &Type) -> bool {
    matches!(ty, Type::Integer(integer) if !matches!(integer, Integer::Int | Integer::Uint32))
}
