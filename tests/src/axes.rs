//! Projects that grow along one axis, such as files, states or errors: what takes time in proportion to the size on each
//! axis is fast enough for every project.

use std::fmt::{Display, Write as _};

use crate::generated_project;

/// An axis: projects of any size that are the same but for one number.
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    /// What there is more of.
    pub name: &'static str,
    /// The least size that is measured.
    pub least: usize,
    /// The project of a size: paths and texts.
    pub project: fn(usize) -> Vec<(String, String)>,
    /// The path of the file that grows, or one of many files.
    pub file: &'static str,
    /// A name of that file that many texts use.
    pub used: &'static str,
    /// How many ranges one edit of the file has; one, if that is not the axis.
    pub ranges: fn(usize) -> usize,
}

impl Axis {
    /// The axis with this name.
    pub fn named(name: &str) -> &'static Axis {
        AXES.iter().find(|axis| axis.name == name).unwrap_or_else(|| panic!("no axis `{name}`"))
    }
}

/// All axes.
pub const AXES: &[Axis] = &[
    axis("files", 25, |size| generated_project(size, size * 50), "/part1.mal", "Component1"),
    axis("lines", 1_250, |size| generated_project(2, size), "/part0.mal", "value"),
    axis("statements", 1_000, statements, ONE, "total"),
    axis("states", 250, states, ONE, "S0"),
    axis("transitions", 250, |size| transitions(size, |edge| format!("value == {edge}")), ONE, "Second"),
    axis(
        "guarded transitions",
        250,
        |size| transitions(size, |edge| format!("decide({edge})")),
        ONE,
        "Second",
    ),
    axis("activities", 125, activities, ONE, "Part"),
    axis("diagnostics", 250, diagnostics, ONE, "plna"),
    Axis { ranges: |size| size, ..axis("ranges of one change", 500, statements, ONE, "total") },
    axis("imports", 25, imports, ONE, "A0"),
    axis("libraries", 50, libraries, ONE, "l0"),
    axis("levels", 4, levels, ONE, "work"),
    axis("features", 125, features, ONE, "input0"),
    axis("parameters", 125, parameters, ONE, "work"),
    axis("operators", 1_000, operators, ONE, "value"),
    axis("instances", 125, instances, ONE, "Part"),
    axis("includes", 50, includes, "/part0.mal", "work0"),
    axis("codels", 500, codels, ONE, "work0"),
];

/// The only file of a project.
const ONE: &str = "/model.mal";

const fn axis(
    name: &'static str,
    least: usize,
    project: fn(usize) -> Vec<(String, String)>,
    file: &'static str,
    used: &'static str,
) -> Axis {
    Axis { name, least, project, file, used, ranges: |_| 1 }
}

/// A text for each number below `size`, joined.
fn each<T: Display>(size: usize, separator: &str, text: impl Fn(usize) -> T) -> String {
    let mut all = String::new();
    for index in 0..size {
        let _ = write!(all, "{}{}", if index > 0 { separator } else { "" }, text(index));
    }
    all
}

/// A project of one model, with `[codel]` of its timing table.
fn project(model: String, times: &str) -> Vec<(String, String)> {
    let config =
        "[project]\nroot = \"model.mal\"\n[timing]\ntables = [\"times.toml\"]\n[platform]\ncpus = 4\n";
    let times = format!("unit = \"us\"\n{times}");
    let files = [(ONE, model), ("/mauve.toml", config.to_owned()), ("/times.toml", times)];
    files.map(|(path, text)| (path.to_owned(), text)).to_vec()
}

/// A library with codels `work` and `decide`, a shell, and a core with this behaviour; one instance of it, which is deployed.
fn robot(behaviour: &str) -> String {
    format!(
        "library robot {{\n  codel work(in value: int): int\n  codel decide(in value: int): bool\n\n  shell Interface {{\n    \
         property gain: int = 1\n    input port measure: int\n    output port command: int\n  }}\n\n  \
         core Behaviour(Interface) {{\n    var value: int = 0;\n    var total: int = 0;\n{behaviour}  }}\n\n  \
         component Part(Interface, Behaviour)\n\n  architecture Robot {{\n    instance part: Part\n  }}\n\n  \
         deployment Run {{\n    architecture Robot\n    activity part {{ priority = 5 period = 1000 affinity = 1 }}\n  }}\n}}\n"
    )
}

