//! `mauve run [PATH]`: builds the program of a deployment, which needs no Orocos, and runs it.
//!
//! The program is built in a folder of the user's cache. Without `--codels`, its codels are stubs; with it, they are those of
//! packages that `mauve generate` wrote, which are built in place. The program replaces this process: signals, its output and
//! its exit code are its own.

pub(super) mod build;

use std::path::{Path, PathBuf};

use mauve_hir::{Database, Decl, Project, ros2_of};
use mauve_orocos::{
    GeneratedFile, GeneratedPackage, Programs, packages_with_stubs, problems, record_inputs, standalone,
};
use mauve_projects::destination::destination_folder;
use mauve_projects::folder::open_file;
use mauve_projects::generate::{GenerateRefusal, GenerateRequest, Out, Selected, generate, read};
use mauve_projects::holder::holder;
use mauve_projects::load::Outside;
use mauve_projects::load::load;
use mauve_projects::output::{Output, say};
use mauve_timing::{CpuSet, Time};
use mauve_wcrt::{Query, response_times};

use super::generate::{refusal_text, warn_of_deadlines};
use crate::errors::{host_called, only_deployment};
use crate::options::time;
use crate::platform::available_cpus;
use crate::text::argument;
use build::{Build, check_tools};

#[derive(Debug, clap::Args)]
pub struct RunCommand {
    /// A model, a folder or a mauve.toml; the current folder when left out.
    #[arg(default_value = ".", hide_default_value = true)]
    path: PathBuf,
    #[command(flatten)]
    outside: Outside,
    /// The deployment; by default the only one.
    #[arg(long, value_name = "NAME")]
    deployment: Option<String>,
    /// Stop after this time, such as 10s or 5min; by default when interrupted.
    #[arg(long = "for", value_name = "TIME", value_parser = time)]
    length: Option<Time>,
    /// Run the codels in this folder, in which `mauve generate` wrote the packages. By default, codels are stubs: they return
    /// pseudo-random values, and take the execution times of the timing tables.
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    codels: Option<PathBuf>,
    /// Record the executions of codels in this folder.
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    trace: Option<PathBuf>,
    /// Also record inputs of codels, in DIR/inputs.toml, for `mauve measure`: of some calls, spread over the run, whose periods take
    /// longer.
    #[arg(long, requires = "trace", requires = "codels", conflicts_with = "simulate_time")]
    inputs: bool,
    /// Run on a virtual clock, as fast as possible, with the execution times of the timing tables.
    #[arg(long)]
    simulate_time: bool,
    /// Exchange the topics of `[ros2]` with programs of ROS 2. Needs Cyclone DDS, and no ROS.
    #[arg(long, conflicts_with = "simulate_time")]
    ros2: bool,
    /// Run the part of this host, `[host.NAME]`, with its topics of ROS 2: a robot with several computers has a program for each.
    #[arg(long, value_name = "NAME")]
    host: Option<String>,
    /// Set a property of an instance; may be given several times.
    #[arg(long, value_name = "INSTANCE.PROPERTY=VALUE")]
    param: Vec<String>,
    /// Run without the permission to use real-time priorities; the response times do not hold then.
    #[arg(long)]
    allow_non_realtime: bool,
    /// Build the program, print its path, and do not run it.
    #[arg(long)]
    build_only: bool,
}

impl RunCommand {
    pub(crate) fn run(self) -> Result<Output, String> {
        let arguments = self.arguments()?;
        if let Some(folder) = self.trace.as_ref().filter(|_| !self.build_only) {
            check_has_no_recording(folder)?;
        }
        let mut db = Database::default();
        let workspaces = load(&mut db, std::slice::from_ref(&self.path), self.outside.allow_outside)?;
        let (project, deployment) = only_deployment(&db, &workspaces, self.deployment.as_deref(), "run")?;
        let problems = problems(&db, project);
        if !problems.is_empty() {
            let text = refusal_text(&db, &workspaces, &problems);
            anstream::eprint!("{text}");
            return Ok(Output::verbatim("", 1));
        }
        let host = host_called(&db, (project, deployment), self.host.as_deref())?;
        let has_topics = self.check_topics(&db, project, deployment, host)?;
        if !self.simulate_time && !self.allow_non_realtime && !self.build_only {
            check_cpus(&db, project, deployment, host)?;
        }
        check_tools()?;
        warn_of_deadlines(&db, &workspaces, &[(project, Some(deployment))])?;
        let program = self.build(&db, project, deployment, host, has_topics)?;
        if self.build_only {
            return Ok(Output::escaped(format!("{}\n", program.display()), 0));
        }
        Err(execute(&program, &arguments))
    }

