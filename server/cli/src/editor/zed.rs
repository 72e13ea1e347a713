//! Zed: the folder of a development extension, which the user installs from Zed's menu. Not tested.

use super::embedded::ZED;
use super::home::EditorHome;
use super::installation::Wanted;
use mauve_projects::destination::behind_links;

pub(super) fn wanted(home: &EditorHome) -> Result<Wanted, String> {
    let folder = behind_links(&home.data.join("mauve/zed"))?;
    let mut wanted = Wanted::in_folder(&folder, ZED);
    wanted.notes = vec![
        "the support for Zed is not tested".to_owned(),
        format!(
            "Zed builds the extension with Rust from rustup: run `zed: install dev extension`, and select `{}`",
            folder.display()
        ),
        "response times need \"inlay_hints\": { \"enabled\": true } in Zed's settings".to_owned(),
    ];
    if let Some(program) = home.program_elsewhere() {
        wanted.notes.push(format!(
            "`mauve` on PATH is another program, or missing: set \"lsp\": {{ \"mauve\": {{ \"binary\": {{ \
             \"path\": \"{program}\", \"arguments\": [\"lsp\"] }} }} }} in Zed's settings"
        ));
    }
    Ok(wanted)
}
