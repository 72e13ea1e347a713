import { execFile } from "node:child_process";
import { cpSync, existsSync, readdirSync } from "node:fs";
import { homedir } from "node:os";
import * as path from "node:path";
import { promisify } from "node:util";
import * as vscode from "vscode";
import { Server } from "./server";

/** The key of the project that is created, and whose model is shown when VS Code has opened it. */
const CREATED = "created";

/** Asks for a folder, has `mauve new` create a project in it, and opens it. */
export async function newProject(server: Server, context: vscode.ExtensionContext): Promise<void> {
  const program = server.program();
  if (program === undefined) {
    return;
  }
  const [parent] =
    (await vscode.window.showOpenDialog({
      title: "New project: where is its folder created?",
      openLabel: "Create Here",
      canSelectFiles: false,
      canSelectFolders: true,
      defaultUri: vscode.Uri.file(homedir()),
    })) ?? [];
  if (parent === undefined) {
    return;
  }
  if (parent.scheme !== "file") {
    void vscode.window.showErrorMessage(`No project was created: ${parent} is not on a disk that the MAUVE server can write to.`);
    return;
  }
  const name = await vscode.window.showInputBox({
    title: `New project in ${parent.fsPath}`,
    prompt: "The name of its folder",
    value: "robot",
    validateInput: (name) => problemOf(parent.fsPath, name.trim()),
  });
  if (name === undefined) {
    return;
  }
  const folder = vscode.Uri.file(path.join(parent.fsPath, name.trim()));
  try {
    await promisify(execFile)(program, ["new", folder.fsPath], { cwd: parent.fsPath });
  } catch (error) {
    const { stderr, message } = error as { stderr?: string; message: string };
    void vscode.window.showErrorMessage(`No project was created: ${stderr?.trim() || message}`);
    return;
  }
  await open(folder, context);
}

/** Opens the sample project: a copy that the user may change. */
export async function openSample(context: vscode.ExtensionContext): Promise<void> {
  const folder = vscode.Uri.joinPath(context.globalStorageUri, "p3dx");
  if (!existsSync(folder.fsPath)) {
    cpSync(path.join(context.extensionPath, "sample"), folder.fsPath, { recursive: true });
  }
  await open(folder, context);
}

/** Returns why a project cannot be created in a folder of this name, if so. */
function problemOf(parent: string, name: string): string | undefined {
  if (name === "") {
    return "Enter the name of a folder.";
  }
  if (name === "." || name === ".." || /[/\\]/.test(name)) {
    return "Enter a name without a path.";
  }
  const folder = path.join(parent, name);
  try {
    return readdirSync(folder).length > 0 ? `${folder} is not empty. Enter another name.` : undefined;
  } catch (error) {
    const isFile = (error as NodeJS.ErrnoException).code === "ENOTDIR";
    return isFile ? `${folder} is a file. Enter another name.` : undefined;
  }
}

/** Opens a project, in the window that the user chooses if this one has a workspace. */
async function open(folder: vscode.Uri, context: vscode.ExtensionContext): Promise<void> {
  let forceNewWindow = false;
  if (vscode.workspace.workspaceFolders !== undefined) {
    const choice = await vscode.window.showInformationMessage(
      `The project is in ${folder.fsPath}.`,
      { modal: true },
      "Open",
      "Open in New Window",
    );
    if (choice === undefined) {
      return;
    }
    forceNewWindow = choice === "Open in New Window";
  }
  await context.globalState.update(CREATED, folder.fsPath);
  await vscode.commands.executeCommand("vscode.openFolder", folder, { forceNewWindow });
}

/** Shows the model of a project that was just created. */
export async function showCreated(context: vscode.ExtensionContext): Promise<void> {
  const created = context.globalState.get<string>(CREATED);
  const folder = vscode.workspace.workspaceFolders?.find(({ uri }) => uri.scheme === "file" && uri.fsPath === created);
  if (folder === undefined) {
    return;
  }
  await context.globalState.update(CREATED, undefined);
  const models = await vscode.workspace.findFiles(new vscode.RelativePattern(folder, "*.mal"));
  const model = models.find(({ path }) => path.endsWith("/deployment.mal")) ?? models[0];
  if (model !== undefined) {
    await vscode.window.showTextDocument(model);
  }
}
