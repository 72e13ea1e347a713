//! Follows the README, the tutorial and the commands of the reference in an empty home folder: each block of code is a new file, a command, the output
//! of a command, or a change of a file. Any other block fails the test.
//!
//! | block | the test |
//! |---|---|
//! | `sh` | runs it in the folder that the last one left; it may fail only where its output follows |
//! | `text` | compares it with the output of the previous commands; a line `…` matches any lines |
//! | `mauve`, `toml`, `yaml`, `cpp` after a line with the name of a file and a colon | writes that file |
//! | `diff` after such a line | changes that file: the lines without `+` must be consecutive lines of the file |

use std::ffi::OsString;
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::MAUVE;

const RUN_THE_SAMPLE: &str = "cargo run -- run tests/models/p3dx --for 30s --simulate-time\n";

/// A reader of the README with an empty home. Cargo takes the profile of tests: what the program is made of is built then.
fn reader_of_the_readme(home: &str) -> Reader {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap();
    let home = mauve_tests::scratch(env!("CARGO_TARGET_TMPDIR"), home);
    let programs = home.join(".cargo/bin");
    let cargo = "#!/bin/sh\ncommand=$1\nshift\nexec \"$CARGO\" \"$command\" --profile test \"$@\"\n";
    mauve_tests::write(&programs, &[("cargo", cargo)]);
    std::fs::set_permissions(programs.join("cargo"), Permissions::from_mode(0o755)).unwrap();
    Reader::new(&home, root, programs)
}

#[test]
fn the_readme_can_be_followed_on_a_clean_home() {
    let mut reader = reader_of_the_readme("documents-readme");
    // That is what runs this test.
    reader.skipped = vec!["bash tests/run\n"];
    let page = reader.folder.join("README.md");
    assert!(reader.follow(&page) >= 4);
}

#[test]
fn orocos_the_robot_of_the_readme_runs() {
    let mut reader = reader_of_the_readme("documents-robot");
    let page = std::fs::read_to_string(reader.folder.join("README.md")).unwrap();
    assert!(page.contains(&format!("99.4 to 100 % of their bounds | `{}`", RUN_THE_SAMPLE.trim_end())));
    reader.run(RUN_THE_SAMPLE).unwrap();
    reader.succeeded().unwrap();
    let printed = reader.printed.take().unwrap().0;
    let share = |line: &str| line.split_once(" %  ✓ met")?.0.rsplit(' ').next()?.parse::<f64>().ok();
    let mut shares: Vec<f64> = printed.lines().filter_map(share).collect();
    shares.sort_by(f64::total_cmp);
    assert_eq!((shares.len(), shares.first(), shares.last()), (9, Some(&99.4), Some(&100.0)), "{printed}");
}

/// A reader of a page of the tutorial or of the reference, with an empty home.
fn reader_of(home: &str) -> Reader {
    let home = mauve_tests::scratch(env!("CARGO_TARGET_TMPDIR"), home);
    Reader::new(&home, home.clone(), Path::new(MAUVE).parent().unwrap().to_owned())
}

fn page(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests").join(name)
}

#[test]
fn the_commands_of_the_reference_run() {
    assert!(reader_of("documents-commands").follow(&page("spec/commands.md")) >= 10);
}

#[test]
fn the_tutorial_can_be_followed_on_a_clean_home() {
    assert!(reader_of("documents-tutorial").follow(&page("tutorial/README.md")) >= 20);
}

#[test]
fn the_page_for_users_of_ros_2_can_be_followed() {
    let mut reader = reader_of("documents-ros2");
    // It runs until it is interrupted; other tests run such a robot.
    let workspace = "cd ws && colcon build && . install/setup.sh\nros2 run robot_ros2 robot-Onboard\n\
                     ros2 launch robot_ros2 Onboard.launch.py\n";
    reader.skipped = vec!["mauve run --ros2\n", workspace];
    assert!(reader.follow(&page("tutorial/ros2.md")) >= 5);
}

