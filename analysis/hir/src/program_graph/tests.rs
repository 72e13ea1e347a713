//! Random programs, executed as they are written and as graphs: both do the same calls in the same order, with the same values. And
//! no variable has been assigned where the data flow says that none is.
//!
//! What a call returns and assigns is drawn from its number. The interpreter of the text knows nothing of graphs: names, scopes,
//! short circuits and the order of operands are its own.

use proptest::prelude::*;
use proptest::test_runner::TestRng;
use rustc_hash::FxHashSet;

use super::*;
use crate::fact::FactKind;
use crate::item_tree::{Kind, Program};
use crate::names::names_of;
use crate::source::Location;
use crate::{Database, Workspace, declaration_facts, projects};

/// The codels, each with the directions of its parameters and whether it returns a bool.
const CODELS: [(&str, &[Direction], bool); 5] = [
    ("get", &[], false),
    ("ask", &[Direction::In], true),
    ("sum", &[Direction::In, Direction::In], false),
    ("fill", &[Direction::Out, Direction::In], false),
    ("step", &[Direction::InOut], true),
];

/// The shared variables: three numbers and three bools.
const SHARED: [&str; 6] = ["i0", "i1", "i2", "b0", "b1", "b2"];

/// What a program has done.
#[derive(Debug, Default, PartialEq)]
struct Done {
    /// Its calls with the values that they get; none for an output.
    calls: Vec<(String, Vec<Option<i32>>)>,
    /// The values of the shared variables at the end.
    end: Vec<i32>,
}

impl Done {
    /// Does a call; returns the values of its result and of its outputs.
    fn call(&mut self, name: &str, arguments: Vec<Option<i32>>, is_bool: bool) -> (i32, i32) {
        self.calls.push((name.to_owned(), arguments));
        let drawn = (self.calls.len() as i32).wrapping_mul(7919) / 3 % 11;
        (if is_bool { drawn % 2 } else { drawn - 5 }, drawn - 3)
    }
}

fn binary(operator: BinaryOperator, left: i32, right: i32) -> i32 {
    match operator {
        BinaryOperator::Add => left.wrapping_add(right),
        BinaryOperator::Subtract => left.wrapping_sub(right),
        BinaryOperator::Multiply => left.wrapping_mul(right),
        BinaryOperator::Less => (left < right).into(),
        BinaryOperator::GreaterOrEqual => (left >= right).into(),
        BinaryOperator::Equal => (left == right).into(),
        BinaryOperator::NotEqual => (left != right).into(),
        _ => panic!("{operator:?} is not drawn"),
    }
}

fn unary(operator: UnaryOperator, value: i32) -> i32 {
    match operator {
        UnaryOperator::Not => 1 - value,
        UnaryOperator::Minus => value.wrapping_neg(),
    }
}

/// Executes a program as it is written. Without a value, a variable begins with 0.
struct Interpreter {
    /// The variables of each open block, outermost first, each with whether it was assigned.
    scopes: Vec<Vec<(Name, i32, bool)>>,
    done: Done,
    /// The reads of variables that were assigned.
    assigned: FxHashSet<SourceId>,
}

impl Interpreter {
    fn variable(&mut self, name: &Name) -> &mut (Name, i32, bool) {
        let all = self.scopes.iter_mut().rev().flat_map(|scope| scope.iter_mut().rev());
        all.into_iter().find(|it| it.0 == *name).unwrap()
    }

    fn assign(&mut self, name: &Name, value: i32) {
        let variable = self.variable(name);
        (variable.1, variable.2) = (value, true);
    }

    /// Returns whether the program ends.
    fn block(&mut self, statements: &[Statement]) -> bool {
        self.scopes.push(Vec::new());
        let ends = statements.iter().any(|it| self.statement(it));
        self.scopes.pop();
        ends
    }

