//! What is too large to be analysed is reported once, and soon.

use mauve_diagnostics::workspace_diagnostics;
use mauve_hir::{Database, Workspace};

fn codes(text: String) -> Vec<&'static str> {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
    let found = workspace_diagnostics(&db, workspace);
    found.iter().map(|it| it.diagnostic.code.name).collect()
}

fn many(count: usize, line: impl Fn(usize) -> String) -> String {
    (0..count).map(line).collect()
}

#[test]
fn a_product_of_many_is_too_large() {
    let component = "shell S { property p: int = 0  property q: int = 0 } core C(S) { update = { } }\n\
                     component K(S, C)\n";
    let instances = |count| many(count, |it| format!("instance i{it}: K\n"));
    for (what, text) in [
        ("a chain of shells", many(1100, |it| format!("shell S{} extends S{it} {{ }}\n", it + 1))),
        ("a chain of imports", many(1100, |it| format!("architecture A{} {{ import A{it} }}\n", it + 1))),
        ("a ring", many(800, |it| format!("architecture A{} {{ import A{it} }}\n", (it + 1) % 800))),
        (
            "a deployment with very many activities",
            format!("{component} architecture A {{ {} }} deployment D {{ architecture A }}", instances(3000)),
        ),
        (
            "very many activities of nothing",
            format!(
                "deployment D {{ architecture A\n{} }}",
                many(3000, |it| format!("activity i{it} {{ }}\n"))
            ),
        ),
        (
            "very many deployments",
            format!("{component} architecture A {{ {} }}\n", instances(200))
                + &many(300, |it| format!("deployment D{it} {{ architecture A }}\n")),
        ),
    ] {
        let found = codes(text);
        assert_eq!(found.iter().filter(|code| **code == "too-large").count(), 1, "{what}: {found:?}");
    }
}

#[test]
fn a_large_robot_is_not() {
    let text = "shell Base { property p: int = 0 } core C(Base) { update = { } }\n".to_owned()
        + &many(2000, |it| format!("shell S{it} extends Base {{ property q: int = 0 }}\n"))
        + "component K(Base, C)\n"
        + &format!("architecture A {{ {} }}\n", many(1000, |it| format!("instance i{it}: K\n")))
        + "deployment D { architecture A }";
    assert!(!codes(text).contains(&"too-large"));
}