const TIMES: &str = "[codel]\n\"robot.work\" = 1\n\"robot.decide\" = 1\n";

fn statements(size: usize) -> Vec<(String, String)> {
    let all = each(size, "", |index| match index % 4 {
        0 => format!("      value = work(value + {index});\n"),
        1 => "      if (value > 1) then { total = total + 1; } else { total = 1; }\n".to_owned(),
        2 => "      total = total + value * gain;\n".to_owned(),
        _ => format!("      if (read(measure, value) == new_data) then {{ total = {index}; }} else {{}}\n"),
    });
    project(robot(&format!("    update = {{\n{all}      write(command, total);\n    }}\n")), TIMES)
}

fn states(size: usize) -> Vec<(String, String)> {
    let all = each(size, "", |state| {
        let (initial, next) = (if state == 0 { "initial " } else { "" }, (state + 1) % size);
        format!(
            "      {initial}state S{state} {{\n        run = {{ value = 1; value = work(value); }}\n        \
             transition next if (decide(value)) to S{next}\n        transition start if (value == 9) to S0\n      }}\n"
        )
    });
    project(robot(&format!("    statemachine {{\n{all}    }}\n")), TIMES)
}

fn transitions(size: usize, guard: impl Fn(usize) -> String) -> Vec<(String, String)> {
    let all = each(size, "", |edge| {
        format!("        transition t{edge} if ({}) to Second {{ total = {edge}; }}\n", guard(edge))
    });
    let behaviour = format!(
        "    statemachine {{\n      initial state First {{\n        run = {{ value = 1; value = work(value); }}\n{all}      }}\n      \
         state Second {{\n        run = {{ value = work(total); }}\n        transition back to First\n      }}\n    }}\n"
    );
    project(robot(&behaviour), TIMES)
}

fn deployed(size: usize, connections: &str, activities: bool) -> Vec<(String, String)> {
    let instances = each(size, "", |index| format!("    instance i{index}: Part\n"));
    let mut model = format!(
        "library robot {{\n  codel work(in value: int): int\n\n  shell Interface {{\n    property gain: int = 1\n    \
         input port measure: int\n    output port command: int\n  }}\n\n  core Behaviour(Interface) {{\n    \
         var value: int = 0;\n    update = {{\n      read(measure, value);\n      write(command, work(value * gain));\n    }}\n  \
         }}\n\n  component Part(Interface, Behaviour)\n\n  architecture Robot {{\n{instances}{connections}  }}\n"
    );
    if activities {
        let activities = each(size, "", |index| {
            let (priority, affinity) = (99 - index * 98 / size, 1 << (index % 4));
            let period = [10, 20, 50, 100, 1000][index * 5 / size];
            format!(
                "    activity i{index} {{ priority = {priority} period = {period} affinity = {affinity} }}\n"
            )
        });
        let _ = write!(model, "\n  deployment Run {{\n    architecture Robot\n{activities}  }}\n");
    }
    model += "}\n";
    project(model, "[codel]\n\"robot.work\" = 1\n")
}

fn activities(size: usize) -> Vec<(String, String)> {
    deployed(size, "", true)
}

fn instances(size: usize) -> Vec<(String, String)> {
    let wires =
        each(size - 1, "", |index| format!("    connection i{index}.command -> i{}.measure\n", index + 1));
    let values = each(size, "", |index| format!("    property i{index}.gain = 2\n"));
    deployed(size, &format!("{wires}{values}"), false)
}

fn diagnostics(size: usize) -> Vec<(String, String)> {
    let all = each(size, "", |index| match index % 4 {
        0 => "      value = plna(1);\n".to_owned(),
        1 => format!("      value = unknown{index} + 1;\n"),
        2 => "      value = 1.5;\n".to_owned(),
        _ => format!("      var unused{index}: int = 1;\n"),
    });
    let model = robot(&format!("    update = {{\n{all}    }}\n"));
    project(model.replace("  codel work", "  codel plan(in value: int): int\n  codel work"), TIMES)
}

fn imports(size: usize) -> Vec<(String, String)> {
    let chain = each(size, "", |index| {
        let import = if index > 0 { format!("    import A{}\n", index - 1) } else { String::new() };
        format!(
            "  architecture A{index} {{\n{import}    instance i{index}: Part\n    property i{index}.gain = 2\n  }}\n"
        )
    });
    let activities = each(size, "", |index| {
        format!(
            "    activity i{index} {{ priority = {} period = 1000 affinity = 1 }}\n",
            99 - index * 98 / size
        )
    });
    let model = robot("    update = { value = work(1); write(command, value); }\n");
    let last = format!("{chain}\n  architecture Robot {{\n    import A{}\n", size - 1);
    let model = model.replace("  architecture Robot {\n", &last);
    project(model.replace("    activity part", &format!("{activities}    activity part")), TIMES)
}

