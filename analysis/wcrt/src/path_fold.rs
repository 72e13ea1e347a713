//! What the jobs of a component execute, folded to any figure that adds up along paths: a number of executions, a distribution of
//! time. `psm.rs` folds it to times, with the reasons for which it cannot.

use mauve_hir::{
    Behaviour, Cost, Decl, Execution, ModelDb, ProgramId, Project, behaviour_of, core_of, fold, product_of,
};

use crate::reason::Timed;

/// A figure that adds up along paths.
pub(crate) trait PathFigure<'db> {
    /// Its values.
    type Value: Clone;
    /// Returns that of one execution of a subject of the tables; `None` where they have no entry for it.
    fn of(&self, timed: &Timed<'db>) -> Option<Self::Value>;
    /// Returns that of several executions, one after the other.
    fn sum(&self, parts: &[Self::Value]) -> Self::Value;
    /// Returns an upper bound of several alternatives.
    fn greatest(&self, parts: &[Self::Value]) -> Self::Value;
}

/// The figures of a component.
pub(crate) struct Folded<V> {
    /// Of each edge of its state machine, in the order of [`crate::Psm::machine`].
    pub(crate) edges: Vec<V>,
    /// Of each operation of its core.
    pub(crate) operations: Vec<V>,
}

/// Folds what a component executes; `None` if that is unknown.
pub(crate) fn folded<'db, F: PathFigure<'db>>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
    figure: &F,
) -> Option<Folded<F::Value>> {
    let core = core_of(db, project, component)?;
    let behaviour = behaviour_of(db, project, core);
    let nothing = Folding::both(figure.sum(&[]));
    let mut folder =
        PathFolder { component, behaviour, figure, operations: vec![nothing; behaviour.operations.len()] };
    // Callees first.
    for &index in &behaviour.order {
        if let Some(operation) = behaviour.operations.get(index) {
            let parts = folder.parts(&operation.cost.parts);
            let cost = parts.get(operation.cost.root as usize)?.clone();
            folder.operations[index] = folder.program(Some(&operation.id), cost);
        }
    }
    let product = product_of(db, project, core);
    let all = folder.parts(&product.costs);
    let edges = product.edges.iter().map(|edge| Some(all.get(edge.cost as usize)?.all.clone()));
    let edges = edges.collect::<Option<_>>()?;
    Some(Folded { edges, operations: folder.operations.into_iter().map(|it| it.all).collect() })
}

/// The figure of all executions, and that of the waits alone: these count where a table has the time of a whole program.
#[derive(Clone)]
struct Folding<V> {
    all: V,
    waits: V,
}

impl<V: Clone> Folding<V> {
    fn both(value: V) -> Folding<V> {
        Folding { waits: value.clone(), all: value }
    }
}

struct PathFolder<'a, 'db, F: PathFigure<'db>> {
    component: Decl<'db>,
    behaviour: &'a Behaviour<'db>,
    figure: &'a F,
    operations: Vec<Folding<F::Value>>,
}

impl<'db, F: PathFigure<'db>> PathFolder<'_, 'db, F> {
    /// Joins parts with a function of the figure.
    fn joined(
        &self,
        parts: [Folding<F::Value>; 2],
        join: fn(&F, &[F::Value]) -> F::Value,
    ) -> Folding<F::Value> {
        let [one, other] = parts;
        Folding {
            all: join(self.figure, &[one.all, other.all]),
            waits: join(self.figure, &[one.waits, other.waits]),
        }
    }

    /// Returns the figure of a program whose parts have this one.
    fn program(&self, id: Option<&ProgramId>, parts: Folding<F::Value>) -> Folding<F::Value> {
        let timed = id.map(|id| Timed::Program(self.component, id.in_table()));
        match timed.and_then(|it| self.figure.of(&it)) {
            Some(own) => Folding { all: self.figure.sum(&[own, parts.waits.clone()]), waits: parts.waits },
            None => parts,
        }
    }

    /// Returns the figures of the parts of a cost.
    fn parts(&self, parts: &[Cost<'db>]) -> Vec<Folding<F::Value>> {
        let nothing = || self.figure.sum(&[]);
        fold(parts, |part, known: &[Folding<F::Value>]| {
            let of = |index: &u32| {
                let found = known.get(*index as usize).cloned();
                found.unwrap_or_else(|| Folding::both(nothing()))
            };
            match part {
                Cost::Nothing | Cost::One(Execution::Send(_)) => Folding::both(nothing()),
                Cost::One(Execution::Codel(codel)) => {
                    let waits = self.figure.of(&Timed::Wait(*codel));
                    let all: Vec<F::Value> =
                        self.figure.of(&Timed::Codel(*codel)).into_iter().chain(waits.clone()).collect();
                    Folding { all: self.figure.sum(&all), waits: waits.unwrap_or_else(nothing) }
                }
                Cost::One(Execution::Access(port)) => {
                    let all = self.figure.of(&Timed::Access(self.component, port.clone()));
                    Folding { all: all.unwrap_or_else(nothing), waits: nothing() }
                }
                Cost::One(Execution::Operation(index)) => {
                    self.operations.get(*index).cloned().unwrap_or_else(|| Folding::both(nothing()))
                }
                Cost::Sum(one, other) => self.joined([of(one), of(other)], F::sum),
                Cost::Greatest(one, other) => self.joined([of(one), of(other)], F::greatest),
                Cost::Program(index, inner) => {
                    self.program(self.behaviour.programs.get(*index).map(|it| &it.id), of(inner))
                }
                Cost::Operation(index, inner) => {
                    self.program(self.behaviour.operations.get(*index).map(|it| &it.id), of(inner))
                }
            }
        })
    }
}
