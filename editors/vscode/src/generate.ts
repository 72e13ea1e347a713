import { realpath } from "node:fs/promises";
import * as path from "node:path";
import * as vscode from "vscode";
import { LSPErrorCodes, ResponseError, WorkspaceEdit } from "vscode-languageclient/node";
import { Server } from "./server";

/** What the server answers to `mauve/generate`. */
interface Generated {
  folder: string;
  files: { path: string; action: "create" | "change" | "remove" }[];
  changedCodels: { path: string; before: string; now: string }[];
  leftCodels: string[];
  leftFiles: string[];
  leftPackages: string[];
  edit: WorkspaceEdit;
}

/** Asks which packages are to be generated, of the projects that have the text in the active editor; generates them. */
export async function generatePackages(server: Server): Promise<void> {
  const document = vscode.window.activeTextEditor?.document;
  if (document === undefined || !["mauve", "toml"].includes(document.languageId)) {
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
  const generated = await ask(server, uri, deployment ?? undefined);
  if (generated === undefined) {
    return false;
  }
  const codels = generated.changedCodels.map(({ path, before, now }) =>
    before === "" ? `The prototype of the codel in ${path} is now "${now}".` : `The prototype of the codel in ${path} is now "${now}"; it was "${before}".`,
  );
  codels.push(...generated.leftCodels.map((path) => `${path}: the model no longer has this codel.`));
  codels.push(...generated.leftFiles.map((path) => `${path} is no longer generated; it is kept because you may have written it.`));
  if (codels.length > 0) {
    void vscode.window.showWarningMessage(`Your own files in ${generated.folder} are kept. ${codels.join(" ")}`);
  }
  if (generated.leftPackages.length > 0) {
    const packages = generated.leftPackages.join(", ");
    void vscode.window.showWarningMessage(
      `These packages in ${generated.folder} are no longer generated from the models; remove them if you do not need them: ${packages}.`,
    );
  }
  if (generated.files.length === 0) {
    void vscode.window.showInformationMessage(`The Orocos packages in ${generated.folder} are up to date.`);
    return true;
  }
  const files = new Set(await Promise.all(generated.files.map((file) => behindLinks(path.join(generated.folder, file.path)))));
  const touched = async () => {
    const changed = vscode.workspace.textDocuments.filter((it) => it.isDirty && it.uri.scheme === "file");
    const places = await Promise.all(changed.map((it) => behindLinks(it.uri.fsPath)));
    return changed.filter((_, index) => files.has(places[index]));
  };
  const [unsaved] = await touched();
  if (unsaved !== undefined) {
    void vscode.window.showErrorMessage(`${unsaved.fileName} has changes that are not saved: save or revert it first.`);
    return false;
  }
  const edit = await server.asEdit(generated.edit);
  // What the user types into one of the files while VS Code shows the edit, VS Code itself refuses to overwrite.
  if (!(await vscode.workspace.applyEdit(edit, { isRefactoring: true }))) {
    return false;
  }
  const saved = await Promise.all((await touched()).map((document) => document.save()));
  return saved.every((it) => it);
}

/** Where a file is behind all links, be it there or not: a folder may be open by another name. */
async function behindLinks(file: string): Promise<string> {
  try {
    return await realpath(file);
  } catch {
    const folder = path.dirname(file);
    return folder === file ? file : path.join(await behindLinks(folder), path.basename(file));
  }
}

/** What is to be done; nothing where the server says why not, which the user is told. */
async function ask(server: Server, uri: string, deployment?: string): Promise<Generated | undefined> {
  for (let attempt = 0; ; attempt++) {
    try {
      return await server.ask<Generated>("mauve/generate", { textDocument: { uri }, deployment });
    } catch (error) {
      // What is typed meanwhile overtakes it.
      const isOvertaken = error instanceof ResponseError && error.code === LSPErrorCodes.ContentModified;
      if (!isOvertaken || attempt === 9) {
        void vscode.window.showErrorMessage(`Nothing was generated: ${error instanceof Error ? error.message : error}`);
        return undefined;
      }
    }
  }
}
