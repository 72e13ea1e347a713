//! The way of a declared chain: from its first name through others to its last one.
//!
//! There may be more ways than can be listed: 4⁸ through ten layers of four instances. So the search finds out first which steps lead
//! to the last name at all, whatever instances a way visits, and ends at the second way that differs from the first: the declaration
//! then says too little.
//!
//! Where no way visits each instance once, data goes in a loop: from the driver that reads the robot to a controller, and back to the
//! driver. Then the shortest way counts that visits each instance twice at most, and once more for each name behind the first.

use std::cell::Cell;
use std::collections::VecDeque;

use mauve_hir::{Decl, PassageEnd};
use rustc_hash::FxHashMap;

use super::WayStep;
use super::network::{DataPlace, Network};

/// So many steps are tried for all chains of an architecture together.
pub(super) const MOST_TRIES: usize = 500_000;

/// What a name in a chain means.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum NamedInChain<'db> {
    Instance(usize),
    /// A port or an operation.
    Feature(DataPlace<'db>),
    /// A codel, in the instances that call it.
    Codel(Decl<'db>, Vec<usize>),
}

impl<'db> NamedInChain<'db> {
    /// Returns the instances that it can mean.
    pub(super) fn instances(&self) -> &[usize] {
        match self {
            NamedInChain::Instance(instance) | NamedInChain::Feature((instance, _)) => {
                std::slice::from_ref(instance)
            }
            NamedInChain::Codel(_, instances) => instances,
        }
    }

    /// Returns whether a way that has this step goes through it; whether one that ends with it leads to it if `is_end`.
    fn has(&self, step: &WayStep<'db>, is_end: bool) -> bool {
        let is_there = match self {
            NamedInChain::Feature((_, end)) => step.ends.contains(end),
            NamedInChain::Codel(codel, _) if is_end => step.ends[1] == PassageEnd::Codel(*codel),
            NamedInChain::Instance(_) | NamedInChain::Codel(..) => true,
        };
        is_there && self.instances().contains(&step.instance)
    }
}

/// The ways of a declared chain.
#[derive(Debug, Default)]
pub(super) struct FoundWays<'db> {
    /// All of them, if they differ only in their ends; otherwise up to the first that goes through other instances or connections.
    pub(super) all: Vec<Vec<WayStep<'db>>>,
    /// The last instance that data comes to.
    pub(super) last: Option<usize>,
}

/// Returns whether two ways differ in more than the ends of their steps.
fn is_other_way(one: &[WayStep<'_>], two: &[WayStep<'_>]) -> bool {
    let taken = |way: &[WayStep<'_>]| way.iter().map(|it| (it.instance, it.connection)).collect::<Vec<_>>();
    taken(one) != taken(two)
}

/// A step, behind so many of the names that a way goes through.
#[derive(Debug)]
struct TriedStep<'db> {
    step: WayStep<'db>,
    passed: usize,
    next: Vec<usize>,
}

