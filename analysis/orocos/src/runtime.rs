//! The runtime of standalone programs: the files in `analysis/orocos/runtime`, which `standalone/runtime` is a copy of.

use crate::generated_file::{GeneratedFile, STANDALONE_MARK, ends};

/// The path and the text of each file of the runtime, which `build.rs` lists.
const FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/runtime.rs"));

/// The folder of the library for topics of ROS 2, which only programs with topics have.
const ROS2: &str = "ros2/";

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
    FILES.iter().filter(|(path, _)| has_topics || !path.starts_with(ROS2)).map(file).collect()
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
            .map(|path| path.strip_prefix(&folder).unwrap().to_str().unwrap().to_owned())
            .collect();
        there.sort();
        let mut named: Vec<_> = FILES.iter().map(|(path, _)| *path).collect();
        named.sort_unstable();
        assert_eq!(named, there);
        for (path, text) in FILES {
            assert!(is_runtime_path(&path.split('/').collect::<Vec<_>>()), "{path}");
            assert!(!text.contains(STANDALONE_MARK), "{path}");
        }
    }
}
