//! What the jobs of a component execute, folded to any figure that adds up along paths: a number of executions, a distribution of
//! time. `psm.rs` folds it to times, with the reasons for which it cannot.

use mauve_hir::{
    Behaviour, Cost, Decl, ModelDb, ProductCost, ProgramId, Project, behaviour_of, core_of, product_of,
};

use crate::reason::Timed;

/// A figure that adds up along paths.
pub(crate) trait Figure<'db> {
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
pub(crate) fn folded<'db, F: Figure<'db>>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
    figure: &F,
) -> Option<Folded<F::Value>> {
    let core = core_of(db, project, component)?;
    let behaviour = behaviour_of(db, project, core);
    let nothing = Folding::both(figure.sum(&[]));
    let mut folder = Folder { component, figure, operations: vec![nothing; behaviour.operations.len()] };
    // Callees first.
    for &index in &behaviour.order {
        if let Some(operation) = behaviour.operations.get(index) {
            folder.operations[index] = folder.program(&operation.id, folder.cost(&operation.cost));
        }
    }
    let edges = match product_of(db, project, core) {
        Some(product) => {
            let mut all: Vec<Folding<F::Value>> = Vec::with_capacity(product.costs.len());
            for cost in &product.costs {
                let found = folder.product(behaviour, &all, cost);
                all.push(found);
            }
            let of = |cost: u32| Some(all.get(cost as usize)?.all.clone());
            product.edges.iter().map(|edge| of(edge.cost)).collect::<Option<_>>()?
        }
        None => {
            let programs = behaviour.programs.iter();
            let programs: Vec<_> =
                programs.map(|it| folder.program(&it.id, folder.cost(&it.cost)).all).collect();
            let of = |edge| {
                let parts: Option<Vec<_>> =
                    behaviour.edges.programs(edge).map(|it| programs.get(it).cloned()).collect();
                Some(figure.sum(&parts?))
            };
            behaviour.edges.all.iter().map(of).collect::<Option<_>>()?
        }
    };
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

struct Folder<'a, 'db, F: Figure<'db>> {
    component: Decl<'db>,
    figure: &'a F,
    operations: Vec<Folding<F::Value>>,
}

impl<'db, F: Figure<'db>> Folder<'_, 'db, F> {
    /// Joins parts with a function of the figure.
    fn joined(
        &self,
        parts: &[Folding<F::Value>],
        join: fn(&F, &[F::Value]) -> F::Value,
    ) -> Folding<F::Value> {
        let of = |part: fn(&Folding<F::Value>) -> &F::Value| {
            join(self.figure, &parts.iter().map(|it| part(it).clone()).collect::<Vec<_>>())
        };
        Folding { all: of(|it| &it.all), waits: of(|it| &it.waits) }
    }

    /// Returns the figure of a program whose parts have this one.
    fn program(&self, id: &ProgramId, parts: Folding<F::Value>) -> Folding<F::Value> {
        match self.figure.of(&Timed::Program(self.component, id.in_table())) {
            Some(own) => Folding { all: self.figure.sum(&[own, parts.waits.clone()]), waits: parts.waits },
            None => parts,
        }
    }

    fn cost(&self, cost: &Cost<'db>) -> Folding<F::Value> {
        let nothing = || self.figure.sum(&[]);
        match cost {
            Cost::Codel(codel) => {
                let waits = self.figure.of(&Timed::Wait(*codel));
                let all: Vec<F::Value> =
                    self.figure.of(&Timed::Codel(*codel)).into_iter().chain(waits.clone()).collect();
                Folding { all: self.figure.sum(&all), waits: waits.unwrap_or_else(nothing) }
            }
            Cost::Operation(index) => {
                self.operations.get(*index).cloned().unwrap_or_else(|| Folding::both(nothing()))
            }
            Cost::Access(port) => {
                let all = self.figure.of(&Timed::Access(self.component, port.clone()));
                Folding { all: all.unwrap_or_else(nothing), waits: nothing() }
            }
            Cost::Send(_) => Folding::both(nothing()),
            Cost::Sum(costs) => self.joined(&self.costs(costs), F::sum),
            Cost::Greatest(costs) => self.joined(&self.costs(costs), F::greatest),
        }
    }

    fn costs(&self, costs: &[Cost<'db>]) -> Vec<Folding<F::Value>> {
        costs.iter().map(|cost| self.cost(cost)).collect()
    }

    /// Returns the figure of a cost of a product; it refers to earlier ones only.
    fn product(
        &self,
        behaviour: &Behaviour<'db>,
        all: &[Folding<F::Value>],
        cost: &ProductCost<'db>,
    ) -> Folding<F::Value> {
        let of = |index: &u32| {
            let found = all.get(*index as usize).cloned();
            found.unwrap_or_else(|| Folding::both(self.figure.sum(&[])))
        };
        let program = |id: Option<&ProgramId>, inner| match id {
            Some(id) => self.program(id, of(inner)),
            None => of(inner),
        };
        match cost {
            ProductCost::One(cost) => self.cost(cost),
            ProductCost::Sum(one, other) => self.joined(&[of(one), of(other)], F::sum),
            ProductCost::Greatest(one, other) => self.joined(&[of(one), of(other)], F::greatest),
            ProductCost::Program(index, inner) => {
                program(behaviour.programs.get(*index).map(|it| &it.id), inner)
            }
            ProductCost::Operation(index, inner) => {
                program(behaviour.operations.get(*index).map(|it| &it.id), inner)
            }
        }
    }
}
