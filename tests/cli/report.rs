//! `mauve report`: one page about a project.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use mauve_tests::{Run, copy, git, mauve, models, scratch, test_name, write};

use crate::MAUVE;

const MODEL: &str = "
codel see(): int  codel plan(): int
shell S { output port scan: int }  shell T { input port scan: int }
core Eye(S) { update = { write(scan, see()); } }  core Pilot(T) { update = { plan(); } }
component Laser(S, Eye)  component Nav(T, Pilot)
architecture A { instance laser: Laser  instance nav: Nav  connection laser.scan -> nav.scan }
deployment D { architecture A
  activity laser { affinity = 1 priority = 2 period = 100 deadline = 50 }
  activity nav { affinity = 1 priority = 1 period = 100 }
}
";
const CONFIG: &str = "timing.tables = [\"t.toml\"]\nplatform.rt_throttling = false\nplatform.cpus = 2\n";

fn project(times: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    write(&folder, &[("robot.mal", MODEL), ("mauve.toml", CONFIG), ("t.toml", times)]);
    folder
}

fn report(folder: &Path, arguments: &[&str]) -> Run {
    mauve(MAUVE, folder, &[&["report"], arguments].concat())
}

/// Checks that each element is closed, each id unique, each link leads somewhere, and that nothing runs or is loaded.
fn check_page(page: &str) {
    assert!(page.starts_with("<!DOCTYPE html>\n<html lang=\"en\">"), "{page}");
    let mut open: Vec<&str> = Vec::new();
    let mut ids = BTreeSet::new();
    for tag in page.split('<').skip(1).filter(|tag| !tag.starts_with('!')) {
        let (tag, _) = tag.split_once('>').expect("the end of a tag");
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        let name = tag.trim_start_matches('/').split([' ', '/']).next().unwrap();
        assert!(!["script", "link", "iframe", "img"].contains(&name), "{tag}");
        assert!(!tag.contains(" on"), "{tag}");
        if let Some((_, id)) = tag.split_once(" id=\"") {
            assert!(ids.insert(id.split('"').next().unwrap()), "a second {id}");
        }
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "</{name}> in {open:?}");
        } else if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
    for link in page.split("href=\"").skip(1) {
        let target = link.split('"').next().unwrap();
        assert!(target.strip_prefix('#').is_some_and(|id| ids.contains(id)), "{target}");
    }
}

#[test]
fn the_robot_on_one_page() {
    let found = report(&models(), &["p3dx"]);
    assert_eq!((found.code, &*found.err), (0, ""));
    let page = &found.out;
    check_page(page);
    assert!(page.contains("<section class=\"verdict tight\""), "{page}");
    assert!(
        page.contains("<p class=\"headline\">! 9 met · 1 tight</p>\n<p>All 9 deadlines are proved"),
        "{page}"
    );
    assert!(
        page.contains("<code>avoid</code></th><td><span class=\"figure met\">✓ ≤ 526 / 600 ms</span>"),
        "{page}"
    );
    // One form of a figure, here and in the tables.
    let wcrt = mauve(MAUVE, &models(), &["graph", "p3dx", "--format", "json"]).out;
    let wcrt: serde_json::Value = serde_json::from_str(&wcrt).unwrap();
    for node in wcrt["nodes"].as_array().unwrap() {
        let (name, figure) = (node["instance"].as_str().unwrap(), node["figure"].as_str().unwrap());
        assert!(page.contains(name), "{name}");
        assert!(page.contains(&format!("\">{figure}")), "{name}: {figure}");
    }
    assert!(page.contains("own time 43 ms + p3dx_driver 10 ms"), "{page}");
    assert_eq!(report(&models(), &["p3dx"]).out, *page, "the same bytes");
    // Paths of this computer would make a difference.
    assert!(!page.contains(models().to_str().unwrap()), "{page}");
}

#[test]
fn a_late_robot_says_what_to_do_next() {
    let folder = project("[codel]\nsee = 30\nplan = 80 # assumed: as on the last robot\n");
    let found = report(&folder, &["-o", "report.html"]);
    assert_eq!((found.code, &*found.out), (1, ""));
    assert!(
        found.err.contains("`report.html` has the report: 1 of 2 deadlines is not proved"),
        "{}",
        found.err
    );
    let page = fs::read_to_string(folder.join("report.html")).unwrap();
    check_page(&page);
    for text in [
        "<section class=\"verdict missed\"",
        "<code>nav</code>: <span class=\"figure missed\">✗ CPU 1 overloaded (110.0 %)",
        "<code>mauve tune</code>",
        "1 execution time is assumed: measure it",
        "<b class=\"warned\">assumed</b>",
        "✗ CPU 1: 110.0 % used, overloaded by 10.0 %",
        "overloaded (110.0 % at priority ≥ 1)",
    ] {
        assert!(page.contains(text), "{text}: {page}");
    }
    // It may be written again, but no other file is overwritten.
    assert_eq!(report(&folder, &["-o", "report.html"]).code, 1);
    let refused = report(&folder, &["-o", "robot.mal"]);
    assert_eq!(refused.code, 2);
    assert!(refused.err.contains("`robot.mal` is not a report"), "{}", refused.err);
    fs::create_dir(folder.join("mine")).unwrap();
    symlink("mine/page.html", folder.join("linked.html")).unwrap();
    assert_eq!(report(&folder, &["-o", "linked.html"]).code, 2);
    assert!(!folder.join("mine/page.html").exists());
}

