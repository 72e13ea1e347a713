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

use mauve_hir::item_tree::Name;

use crate::codels::headers_of;
use crate::cpp_type::Headers;
use crate::deployment::topic_package;
use crate::escape::xml;
use crate::generated_file::{GeneratedFile, MARK, generated_from};
use crate::library::{Libraries, Library, Model};

/// Returns the build files of a package that has these other files.
pub(crate) fn build_files(model: Model<'_, '_>, files: &[GeneratedFile]) -> Vec<GeneratedFile> {
    let library = model.library;
    let calls = names_of(model.libraries, &library.calls);
    let build = Build { library, calls, headers: headers_of(model), files };
    let mut texts = vec![
        ("package.xml".to_owned(), package_xml(model, &build)),
        ("CMakeLists.txt".to_owned(), build.cmake_lists()),
    ];
    if library.components.len() > 1 {
        let package = &library.package;
        texts.push((format!("src/{package}-components.cpp"), component_library(package)));
    }
    texts.into_iter().map(|(path, text)| GeneratedFile::generated(path, text)).collect()
}

fn names_of<'a>(libraries: &'a Libraries<'_>, numbers: &BTreeSet<usize>) -> Vec<&'a str> {
    numbers.iter().filter_map(|&index| Some(libraries.all.get(index)?.package.as_str())).collect()
}

fn component_library(package: &str) -> String {
    format!(
        "// {}\n//\n\
         // The entry point through which the deployer loads the components of this library.\n\n\
         #include <rtt/Component.hpp>\n\nORO_CREATE_COMPONENT_LIBRARY()\n",
        generated_from(package)
    )
}

