//! Build files of a package: `package.xml`, `CMakeLists.txt`, and the entry point of a library of components.
//!
//! A package builds with catkin if catkin is installed, and with plain CMake otherwise. Its codels are a separate
//! shared library, so packages whose components call them do not link its components:
//!
//! ```text
//! motion-codels       src/codels/*.cpp, the user's, and include/motion: what other packages link
//! motion-components   the components, for the deployer
//! ```

use std::collections::BTreeSet;

use crate::codels::headers_of;
use crate::cpp_type::Headers;
use crate::deployment::topic_package;
use crate::escape::xml;
use crate::generated_file::{GeneratedFile, MARK, generated_from};
use crate::library::{Libraries, Library, Model};
use crate::template::{filled, flag, lines};

/// Returns the build files of a package that has these other files.
pub(crate) fn build_files(model: Model<'_, '_>, files: &[GeneratedFile]) -> Vec<GeneratedFile> {
    let library = model.library;
    let headers = headers_of(model);
    let build = PackageBuild {
        calls: names_of(model.libraries, &library.calls),
        has_codels: !library.codels.is_empty(),
        has_components: !library.components.is_empty(),
        uses_rtt: !library.components.is_empty() || headers.paths.iter().any(|path| path.starts_with("rtt/")),
        library,
        headers,
        files,
    };
    let mut all = vec![
        GeneratedFile::generated("package.xml".to_owned(), package_xml(model, &build)),
        GeneratedFile::generated("CMakeLists.txt".to_owned(), build.cmake_lists()),
    ];
    if library.components.len() > 1 {
        let template = include_str!("../templates/components.cpp");
        all.push(GeneratedFile::from_template(&library.package, COMPONENT_LIBRARY, template));
    }
    all
}

/// The file through which the deployer loads several components.
const COMPONENT_LIBRARY: &str = "src/{lib}-components.cpp";

fn names_of<'a>(libraries: &'a Libraries<'_>, numbers: &BTreeSet<usize>) -> Vec<&'a str> {
    numbers.iter().filter_map(|&index| Some(libraries.all.get(index)?.package.as_str())).collect()
}

/// Returns the element of the maintainer of a package, and its licence.
pub(crate) fn about_package(model: Model<'_, '_>) -> (String, String) {
    let config = model.config();
    // Without a configured maintainer and licence, the values are those that catkin's tools write.
    let maintainer = match &config.maintainer {
        Some(it) => {
            // catkin puts the name into a text of CMake as it is, where these signs end it or run something.
            let name = it.name.replace('"', "'").replace(['$', '\\'], "/");
            format!("<maintainer email=\"{}\">{}</maintainer>", xml(&it.email), xml(&name))
        }
        None => "<maintainer email=\"user@todo.todo\">user</maintainer>".to_owned(),
    };
    let license = xml(config.license.as_deref().unwrap_or("TODO"));
    (maintainer, license)
}

fn package_xml(model: Model<'_, '_>, build: &PackageBuild<'_, '_>) -> String {
    let Model { library, .. } = model;
    let config = model.config();
    let (maintainer, license) = about_package(model);
    let depends: BTreeSet<&str> = build
        .headers
        .packages
        .iter()
        .map(|it| it.as_str())
        .chain(build.calls.iter().copied())
        .chain(build.uses_rtt.then_some("rtt"))
        .collect();
    let mut exec_depends: BTreeSet<String> = BTreeSet::new();
    if config.ros_streams != Some(false) {
        exec_depends.extend(packages_of_ports(model).iter().map(|it| format!("rtt_{it}")));
        if config.introspection != Some(false) && build.has_components {
            exec_depends.insert("rtt_std_msgs".to_owned());
        }
    }
    if !library.deployments.is_empty() {
        exec_depends.extend(["ocl", "rtt_ros"].map(str::to_owned));
        if config.ros_streams != Some(false) {
            exec_depends.extend(["rtt_roscomm", "rtt_rosnode"].map(str::to_owned));
        }
    }
    exec_depends.extend(names_of(model.libraries, &library.runs).into_iter().map(str::to_owned));
    let runs = exec_depends.iter().filter(|it| !depends.contains(it.as_str()));
    // The packages that `ros.import` of rtt_ros imports together with this package.
    let plugins = exec_depends.iter().filter(|it| it.starts_with("rtt_"));
    let values = [
        ("mark", MARK.to_owned()),
        ("lib", library.package.clone()),
        ("parts", parts(library)),
        ("maintainer", maintainer),
        ("license", license),
        ("depends", lines(depends.iter().map(|it| format!("  <depend>{it}</depend>")))),
        ("runs", lines(runs.map(|it| format!("  <exec_depend>{it}</exec_depend>")))),
        ("plugins", lines(plugins.map(|it| format!("      <plugin_depend>{it}</plugin_depend>")))),
    ];
    filled(include_str!("../templates/package.xml"), &values)
}

