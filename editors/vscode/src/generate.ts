import * as path from "node:path";
import * as vscode from "vscode";
import type { WorkspaceEdit } from "vscode-languageclient/node";
import { behindLinks } from "./find";
import { languages } from "./recognise";
import { messageOf, Server } from "./server";

/** What the server answers to `mauve/generate`. */
interface Generated {
  folder: string;
  files: { path: string; action: "create" | "change" | "remove" }[];
  /** What stays, though the models have left it behind. */
  warning: string | null;
  /** That nothing changes. */
  nothing: string | null;
  edit: WorkspaceEdit;
}

/** Asks which packages are to be generated, of the projects that have the text in the active editor; generates them. */
export async function generatePackages(server: Server): Promise<void> {
  const document = vscode.window.activeTextEditor?.document;
  if (document === undefined || !languages.includes(document.languageId)) {
    void vscode.window.showInformationMessage("Open a model first: packages are generated for its project.");
    return;
  }
  await generate(server, document.uri.toString());
}

/**
 * Generates the Orocos packages of a deployment, or all of the projects that have a file. VS Code shows the edit before it
 * makes it, since the server asks for that; then the files are saved: they are for a compiler.
 */
export async function generate(server: Server, uri: string, deployment?: string | null): Promise<boolean> {
  let generated: Generated;
  try {
    generated = await server.request("mauve/generate", { textDocument: { uri }, deployment: deployment ?? undefined });
  } catch (error) {
    void vscode.window.showErrorMessage(`Nothing was generated: ${messageOf(error)}`);
    return false;
  }
  if (generated.warning !== null) {
    void vscode.window.showWarningMessage(generated.warning);
  }
  if (generated.nothing !== null) {
    void vscode.window.showInformationMessage(generated.nothing);
    return true;
  }
  const files = new Set(generated.files.map((file) => behindLinks(path.join(generated.folder, file.path))));
  const isTouched = (it: vscode.TextDocument) => it.isDirty && it.uri.scheme === "file" && files.has(behindLinks(it.uri.fsPath));
  const touched = () => vscode.workspace.textDocuments.filter(isTouched);
  const [unsaved] = touched();
  if (unsaved !== undefined) {
    void vscode.window.showErrorMessage(`${unsaved.fileName} has changes that are not saved: save or revert it first.`);
    return false;
  }
  const edit = await server.asEdit(generated.edit);
  // What the user types into one of the files while VS Code shows the edit, VS Code itself refuses to overwrite.
  if (!(await vscode.workspace.applyEdit(edit, { isRefactoring: true }))) {
    return false;
  }
  const saved = await Promise.all(touched().map((document) => document.save()));
  return saved.every((it) => it);
}