#[test]
#[cfg(target_os = "linux")]
fn orocos_the_page_from_a_recording_to_priorities_can_be_followed() {
    let mut reader = reader_of("documents-executor");
    let (recorder, _) = crate::import::record_callbacks();
    let recordings = reader.home.join(".ros/tracing");
    std::fs::create_dir_all(&recordings).unwrap();
    let mut copy = Command::new("cp");
    mauve_tests::orocos::run(copy.arg("-r").arg(recorder.output()).arg(recordings.join("arm")));
    reader.skipped =
        vec!["ros2 trace --session-name arm\n", "ros2 run cie_thread_configurator prerun_node\n"];
    let page = page("tutorial/executor.md");
    let all = blocks(&std::fs::read_to_string(&page).unwrap());
    let (recorded, rest) = all.split_at(all.iter().position(|it| it.text == "mauve check robot\n").unwrap());
    reader.is_any_time = true;
    reader.follow_blocks(&page, recorded);
    crate::import::replace_recorded_times(&reader.home.join("robot"));
    reader.is_any_time = false;
    reader.follow_blocks(&page, rest);
}

struct Reader {
    home: PathBuf,
    /// Where the next command runs.
    folder: PathBuf,
    path: OsString,
    skipped: Vec<&'static str>,
    /// Whether the last command was skipped: then its output is.
    is_skipping: bool,
    /// Whether outputs may have other times than the page, in columns of other widths.
    is_any_time: bool,
    /// The output of the last commands, and whether they succeeded.
    printed: Option<(String, bool)>,
}

/// A block of code: the line before it, the word behind its fence, its text.
struct Block {
    lead: String,
    info: String,
    line: usize,
    text: String,
}

impl Reader {
    /// A reader with an empty `home` who begins in `folder`, and has the programs of one folder beside those of the system.
    fn new(home: &Path, folder: PathBuf, programs: PathBuf) -> Reader {
        let system = std::env::var_os("PATH").unwrap_or_default();
        let path = std::env::join_paths(std::iter::once(programs).chain(std::env::split_paths(&system)));
        Reader {
            home: home.to_owned(),
            folder,
            path: path.unwrap(),
            skipped: Vec::new(),
            is_skipping: false,
            is_any_time: false,
            printed: None,
        }
    }

    /// Follows a page and returns how many blocks it has.
    fn follow(&mut self, page: &Path) -> usize {
        let blocks = blocks(&std::fs::read_to_string(page).unwrap());
        self.follow_blocks(page, &blocks);
        blocks.len()
    }

    fn follow_blocks(&mut self, page: &Path, blocks: &[Block]) {
        for block in blocks {
            let followed = match block.info.as_str() {
                "sh" => self.run(&block.text),
                "text" => self.compare(&block.text),
                "diff" => self.change(block),
                _ => self.write(block),
            };
            let at = format!("{}:{}", page.file_name().unwrap().display(), block.line);
            followed.unwrap_or_else(|error| panic!("{at}: {error}\n{}", block.text));
        }
        self.succeeded().unwrap_or_else(|error| panic!("{}: {error}", page.display()));
    }

    fn run(&mut self, commands: &str) -> Result<(), String> {
        self.succeeded()?;
        self.is_skipping = self.skipped.contains(&commands);
        if self.is_skipping {
            return Ok(());
        }
        let at = self.home.join(".folder");
        let script = format!("exec 2>&1\ntrap 'pwd >{}' EXIT\n{commands}", at.display());
        let kept = |name: &str, below: &str| {
            std::env::var_os(name).unwrap_or_else(|| {
                std::env::home_dir().map(|home| home.join(below)).unwrap_or_default().into_os_string()
            })
        };
        let output = Command::new("bash")
            .args(["-euc", &script])
            .current_dir(&self.folder)
            .env("PATH", &self.path)
            .env("CARGO_HOME", kept("CARGO_HOME", ".cargo"))
            .env("RUSTUP_HOME", kept("RUSTUP_HOME", ".rustup"))
            .env("CARGO_INSTALL_ROOT", self.home.join(".cargo"))
            .env("CARGO", env!("CARGO"))
            .envs(mauve_tests::orocos::RUNS_ONCE)
            // The program of the tests stays as it is.
            .env("CARGO_TARGET_DIR", Path::new(env!("CARGO_TARGET_TMPDIR")).join("documents"))
            .env("CARGO_BUILD_BUILD_DIR", Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap())
            .env("HOME", &self.home)
            .env_remove("XDG_CACHE_HOME")
            .env_remove("XDG_DATA_HOME")
            .env_remove("NVIM_APPNAME")
            .env_remove("MAUVE_MODELS")
            .env_remove("ROS_PACKAGE_PATH")
            .stdin(Stdio::null())
            .output()
            .map_err(|error| format!("bash does not run: {error}"))?;
        self.folder = std::fs::read_to_string(&at).unwrap().trim_end().into();
        self.printed = Some((String::from_utf8_lossy(&output.stdout).into_owned(), output.status.success()));
        Ok(())
    }