#[test]
fn an_error_leaves_nothing_proved() {
    let folder = project("[codel]\nsee = 30\n");
    let found = report(&folder, &[]);
    assert_eq!(found.code, 1);
    check_page(&found.out);
    for text in [
        "<section class=\"verdict unknown\"",
        "Not analysed",
        "? no time for plan",
        "<b class=\"failed\">no time</b>",
    ] {
        assert!(found.out.contains(text), "{text}: {}", found.out);
    }
    write(&folder, &[("robot.mal", "codel see(): int")]);
    let found = report(&folder, &[]);
    assert_eq!(found.code, 2);
    assert!(found.err.contains("no deployment in these models: nothing to report"), "{}", found.err);
}

#[test]
fn what_changed_since_a_revision() {
    let folder = project("[codel]\nsee = 10\nplan = 20\n");
    for arguments in
        [&["init", "--quiet"][..], &["add", "--all"], &["commit", "--quiet", "--message", "first"]]
    {
        assert!(git(&folder, arguments).status.success());
    }
    write(&folder, &[("t.toml", "[codel]\nsee = 60\nplan = 20\n")]);
    let found = report(&folder, &["--since", "HEAD"]);
    assert_eq!(found.code, 1, "{}", found.err);
    check_page(&found.out);
    for text in [
        "<h2>What changed</h2>",
        "<td>✓ 10 / 50 ms</td>",
        "<b class=\"worse\">✗ 60 / 50 ms</b>",
        "no longer met",
        "execution times: see 10 → 60 ms",
    ] {
        assert!(found.out.contains(text), "{text}: {}", found.out);
    }
    assert_eq!(report(&folder, &["--since", "nothing"]).code, 2);
}

#[test]
fn what_cannot_be_read_of_a_revision_has_no_figure() {
    let folder = project("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 40\n");
    for arguments in
        [&["init", "--quiet"][..], &["add", "--all"], &["commit", "--quiet", "--message", "first"]]
    {
        assert!(git(&folder, arguments).status.success());
    }
    write(&folder, &[("t.toml", "[codel]\nsee = 10\nplan = 20\n")]);
    let found = report(&folder, &["--since", "HEAD"]);
    assert_eq!(found.code, 2, "{}", found.err);
    check_page(&found.out);
    for text in [
        "not compared, since files cannot be read",
        "`t.toml`: this file is only a pointer to one that Git LFS stores",
    ] {
        assert!(found.out.contains(text), "{text}: {}", found.out);
    }
    assert!(!found.out.contains("met now"), "{}", found.out);
}

#[test]
fn names_and_comments_are_text() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name()).join("a <script>alert(1) & \"b\"");
    fs::create_dir_all(&folder).unwrap();
    write(&folder, &[("robot.mal", &MODEL.replace("\"", ""))]);
    let accepted = "deployment.D.accept = { nav = '<img src=x onerror=alert(1)>' }\n";
    write(&folder, &[("mauve.toml", &format!("{CONFIG}{accepted}"))]);
    write(
        &folder,
        &[(
            "t.toml",
            "[codel]\nsee = 30\nplan = 90 # assumed: <script>alert(2)</script>\n\"<script>alert(3)</script>\" = 1\n",
        )],
    );
    let found = report(&folder, &["."]);
    assert!(found.code < 2, "{}", found.err);
    check_page(&found.out);
    assert!(
        found.out.contains("Timing report of a &lt;script&gt;alert(1) &amp; &quot;b&quot;"),
        "{}",
        found.out
    );
    assert!(found.out.contains("&lt;script&gt;alert("), "{}", found.out);
}

#[test]
fn one_of_several_deployments() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    copy(&models().join("p3dx"), &folder);
    let text = fs::read_to_string(folder.join("deployment.mal")).unwrap();
    let other = text.split_once("deployment P3dxDeployment").unwrap().1;
    write(&folder, &[("deployment.mal", &format!("{text}\ndeployment Other{other}"))]);
    let both = report(&folder, &[]).out;
    check_page(&both);
    assert_eq!(both.matches("<section id=\"deployment-").count(), 2);
    let one = report(&folder, &["--deployment", "Other", "--significance", "1e-3"]).out;
    assert_eq!(one.matches("<section id=\"deployment-").count(), 1);
    assert!(one.contains("<code>Other</code> <small>at 1e-3"), "{one}");
}

#[test]
fn execution_times_have_their_evidence() {
    let measured = "executions = 20000\ngreatest = 9.5\ntimes = [10, 12]\nmethod = \"generalised Pareto\"\ndate = 2026-11-26\n\
                    samples = \"s\"\nfiles = []\nbytes = 1\nwarnings = [\"heavy-tail\"]\n";
    let folder = project(&format!(
        "levels = [1e-3, 1e-4]\n[codel]\nsee = [10, 12]\nplan = 3\n[measured.see]\n{measured}"
    ));
    let page = report(&folder, &[]).out;
    check_page(&page);
    let evidence = "measured</b> 2026-11-26, 20000 executions, the longest 9.5 ms; generalised Pareto<br/><b class=\"warned\">heavy-tail</b>";
    assert!(page.contains(evidence), "{page}");
    assert!(page.contains("<td>written by hand <small>t.toml</small></td>"), "{page}");
}
