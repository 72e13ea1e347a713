//! The tracing of a package: spans of its components, programs, codels and accesses of ports, and its locks, recorded by LTTng-UST.
//!
//! With the option `MAUVE_TRACING` every step of a component, every program and every codel is an event where it begins
//! (`phase` 0) and one where it ends (`phase` 1), with the CPU time that its thread has used so far: the difference is an
//! execution time that no preemption is in. Without the option the macros of the header leave nothing behind.
//!
//! **One provider per package**, `mauve_<package>`: several packages are loaded into one deployer, and LTTng-UST has no
//! place for two providers of one name in a process. Up to 2.10 it aborts ("Duplicate registration"), and since 2.11 each
//! package's events count as definitions of the same ones, and everything is recorded once for each of them (seen with
//! 2.13). `lttng enable-event -u 'mauve*'` enables them all.
//!
//! **The header knows no LTTng**, whose headers define macros such as `tracepoint`, which a model may use as names. The
//! functions of the provider also keep a span that nobody records cheap: a call and a branch, and no clock is read (1 ns,
//! where a recorded event takes 500, 370 of them for the clock of a thread's CPU time).
//!
//! **What is counted.** The clock is the last thing that is read before a beginning is recorded, and the first when it
//! ends: a span counts about 500 ns of its own tracing, and 1 µs for each span inside of it. So times are rather too long
//! than too short.
//!
//! **Waits.** The begin and the end of a codel have how often its thread gave up the CPU by its own will so far: a system call of about
//! 300 ns, outside of the execution time of the codel, and within that of its program. A span without such a wait was only preempted.
//! A lock has one event, when it is left: locks are no brackets. The codels of a package are in a library of their own, which is loaded
//! without the provider, too: the header of locks refers to its functions weakly.
//!
//! **Scheduling.** The begin of a period has the real-time priority of its thread and the CPUs that the thread may use, as the
//! kernel has them at that time: two system calls, only where a session records the event, and before the clock is read. (The
//! C library keeps a copy of the priority, which misses changes by other programs such as `chrt`.)
//!
//! **Balance.** A span whose beginning nobody recorded does not record its end, and one that an exception leaves does: so
//! begins and ends are brackets in each thread. Two things break them: a session that ends before a span does leaves a
//! beginning without an end at the end of its trace, and one that starts within a span that another session already
//! records sees an end without a beginning at its start. (Lost events do too; `babeltrace2` says where.)
//!
//! **No text is empty**: babeltrace2 up to 2.0.4 shows the text of an earlier event in its place. A program that has no
//! state or no transition has `-` there.
//!
//! Works with LTTng-UST 2.7 and later: it had no enumerations, so a phase is a number, and no macros with `LTTNG_UST_`, and
//! later versions still know those without.

use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, ModelDb, ProgramId};

use crate::escape::cpp_string;
use crate::generated_file::GeneratedFile;
use crate::library::Library;

/// Returns the header, that of locks, the events and their provider; none for a library without components.
pub(crate) fn trace_files(library: &Library<'_>) -> Vec<GeneratedFile> {
    if library.components.is_empty() {
        return Vec::new();
    }
    let files = [
        ("include/{lib}/{lib}-trace.hpp", include_str!("../templates/trace.hpp")),
        ("include/{lib}/{lib}-lock.hpp", include_str!("../templates/lock.hpp")),
        ("tracing/{lib}-tp.h", include_str!("../templates/tp.h")),
        ("tracing/{lib}-tp.c", include_str!("../templates/tp.c")),
    ];
    files.map(|(path, template)| GeneratedFile::from_template(&library.package, path, template)).into()
}

/// Returns the name of a codel in a trace, as a C++ literal.
pub(crate) fn codel_key(db: &dyn ModelDb, codel: Decl<'_>) -> String {
    cpp_string(&codel.qualified(db))
}

/// Returns the name of a port in a trace, as a C++ literal: that of its component, a dot and its own.
pub(crate) fn port_key(db: &dyn ModelDb, component: Decl<'_>, port: &Name) -> String {
    cpp_string(&format!("{}.{port}", component.qualified(db)))
}

/// Returns the names of a program in a trace, as C++ literals: component, state, transition and program.
pub(crate) fn program_key(db: &dyn ModelDb, component: Decl<'_>, program: &ProgramId) -> String {
    let [state, transition, program] = span_of(program).map(cpp_string);
    format!("{}, {state}, {transition}, {program}", cpp_string(&component.qualified(db)))
}

fn span_of(program: &ProgramId) -> [&str; 3] {
    match program {
        ProgramId::Hook(kind) => ["", "", kind.keyword()],
        ProgramId::Operation(name) => ["", name, "operation"],
        ProgramId::Method { state, kind } => [state, "", kind.keyword()],
        ProgramId::Guard { state, transition } => [state, transition, "guard"],
        ProgramId::Effect { state, transition } => [state, transition, "effect"],
    }
}
