//! The files of a package.

use mauve_model::{Decl, ModelDb, Project};

use crate::build::build_files;
use crate::codels::codel_files;
use crate::component::component_files;
use crate::deployment::deployment_files;
use crate::export::export_files;
use crate::library::{Libraries, Library, Problem, libraries, problems};
use crate::task::task_files;
use crate::trace::trace_files;

/// A package that can be built.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Package {
    /// Its name, which is that of its folder.
    pub name: String,
    /// Its files.
    pub files: Vec<GeneratedFile>,
}

/// A file of a package.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GeneratedFile {
    /// From the folder of its package, with `/` between the parts, none of which is `.` or `..`.
    pub path: String,
    /// What stands in it.
    pub text: String,
    /// Whose it is.
    pub owner: Owner,
}

/// Whose a file is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Owner {
    /// The generator's: it is written anew whenever it changes.
    Generator,
    /// The user's: it is written once, and what it must define is the prototype of a codel.
    User {
        /// `double clearance(const ::sensor_msgs::LaserScan& scan, double width)`
        prototype: String,
    },
}

/// The packages that a deployment needs, or all of a project, those that others need first.
///
/// # Errors
///
/// What must be put right in the model first.
pub fn packages<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Option<Decl<'db>>,
) -> Result<Vec<Package>, Vec<Problem<'db>>> {
    let found = problems(db, project);
    if !found.is_empty() {
        return Err(found);
    }
    let (libraries, _) = libraries(db, project);
    let needed = deployment.map(|deployment| libraries.needed_by(deployment));
    let is_needed = |index: &usize| needed.as_ref().is_none_or(|needed| needed.contains(index));
    let all = libraries.all.iter().enumerate().filter(|(index, _)| is_needed(index));
    Ok(all.map(|(_, library)| package(db, project, libraries, library)).collect())
}

fn package<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    libraries: &Libraries<'db>,
    library: &Library<'db>,
) -> Package {
    let mut files = codel_files(db, project, library);
    files.extend(component_files(db, project, libraries, library));
    files.extend(task_files(library));
    files.extend(trace_files(library));
    files.extend(deployment_files(db, project, libraries, library));
    files.extend(export_files(db, project, library));
    // The last one: what is installed is what the others make.
    let build = build_files(db, project, libraries, library, &files);
    files.extend(build);
    Package { name: library.package.clone(), files }
}