    fn statement(&mut self, statement: &Statement) -> bool {
        match statement {
            Statement::Variable(variable) => {
                let value = variable.value.as_ref().map_or(0, |it| self.value(it));
                let has_value = variable.value.is_some();
                self.scopes.last_mut().unwrap().push((variable.name.name.clone(), value, has_value));
            }
            Statement::If { condition, then, otherwise, .. } => {
                let value = self.value(condition);
                let otherwise = otherwise.as_deref().unwrap_or_default();
                return self.block(if value == 1 { then } else { otherwise });
            }
            Statement::Block(inner) => return self.block(inner),
            Statement::Return(..) => return true,
            Statement::Assign(target, value) => {
                let value = self.value(value);
                self.assign(&target.name, value);
            }
            Statement::Expr(value) => _ = self.value(value),
        }
        false
    }

    fn value(&mut self, expr: &Expr) -> i32 {
        match expr {
            Expr::Literal(Literal::Int(text), _) => text.parse().unwrap(),
            Expr::Literal(Literal::Bool(value), _) => (*value).into(),
            Expr::Name(name) => {
                let (_, value, is_assigned) = *self.variable(&name.name);
                self.assigned.extend(is_assigned.then_some(name.id));
                value
            }
            Expr::Unary(operator, inner, _) => unary(*operator, self.value(inner)),
            Expr::Binary(BinaryOperator::And, left, right, _) => {
                if self.value(left) == 1 {
                    self.value(right)
                } else {
                    0
                }
            }
            Expr::Binary(BinaryOperator::Or, left, right, _) => {
                if self.value(left) == 1 {
                    1
                } else {
                    self.value(right)
                }
            }
            Expr::Binary(operator, left, right, _) => {
                let left = self.value(left);
                binary(*operator, left, self.value(right))
            }
            Expr::Call { callee, arguments, .. } => {
                let (_, directions, is_bool) = CODELS.iter().find(|it| it.0 == &*callee.name).unwrap();
                let directions = || arguments.iter().zip(*directions);
                // Inputs from left to right; the others by reference.
                let inputs = directions().map(|(it, direction)| match direction {
                    Direction::In => Some(self.value(it)),
                    _ => None,
                });
                let mut values: Vec<Option<i32>> = inputs.collect();
                for ((argument, direction), value) in directions().zip(&mut values) {
                    if *direction == Direction::InOut {
                        *value = Some(self.value(argument));
                    }
                }
                let (result, output) = self.done.call(&callee.name, values, *is_bool);
                for (argument, direction) in directions() {
                    if let (Expr::Name(name), true) = (argument, *direction != Direction::In) {
                        self.assign(&name.name, output);
                    }
                }
                result
            }
            it => panic!("{it:?} is not drawn"),
        }
    }
}

/// Executes the graph of a program.
struct Machine<'a, 'db> {
    db: &'db dyn ModelDb,
    graph: &'a ProgramGraph<'db>,
    registers: Vec<i32>,
    done: Done,
}

impl Machine<'_, '_> {
    fn value(&self, term: u32) -> i32 {
        match self.graph.term(term) {
            Term::Bool(value) | Term::Decided(value, _) => value.into(),
            Term::Int(value) => value,
            Term::Register(register, _) => self.registers[register as usize],
            Term::Unary(operator, inner) => unary(operator, self.value(inner)),
            Term::Binary(operator, left, right) => binary(operator, self.value(left), self.value(right)),
            it => panic!("{it:?} is not drawn"),
        }
    }

    fn run(&mut self) {
        let mut next = self.graph.start;
        loop {
            let node = &self.graph.nodes[next as usize];
            next = node.next;
            match &node.action {
                Action::Nothing => {}
                Action::Branch { condition, fails, .. } => {
                    if self.value(*condition) != 1 {
                        next = *fails;
                    }
                }
                Action::Assign { to, value } => {
                    self.registers[*to as usize] = value.map_or(0, |it| self.value(it));
                }
                Action::Call(call) => {
                    let values = call.arguments.iter().map(|it| match it.direction {
                        Direction::Out => None,
                        _ => Some(self.value(it.value)),
                    });
                    let values = values.collect();
                    let Some(Callee::Codel(codel)) = call.callee else { panic!("{call:?}") };
                    let name = codel.name(self.db).clone();
                    let (_, _, is_bool) = CODELS.iter().find(|it| it.0 == &*name).unwrap();
                    let (result, output) = self.done.call(&name, values, *is_bool);
                    self.registers[call.result as usize] = result;
                    for argument in call.arguments.iter().filter(|it| it.direction != Direction::In) {
                        self.registers[argument.variable.unwrap() as usize] = output;
                    }
                }
                Action::Return(_) => return,
            }
        }
    }
}

