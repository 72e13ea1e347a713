import { ChildProcess, spawn } from "node:child_process";
import { randomBytes } from "node:crypto";
import { existsSync, mkdirSync, rmSync } from "node:fs";
import { FileHandle, open } from "node:fs/promises";
import * as path from "node:path";
import * as vscode from "vscode";
import type { Graph } from "./answers";
import { bodyOf, Comparison, Observed, observedOf, Periods, width } from "./observed";
import { languages } from "./recognise";
import { messageOf, Server } from "./server";

/** So often, in milliseconds, the figures of a run that goes on are read. */
const pace = 500;

/** The project and the program that a command works with. */
interface Place {
  program: string;
  folder: vscode.Uri;
  /** The path of the project or, without mauve.toml, of the model. */
  model: string;
  graph: Graph;
}

/** How a program of `mauve` ended. */
interface Ended {
  code: number | null;
  stdout: string;
  stderr: string;
  /** The user knows why then. */
  isCancelled: boolean;
}

/** Follows a run until it is over. */
type Follow = (isOver: () => boolean, progress: vscode.Progress<{ message?: string }>) => Promise<unknown>;

/** The commands that run a deployment, and those that read recordings. */
export class Runs implements vscode.Disposable {
  private readonly output = vscode.window.createOutputChannel("MAUVE Run");
  private view?: vscode.WebviewPanel;
  private readonly children = new Set<ChildProcess>();
  private readonly registrations: vscode.Disposable;

  constructor(
    private readonly server: Server,
    /** Where the recording of the last run is. */
    private readonly storage: vscode.Uri,
  ) {
    const command = (name: string, run: () => Promise<unknown>) =>
      vscode.commands.registerCommand(name, () => run().catch((error) => vscode.window.showErrorMessage(messageOf(error))));
    this.registrations = vscode.Disposable.from(
      this.output,
      command("mauve.run", () => this.run()),
      command("mauve.importRecording", () => this.import()),
      command("mauve.checkRecording", () => this.check()),
    );
  }

  dispose(): void {
    this.children.forEach((it) => it.kill("SIGINT"));
    this.registrations.dispose();
  }

  private get recording(): string {
    return path.join(this.storage.fsPath, "recording");
  }

  /** Builds and runs a deployment, and shows its response times beside their bounds while it runs. */
  private async run(): Promise<void> {
    const place = await this.place("run");
    if (place === undefined) {
      return;
    }
    const codels = path.join(place.folder.fsPath, "generated");
    const ways = [
      { label: "On a virtual clock, for 60 s of it", description: "codels take the times of the tables", options: ["--simulate-time", "--for", "60s"] },
      { label: "In real time, for 10 s", description: "codels take the times of the tables", options: ["--for", "10s"] },
      { label: "In real time, until it is cancelled", description: "codels take the times of the tables", options: [] },
      ...(existsSync(codels) ? [{ label: "With your codels, until it is cancelled", description: codels, options: ["--codels", codels] }] : []),
    ];
    const way = await vscode.window.showQuickPick(ways, { title: `Run ${place.graph.name}`, placeHolder: "How is it to run?" });
    if (way !== undefined) {
      await this.runWith(place, way.options);
    }
  }

  private async runWith(place: Place, options: string[]): Promise<unknown> {
    const { graph, model } = place;
    rmSync(this.recording, { recursive: true, force: true });
    mkdirSync(this.storage.fsPath, { recursive: true });
    const periods = new Periods();
    const show = (state: string) => this.show(`${graph.name}: ${state}`, graph, periods.observed, []);
    const follow: Follow = async (isOver, progress) => {
      let file: FileHandle | undefined;
      for (let isLast = false; ; ) {
        // The file gets its name when it is complete; one that is open stays so.
        for (const name of ["periods.csv.partial", "periods.csv"]) {
          file ??= await open(path.join(this.recording, name)).catch(() => undefined);
        }
        const part = (await file?.readFile("utf8")) ?? "";
        periods.add(part);
        if (part !== "") {
          show("running");
          const count = [...periods.observed.values()].reduce((sum, it) => sum + it.periods, 0);
          progress.report({ message: `${count} periods so far` });
        }
        if (isLast) {
          return file?.close();
        }
        isLast = isOver();
        await new Promise((resolve) => setTimeout(resolve, isLast ? 0 : pace));
      }
    };
    const parameters = ["run", model, "--deployment", graph.name, "--trace", this.recording, ...options];
    const ended = await this.start(place, `Running ${graph.name}`, parameters, follow);
    const anyway = "--allow-non-realtime";
    if (!existsSync(this.recording)) {
      const offers = ended.stderr.includes(anyway) && !options.includes(anyway) ? ["Run Without Real-Time Priorities"] : [];
      const choice = await this.fail(`${graph.name} did not run`, ended, ...offers);
      return choice && this.runWith(place, [...options, anyway]);
    }
    return this.compare(place, [this.recording], ended.code === 0 ? "" : ` (exit code ${ended.code}: see the output)`);
  }