/// Returns the message packages whose typekits are needed to stream ports to topics.
fn packages_of_ports(model: Model<'_, '_>) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for &(component, _) in &model.library.components {
        for feature in model.features(component).into_iter().filter(|it| it.kind.is_port()) {
            let ty = feature.data(model.db).and_then(|it| it.ty.as_ref());
            found.extend(topic_package(&model.type_of(feature.shell, ty)));
        }
    }
    found
}

/// Returns what a package has: `components and codels`.
fn parts(library: &Library<'_>) -> String {
    let parts = [
        ("components", library.components.len()),
        ("codels", library.codels.len()),
        ("deployments", library.deployments.len()),
    ];
    let parts: Vec<&str> = parts.iter().filter(|(_, number)| *number > 0).map(|(name, _)| *name).collect();
    match parts.as_slice() {
        [others @ .., last] if !others.is_empty() => format!("{} and {last}", others.join(", ")),
        parts => parts.join(""),
    }
}

/// What the build files of a package depend on.
struct PackageBuild<'a, 'db> {
    library: &'a Library<'db>,
    calls: Vec<&'a str>,
    headers: Headers,
    has_codels: bool,
    has_components: bool,
    uses_rtt: bool,
    files: &'a [GeneratedFile],
}

impl PackageBuild<'_, '_> {
    fn cmake_lists(&self) -> String {
        let Library { package, codels, components, .. } = self.library;
        let messages: Vec<&str> = self.headers.packages.iter().map(|it| it.as_str()).collect();
        let messages = messages.join(" ");
        let exported = match (self.has_codels, messages.as_str()) {
            (false, _) => String::new(),
            (true, "") => format!("INCLUDE_DIRS include LIBRARIES {package}-codels"),
            (true, all) => format!("INCLUDE_DIRS include LIBRARIES {package}-codels CATKIN_DEPENDS {all}"),
        };
        let sources = components.iter().map(|(_, name)| format!("  {name}/{name}-component.cpp"));
        let entry = (components.len() > 1).then(|| format!("  src/{package}-components.cpp"));
        // RTT's own macros link without a keyword, and CMake does not let the two be mixed.
        let mut linked = String::new();
        if self.has_codels {
            linked += &format!(" {package}-codels");
        }
        if !self.calls.is_empty() {
            linked += " ${called_codels}";
        }
        if !messages.is_empty() {
            linked += " ${message_libraries}";
        }
        let targets = match (self.has_codels, self.has_components) {
            (true, true) => format!("targets {package}-codels and {package}-components are"),
            (true, false) => format!("target {package}-codels is"),
            (false, true) => format!("target {package}-components is"),
            (false, false) => String::new(),
        };
        let has = |folder: &str| {
            let mut paths = self.files.iter().filter_map(|file| file.path.strip_prefix(folder));
            paths.any(|rest| rest.starts_with('/'))
        };
        let folders: Vec<&str> = ["launch", "models", "scripts"].into_iter().filter(|it| has(it)).collect();
        let values = [
            ("generated", generated_from(package)),
            ("lib", package.clone()),
            ("rtt", flag(self.uses_rtt)),
            ("messages", messages),
            ("calls", self.calls.join(" ")),
            ("exported", exported),
            ("codels", lines(codels.iter().map(|(_, name)| format!("  src/codels/{name}.cpp")))),
            ("components", lines(sources.chain(entry))),
            ("linked", linked),
            ("folders", folders.join(" ")),
            ("targets", targets),
        ];
        filled(include_str!("../templates/CMakeLists.txt"), &values)
    }
}