/// Returns the ways from one of the `first` steps through these names to the last one. None where the budget is exhausted.
pub(super) fn ways<'db>(
    network: &Network<'db>,
    first: Vec<WayStep<'db>>,
    through: &[&NamedInChain<'db>],
    to: &NamedInChain<'db>,
    budget: &Cell<usize>,
) -> Option<FoundWays<'db>> {
    let spend = || budget.get().checked_sub(1).map(|left| budget.set(left));
    let mut tried: Vec<TriedStep<'db>> = Vec::new();
    let mut known: FxHashMap<(WayStep<'db>, usize), usize> = FxHashMap::default();
    let mut index_of = |tried: &mut Vec<TriedStep<'db>>, step: WayStep<'db>, before: usize| {
        let rest = through.iter().skip(before);
        let passed = before + rest.take_while(|it| it.has(&step, false)).count();
        *known.entry((step.clone(), passed)).or_insert_with(|| {
            tried.push(TriedStep { step, passed, next: Vec::new() });
            tried.len() - 1
        })
    };
    let first: Vec<usize> = first.into_iter().map(|step| index_of(&mut tried, step, 0)).collect();
    let leading = network.leading(to.instances());
    let mut number = 0;
    while let Some(TriedStep { step, passed, .. }) = tried.get(number) {
        spend()?;
        let (following, passed) = (network.following(step, &|it| !leading.contains(&it), true), *passed);
        tried[number].next = following.into_iter().map(|it| index_of(&mut tried, it, passed)).collect();
        number += 1;
    }
    let last = tried.last().map(|it| it.step.instance);
    let is_end = |it: &TriedStep<'db>| it.passed == through.len() && to.has(&it.step, true);
    let mut before: Vec<Vec<usize>> = vec![Vec::new(); tried.len()];
    for (number, it) in tried.iter().enumerate() {
        it.next.iter().for_each(|&next| before[next].push(number));
    }
    // The number of steps from each to an end.
    let mut left: Vec<Option<usize>> = vec![None; tried.len()];
    let mut reached: VecDeque<usize> = (0..tried.len()).filter(|&it| is_end(&tried[it])).collect();
    reached.iter().for_each(|&it| left[it] = Some(1));
    while let Some(number) = reached.pop_front() {
        for &it in &before[number] {
            if left[it].is_none() {
                left[it] = left[number].map(|steps| steps + 1);
                reached.push_back(it);
            }
        }
    }
    // The ways of so many steps at most that visit each instance so often at most.
    let search = |most: usize, longest: usize| {
        let mut all: Vec<Vec<WayStep<'db>>> = Vec::new();
        let mut way: Vec<usize> = Vec::new();
        let mut visits: FxHashMap<usize, usize> = FxHashMap::default();
        let mut open = vec![first.clone().into_iter()];
        while let Some(rest) = open.last_mut() {
            let Some(number) = rest.next() else {
                open.pop();
                let last = way.pop().and_then(|it| visits.get_mut(&tried[it].step.instance));
                last.into_iter().for_each(|it| *it -= 1);
                continue;
            };
            let it = &tried[number];
            let visits = visits.entry(it.step.instance).or_default();
            if left[number].is_none_or(|left| way.len() + left > longest) || *visits == most {
                continue;
            }
            spend()?;
            *visits += 1;
            way.push(number);
            if is_end(it) {
                all.push(way.iter().map(|&it| tried[it].step.clone()).collect());
                if all.first().zip(all.last()).is_some_and(|(one, two)| is_other_way(one, two)) {
                    break;
                }
            }
            open.push(it.next.clone().into_iter());
        }
        Some(all)
    };
    let mut all = search(1, usize::MAX)?;
    let most = 1 + through.len().max(1);
    let least = first.iter().filter_map(|&it| left[it]).min().unwrap_or(usize::MAX);
    for longest in least..=most * network.flat.instances.len() {
        if !all.is_empty() {
            break;
        }
        all = search(most, longest)?;
    }
    Some(FoundWays { all, last })
}