fn libraries(size: usize) -> Vec<(String, String)> {
    let all = each(size, "\n", |index| {
        let used = if index > 0 { format!("  use l{}\n  use l0\n", index - 1) } else { String::new() };
        let call = if index > 0 { format!("work{}(work0(1))", index - 1) } else { "work0(1)".to_owned() };
        format!(
            "library l{index} {{\n{used}  codel work{index}(in value: int): int\n  shell Shell{index} {{\n    output port command: int\n  \
             }}\n  core Core{index}(Shell{index}) {{\n    update = {{ write(command, {call}); }}\n  }}\n  \
             component Part{index}(Shell{index}, Core{index})\n}}\n"
        )
    });
    let times = each(size, "", |index| format!("\"l{index}.work{index}\" = 1\n"));
    project(all, &format!("[codel]\n{times}"))
}

fn levels(size: usize) -> Vec<(String, String)> {
    let levels = each(size, ", ", |index| format!("{:e}", 1e-4 / (index + 1) as f64));
    let times = each(size, ", ", |index| 100 + index);
    let (_, model) = deployed(500, "", true).swap_remove(0);
    project(model, &format!("levels = [{levels}]\n[codel]\n\"robot.work\" = [{times}]\n"))
}

fn features(size: usize) -> Vec<(String, String)> {
    let ports = each(size, "", |index| format!("    input port input{index}: int\n"));
    let reads = each(size, "", |index| format!("      read(input{index}, value);\n"));
    let model = robot(&format!(
        "    update = {{\n{reads}      write(command, work(value));\n      total = 1;\n    }}\n"
    ));
    project(model.replace("    input port measure: int\n", &ports), TIMES)
}

fn parameters(size: usize) -> Vec<(String, String)> {
    let parameters = each(size, ",\n    ", |index| format!("in p{index}: int"));
    let arguments = each(size, ",\n        ", |index| format!("value + {index}"));
    let model = robot(&format!(
        "    update = {{\n      value = many(\n        {arguments});\n      value = work(value);\n    }}\n"
    ));
    let codel = format!("  codel many(\n    {parameters}): int\n");
    project(
        model.replace("  codel work", &format!("{codel}  codel work")),
        &format!("{TIMES}\"robot.many\" = 1\n"),
    )
}

fn operators(size: usize) -> Vec<(String, String)> {
    let chain = each(size, "\n        ", |index| format!("{} value * {}", ["+", "-"][index % 2], index % 10));
    project(
        robot(&format!("    update = {{\n      value = work(1 {chain});\n      value = 1;\n    }}\n")),
        TIMES,
    )
}

fn includes(size: usize) -> Vec<(String, String)> {
    let part = |index: usize| {
        let include =
            if index + 1 < size { format!("include \"part{}.mal\"\n", index + 1) } else { String::new() };
        format!(
            "{include}library l{index} {{\n  use l{0}\n  codel work{index}(in value: int): int\n  shell Shell{index} {{ \
             output port command: int }}\n  core Core{index}(Shell{index}) {{\n    update = {{ var value: int = 1;  \
             write(command, work{0}(value)); }}\n  }}\n  component Part{index}(Shell{index}, Core{index})\n}}\n",
            (index + 1) % size
        )
    };
    let mut files = project("include \"part0.mal\"\n".to_owned(), "[codel]\n\"l0.work0\" = 1\n");
    files.extend((0..size).map(|index| (format!("/part{index}.mal"), part(index))));
    files
}

fn codels(size: usize) -> Vec<(String, String)> {
    let all = each(size, "", |index| format!("  codel work{index}(in value: int): int\n"));
    let calls = each(size, "", |index| format!("      value = work{index}(value + 1);\n"));
    let times = each(size, "", |index| format!("\"robot.work{index}\" = 1\n"));
    let model = robot(&format!("    update = {{\n{calls}      write(command, value);\n    }}\n"));
    project(model.replace("  codel work(", &format!("{all}  codel work(")), &format!("{TIMES}{times}"))
}