  /** Adds the execution times of a recording to a sample file. */
  private async import(): Promise<unknown> {
    const place = await this.place("import");
    const recordings = place && (await this.ask("Import"));
    const samples =
      recordings &&
      (await vscode.window.showSaveDialog({
        title: "The sample file that the executions are added to",
        saveLabel: "Add",
        defaultUri: vscode.Uri.joinPath(place.folder, `${path.basename(place.folder.fsPath)}.samples`),
      }));
    if (samples === undefined) {
      return;
    }
    const ended = await this.start(place!, "Importing the recording", ["trace", "import", ...recordings!, "-o", samples.fsPath]);
    if (ended.code !== 0) {
      return this.fail("Nothing was imported", ended);
    }
    const said = /^imported .*/m.exec(`${ended.stdout}\n${ended.stderr}`)?.[0] ?? "imported";
    if ((await vscode.window.showInformationMessage(said, "Show What Was Observed")) !== undefined) {
      // The samples are not text. What is beside them is, and says how `mauve check` compares it.
      const { dir, name } = path.parse(samples.fsPath);
      await vscode.window.showTextDocument(vscode.Uri.file(path.join(dir, `${name}.observed.toml`)));
    }
  }

  /** Compares a recording with the model. */
  private async check(): Promise<void> {
    const place = await this.place("check");
    const recordings = place && (await this.ask("Check"));
    if (recordings !== undefined) {
      await this.compare(place!, recordings, "");
    }
  }

  private async compare(place: Place, recordings: string[], more: string): Promise<unknown> {
    const { graph, model } = place;
    const parameters = ["trace", "check", "--format", "json", "--deployment", graph.name, ...recordings, model];
    const ended = await this.start(place, "Comparing the recording with the model", parameters);
    if (!ended.stdout.startsWith("{")) {
      return this.fail("The recording was not compared", ended);
    }
    const comparison = JSON.parse(ended.stdout) as Comparison;
    const { length } = comparison.findings;
    const said = length === 0 ? "nothing contradicts the model" : length === 1 ? "1 finding contradicts the model" : `${length} findings contradict the model`;
    this.show(`${graph.name}: ${said}${more}`, graph, observedOf(comparison), comparison.findings.map(({ message }) => message));
    const tell = length === 0 && more === "" ? vscode.window.showInformationMessage : vscode.window.showWarningMessage;
    void tell(`${graph.name}: ${said}${more}`, "Show Output").then((choice) => choice && this.output.show());
  }

  /** Says what failed, unless the user cancelled it; returns the offer that is chosen. */
  private async fail(what: string, { stderr, isCancelled }: Ended, ...offers: string[]): Promise<string | undefined> {
    const choice = isCancelled ? undefined : await vscode.window.showErrorMessage(`${what}: ${lastLine(stderr)}`, "Show Output", ...offers);
    return choice === "Show Output" ? void this.output.show() : choice;
  }

  /** The recordings to be read: that of the last run, or others. */
  private async ask(label: string): Promise<string[] | undefined> {
    if (existsSync(this.recording)) {
      const last = { label: "The recording of the last run", paths: [this.recording] };
      const chosen = await vscode.window.showQuickPick([last, { label: "Another recording…", paths: undefined }], { title: `${label} which recording?` });
      if (chosen === undefined || chosen.paths !== undefined) {
        return chosen?.paths;
      }
    }
    const kinds = [
      { label: "Folder", description: "of LTTng, or of mauve run --trace", isFolder: true },
      { label: "File", description: "of executions, as comma-separated values", isFolder: false },
    ];
    const kind = await vscode.window.showQuickPick(kinds, { title: `${label} which recording?` });
    const isFolder = kind?.isFolder ?? false;
    const options = { title: `${label} which recording?`, openLabel: label, canSelectFolders: isFolder, canSelectFiles: !isFolder, canSelectMany: true };
    return kind && (await vscode.window.showOpenDialog(options))?.map(({ fsPath }) => fsPath);
  }

