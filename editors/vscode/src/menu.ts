import * as vscode from "vscode";
import { entriesOf, Entry, fixesOf, mostWithFixes, Problem, problemsOf } from "./problems";
import { messageOf, Server } from "./server";
import { openServerSetting } from "./settings";

/** So many milliseconds the list waits for its problems and fixes. */
const patience = 500;

/** Shows the list behind the item in the status bar: the problems with their fixes, then the server and what one does with it. */
export async function showMenu(server: Server, verdict: { text: string }): Promise<void> {
  const picker = vscode.window.createQuickPick<Entry>();
  const menu = menuOf(server);
  const title = () => (verdict.text === "" ? `MAUVE server: ${server.current.kind}` : `MAUVE ${verdict.text}`);
  picker.title = title();
  picker.placeholder = "Go to a problem, apply a fix, or choose a command";
  picker.matchOnDescription = true;
  picker.keepScrollPosition = true;
  picker.items = menu;
  let isOpen = true;
  picker.onDidHide(() => {
    isOpen = false;
    picker.dispose();
  });
  picker.onDidAccept(() => {
    const [chosen] = picker.selectedItems;
    picker.hide();
    Promise.resolve(chosen?.run?.()).catch((error) => vscode.window.showErrorMessage(messageOf(error)));
  });
  const fill = async () => {
    const problems = await problemsOf(server);
    const none = { label: verdict.text === "" ? "The models are being analysed" : "No problems" };
    const fixes = new Map<Problem, vscode.CodeAction[]>();
    const show = () => {
      const [active] = picker.activeItems;
      picker.title = title();
      picker.items = [...(problems.length === 0 ? [none] : entriesOf(problems, fixes)), ...menu];
      // The row that the user has reached stays the active one.
      picker.activeItems = picker.items.filter(({ label }) => fixes.size > 0 && label === active?.label).slice(0, 1);
    };
    show();
    for (const problem of problems.slice(0, mostWithFixes)) {
      fixes.set(problem, isOpen ? await fixesOf(problem) : []);
      if (isOpen) {
        show();
      }
    }
    picker.busy = false;
  };
  if (server.current.kind === "running") {
    picker.busy = true;
    // Rows that come later move those that the user may be about to click.
    await Promise.race([fill(), new Promise((resolve) => setTimeout(resolve, patience))]);
  }
  picker.show();
}

function menuOf(server: Server): Entry[] {
  const command = (icon: string, label: string, name: string): Entry => ({
    label: `$(${icon}) ${label}`,
    run: () => vscode.commands.executeCommand(name),
  });
  return [
    { label: "Show", kind: vscode.QuickPickItemKind.Separator },
    command("type-hierarchy", "Show Architecture", "mauve.showArchitecture"),
    command("lightbulb", "What If…", "mauve.whatIf"),
    command("play", "Run…", "mauve.run"),
    command("settings", "Choose Significance Level", "mauve.chooseSignificance"),
    command("package", "Generate Orocos Packages", "mauve.generatePackages"),
    { label: "Server", kind: vscode.QuickPickItemKind.Separator },
    serverEntry(server),
    command("debug-restart", "Restart Server", "mauve.restartServer"),
    command("output", "Show Log", "mauve.showLog"),
    command("refresh", "Reload Models", "mauve.reloadModels"),
    { label: "$(gear) Open Settings", run: openServerSetting },
  ];
}

/** The path and the version of the server, copied when chosen; the problem where no server runs. */
function serverEntry(server: Server): Entry {
  const state = server.current;
  if (state.kind === "error") {
    return { label: "$(error) No server", detail: state.problem, run: () => vscode.env.clipboard.writeText(state.problem) };
  }
  if (state.kind !== "running") {
    return { label: `$(circle-slash) The server is ${state.kind}` };
  }
  const version = `mauve ${state.version ?? "of unknown version"}`;
  return {
    label: `$(copy) ${version}`,
    detail: state.path,
    run: () => vscode.env.clipboard.writeText(`${state.path} (${version})`),
  };
}