/// Draws a program.
struct Drawn {
    random: TestRng,
    text: String,
    /// The numbers and the bools of each open block.
    names: Vec<[Vec<String>; 2]>,
    declared: usize,
}

impl Drawn {
    fn below(&mut self, end: u32) -> u32 {
        self.random.next_u32() % end
    }

    fn name(&mut self, is_bool: bool) -> String {
        let all: Vec<&String> = self.names.iter().flat_map(|it| &it[usize::from(is_bool)]).collect();
        let index = self.random.next_u32() as usize % all.len();
        all[index].clone()
    }

    fn expr(&mut self, is_bool: bool, depth: u32) -> String {
        let pick = self.below(if depth == 0 { 3 } else { 10 });
        let inner = depth.saturating_sub(1);
        match (pick, is_bool) {
            (0, true) if self.below(3) == 0 => (self.below(2) == 0).to_string(),
            (0, false) => self.below(7).to_string(),
            (0..=2, _) => self.name(is_bool),
            (3, true) => format!("!({})", self.expr(true, inner)),
            (3, false) => format!("-({})", self.expr(false, inner)),
            (4..=6, true) => {
                let operator = ["&&", "||"][self.below(2) as usize];
                format!("({} {operator} {})", self.expr(true, inner), self.expr(true, inner))
            }
            (4..=5, false) => {
                let operator = ["+", "-", "*"][self.below(3) as usize];
                format!("({} {operator} {})", self.expr(false, inner), self.expr(false, inner))
            }
            (7, true) => {
                let operator = ["<", ">=", "==", "!="][self.below(4) as usize];
                format!("({} {operator} {})", self.expr(false, inner), self.expr(false, inner))
            }
            _ => self.call(is_bool, inner),
        }
    }

    fn call(&mut self, is_bool: bool, depth: u32) -> String {
        let fitting: Vec<_> = CODELS.iter().filter(|it| it.2 == is_bool).collect();
        let (name, directions, _) = fitting[self.below(fitting.len() as u32) as usize];
        let argument = |it: &Direction| match it {
            Direction::In => self.expr(false, depth),
            _ => self.name(false),
        };
        format!("{name}({})", directions.iter().map(argument).collect::<Vec<_>>().join(", "))
    }

    fn block(&mut self, depth: u32) {
        self.text += "{ ";
        self.names.push(Default::default());
        for _ in 0..self.below(4) {
            self.statement(depth);
        }
        self.names.pop();
        self.text += "} ";
    }

    fn statement(&mut self, depth: u32) {
        let is_bool = self.below(2) == 0;
        match self.below(if depth == 0 { 6 } else { 10 }) {
            0 | 1 => {
                // An inner variable may have the name of an outer one.
                let is_new = self.names.len() == 1 || self.below(2) == 0;
                self.declared += usize::from(is_new);
                let name = if is_new { format!("v{}", self.declared) } else { self.name(is_bool) };
                let own = self.names.last().unwrap();
                if own.iter().flatten().any(|it| *it == name) {
                    return;
                }
                let ty = if is_bool { "bool" } else { "int" };
                let value =
                    if self.below(4) > 0 { format!(" = {}", self.expr(is_bool, 2)) } else { String::new() };
                self.text += &format!("var {name}: {ty}{value}; ");
                self.names.last_mut().unwrap()[usize::from(is_bool)].push(name);
            }
            2 | 3 => {
                let (name, value) = (self.name(is_bool), self.expr(is_bool, 3));
                self.text += &format!("{name} = {value}; ");
            }
            4 | 5 if self.below(6) == 0 => self.text += "return; ",
            4 | 5 => {
                let call = self.call(is_bool, 2);
                self.text += &format!("{call}; ");
            }
            6 => self.block(depth - 1),
            _ => {
                let condition = self.expr(true, 3);
                self.text += &format!("if {condition} then ");
                self.block(depth - 1);
                if self.below(2) == 0 {
                    self.text += "else ";
                    self.block(depth - 1);
                }
            }
        }
    }
}