    /// Commands that fail must have their output on the page.
    fn succeeded(&self) -> Result<(), String> {
        match &self.printed {
            Some((printed, false)) => Err(format!("the commands before this failed:\n{printed}")),
            _ => Ok(()),
        }
    }

    fn compare(&mut self, expected: &str) -> Result<(), String> {
        if self.is_skipping {
            return Ok(());
        }
        let (printed, _) = self.printed.take().ok_or("no command was run before this output")?;
        let is_time = |word: &str| word.contains('.') && word.parse::<f64>().is_ok();
        let any_time = |line: &str| {
            line.split_whitespace()
                .map(|it| if is_time(it) { "0.0" } else { it })
                .collect::<Vec<_>>()
                .join(" ")
        };
        let line = |line: &str| match self.is_any_time {
            true => any_time(line),
            false => line.trim_end().to_owned(),
        };
        let lines = |text: &str| text.lines().map(line).collect::<Vec<_>>();
        match matches(&lines(expected), &lines(&printed)) {
            true => Ok(()),
            false => Err(format!("printed was:\n{printed}\nbut the page says:")),
        }
    }

    fn write(&self, block: &Block) -> Result<(), String> {
        std::fs::write(self.folder.join(block.file()?), &block.text).map_err(|error| error.to_string())
    }

    fn change(&self, block: &Block) -> Result<(), String> {
        let path = self.folder.join(block.file()?);
        let text = std::fs::read_to_string(&path).map_err(|error| error.to_string())?;
        let side = |other: char| -> String {
            let lines = block.text.lines().filter(|line| !line.starts_with(other));
            lines.map(|line| format!("{}\n", line.get(1..).unwrap_or_default())).collect()
        };
        let (before, after) = (side('+'), side('-'));
        if text.matches(&before).count() != 1 {
            return Err(format!("these lines are not there, or not once:\n{before}in\n{text}"));
        }
        std::fs::write(&path, text.replacen(&before, &after, 1)).map_err(|error| error.to_string())
    }
}

impl Block {
    /// The file that the line before the block names.
    fn file(&self) -> Result<&str, String> {
        let name = self.lead.strip_suffix(':').and_then(|lead| lead.rsplit('`').nth(1));
        name.ok_or_else(|| format!("the line before the block names no file: {}", self.lead))
    }
}

fn blocks(page: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut lead = String::new();
    let mut lines = page.lines().enumerate();
    while let Some((line, text)) = lines.next() {
        if let Some(info) = text.strip_prefix("```") {
            let block: String = lines
                .by_ref()
                .take_while(|(_, text)| *text != "```")
                .map(|(_, text)| format!("{text}\n"))
                .collect();
            blocks.push(Block { lead: lead.clone(), info: info.to_owned(), line: line + 1, text: block });
        } else if !text.is_empty() {
            text.clone_into(&mut lead);
        }
        assert!(!text.starts_with("    "), "a block without a fence, which nothing tests: {text}");
    }
    blocks
}

/// Returns whether a text matches lines in which `…` matches any lines.
fn matches(expected: &[String], found: &[String]) -> bool {
    match expected.split_first() {
        None => found.is_empty(),
        Some((first, rest)) if first.trim() == "…" => {
            (0..=found.len()).any(|skipped| matches(rest, &found[skipped..]))
        }
        Some((first, rest)) => found.first() == Some(first) && matches(rest, &found[1..]),
    }
}

#[test]
fn a_page_that_says_something_else_is_found() {
    let lines = |text: &str| text.split('|').map(str::to_owned).collect::<Vec<_>>();
    for (expected, found, same) in [
        ("a|b", "a|b", true),
        ("a|…|c", "a|b|b|c", true),
        ("…", "", true),
        ("a|…|c", "a|b", false),
        ("a", "a|b", false),
    ] {
        assert_eq!(matches(&lines(expected), &lines(found)), same, "{expected} {found}");
    }
    let page = "Change `a.mal`:\n\n```diff\n x\n-y\n+z\n```\n";
    let [block] = blocks(page).try_into().unwrap_or_else(|_| panic!("one block"));
    assert_eq!((block.file(), block.line), (Ok("a.mal"), 3));
}