    /// Returns whether the program has topics, and says what they need.
    ///
    /// # Errors
    ///
    /// They cannot be made.
    fn check_topics<'db>(
        &self,
        db: &'db Database,
        project: Project<'db>,
        deployment: Decl<'db>,
        host: Option<usize>,
    ) -> Result<bool, String> {
        let found = ros2_of(db, project, deployment);
        let has_topics = found.topics_of(host.unwrap_or_default()).next().is_some();
        if self.simulate_time && has_topics && host.is_some() {
            say("on the virtual clock, no data comes from the other hosts, and none goes there");
        }
        let with_topics = !self.simulate_time && (self.ros2 || host.is_some());
        match (with_topics, has_topics) {
            (true, false) if host.is_some() => Ok(false),
            (true, false) => Err(format!(
                "`{}` has no topics: write `[ros2]` with a `gateway` into mauve.toml, and leave a port whose type is a message without \
                 a connection, or name it in `topics`",
                deployment.qualified(db)
            )),
            (true, true) if !has_cyclone() => Err(
                "`mauve run --ros2` needs Cyclone DDS, and does not find it: on Debian, `apt-get install cyclonedds-dev`".to_owned(),
            ),
            (false, true) if !self.simulate_time => {
                say("topics of ROS 2 are not made without --ros2");
                Ok(false)
            }
            _ => Ok(with_topics),
        }
    }

    /// Returns the arguments of the program.
    fn arguments(&self) -> Result<Vec<String>, String> {
        let mut arguments = Vec::new();
        arguments.extend(self.length.map(|length| format!("--for={}ns", length.as_nanos())));
        for parameter in &self.param {
            let name = parameter.split_once('=').and_then(|(name, _)| name.split_once('.'));
            if name.is_none_or(|(instance, property)| instance.is_empty() || property.is_empty()) {
                return Err(format!(
                    "--param is INSTANCE.PROPERTY=VALUE, such as pilot.width=0.5, and not `{parameter}`"
                ));
            }
            arguments.push(format!("--param={parameter}"));
        }
        if let Some(folder) = &self.trace {
            let unusable = "--trace is the path of a folder, in UTF-8";
            let named = Some(folder).filter(|it| !it.as_os_str().is_empty()).ok_or(unusable)?;
            let real = destination_folder(named)?;
            arguments.push(format!("--trace={}", real.to_str().ok_or(unusable)?));
        }
        let flags = [
            ("--simulate-time", self.simulate_time),
            ("--allow-non-realtime", self.allow_non_realtime),
            ("--spend-times", self.codels.is_none()),
            ("--inputs", self.inputs),
            // It shows a table only on a terminal.
            ("--live", true),
        ];
        arguments.extend(flags.into_iter().filter(|(_, is_set)| *is_set).map(|(flag, _)| flag.to_owned()));
        Ok(arguments)
    }

    /// Generates and builds the program, and returns its path.
    fn build<'db>(
        &self,
        db: &'db Database,
        project: Project<'db>,
        deployment: Decl<'db>,
        host: Option<usize>,
        has_topics: bool,
    ) -> Result<PathBuf, String> {
        let root = project.root(db).path(db);
        let codels = match &self.codels {
            Some(folder) => Some(built_packages(db, project, deployment, folder, &self.path)?.real),
            None => None,
        };
        let mut all = match &codels {
            Some(_) => Vec::new(),
            None => packages_with_stubs(db, project, deployment).unwrap_or_default(),
        };
        // The project has no problems: they were reported.
        let programs = host.map_or(Programs::Whole, Programs::OfHost);
        all.extend(standalone(db, project, Some(deployment), has_topics, programs));
        let program = program_in(&all).ok_or("the deployment has no program")?;
        if let Some(package) = all.last_mut().filter(|_| self.inputs) {
            for (codel, parameter) in record_inputs(db, project, deployment, &program, package) {
                say(&format!(
                    "the inputs of `{}` are not recorded: values of `{parameter}` exist only in the robot",
                    codel.qualified(db)
                ));
            }
        }
        let name = deployment.qualified(db);
        if codels.is_none() {
            say(&format!(
                "the codels of {name} are stubs that return pseudo-random values; --codels runs yours"
            ));
        }
        Build::open(root, codels.as_deref())?.build(&all, &program, &name)
    }
}

