//! The runtime of standalone programs: the files in `analysis/orocos/runtime`, which `standalone/runtime` is a copy of.

use crate::generated_file::{GeneratedFile, STANDALONE_MARK, ends};

/// Embeds files of the runtime.
macro_rules! files {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_str!(concat!("../runtime/", $path)))),*]
    };
}

/// The path and the text of each file of the runtime.
const FILES: &[(&str, &str)] = files![
    "CMakeLists.txt",
    "README.md",
    "include/mauve/clock.hpp",
    "include/mauve/cpus.hpp",
    "include/mauve/execution.hpp",
    "include/mauve/gateway.hpp",
    "include/mauve/inputs.hpp",
    "include/mauve/lock.hpp",
    "include/mauve/measure.hpp",
    "include/mauve/robot.hpp",
    "include/mauve/stub.hpp",
    "include/mauve/thread.hpp",
    "include/rtt/Activity.hpp",
    "include/rtt/Component.hpp",
    "include/rtt/ConnPolicy.hpp",
    "include/rtt/ExecutionEngine.hpp",
    "include/rtt/FlowStatus.hpp",
    "include/rtt/InputPort.hpp",
    "include/rtt/Logger.hpp",
    "include/rtt/Operation.hpp",
    "include/rtt/OperationCaller.hpp",
    "include/rtt/OutputPort.hpp",
    "include/rtt/Property.hpp",
    "include/rtt/SendHandle.hpp",
    "include/rtt/SendStatus.hpp",
    "include/rtt/Service.hpp",
    "include/rtt/ServiceRequester.hpp",
    "include/rtt/TaskContext.hpp",
    "include/rtt/base/ActivityInterface.hpp",
    "include/rtt/base/PortInterface.hpp",
    "include/rtt/base/PropertyBase.hpp",
    "include/rtt/base/RunnableInterface.hpp",
    "include/rtt/base/TaskCore.hpp",
    "include/rtt/extras/SlaveActivity.hpp",
    "include/rtt/internal/Channel.hpp",
    "include/rtt/internal/Connections.hpp",
    "include/rtt/internal/OperationBody.hpp",
    "include/rtt/internal/SentCall.hpp",
    "include/rtt/os/fosi.h",
    "lib/cmake/orocos-rtt/UseOROCOS-RTT.cmake",
    "lib/cmake/orocos-rtt/orocos-rtt-config-version.cmake",
    "lib/cmake/orocos-rtt/orocos-rtt-config.cmake",
    "src/chains.cpp",
    "src/chains.hpp",
    "src/context.hpp",
    "src/execution.cpp",
    "src/inputs.cpp",
    "src/lock.cpp",
    "src/logger.cpp",
    "src/measure.cpp",
    "src/options.cpp",
    "src/options.hpp",
    "src/other_threads.cpp",
    "src/other_threads.hpp",
    "src/queue.hpp",
    "src/report.cpp",
    "src/report.hpp",
    "src/robot.cpp",
    "src/supervisor.cpp",
    "src/supervisor.hpp",
    "src/task_core.cpp",
    "src/thread.cpp",
    "src/timeline.cpp",
    "src/timeline.hpp",
    "src/trace_file.cpp",
    "src/trace_file.hpp",
    "src/virtual_clock.cpp",
    "src/virtual_clock.hpp",
];

/// The same of the library for topics of ROS 2, which only programs with topics have.
const ROS2_FILES: &[(&str, &str)] = files![
    "ros2/CMakeLists.txt",
    "ros2/include/mauve/cdr.hpp",
    "ros2/include/mauve/ros2.hpp",
    "ros2/src/domain.cpp",
    "ros2/src/domain.hpp",
    "ros2/src/ros2.cpp",
    "ros2/src/samples.cpp",
    "ros2/src/samples.hpp",
];

/// Returns the files of the runtime, each with the mark of the generator.
pub(crate) fn runtime_files(has_topics: bool) -> Vec<GeneratedFile> {
    let file = |&(path, text): &(&str, &str)| {
        let mark = format!("{STANDALONE_MARK}: do not change this file.");
        let text = match path.rsplit('.').next() {
            Some("md") => format!("<!-- {mark} -->\n\n{text}"),
            Some("txt" | "cmake") => format!("# {mark}\n\n{text}"),
            _ => format!("// {mark}\n\n{text}"),
        };
        GeneratedFile::generated(format!("runtime/{path}"), text)
    };
    FILES.iter().chain(if has_topics { ROS2_FILES } else { &[] }).map(file).collect()
}

/// Returns whether a path in `runtime` has the form of one of its files, in this or another version of MAUVE.
pub(crate) fn is_runtime_path(path: &[&str]) -> bool {
    let is_header = |file: &str| ends(file, &[".h", ".hpp"]);
    match *path {
        ["CMakeLists.txt" | "README.md"] | ["ros2", "CMakeLists.txt"] => true,
        ["lib", "cmake", "orocos-rtt", file] => {
            file.strip_suffix(".cmake").is_some_and(|name| name.split('-').all(|part| ends(part, &[""])))
        }
        ["include", "mauve", file] | ["ros2", "include", "mauve", file] => is_header(file),
        ["include", "rtt", file] | ["include", "rtt", "base" | "extras" | "internal" | "os", file] => {
            is_header(file)
        }
        ["src", file] | ["ros2", "src", file] => ends(file, &[".cpp", ".hpp"]),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn all_files_of_the_runtime_are_generated() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("runtime");
        let mut there: Vec<String> = mauve_tests::files_in(&folder)
            .iter()
            .map(|path| path.strip_prefix(&folder).unwrap().to_str().unwrap().replace('\\', "/"))
            .collect();
        there.sort();
        let all = || FILES.iter().chain(ROS2_FILES);
        let mut named: Vec<_> = all().map(|(path, _)| *path).collect();
        named.sort_unstable();
        assert_eq!(named, there);
        for (path, text) in all() {
            assert!(!text.contains(STANDALONE_MARK), "{path}");
        }
    }
}
