import * as vscode from "vscode";
import { Server } from "./server";

/** Runs `mauve check` in a terminal, as a job in CI does, in the folder of the text in the active editor. */
export async function checkProject(server: Server): Promise<void> {
  const active = vscode.window.activeTextEditor?.document.uri;
  const folder = (active && vscode.workspace.getWorkspaceFolder(active)) ?? vscode.workspace.workspaceFolders?.[0];
  if (folder === undefined) {
    void vscode.window.showInformationMessage("Open the folder of a project first.");
    return;
  }
  const program = server.program();
  if (program === undefined) {
    return;
  }
  const execution = new vscode.ProcessExecution(program, ["check"], { cwd: folder.uri.fsPath });
  const task = new vscode.Task({ type: "process" }, folder, "check", "mauve", execution, []);
  task.presentationOptions = { clear: true, focus: false };
  await vscode.tasks.executeTask(task);
}