fn package_xml(model: Model<'_, '_>, build: &Build<'_, '_>) -> String {
    let Model { library, .. } = model;
    let package = &library.package;
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

    let mut depends: BTreeSet<String> = build.headers.packages.iter().map(ToString::to_string).collect();
    depends.extend(build.calls.iter().map(|&it| it.to_owned()));
    if build.uses_rtt() {
        depends.insert("rtt".to_owned());
    }
    let mut exec_depends: BTreeSet<String> = BTreeSet::new();
    if config.ros_streams != Some(false) {
        exec_depends.extend(packages_of_ports(model).iter().map(|it| format!("rtt_{it}")));
        if config.introspection != Some(false) && !library.components.is_empty() {
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

    let mut out = format!(
        "<?xml version=\"1.0\"?>\n\
         <!-- {MARK} {package}: change the model, or mauve.toml, not this file. -->\n\
         <package format=\"2\">\n  <name>{package}</name>\n  <version>0.0.0</version>\n  \
         <description>{}</description>\n  {maintainer}\n  <license>{license}</license>\n\n  \
         <buildtool_depend>catkin</buildtool_depend>\n",
        description(library),
    );
    for (tag, packages) in
        [("depend", &depends), ("exec_depend", &exec_depends.difference(&depends).cloned().collect())]
    {
        if !packages.is_empty() {
            out.push('\n');
        }
        packages.iter().for_each(|it| out += &format!("  <{tag}>{it}</{tag}>\n"));
    }
    // The packages that `ros.import` of rtt_ros imports together with this package.
    let plugins: Vec<&String> = exec_depends.iter().filter(|it| it.starts_with("rtt_")).collect();
    if !plugins.is_empty() {
        out += "\n  <export>\n    <rtt_ros>\n";
        plugins.iter().for_each(|it| out += &format!("      <plugin_depend>{it}</plugin_depend>\n"));
        out += "    </rtt_ros>\n  </export>\n";
    }
    out + "</package>\n"
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

fn description(library: &Library<'_>) -> String {
    let parts = [
        ("components", library.components.len()),
        ("codels", library.codels.len()),
        ("deployments", library.deployments.len()),
    ];
    let parts: Vec<&str> = parts.iter().filter(|(_, number)| *number > 0).map(|(name, _)| *name).collect();
    let parts = match parts.as_slice() {
        [others @ .., last] if !others.is_empty() => format!("{} and {last}", others.join(", ")),
        parts => parts.join(""),
    };
    format!("The {parts} of library {} of a MAUVE model, for Orocos.", library.package)
}

struct Build<'a, 'db> {
    library: &'a Library<'db>,
    calls: Vec<&'a str>,
    headers: Headers,
    files: &'a [GeneratedFile],
}

impl Build<'_, '_> {
    fn has_codels(&self) -> bool {
        !self.library.codels.is_empty()
    }

    fn has_components(&self) -> bool {
        !self.library.components.is_empty()
    }

    fn has_targets(&self) -> bool {
        self.has_codels() || self.has_components()
    }

    fn uses_rtt(&self) -> bool {
        self.has_components() || self.headers.paths.iter().any(|path| path.starts_with("rtt/"))
    }

    fn has(&self, folder: &str) -> bool {
        self.files.iter().any(|file| file.path.strip_prefix(folder).is_some_and(|it| it.starts_with('/')))
    }

    fn cmake_lists(&self) -> String {
        let package = &self.library.package;
        let mut out = format!("# {}\n", generated_from(package));
        if self.has_targets() {
            out += "#\n# Put dependencies of codels, such as other libraries, into user.cmake in this folder: \
                see the end.\n";
        }
        out += &format!(
            "\ncmake_minimum_required(VERSION 3.10...3.25)\nproject({package} VERSION 0.0.0 LANGUAGES C CXX)\n"
        );
        if self.has_targets() {
            self.settings(&mut out);
        }
        out += "\n# A catkin package if catkin is installed; plain CMake otherwise, or with ORO_USE_CATKIN \
            off.\n\
                if(NOT DEFINED ORO_USE_CATKIN)\n  find_package(catkin QUIET)\n  \
                set(ORO_USE_CATKIN ${catkin_FOUND})\n\
                elseif(ORO_USE_CATKIN)\n  find_package(catkin REQUIRED)\nendif()\n";
        self.dependencies(&mut out);
        self.catkin_package(&mut out);
        if self.uses_rtt() {
            self.rtt(&mut out);
        }
        if self.has_codels() {
            self.codels(&mut out);
        }
        if self.has_components() {
            self.components(&mut out);
        }
        self.installed(&mut out);
        if self.has_targets() {
            let targets = match (self.has_codels(), self.has_components()) {
                (true, true) => format!("targets {package}-codels and {package}-components are"),
                (true, false) => format!("target {package}-codels is"),
                _ => format!("target {package}-components is"),
            };
            out += &format!(
                "\n# Your additions, if the file exists: {targets} defined at this point.\n\
                 include(${{CMAKE_CURRENT_SOURCE_DIR}}/user.cmake OPTIONAL)\n"
            );
        }
        if self.uses_rtt() {
            out += "\norocos_generate_package()\n";
        }
        out
    }

    fn settings(&self, out: &mut String) {
        if self.has_components() {
            *out += "\noption(MAUVE_TRACING \"Record programs, states and codels with LTTng\" OFF)\n";
        }
        *out += "\n# RTT's headers are not valid C++20: they have a method named `requires`, which is a \
            keyword there.\n\
                 if(NOT CMAKE_CXX_STANDARD)\n  set(CMAKE_CXX_STANDARD 14)\nendif()\n\
                 set(CMAKE_CXX_STANDARD_REQUIRED ON)\nset(CMAKE_CXX_EXTENSIONS OFF)\n";
    }

    /// Writes the includes and libraries as variables of this file, so that several packages can be built together.
    fn dependencies(&self, out: &mut String) {
        if self.uses_rtt() {
            *out += "\nif(NOT OROCOS_TARGET AND \"$ENV{OROCOS_TARGET}\" STREQUAL \"\")\n  \
                     set(OROCOS_TARGET gnulinux CACHE STRING \"The target that RTT was built for\")\nendif()\n\
                     find_package(OROCOS-RTT REQUIRED)\n";
        }
        if self.has_messages() {
            let all: Vec<&str> = self.headers.packages.iter().map(Name::as_str).collect();
            *out += &format!(
                "\nset(message_include_dirs)\nset(message_libraries)\nset(message_targets)\n\
                 foreach(package {})\n  find_package(${{package}} REQUIRED CONFIG)\n  \
                 list(APPEND message_include_dirs ${{${{package}}_INCLUDE_DIRS}})\n  \
                 list(APPEND message_libraries ${{${{package}}_LIBRARIES}})\n  \
                 list(APPEND message_targets ${{${{package}}_EXPORTED_TARGETS}})\nendforeach()\n\
                 include_directories(SYSTEM ${{message_include_dirs}})\n",
                all.join(" ")
            );
        }
        if !self.calls.is_empty() {
            *out += &format!(
                "\n# The codels of other packages: built in the same workspace, or installed.\n\
                 set(called_codels)\nforeach(package {})\n  if(NOT TARGET ${{package}}-codels)\n    \
                 find_package(${{package}} REQUIRED CONFIG)\n    \
                 include_directories(${{${{package}}_INCLUDE_DIRS}})\n  endif()\n  \
                 if(TARGET ${{package}}-codels)\n    list(APPEND called_codels ${{package}}-codels)\n  else()\n    \
                 list(APPEND called_codels ${{${{package}}_LIBRARIES}})\n  endif()\nendforeach()\n",
                self.calls.join(" ")
            );
        }
    }

    fn catkin_package(&self, out: &mut String) {
        let package = &self.library.package;
        *out += "\nif(ORO_USE_CATKIN)\n";
        if self.has_codels() {
            let all: Vec<&str> = self.headers.packages.iter().map(Name::as_str).collect();
            let messages =
                if all.is_empty() { String::new() } else { format!(" CATKIN_DEPENDS {}", all.join(" ")) };
            *out += &format!("  catkin_package(INCLUDE_DIRS include LIBRARIES {package}-codels{messages})\n");
        } else {
            *out += "  catkin_package()\n";
        }
        *out += "else()\n  install(FILES package.xml DESTINATION share/${PROJECT_NAME})\nendif()\n";
    }

    fn rtt(&self, out: &mut String) {
        *out += "\n# Components link only the codels that they call from other packages.\n\
                 set(OROCOS_NO_AUTO_LINKING ON CACHE BOOL \"Link no components of other packages\")\n\
                 include(${OROCOS-RTT_USE_FILE_PATH}/UseOROCOS-RTT.cmake)\n\
                 include_directories(SYSTEM ${OROCOS-RTT_INCLUDE_DIRS})\n";
    }

    fn has_messages(&self) -> bool {
        !self.headers.packages.is_empty()
    }

    /// Writes the dependency of a target on the messages of the workspace, which must be generated first.
    fn after_messages(&self, out: &mut String, target: &str) {
        if self.has_messages() {
            *out +=
                &format!("if(message_targets)\n  add_dependencies({target} ${{message_targets}})\nendif()\n");
        }
    }

    fn codels(&self, out: &mut String) {
        let package = &self.library.package;
        *out += &format!("\n# The codels, written by the user.\nadd_library({package}-codels SHARED\n");
        self.library.codels.iter().for_each(|(_, name)| *out += &format!("  src/codels/{name}.cpp\n"));
        *out += &format!(
            ")\ntarget_include_directories({package}-codels PUBLIC\n  \
             $<BUILD_INTERFACE:${{CMAKE_CURRENT_SOURCE_DIR}}/include>\n  $<INSTALL_INTERFACE:include>\n)\n"
        );
        if self.has_messages() {
            *out += &format!(
                "target_include_directories({package}-codels SYSTEM PUBLIC ${{message_include_dirs}})\n\
                 target_link_libraries({package}-codels PUBLIC ${{message_libraries}})\n"
            );
        }
        if self.uses_rtt() {
            *out += &format!("target_link_libraries({package}-codels PRIVATE ${{OROCOS-RTT_LIBRARIES}})\n");
        }
        *out += &format!(
            "if(UNIX AND NOT APPLE)\n  # A codel without a definition is a link error, instead of an error \
             when the robot starts.\n  \
             set_target_properties({package}-codels PROPERTIES LINK_FLAGS \"-Wl,-z,defs\")\nendif()\n"
        );
        self.after_messages(out, &format!("{package}-codels"));
        *out += &format!(
            "install(TARGETS {package}-codels EXPORT {package}-codels\n  \
             ARCHIVE DESTINATION lib LIBRARY DESTINATION lib RUNTIME DESTINATION bin\n)\n\
             if(NOT ORO_USE_CATKIN)\n  install(EXPORT {package}-codels FILE {package}Config.cmake\n    \
             DESTINATION share/${{PROJECT_NAME}}/cmake\n  )\nendif()\n"
        );
    }

    fn components(&self, out: &mut String) {
        let package = &self.library.package;
        *out +=
            &format!("\n# The components, loaded by the deployer.\norocos_component({package}-components\n");
        for (_, name) in &self.library.components {
            *out += &format!("  {name}/{name}-component.cpp\n");
        }
        if self.library.components.len() > 1 {
            *out += &format!("  src/{package}-components.cpp\n");
        }
        let own = if self.has_codels() { format!(" {package}-codels") } else { String::new() };
        let called = if self.calls.is_empty() { "" } else { " ${called_codels}" };
        let messages = if self.has_messages() { " ${message_libraries}" } else { "" };
        // RTT's own macros link without a keyword, and CMake does not let the two be mixed.
        *out += &format!(
            ")\ntarget_include_directories({package}-components PRIVATE include)\n\
             target_link_libraries({package}-components{own}{called}{messages})\n"
        );
        self.after_messages(out, &format!("{package}-components"));
        *out += &format!(
            "if(MAUVE_TRACING)\n  find_package(LTTngUST REQUIRED)\n  \
             target_sources({package}-components PRIVATE tracing/{package}-tp.c)\n  \
             target_compile_definitions({package}-components PRIVATE MAUVE_TRACING)\n  \
             target_include_directories({package}-components PRIVATE tracing)\n  \
             target_link_libraries({package}-components LTTng::UST ${{CMAKE_DL_LIBS}})\nendif()\n"
        );
    }

    fn installed(&self, out: &mut String) {
        let package = &self.library.package;
        if self.has_codels() {
            let headers = ["types", "codels"].map(|it| format!("  include/{package}/{package}-{it}.hpp\n"));
            let headers = headers.concat();
            *out += &match self.uses_rtt() {
                true => format!("\norocos_install_headers(\n{headers}  INSTALL include/{package}\n)\n"),
                false => format!("\ninstall(FILES\n{headers}  DESTINATION include/{package}\n)\n"),
            };
        }
        let folders: Vec<&str> =
            ["launch", "models", "scripts"].into_iter().filter(|it| self.has(it)).collect();
        if !folders.is_empty() {
            *out +=
                &format!("\ninstall(DIRECTORY {} DESTINATION share/${{PROJECT_NAME}})\n", folders.join(" "));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use expect_test::{Expect, expect};
    use mauve_hir::{Database, Workspace, projects};

    use crate::packages;

    const MODEL: &str = "\
//- /mauve.toml
[generate]
maintainer = \"Ada Lovelace <ada@example.org>\"
license = \"BSD & others\"
//- /robot.mal
library kinematics { codel clearance(in bearing: double): double }
library motion {
  use kinematics
  use geometry_msgs
  codel steer(in gap: double): TwistStamped
  shell S { output port command: TwistStamped }
  core K(S) { update = { write(command, steer(clearance(0.0))); } }
  component Pilot(S, K)
  component Copilot(S, K)
}
library robot {
  use motion
  architecture A { instance pilot: Pilot }
  deployment D { architecture A  activity pilot { priority = 1 period = 100 } }
}
";

    fn check(package: &str, path: &str, expected: Expect) {
        let db = Database::default();
        let texts = mauve_tests::fixture(MODEL).into_iter().map(|(path, text)| (PathBuf::from(path), text));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let packages = packages(&db, projects(&db, workspace)[0], None).unwrap();
        let package = packages.iter().find(|it| it.name == package).unwrap();
        expected.assert_eq(&package.files.iter().find(|file| file.path == path).unwrap().text);
    }

    #[test]
    fn a_package_with_all() {
        check(
            "motion",
            "package.xml",
            expect![[r#"
                <?xml version="1.0"?>
                <!-- Generated by `mauve generate` from library motion: change the model, or mauve.toml, not this file. -->
                <package format="2">
                  <name>motion</name>
                  <version>0.0.0</version>
                  <description>The components and codels of library motion of a MAUVE model, for Orocos.</description>
                  <maintainer email="ada@example.org">Ada Lovelace</maintainer>
                  <license>BSD &amp; others</license>

                  <buildtool_depend>catkin</buildtool_depend>

                  <depend>geometry_msgs</depend>
                  <depend>kinematics</depend>
                  <depend>rtt</depend>

                  <exec_depend>rtt_geometry_msgs</exec_depend>
                  <exec_depend>rtt_std_msgs</exec_depend>

                  <export>
                    <rtt_ros>
                      <plugin_depend>rtt_geometry_msgs</plugin_depend>
                      <plugin_depend>rtt_std_msgs</plugin_depend>
                    </rtt_ros>
                  </export>
                </package>
            "#]],
        );
        check(
            "motion",
            "CMakeLists.txt",
            expect![[r##"
                # Generated by `mauve generate` from library motion: change the model, not this file.
                #
                # Put dependencies of codels, such as other libraries, into user.cmake in this folder: see the end.

                cmake_minimum_required(VERSION 3.10...3.25)
                project(motion VERSION 0.0.0 LANGUAGES C CXX)

                option(MAUVE_TRACING "Record programs, states and codels with LTTng" OFF)

                # RTT's headers are not valid C++20: they have a method named `requires`, which is a keyword there.
                if(NOT CMAKE_CXX_STANDARD)
                  set(CMAKE_CXX_STANDARD 14)
                endif()
                set(CMAKE_CXX_STANDARD_REQUIRED ON)
                set(CMAKE_CXX_EXTENSIONS OFF)

                # A catkin package if catkin is installed; plain CMake otherwise, or with ORO_USE_CATKIN off.
                if(NOT DEFINED ORO_USE_CATKIN)
                  find_package(catkin QUIET)
                  set(ORO_USE_CATKIN ${catkin_FOUND})
                elseif(ORO_USE_CATKIN)
                  find_package(catkin REQUIRED)
                endif()

                if(NOT OROCOS_TARGET AND "$ENV{OROCOS_TARGET}" STREQUAL "")
                  set(OROCOS_TARGET gnulinux CACHE STRING "The target that RTT was built for")
                endif()
                find_package(OROCOS-RTT REQUIRED)

                set(message_include_dirs)
                set(message_libraries)
                set(message_targets)
                foreach(package geometry_msgs)
                  find_package(${package} REQUIRED CONFIG)
                  list(APPEND message_include_dirs ${${package}_INCLUDE_DIRS})
                  list(APPEND message_libraries ${${package}_LIBRARIES})
                  list(APPEND message_targets ${${package}_EXPORTED_TARGETS})
                endforeach()
                include_directories(SYSTEM ${message_include_dirs})

                # The codels of other packages: built in the same workspace, or installed.
                set(called_codels)
                foreach(package kinematics)
                  if(NOT TARGET ${package}-codels)
                    find_package(${package} REQUIRED CONFIG)
                    include_directories(${${package}_INCLUDE_DIRS})
                  endif()
                  if(TARGET ${package}-codels)
                    list(APPEND called_codels ${package}-codels)
                  else()
                    list(APPEND called_codels ${${package}_LIBRARIES})
                  endif()
                endforeach()

                if(ORO_USE_CATKIN)
                  catkin_package(INCLUDE_DIRS include LIBRARIES motion-codels CATKIN_DEPENDS geometry_msgs)
                else()
                  install(FILES package.xml DESTINATION share/${PROJECT_NAME})
                endif()

                # Components link only the codels that they call from other packages.
                set(OROCOS_NO_AUTO_LINKING ON CACHE BOOL "Link no components of other packages")
                include(${OROCOS-RTT_USE_FILE_PATH}/UseOROCOS-RTT.cmake)
                include_directories(SYSTEM ${OROCOS-RTT_INCLUDE_DIRS})

                # The codels, written by the user.
                add_library(motion-codels SHARED
                  src/codels/steer.cpp
                )
                target_include_directories(motion-codels PUBLIC
                  $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
                  $<INSTALL_INTERFACE:include>
                )
                target_include_directories(motion-codels SYSTEM PUBLIC ${message_include_dirs})
                target_link_libraries(motion-codels PUBLIC ${message_libraries})
                target_link_libraries(motion-codels PRIVATE ${OROCOS-RTT_LIBRARIES})
                if(UNIX AND NOT APPLE)
                  # A codel without a definition is a link error, instead of an error when the robot starts.
                  set_target_properties(motion-codels PROPERTIES LINK_FLAGS "-Wl,-z,defs")
                endif()
                if(message_targets)
                  add_dependencies(motion-codels ${message_targets})
                endif()
                install(TARGETS motion-codels EXPORT motion-codels
                  ARCHIVE DESTINATION lib LIBRARY DESTINATION lib RUNTIME DESTINATION bin
                )
                if(NOT ORO_USE_CATKIN)
                  install(EXPORT motion-codels FILE motionConfig.cmake
                    DESTINATION share/${PROJECT_NAME}/cmake
                  )
                endif()

                # The components, loaded by the deployer.
                orocos_component(motion-components
                  Pilot/Pilot-component.cpp
                  Copilot/Copilot-component.cpp
                  src/motion-components.cpp
                )
                target_include_directories(motion-components PRIVATE include)
                target_link_libraries(motion-components motion-codels ${called_codels} ${message_libraries})
                if(message_targets)
                  add_dependencies(motion-components ${message_targets})
                endif()
                if(MAUVE_TRACING)
                  find_package(LTTngUST REQUIRED)
                  target_sources(motion-components PRIVATE tracing/motion-tp.c)
                  target_compile_definitions(motion-components PRIVATE MAUVE_TRACING)
                  target_include_directories(motion-components PRIVATE tracing)
                  target_link_libraries(motion-components LTTng::UST ${CMAKE_DL_LIBS})
                endif()

                orocos_install_headers(
                  include/motion/motion-types.hpp
                  include/motion/motion-codels.hpp
                  INSTALL include/motion
                )

                install(DIRECTORY models DESTINATION share/${PROJECT_NAME})

                # Your additions, if the file exists: targets motion-codels and motion-components are defined at this point.
                include(${CMAKE_CURRENT_SOURCE_DIR}/user.cmake OPTIONAL)

                orocos_generate_package()
            "##]],
        );
        check(
            "motion",
            "src/motion-components.cpp",
            expect![[r#"
            // Generated by `mauve generate` from library motion: change the model, not this file.
            //
            // The entry point through which the deployer loads the components of this library.

            #include <rtt/Component.hpp>

            ORO_CREATE_COMPONENT_LIBRARY()
        "#]],
        );
    }

    #[test]
    fn codels_alone_need_no_rtt() {
        check(
            "kinematics",
            "package.xml",
            expect![[r#"
            <?xml version="1.0"?>
            <!-- Generated by `mauve generate` from library kinematics: change the model, or mauve.toml, not this file. -->
            <package format="2">
              <name>kinematics</name>
              <version>0.0.0</version>
              <description>The codels of library kinematics of a MAUVE model, for Orocos.</description>
              <maintainer email="ada@example.org">Ada Lovelace</maintainer>
              <license>BSD &amp; others</license>

              <buildtool_depend>catkin</buildtool_depend>
            </package>
        "#]],
        );
        check(
            "kinematics",
            "CMakeLists.txt",
            expect![[r##"
                # Generated by `mauve generate` from library kinematics: change the model, not this file.
                #
                # Put dependencies of codels, such as other libraries, into user.cmake in this folder: see the end.

                cmake_minimum_required(VERSION 3.10...3.25)
                project(kinematics VERSION 0.0.0 LANGUAGES C CXX)

                # RTT's headers are not valid C++20: they have a method named `requires`, which is a keyword there.
                if(NOT CMAKE_CXX_STANDARD)
                  set(CMAKE_CXX_STANDARD 14)
                endif()
                set(CMAKE_CXX_STANDARD_REQUIRED ON)
                set(CMAKE_CXX_EXTENSIONS OFF)

                # A catkin package if catkin is installed; plain CMake otherwise, or with ORO_USE_CATKIN off.
                if(NOT DEFINED ORO_USE_CATKIN)
                  find_package(catkin QUIET)
                  set(ORO_USE_CATKIN ${catkin_FOUND})
                elseif(ORO_USE_CATKIN)
                  find_package(catkin REQUIRED)
                endif()

                if(ORO_USE_CATKIN)
                  catkin_package(INCLUDE_DIRS include LIBRARIES kinematics-codels)
                else()
                  install(FILES package.xml DESTINATION share/${PROJECT_NAME})
                endif()

                # The codels, written by the user.
                add_library(kinematics-codels SHARED
                  src/codels/clearance.cpp
                )
                target_include_directories(kinematics-codels PUBLIC
                  $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
                  $<INSTALL_INTERFACE:include>
                )
                if(UNIX AND NOT APPLE)
                  # A codel without a definition is a link error, instead of an error when the robot starts.
                  set_target_properties(kinematics-codels PROPERTIES LINK_FLAGS "-Wl,-z,defs")
                endif()
                install(TARGETS kinematics-codels EXPORT kinematics-codels
                  ARCHIVE DESTINATION lib LIBRARY DESTINATION lib RUNTIME DESTINATION bin
                )
                if(NOT ORO_USE_CATKIN)
                  install(EXPORT kinematics-codels FILE kinematicsConfig.cmake
                    DESTINATION share/${PROJECT_NAME}/cmake
                  )
                endif()

                install(FILES
                  include/kinematics/kinematics-types.hpp
                  include/kinematics/kinematics-codels.hpp
                  DESTINATION include/kinematics
                )

                # Your additions, if the file exists: target kinematics-codels is defined at this point.
                include(${CMAKE_CURRENT_SOURCE_DIR}/user.cmake OPTIONAL)
            "##]],
        );
    }

    #[test]
    fn deployments_alone_are_installed() {
        check(
            "robot",
            "package.xml",
            expect![[r#"
                <?xml version="1.0"?>
                <!-- Generated by `mauve generate` from library robot: change the model, or mauve.toml, not this file. -->
                <package format="2">
                  <name>robot</name>
                  <version>0.0.0</version>
                  <description>The deployments of library robot of a MAUVE model, for Orocos.</description>
                  <maintainer email="ada@example.org">Ada Lovelace</maintainer>
                  <license>BSD &amp; others</license>

                  <buildtool_depend>catkin</buildtool_depend>

                  <exec_depend>motion</exec_depend>
                  <exec_depend>ocl</exec_depend>
                  <exec_depend>rtt_ros</exec_depend>
                  <exec_depend>rtt_roscomm</exec_depend>
                  <exec_depend>rtt_rosnode</exec_depend>

                  <export>
                    <rtt_ros>
                      <plugin_depend>rtt_ros</plugin_depend>
                      <plugin_depend>rtt_roscomm</plugin_depend>
                      <plugin_depend>rtt_rosnode</plugin_depend>
                    </rtt_ros>
                  </export>
                </package>
            "#]],
        );
        check(
            "robot",
            "CMakeLists.txt",
            expect![[r#"
                # Generated by `mauve generate` from library robot: change the model, not this file.

                cmake_minimum_required(VERSION 3.10...3.25)
                project(robot VERSION 0.0.0 LANGUAGES C CXX)

                # A catkin package if catkin is installed; plain CMake otherwise, or with ORO_USE_CATKIN off.
                if(NOT DEFINED ORO_USE_CATKIN)
                  find_package(catkin QUIET)
                  set(ORO_USE_CATKIN ${catkin_FOUND})
                elseif(ORO_USE_CATKIN)
                  find_package(catkin REQUIRED)
                endif()

                if(ORO_USE_CATKIN)
                  catkin_package()
                else()
                  install(FILES package.xml DESTINATION share/${PROJECT_NAME})
                endif()

                install(DIRECTORY launch models scripts DESTINATION share/${PROJECT_NAME})
            "#]],
        );
    }
}
