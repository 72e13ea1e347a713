//! Generated components do what their models say: random ones are built, run with random inputs, and compared line by line
//! with an interpreter that knows neither the analyser nor the generator.
//!
//! `MAUVE_SEED` gives other components, `MAUVE_MACHINES` more of them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use mauve_hir::{Database, Workspace, projects};
use mauve_orocos::{FileOwner, packages};
use mauve_tests::machines::{
    Component, Library, codels_source, expected_run, program_source, random_library,
};
use mauve_tests::orocos::{build, component_library, configure, run};
use mauve_tests::{scratch, search, write};

/// The CMake code in addition to the generated one: codels and trace points record the execution.
const USER_CMAKE: &str = "\
target_compile_options(machines-components PRIVATE -Wall -Wextra -Werror)
target_include_directories(machines-components BEFORE PRIVATE ${RIG_TRACE})
target_link_libraries(machines-codels PRIVATE recorder)
target_link_libraries(machines-components recorder)
target_precompile_headers(machines-components PRIVATE <rtt/Component.hpp> <rtt/Logger.hpp>)
";

/// Generates the package into a folder, with codels of the test instead of the user's.
fn generate(library: &Library, folder: &Path) {
    let text = library.text();
    write(folder, &[("machines.mal", text.as_str())]);
    let db = Database::default();
    let workspace =
        Workspace::of_texts(&db, "/".into(), vec![(PathBuf::from("/machines.mal"), text.clone())]);
    let project = projects(&db, workspace)[0];
    let packages = packages(&db, project, None).unwrap_or_else(|problems| {
        panic!("{:#?}\n{text}", problems.iter().map(|it| &it.kind).collect::<Vec<_>>())
    });
    let [package] = packages.as_slice() else { panic!("{} packages", packages.len()) };
    let (mut prototypes, mut codels) = (BTreeMap::new(), Vec::new());
    let package_folder = folder.join("package");
    for file in &package.files {
        match &file.owner {
            FileOwner::Generator => write(&package_folder, &[(&file.path, &file.text)]),
            FileOwner::User { prototype } => {
                let name = prototype.split('(').next().unwrap().rsplit(' ').next().unwrap();
                prototypes.insert(name.to_owned(), prototype.clone());
                codels.push((file.path.clone(), String::new()));
            }
        }
    }
    // A word of C++ has a `_` behind it.
    let prototype = |name: &str| {
        let found = prototypes.get(name).or_else(|| prototypes.get(&format!("{name}_")));
        found.unwrap_or_else(|| panic!("no codel {name}")).clone()
    };
    // One file compiles faster than many.
    codels[0].1 = codels_source(library, &prototype);
    write(&package_folder, &codels);
    write(&package_folder, &[("user.cmake", USER_CMAKE)]);
    write(folder, &[("program.cpp".to_owned(), program_source(library))]);
    write(folder, &[("trace/machines/machines-trace.hpp", "#include <trace.hpp>\n")]);
}

/// The lines of each component's run: one component after the other, and then all at once, in threads.
fn runs(folder: &Path, compiler: &str) -> [BTreeMap<String, Vec<String>>; 2] {
    let rig = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/orocos/rig"));
    let built = folder.join("build");
    run(configure(rig, &built, compiler, &[]).args([
        format!("-DPACKAGE={}", folder.join("package").display()),
        format!("-DPROGRAM={}", folder.join("program.cpp").display()),
        format!("-DRIG_TRACE={};{}", folder.join("trace").display(), rig.display()),
        "-DCMAKE_DISABLE_FIND_PACKAGE_catkin=ON".to_owned(),
        "-DCMAKE_UNITY_BUILD=ON".to_owned(),
    ]));
    run(&mut build(&built));
    let library = component_library(&built, "machines-components");
    [&[] as &[&str], &["all at once"]].map(|how| {
        let said = run(Command::new(built.join("rig")).arg(&library).args(how));
        lines_by_component(&said)
    })
}

fn lines_by_component(said: &str) -> BTreeMap<String, Vec<String>> {
    let mut runs: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut name = String::new();
    for line in said.lines() {
        if let Some(next) = line.strip_prefix("== ") {
            name = next.to_owned();
        }
        runs.entry(name.clone()).or_default().push(line.to_owned());
    }
    runs
}

/// The text of one component, for a failure.
fn text_of(library: &Library, component: &Component) -> String {
    Library { codels: library.codels.clone(), components: vec![component.clone()] }.text()
}

/// Events that must occur in the runs of all components together, so that the test covers them.
const SEEN: [&str; 21] = [
    ": configure, ",
    ": start, ",
    ": update, ",
    ": stop, ",
    ": cleanup, ",
    ": operation, ",
    ": entry, ",
    ": run, ",
    ": handle, ",
    ": exit, ",
    ": guard, ",
    ": effect, ",
    "> component ",
    " codel machines.",
    "configure true",
    "configure false",
    "start true",
    "served ",
    "done ",
    "refused ",
    "out ",
];

fn components_do_what_their_models_say(seed: u64, compiler: &str) {
    let seed = seed + search::seed();
    let count: u64 = search::cases("MAUVE_MACHINES", 25);
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("machines_{compiler}"));
    let library = random_library(seed, count as usize);
    generate(&library, &folder);
    let [mut runs, all_at_once] = runs(&folder, compiler);
    for (name, lines) in &runs {
        assert!(
            all_at_once.get(name) == Some(lines),
            "seed {seed}: {name} behaves differently beside the others"
        );
    }
    assert_eq!(runs.len(), all_at_once.len());
    let mut seen: BTreeSet<&str> = BTreeSet::new();
    for component in &library.components {
        let expected = expected_run(&library, component).unwrap();
        let found = runs.remove(&component.name).unwrap_or_default();
        let same = expected.iter().zip(&found).take_while(|(expected, found)| expected == found).count();
        if same < expected.len().max(found.len()) {
            let show = |lines: &[String]| {
                let part = lines.iter().skip(same.saturating_sub(12)).take(16);
                part.map(|line| format!("    {line}\n")).collect::<String>()
            };
            panic!(
                "seed {seed}, {}, line {same}\nexpected\n{}found\n{}{}\nin {}",
                component.name,
                show(&expected),
                show(&found),
                text_of(&library, component),
                folder.display()
            );
        }
        seen.extend(SEEN.into_iter().filter(|what| found.iter().any(|line| line.contains(what))));
    }
    assert_eq!(runs.keys().collect::<Vec<_>>(), Vec::<&String>::new(), "runs of no component");
    if count >= 25 {
        let missing: Vec<&str> = SEEN.into_iter().filter(|what| !seen.contains(what)).collect();
        assert!(missing.is_empty(), "no component did {missing:?}");
    }
}

#[test]
fn orocos_components_of_gcc_do_what_their_models_say() {
    components_do_what_their_models_say(1, "g++");
}

#[test]
fn orocos_components_of_clang_do_what_their_models_say() {
    components_do_what_their_models_say(2, "clang++");
}
