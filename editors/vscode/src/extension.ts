import * as vscode from "vscode";
import { checkProject } from "./check";
import { generate, generatePackages } from "./generate";
import { showMenu } from "./menu";
import { newProject, openSample, showCreated } from "./project";
import { Panels } from "./panels";
import { languageOf } from "./recognise";
import { Runs } from "./run";
import { Server } from "./server";
import { Tree } from "./tree";
import { Verdict } from "./verdict";
import { openWalkthrough, watchSteps } from "./walkthrough";

let server: Server;

export async function activate(context: vscode.ExtensionContext): Promise<void> {
  const log = vscode.window.createOutputChannel("MAUVE", "log");
  const verdict: Verdict = new Verdict(() => server);
  server = new Server(context.extensionPath, log, (state) => verdict.showState(state), {
    // The server's own would leave the files to be saved by the user.
    "mauve.generateOrocos": (uri: string, deployment?: string) => generate(server, uri, deployment),
  });

  // A project begins and ends with its mauve.toml: which TOML and YAML files the server gets depends on it.
  const projects = vscode.workspace.createFileSystemWatcher("**/mauve.toml", false, true, false);
  context.subscriptions.push(
    log,
    verdict,
    projects,
    watchSteps(),
    new Panels(server, context.extensionUri),
    new Tree(server),
    new Runs(server, context.storageUri ?? context.globalStorageUri),
    vscode.languages.onDidChangeDiagnostics(() => verdict.update()),
    vscode.window.onDidChangeWindowState(({ focused }) => focused && server.focused()),
    projects.onDidCreate(() => server.restart()),
    projects.onDidDelete(() => server.restart()),
    vscode.commands.registerCommand("mauve.newProject", () => newProject(server, context)),
    vscode.commands.registerCommand("mauve.openSample", () => openSample(context)),
    vscode.commands.registerCommand("mauve.checkProject", () => checkProject(server)),
    vscode.commands.registerCommand("mauve.openWalkthrough", openWalkthrough),
    vscode.commands.registerCommand("mauve.generatePackages", () => generatePackages(server)),
    vscode.commands.registerCommand("mauve.chooseSignificance", () => chooseSignificance(server)),
    vscode.commands.registerCommand("mauve.showReferences", (uri, position, locations) =>
      server.showReferences(uri, position, locations),
    ),
    vscode.commands.registerCommand("mauve.reloadModels", () =>
      server.request("workspace/executeCommand", { command: "mauve.reload" }),
    ),
    vscode.commands.registerCommand("mauve.restartServer", () => server.restart()),
    vscode.commands.registerCommand("mauve.showLog", () => log.show()),
    vscode.commands.registerCommand("mauve.showMenu", () => showMenu(server, verdict)),
    vscode.workspace.onDidChangeConfiguration((change) => {
      if (change.affectsConfiguration("mauve.server")) {
        void server.restart();
      }
    }),
    // Then programs in it count too.
    vscode.workspace.onDidGrantWorkspaceTrust(() => server.restart()),
    vscode.workspace.onDidOpenTextDocument(recognise),
  );
  void vscode.commands.executeCommand("setContext", "mauve.isActive", true);
  await Promise.all(vscode.workspace.textDocuments.map(recognise));
  await server.restart();
  await showCreated(context);
}

export function deactivate(): Promise<void> | undefined {
  return server?.stop();
}

/** Asks at which level of the timing tables response times are to be shown, for the rest of the session. */
async function chooseSignificance(server: Server): Promise<void> {
  const status = await server.request<{ levels: number[]; workspaces: { significance: number }[] }>("mauve/status");
  const shown = new Set(status.workspaces.map(({ significance }) => significance));
  const levels = status.levels.map((level) => ({
    label: level.toExponential(),
    description: shown.has(level) ? "shown now" : undefined,
    level: level as number | null,
  }));
  const ofProject = { label: "mauve.toml", description: "the level that the project names", level: null };
  const chosen = await vscode.window.showQuickPick([...levels, ofProject], {
    title: "Significance level",
    placeHolder: "The probability that one execution of a codel exceeds the time in its table",
  });
  if (chosen !== undefined) {
    await vscode.commands.executeCommand("mauve.setSignificance", chosen.level);
  }
}

/** Documents that were given another language, once: what the user then chooses for them stays. */
const recognised = new Set<string>();

/** Gives a `.mal` document to the language that it is written in, whichever extension claimed it. */
async function recognise(document: vscode.TextDocument): Promise<void> {
  const uri = document.uri.toString();
  if (!document.uri.path.endsWith(".mal") || recognised.has(uri)) {
    return;
  }
  const language = languageOf(document.getText());
  if (language === "mal" && document.languageId === "mauve") {
    recognised.add(uri);
    const known = await vscode.languages.getLanguages();
    await vscode.languages.setTextDocumentLanguage(document, known.includes("mal") ? "mal" : "plaintext");
  } else if (language === "mauve" && document.languageId === "mal") {
    recognised.add(uri);
    await vscode.languages.setTextDocumentLanguage(document, "mauve");
  }
}
