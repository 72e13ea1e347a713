//! The runtime has the observed behaviour of RTT: `analysis/orocos/runtime/README.md`.

use std::path::{Path, PathBuf};
use std::process::Command;

use mauve_tests::orocos::{COMPILERS, build, component_library, configure, is_real, run, try_run};
use mauve_tests::{scratch, write};

/// The project that checks the behaviour.
const CONFORMANCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/orocos/conformance");

fn folder(name: &str) -> PathBuf {
    scratch(env!("CARGO_TARGET_TMPDIR"), &format!("rtt_conformance/{name}"))
}

#[test]
fn orocos_conformance() {
    for compiler in COMPILERS {
        let folder = folder(compiler);
        run(&mut configure(Path::new(CONFORMANCE), &folder, compiler, &[]));
        let built = run(&mut build(&folder));
        assert!(is_real() || !built.contains("warning"), "{built}");
        let library = |name: &str| component_library(&folder, &format!("conformance-{name}"));
        let mut command = Command::new(folder.join("conformance"));
        let said = run(command.arg(library("one")).arg(library("several")));
        let (held, all) = said.trim().strip_suffix(" checks hold").unwrap().split_once(" of ").unwrap();
        assert!(held == all && all.parse::<usize>().unwrap() > 100, "{said}");
    }
}

/// Builds a package whose one component calls a function: with a `CMakeLists.txt` that ends so.
fn package(name: &str, source: &str, end: &str) -> Result<String, String> {
    let folder = folder(name);
    let head = "cmake_minimum_required(VERSION 3.10)\nproject(package CXX)\nset(CMAKE_CXX_STANDARD 14)\n\
        find_package(OROCOS-RTT REQUIRED)\ninclude(${OROCOS-RTT_USE_FILE_PATH}/UseOROCOS-RTT.cmake)\n\
        include_directories(SYSTEM ${OROCOS-RTT_INCLUDE_DIRS})\n";
    let component = "#include <rtt/Component.hpp>\n#include <rtt/TaskContext.hpp>\n\nint codel();\n\nstruct C : RTT::TaskContext {\n  explicit C(const \
        std::string& name) : RTT::TaskContext(name) {}\n  void updateHook() override { codel(); }\n};\n\n\
        ORO_CREATE_COMPONENT(C)\n";
    write(
        &folder,
        &[
            ("source/CMakeLists.txt", format!("{head}{end}")),
            ("source/codel.cpp", source.to_owned()),
            ("source/component.cpp", component.to_owned()),
        ]
        .map(|(path, text)| (path.to_owned(), text)),
    );
    let installed = format!("-DCMAKE_INSTALL_PREFIX={}", folder.join("installed").display());
    let mut configuration = configure(&folder.join("source"), &folder.join("build"), COMPILERS[0], &[]);
    try_run(configuration.arg(installed))?;
    try_run(&mut build(&folder.join("build")))?;
    try_run(build(&folder.join("build")).args(["--target", "install"]))?;
    let files =
        Command::new("find").arg(".").args(["-type", "f"]).current_dir(folder.join("installed")).output();
    let files = String::from_utf8(files.unwrap().stdout).unwrap();
    let mut files: Vec<&str> = files.lines().collect();
    files.sort_unstable();
    Ok(files.join("\n"))
}

#[test]
fn orocos_packages_are_installed_where_a_deployer_looks() {
    let end = "orocos_component(parts component.cpp codel.cpp)\norocos_install_headers(codel.cpp)\n\
        orocos_generate_package()\n";
    assert_eq!(
        package("installed", "int codel() { return 1; }\n", end).unwrap(),
        "./include/orocos/package/codel.cpp\n./lib/orocos/gnulinux/package/libparts-gnulinux.so\n\
         ./lib/pkgconfig/package-gnulinux.pc"
    );
}

#[test]
fn orocos_codels_that_are_missing_do_not_link() {
    let failure = package("undefined", "", "orocos_component(parts component.cpp codel.cpp)\n").unwrap_err();
    assert!(failure.contains("undefined reference to `codel()'"), "{failure}");
}

/// `handle = {}` means an assignment that RTT has, and that does not compile.
#[test]
fn orocos_handles_are_not_emptied_with_braces() {
    let source = |value| {
        format!(
            "#include <rtt/OperationCaller.hpp>\n\nint codel() {{\n  RTT::SendHandle<int(int)> handle;\n  handle = {value};\n  \
             int result = 7;\n  return handle.collectIfDone(result);\n}}\n"
        )
    };
    let end = "orocos_component(parts component.cpp codel.cpp)\n";
    let built = package("handle", &source("decltype(handle)()"), end).map(drop);
    assert_eq!(built, Ok(()));
    let failure = package("braces", &source("{}"), end).unwrap_err();
    assert!(failure.contains("DisposableInterface"), "{failure}");
}

#[test]
fn orocos_components_are_not_linked_with_keywords() {
    let end = "orocos_component(parts component.cpp codel.cpp)\ntarget_link_libraries(parts PRIVATE m)\n";
    let failure = package("keywords", "int codel() { return 1; }\n", end).unwrap_err();
    assert!(failure.replace("\n  ", " ").contains("must be either all-keyword or all-plain"), "{failure}");
}