#[cfg(test)]
mod tests {
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};

    use crate::chains::{ChainProblem, declared::declared_chains};

    /// The result of each declared chain of `config` in ten layers of four instances. An instance reads all instances of the layer
    /// before it.
    fn problems(config: &str) -> Vec<Result<usize, ChainProblem>> {
        let four = |of: &dyn Fn(usize) -> String| (0..4).map(of).collect::<Vec<_>>().join(" ");
        let ports = four(&|it| format!("input port i{it}: Float64"));
        let body = four(&|it| format!("var v{it}: Float64;")) + " update = { ";
        let body = body + &four(&|it| format!("read(i{it}, v{it});"));
        let mut model = format!(
            "use std_msgs\ncodel look(): Float64\ncodel act(in a: Float64): int\n\
             codel join(in a: Float64, in b: Float64, in c: Float64, in d: Float64): Float64\n\
             shell First {{ output port o: Float64 }}\nshell Middle {{ {ports} output port o: Float64 }}\n\
             core F(First) {{ update = {{ write(o, look()); }} }}\n\
             core M(Middle) {{ {body} write(o, join(v0, v1, v2, v3)); }} }}\n\
             component Source(First, F)\ncomponent Node(Middle, M)\narchitecture A {{\n"
        );
        for layer in 0..10 {
            for it in 0..4 {
                let component = if layer == 0 { "Source" } else { "Node" };
                model += &format!("instance n{layer}_{it}: {component}\n");
                let before = |from| format!("connection n{}_{from}.o -> n{layer}_{it}.i{from}\n", layer - 1);
                model += &(0..4).filter(|_| layer > 0).map(before).collect::<String>();
            }
        }
        problems_in(model + "}", config)
    }

    /// The number of steps of each declared chain in the architecture `A` of a model, or the problem.
    fn problems_in(model: String, config: &str) -> Vec<Result<usize, ChainProblem>> {
        let db = Database::default();
        let files = [("/m.mal".into(), model), ("/mauve.toml".into(), config.to_owned())];
        let project = projects(&db, Workspace::of_texts(&db, "/".into(), files))[0];
        let architecture = names_of(&db, project).anywhere(Kind::Architecture, "A")[0];
        let found = declared_chains(&db, project, architecture).iter();
        found.map(|it| it.way.as_ref().map(|way| way.steps.len()).map_err(|it| it.1.clone())).collect()
    }

    fn chain(name: &str, through: &[String], to: &str) -> String {
        format!("[chains.{name}]\nfrom = \"n0_3\"\nthrough = {through:?}\nto = \"{to}\"\n")
    }

    #[test]
    fn of_many_ways_two_are_enough_to_say_so() {
        let ports = ["n8_0.i0", "n8_1.i0"].map(Into::into).to_vec();
        let chains: String = (0..1000).map(|it| chain(&format!("c{it}"), &[], "n9_3.o")).collect();
        let several = Err(ChainProblem::SeveralWays { through: ports });
        assert_eq!(problems(&chains), vec![several; 1000]);
    }

    #[test]
    fn a_codel_on_the_way_and_at_its_end_is_ambiguous() {
        let model = "use std_msgs
            codel look(): Float64 codel log(in a: Float64): int codel act(in a: Float64): int
            shell S { output port o: Float64 } shell M { input port i: Float64 output port o: Float64 }
            shell E { input port i: Float64 }
            core Look(S) { update = { write(o, look()); } }
            core Pass(M) { var v: Float64; update = { read(i, v); log(v); write(o, v); } }
            core Act(E) { var v: Float64; update = { read(i, v); log(v); act(v); } }
            component Eye(S, Look) component Brain(M, Pass) component Arm(E, Act)
            architecture A { instance eye: Eye instance brain: Brain instance arm: Arm
                connection eye.o -> brain.i connection brain.o -> arm.i }";
        let chain =
            |to: &str| format!("[chains.{}]\nfrom = \"eye.o\"\nto = \"{to}\"\n", to.replace('.', "_"));
        let config = chain("log") + &chain("act") + &chain("arm.log") + &chain("brain.log");
        let instances = ["brain", "arm"].map(Into::into).to_vec();
        let ambiguous = Err(ChainProblem::Ambiguous { codel: "log".into(), instances });
        assert_eq!(problems_in(model.to_owned(), &config), [Ok(3), Ok(3), Ok(2), ambiguous]);
    }

    #[test]
    fn the_only_way_through_all_names_is_found() {
        let all: Vec<String> = (1..9).map(|layer| format!("n{layer}_3")).collect();
        let but_one: Vec<String> = all.iter().filter(|it| *it != "n5_3").cloned().collect();
        let found = problems(&(chain("all", &all, "n9_3.o") + &chain("but_one", &but_one, "n9_3.o")));
        let ports = ["n5_0.i3", "n5_1.i3"].map(Into::into).to_vec();
        assert_eq!(found, [Ok(10), Err(ChainProblem::SeveralWays { through: ports })]);
    }
}