/// Returns the model of a core with this program.
fn model(program: &str) -> String {
    let mut text = String::new();
    for (name, directions, is_bool) in CODELS {
        let parameters =
            directions.iter().zip(["x", "y"]).map(|(it, name)| format!("{} {name}: int", it.keyword()));
        let result = if is_bool { "bool" } else { "int" };
        text += &format!("codel {name}({}): {result}\n", parameters.collect::<Vec<_>>().join(", "));
    }
    let variables =
        SHARED.map(|it| format!("  var {it}: {}\n", if it.starts_with('b') { "bool" } else { "int" }));
    format!("{text}shell S {{ }}\ncore C(S) {{\n{}  update = {program}\n}}\n", variables.concat())
}

fn check(program: &str) {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), model(program))]);
    let project = projects(&db, workspace)[0];
    let core = names_of(&db, project).anywhere(Kind::Core, "C")[0];
    let hook = BodyId::Hook(0);
    let graph = graph_of(&db, project, core, hook, ProgramIn::Whole).unwrap();
    let tree = crate::source::core(&db, core).unwrap();
    let Program { statements, completeness, .. } = &tree.hooks[0].program;
    assert!(completeness.is_complete(), "{program}");

    let outermost = SHARED.map(|it| (Name::from(it), 0, false)).to_vec();
    let mut interpreter =
        Interpreter { scopes: vec![outermost], done: Done::default(), assigned: FxHashSet::default() };
    interpreter.block(statements);
    let Interpreter { mut scopes, mut done, assigned } = interpreter;
    done.end = scopes.remove(0).into_iter().map(|(_, value, _)| value).collect();

    let mut machine =
        Machine { db: &db, graph, registers: vec![0; graph.registers.len()], done: Done::default() };
    machine.run();
    let Machine { registers, done: mut of_graph, .. } = machine;
    // A shared variable without a register is not used.
    let value = |index: u32| {
        let is_it = |it: &Register| it.variable == Some(VariableId { group: None, index });
        graph.registers.iter().position(is_it).map_or(0, |it| registers[it])
    };
    of_graph.end = (0..SHARED.len() as u32).map(value).collect();
    assert_eq!(of_graph, done, "{program}");

    for fact in declaration_facts(&db, project, core) {
        if let (FactKind::ReadBeforeAssignment { name, .. }, Location::Source(_, id)) = (&fact.kind, &fact.at)
        {
            assert!(!assigned.contains(id), "{name} is assigned: {program}");
        }
    }
}

#[test]
fn operands_and_arguments_are_evaluated_from_left_to_right() {
    check("{ i0 = 1; i1 = i0 + fill(i0, i0) + i0; i2 = sum(i0, fill(i0, 3)); }");
    check("{ b0 = b1 && ask(i0) || !(step(i1) && ask(i1)); if b0 || step(i0) then { return; } get(); }");
    check("{ var i0: int = i0 + 1; { var i0: int; i0 = 4; } sum(i0, i1); }");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, ..ProptestConfig::default() })]
    #[test]
    fn a_graph_does_what_the_text_says(random in any::<()>().prop_perturb(|(), random| random)) {
        let mut drawn = Drawn { random, text: String::new(), names: Vec::new(), declared: 0 };
        let of = |prefix: char| SHARED.into_iter().filter(move |it| it.starts_with(prefix)).map(str::to_owned);
        drawn.names.push([of('i').collect(), of('b').collect()]);
        drawn.block(4);
        check(&drawn.text);
    }
}