  /** The folder of the active text, and the deployment; nothing where the user is told why, or chooses none. */
  private async place(what: "run" | "import" | "check"): Promise<Place | undefined> {
    if (what === "run" && !vscode.workspace.isTrusted) {
      const told = "MAUVE: Run builds and runs the code of this folder. Trust the folder first.";
      if ((await vscode.window.showErrorMessage(told, "Manage Trust")) !== undefined) {
        await vscode.commands.executeCommand("workbench.trust.manage");
      }
      return undefined;
    }
    const [config] = await vscode.workspace.findFiles("**/mauve.toml", undefined, 1);
    const active = vscode.window.activeTextEditor?.document;
    const uri = active !== undefined && languages.includes(active.languageId) ? active.uri : config;
    if (uri?.scheme !== "file") {
      void vscode.window.showInformationMessage("Open a model of a project on a disk first.");
      return undefined;
    }
    const graphs = await this.server.request<Graph[]>("mauve/graph", { textDocument: { uri: uri.toString() }, drawing: "dot" });
    const deployments = graphs.filter(({ significance }) => significance !== null);
    const names = deployments.map((graph) => ({ label: graph.name, description: graph.root, graph }));
    const chosen = names.length < 2 ? names[0] : await vscode.window.showQuickPick(names, { title: "Which deployment?" });
    if (names.length === 0) {
      void vscode.window.showInformationMessage("The project of this text has no deployment.");
    }
    const program = this.server.program();
    if (chosen === undefined || program === undefined) {
      return undefined;
    }
    await vscode.workspace.saveAll(false);
    const project = projectOf(uri.fsPath);
    return { program, graph: chosen.graph, folder: vscode.Uri.file(project ?? path.dirname(uri.fsPath)), model: project ?? uri.fsPath };
  }

  /** Runs the program with a progress that can be cancelled, as Ctrl-C does; `follow` goes on until it is over. */
  private async start(place: Place, title: string, parameters: string[], follow?: Follow): Promise<Ended> {
    this.output.appendLine(`mauve ${parameters.join(" ")}`);
    const options = { location: vscode.ProgressLocation.Notification, title, cancellable: true };
    return vscode.window.withProgress(options, async (progress, token) => {
      const child = spawn(place.program, parameters, { cwd: place.folder.fsPath });
      this.children.add(child);
      const ended: Ended = { code: null, stdout: "", stderr: "", isCancelled: false };
      token.onCancellationRequested(() => (ended.isCancelled = child.kill("SIGINT")));
      const isDocument = parameters.includes("json");
      child.stdout.setEncoding("utf8").on("data", (text: string) => {
        ended.stdout += text;
        this.output.append(isDocument ? "" : text);
      });
      child.stderr.setEncoding("utf8").on("data", (text: string) => {
        ended.stderr += text;
        this.output.append(text);
      });
      progress.report({ message: follow && "building the program" });
      let isOver = false;
      const over = new Promise<void>((resolve) => {
        child.on("error", (error) => (ended.stderr += messageOf(error)));
        child.on("close", (code) => {
          ended.code = code;
          isOver = true;
          resolve();
        });
      });
      await Promise.all([over, follow?.(() => isOver, progress)]);
      this.children.delete(child);
      return ended;
    });
  }

  /** Shows what was observed in the panel, which stays open for the next figures. */
  private show(title: string, graph: Graph, observed: ReadonlyMap<string, Observed>, findings: string[]): void {
    if (this.view === undefined) {
      const place = { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true };
      this.view = vscode.window.createWebviewPanel("mauve.observed", "Observed", place, { enableScripts: true, localResourceRoots: [], retainContextWhenHidden: true });
      this.view.onDidDispose(() => (this.view = undefined));
      this.view.webview.html = page();
    }
    void this.view.webview.postMessage(bodyOf(title, graph.nodes, observed, findings));
  }
}

/** The nearest folder with a mauve.toml above a file. */
function projectOf(file: string): string | undefined {
  const folder = path.dirname(file);
  return folder === file ? undefined : existsSync(path.join(folder, "mauve.toml")) ? folder : projectOf(folder);
}

function lastLine(text: string): string {
  return text.trimEnd().split("\n").at(-1) ?? "";
}

/** A page whose only script shows the bodies that it is sent. */
function page(): string {
  const nonce = randomBytes(16).toString("hex");
  return `<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'nonce-${nonce}'; script-src 'nonce-${nonce}'">
<title>Observed</title><style nonce="${nonce}">
body { font: var(--vscode-font-size) var(--vscode-font-family); padding: 1em; }
h1, h2 { font-size: 1.1em; } table { border-collapse: collapse; } th { text-align: left; font-weight: normal; }
th, td { padding: 2px 1em 2px 0; white-space: nowrap; } thead { color: var(--vscode-descriptionForeground); vertical-align: bottom; } thead th { white-space: normal; }
td svg { width: clamp(40px, 25vw, ${width}px); } @media (max-width: 480px) { th, td { padding-right: .6em; } :is(th, td):last-child { display: none; } }
.track { fill: var(--vscode-editorWidget-border, #8888); } .seen { fill: var(--vscode-charts-blue); color: var(--vscode-charts-blue); }
.missed .seen { fill: var(--vscode-editorError-foreground); } .missed td:nth-child(2) { color: var(--vscode-editorError-foreground); }
line { stroke-width: 2; } .bound { stroke: var(--vscode-charts-orange); color: var(--vscode-charts-orange); }
.deadline { stroke: var(--vscode-foreground); color: var(--vscode-foreground); }
</style></head><body><main></main><script nonce="${nonce}">
addEventListener("message", ({ data }) => (document.querySelector("main").innerHTML = data));
</script></body></html>`;
}