/// Whether CMake will find Cyclone DDS: where it looks on Debian, or where the user says.
fn has_cyclone() -> bool {
    let is_named = ["CMAKE_PREFIX_PATH", "CycloneDDS_DIR", "CycloneDDS_ROOT"];
    let header = |folder: &str| Path::new(folder).join("include/dds/dds.h").exists();
    is_named.into_iter().any(|it| std::env::var_os(it).is_some())
        || ["/usr", "/usr/local"].into_iter().any(header)
}

/// Refuses CPUs that the program would refuse after the build.
fn check_cpus<'db>(
    db: &'db Database,
    project: Project<'db>,
    deployment: Decl<'db>,
    host: Option<usize>,
) -> Result<(), String> {
    let report = response_times(db, project, deployment, Query::shown(db, project, deployment));
    let of_host = host.and_then(|it| report.hosts.all.get(it)).map_or(CpuSet::ALL, |it| it.cpus);
    let tasks = report.activities.iter().map(|it| &it.task).chain(report.others());
    let real_time = tasks.filter(|it| it.priority.real_time().is_some());
    let needed: CpuSet = real_time.filter_map(|it| it.cpus).map(|cpus| cpus & of_host).collect();
    let missing = report.hosts.local(needed).1 - available_cpus().unwrap_or(CpuSet::ALL);
    if missing.is_empty() {
        return Ok(());
    }
    Err(format!(
        "programs on this computer may not use {missing} of the deployment; --simulate-time needs none of this, and with \
         --allow-non-realtime the response times do not hold"
    ))
}

/// Returns the folder of the packages with the user's codels.
///
/// # Errors
///
/// The packages are not those of the model at `path`.
pub(super) fn built_packages<'db>(
    db: &'db Database,
    project: Project<'db>,
    deployment: Decl<'db>,
    folder: &Path,
    path: &Path,
) -> Result<Out, String> {
    let out = Out::named(folder);
    let selected = vec![Selected::new(db, project, Some(deployment), out.clone())];
    let request = GenerateRequest { selected, ..GenerateRequest::default() };
    let folders = match generate(db, &request, &read) {
        Ok(folders) => folders,
        Err(GenerateRefusal::Other(why)) => return Err(why),
        // They were reported.
        Err(GenerateRefusal::Problems(_)) => Vec::new(),
    };
    if !folders.iter().all(|it| it.plan.has_current_code()) {
        let plans = || folders.iter().map(|it| &it.plan);
        let codel = plans().find_map(|plan| plan.changed_codels.first());
        let is_generated = plans().all(|plan| plan.steps.is_empty() && plan.edited.is_empty());
        let what = match codel.filter(|_| is_generated) {
            Some(codel) => {
                format!("write `{}` for its new prototype, which the file beside it has", codel.path)
            }
            None => {
                format!("run `mauve generate {} --out {}` first", argument(path), argument(folder))
            }
        };
        return Err(format!("the packages in `{}` are not those of the model: {what}", folder.display()));
    }
    out
}

/// Refuses a folder that has a recording, complete or not: the program would refuse it after the build.
fn check_has_no_recording(folder: &Path) -> Result<(), String> {
    let files =
        ["executions.csv", "periods.csv", "inputs.toml", "executions.csv.partial", "periods.csv.partial"];
    let Some(file) = files.into_iter().find(|file| folder.join(file).symlink_metadata().is_ok()) else {
        return Ok(());
    };
    let shown = folder.display();
    let open = folder.join(file).canonicalize().and_then(|real| open_file(&real));
    if let Some(other) = open.ok().and_then(|file| holder(&file)) {
        return Err(format!("{other} records into `{shown}`: name another folder for --trace"));
    }
    Err(format!(
        "`{shown}` has a recording, `{file}`, which is not overwritten: name another folder for --trace, or move or remove that one; \
         `mauve trace import` adds its executions to a sample file"
    ))
}

/// Returns the name of the program, which is that of its main.
fn program_in(packages: &[GeneratedPackage]) -> Option<String> {
    let name = |file: &GeneratedFile| Some(file.path.strip_suffix(".cpp")?.to_owned());
    let main =
        packages.last()?.files.iter().find(|file| !file.path.contains('/') && file.path.ends_with(".cpp"));
    main.and_then(name)
}

/// Replaces this process by the program. Returns why it does not.
fn execute(program: &Path, arguments: &[String]) -> String {
    use std::os::unix::process::CommandExt as _;
    let error = std::process::Command::new(program).args(arguments).exec();
    format!("cannot run `{}`: {error}", program.display())
}
