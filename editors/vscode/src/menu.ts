import * as vscode from "vscode";
import { Server } from "./server";
import { openServerSetting } from "./settings";

interface Entry extends vscode.QuickPickItem {
  run?: () => unknown;
}

/** Shows the menu of the item in the status bar: the server that runs, and what one does with it. */
export async function showMenu(server: Server): Promise<void> {
  const command = (icon: string, label: string, name: string): Entry => ({
    label: `$(${icon}) ${label}`,
    run: () => vscode.commands.executeCommand(name),
  });
  const chosen = await vscode.window.showQuickPick<Entry>(
    [
      serverEntry(server),
      { label: "", kind: vscode.QuickPickItemKind.Separator },
      command("debug-restart", "Restart Server", "mauve.restartServer"),
      command("output", "Show Log", "mauve.showLog"),
      command("type-hierarchy", "Show Architecture", "mauve.showArchitecture"),
      command("lightbulb", "What If…", "mauve.whatIf"),
      command("settings", "Choose Significance Level", "mauve.chooseSignificance"),
      command("refresh", "Reload Models", "mauve.reloadModels"),
      command("package", "Generate Orocos Packages", "mauve.generatePackages"),
      { label: "$(gear) Open Settings", run: openServerSetting },
    ],
    { title: `MAUVE server: ${server.current.kind}` },
  );
  await chosen?.run?.();
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
