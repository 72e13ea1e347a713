import { randomBytes } from "node:crypto";
import * as path from "node:path";
import * as vscode from "vscode";
import type { Location } from "vscode-languageclient/node";
import type { Answers, FromPanel, Item, PanelKind, Subject, ToPanel } from "./answers";
import { kinds, Loaded, nameOf, Request } from "./kinds";
import { Latest } from "./latest";
import { hasLost, typingTime } from "./lost";
import { litAt, Places, placesOf } from "./lit";
import { moved } from "./moved";
import { languages } from "./recognise";
import { messageOf, Server } from "./server";
import { valuesOf } from "./values";

/** The commands that open panels. */
const commands: Record<PanelKind, string> = {
  architecture: "mauve.showArchitecture",
  stateMachine: "mauve.showStateMachine",
  schedule: "mauve.showSchedule",
  chains: "mauve.showChains",
  cpuBudget: "mauve.showCpuBudget",
  executionTimes: "mauve.showExecutionTimes",
  probability: "mauve.showProbability",
  whatIf: "mauve.whatIf",
};

/** So many milliseconds after a change without an answer, a drawing is marked as an earlier one. */
const patience = 500;

/** The panels: one of each kind at most. */
export class Panels implements vscode.Disposable {
  private readonly open = new Map<PanelKind, Panel>();
  private readonly registrations: vscode.Disposable;

  constructor(
    private readonly server: Server,
    private readonly extension: vscode.Uri,
  ) {
    const names = Object.keys(commands) as PanelKind[];
    const all = () => [...this.open.values()];
    this.registrations = vscode.Disposable.from(
      ...names.map((kind) => vscode.commands.registerCommand(commands[kind], (uri, place) => this.show(kind, uri, place))),
      ...names.map((kind) =>
        vscode.window.registerWebviewPanelSerializer(`mauve.${kind}`, {
          deserializeWebviewPanel: async (panel, state?: { subject?: Subject }) => {
            // A page that was never shown has no state.
            const subject = state?.subject ?? subjectOf(undefined);
            if (subject === undefined) {
              panel.dispose();
            } else {
              this.add(kind, panel, subject);
            }
          },
        }),
      ),
      ...["save", "copy"].map((what) =>
        vscode.commands.registerCommand(`mauve.${what}Drawing`, () => {
          const panel = all().find(({ view }) => view.active) ?? all().find(({ view }) => view.visible);
          return panel?.export(what as "save" | "copy");
        }),
      ),
      server.onDidEdit((change) => all().forEach((panel) => panel.edit(change))),
      server.onDidUpdate(() => all().forEach((panel) => panel.update())),
      server.onDidEnd(() => all().forEach((panel) => panel.expire())),
      vscode.window.onDidChangeTextEditorSelection(() => all().forEach((panel) => panel.light())),
      vscode.window.onDidChangeActiveTextEditor(() => all().forEach((panel) => panel.light())),
    );
  }

  dispose(): void {
    this.registrations.dispose();
  }

  /** Shows a panel of the declaration at the cursor, or at a place that a code lens or the tree names. */
  private async show(kind: PanelKind, uri?: unknown, place?: Partial<Subject>): Promise<void> {
    let subject = subjectOf(uri, place);
    if (subject === undefined && kind === "architecture") {
      // Without a model in an editor, as in the walkthrough, the panel shows the first project.
      const [project] = await vscode.workspace.findFiles("**/mauve.toml", undefined, 1);
      subject = project && { uri: project.toString() };
    }
    if (subject === undefined) {
      void vscode.window.showInformationMessage("Open a model first: the panel shows the declaration at the cursor in it.");
      return;
    }
    const opened = this.open.get(kind);
    if (opened !== undefined) {
      opened.reveal(subject);
      return;
    }
    const column = { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true };
    this.add(kind, vscode.window.createWebviewPanel(`mauve.${kind}`, "MAUVE", column), subject);
  }

  private add(kind: PanelKind, view: vscode.WebviewPanel, subject: Subject): void {
    this.open.get(kind)?.view.dispose();
    const panel = new Panel(kind, view, subject, this.server, this.extension);
    this.open.set(kind, panel);
    view.onDidDispose(() => {
      panel.dispose();
      if (this.open.get(kind) === panel) {
        this.open.delete(kind);
      }
    });
  }
}

/** A panel, which follows the texts. */
class Panel {
  private loaded?: Loaded<Answers[PanelKind]>;
  private places: Places = new Map();
  /** Why the drawing is not that of the text; empty if it is. */
  private mark = "";
  private problem = "";
  private timer?: NodeJS.Timeout;
  /** Until then the user may be typing, and unknown figures are not shown. */
  private typingEnds = 0;
  private again?: NodeJS.Timeout;
  /** Counts the subjects: an answer about an earlier one is not shown. */
  private subjects = 0;
  /** Whether its page is narrow, as it is beside an editor. */
  private narrow = true;
  private readonly ask: Request = (method, parameters) =>
    this.server.request(method, this.narrow ? { ...parameters, drawing: "narrow" } : parameters);
  private readonly latest = new Latest((isOutdated) => this.load(isOutdated));

  constructor(
    private readonly kind: PanelKind,
    readonly view: vscode.WebviewPanel,
    private subject: Subject,
    private readonly server: Server,
    extension: vscode.Uri,
  ) {
    const { webview } = view;
    webview.options = { enableScripts: true, localResourceRoots: ["out", "media"].map((it) => vscode.Uri.joinPath(extension, it)) };
    view.iconPath = vscode.Uri.joinPath(extension, "icon.png");
    webview.onDidReceiveMessage((message: FromPanel) => this.receive(message));
    // A hidden panel asks for nothing, and its page is gone until it is visible again.
    view.onDidChangeViewState(() => view.visible && this.update());
    webview.html = page(webview, extension, kind);
    this.update();
  }

  dispose(): void {
    clearTimeout(this.timer);
    clearTimeout(this.again);
    this.latest.abandon();
  }

  reveal(subject: Subject): void {
    this.view.reveal(undefined, true);
    // The state at the beginning is kept until the panel is closed.
    const { values, before } = this.subject;
    this.change(this.kind === "whatIf" ? { ...subject, values, before } : subject);
  }

  private change(subject: Subject): void {
    this.subject = subject;
    this.subjects++;
    this.latest.abandon();
    this.update();
  }

  /** A text has changed: its places have moved, and the drawing may be an earlier one. */
  edit({ document, contentChanges }: vscode.TextDocumentChangeEvent): void {
    const { uri, position } = this.subject;
    if (position !== undefined && document.uri.toString() === uri) {
      this.subject = { ...this.subject, position: contentChanges.reduce(moved, position) };
    }
    this.typingEnds = Date.now() + typingTime;
    this.timer ??= setTimeout(() => this.setMark("Earlier drawing: the server has not answered since the last edit"), patience);
  }

  /** The server has ended: another may follow. */
  expire(): void {
    this.latest.abandon();
    this.setMark("Earlier drawing: the server is not running");
  }

  update(): void {
    if (this.view.visible) {
      void this.latest.request();
    }
  }

  private async load(isOutdated: () => boolean): Promise<void> {
    const { subject, subjects, kind } = this;
    let loaded: Loaded<Answers[PanelKind]>;
    try {
      loaded = await kinds[kind].load(this.ask, subject);
    } catch (error) {
      if (!isOutdated()) {
        this.fail(error);
      }
      return;
    }
    if (subjects !== this.subjects) {
      return;
    }
    // Of an incomplete text, the last drawing says more.
    const { answer } = loaded;
    const before = this.loaded;
    const isOfSame = before !== undefined && before.subject.name === loaded.subject.name && before.chosen === loaded.chosen;
    if (answer.incomplete && isOfSame && !before.answer.incomplete) {
      this.stopWaiting();
      this.setMark("Earlier drawing: the text has syntax errors");
      return;
    }
    clearTimeout(this.again);
    const left = this.typingEnds - Date.now();
    if (left > 0 && isOfSame && hasLost(before.answer, answer)) {
      this.stopWaiting();
      this.setMark("Earlier drawing: figures are unknown since the last edit");
      this.again = setTimeout(() => this.update(), left);
      return;
    }
    this.subject = { ...loaded.subject, position: this.subject.position };
    this.problem = "";
    const isSame = before !== undefined && JSON.stringify(before) === JSON.stringify(loaded);
    this.loaded = loaded;
    if (!isSame) {
      this.places = placesOf(answer);
      this.view.title = `${kinds[kind].title}: ${nameOf(loaded.subject)}`;
      this.send();
    }
    if (!isOutdated()) {
      this.stopWaiting();
      this.setMark(answer.incomplete ? "Incomplete: the text has syntax errors" : "");
    }
  }

  /** The server has answered: the panel no longer waits. */
  private stopWaiting(): void {
    clearTimeout(this.timer);
    this.timer = undefined;
  }

  private fail(error: unknown): void {
    if (this.server.current.kind === "starting") {
      return; // It says when it runs.
    }
    const message = messageOf(error);
    this.stopWaiting();
    if (this.loaded === undefined || this.subject.name === undefined) {
      this.loaded = undefined;
      this.problem = message;
      this.post({ type: "problem", message });
    } else {
      this.setMark(`Earlier drawing: ${message}`);
    }
  }

  private setMark(why: string): void {
    if (this.mark !== why) {
      this.mark = why;
      this.post({ type: "mark", why });
    }
  }

  private post(message: ToPanel): void {
    void this.view.webview.postMessage(message);
  }

  private send(): void {
    const { kind, loaded, subject } = this;
    if (loaded !== undefined) {
      this.post({ type: "show", kind, answer: loaded.answer, choices: loaded.choices, chosen: loaded.chosen, subject });
      this.light();
    }
  }

  /** Lights the elements at the cursor. */
  light(): void {
    const editor = vscode.window.activeTextEditor;
    if (editor !== undefined && this.view.visible) {
      const line = editor.selection.active.line;
      this.post({ type: "light", items: litAt(this.places, editor.document.uri.toString(), line) });
    }
  }

  private async receive(message: FromPanel): Promise<void> {
    switch (message.type) {
      case "narrow":
        this.narrow = message.narrow;
        return this.change(this.subject);
      case "ready":
        if (this.narrow !== message.narrow) {
          this.narrow = message.narrow;
          this.loaded = undefined;
          this.change(this.subject);
        }
        // The page is new: it has nothing.
        this.send();
        this.post({ type: "mark", why: this.mark });
        if (this.problem !== "") {
          this.post({ type: "problem", message: this.problem });
        }
        return;
      case "go":
        return this.go(message.item);
      case "choose":
        return this.change(kinds[this.kind].choose(this.subject, message.value));
      case "lightChain": {
        const { uri, name } = this.subject;
        return vscode.commands.executeCommand("mauve.showArchitecture", uri, { name, chain: message.chain });
      }
      case "values":
        return this.change({ ...this.subject, values: valuesOf(message.text) });
      case "reset":
        return this.change({ ...this.subject, before: undefined });
      case "apply":
        return this.apply();
      case "setLevel":
        return vscode.commands.executeCommand("mauve.setSignificance", message.level);
      case "chooseLevel":
        return vscode.commands.executeCommand("mauve.chooseSignificance");
      default:
        return this.export(message.type);
    }
  }

  private async go(item: Item): Promise<void> {
    const location = this.places.get(item)?.find((at) => at !== null);
    if (location) {
      await showLocation(location);
    }
  }

  /** Writes the values into the texts, which are compared with the same state as before. */
  private async apply(): Promise<void> {
    const versions = new Map(vscode.workspace.textDocuments.map(({ uri, version }) => [uri.toString(), version]));
    try {
      const { answer } = await kinds.whatIf.load(this.ask, this.subject);
      if (answer.edit === null) {
        void vscode.window.showInformationMessage("There are no values to write into the text.");
        return;
      }
      const edit = await this.server.asEdit(answer.edit);
      const isOld = ({ uri, version }: vscode.TextDocument) => edit.has(uri) && versions.get(uri.toString()) !== version;
      if (vscode.workspace.textDocuments.some(isOld) || !(await vscode.workspace.applyEdit(edit))) {
        throw new Error("the text has changed: try again");
      }
    } catch (error) {
      void vscode.window.showErrorMessage(`Nothing was written: ${messageOf(error)}`);
      return;
    }
    this.post({ type: "values", text: "" });
    this.change({ ...this.subject, values: [] });
  }

  /** Saves the drawing as the server has drawn it, or copies it. */
  async export(how: "save" | "copy"): Promise<void> {
    const drawing = this.loaded?.answer.drawing;
    if (typeof drawing !== "string") {
      void vscode.window.showInformationMessage("The panel has no drawing.");
      return;
    }
    if (how === "copy") {
      await vscode.env.clipboard.writeText(drawing);
      vscode.window.setStatusBarMessage("The drawing was copied as SVG.", 3000);
      return;
    }
    const folder = path.dirname(vscode.Uri.parse(this.subject.uri).fsPath);
    const name = `${nameOf(this.subject).replace(/[^\w.-]+/g, "-")}.svg`;
    const file = await vscode.window.showSaveDialog({
      defaultUri: vscode.Uri.file(path.join(folder, name)),
      filters: { SVG: ["svg"] },
      title: "Save the drawing",
    });
    if (file !== undefined) {
      await vscode.workspace.fs.writeFile(file, Buffer.from(drawing));
    }
  }
}

/** Shows a location in the editor that has its document, otherwise in the first group. */
export async function showLocation({ uri, range }: Location): Promise<void> {
  const editor = vscode.window.visibleTextEditors.find(({ document }) => document.uri.toString() === uri);
  const { start, end } = range;
  await vscode.window.showTextDocument(vscode.Uri.parse(uri), {
    selection: new vscode.Range(start.line, start.character, end.line, end.character),
    viewColumn: editor?.viewColumn ?? vscode.ViewColumn.One,
  });
}

/** The document and the position that an argument of a command names, otherwise those of the cursor. */
function subjectOf(uri: unknown, place?: Partial<Subject>): Subject | undefined {
  // The menu of an editor's title passes its URI.
  const named = uri instanceof vscode.Uri ? uri.toString() : typeof uri === "string" ? uri : undefined;
  if (named !== undefined && place !== undefined && ("position" in place || "name" in place)) {
    return { ...place, uri: vscode.Uri.parse(named).toString() };
  }
  const editor = vscode.window.activeTextEditor ?? vscode.window.visibleTextEditors[0];
  if (editor === undefined || !languages.includes(editor.document.languageId)) {
    return undefined;
  }
  const { line, character } = editor.selection.active;
  return { uri: editor.document.uri.toString(), position: { line, character } };
}

/** The page of a panel: all of it is in the extension, and only its own script and styles have effect. */
function page(webview: vscode.Webview, extension: vscode.Uri, kind: PanelKind): string {
  const nonce = randomBytes(16).toString("base64");
  const local = (...segments: string[]) => webview.asWebviewUri(vscode.Uri.joinPath(extension, ...segments));
  return `<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src ${webview.cspSource} 'nonce-${nonce}'; script-src 'nonce-${nonce}'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="stylesheet" href="${local("media", "panel.css")}">
<title>MAUVE</title>
</head>
<body data-kind="${kind}">
<script nonce="${nonce}" src="${local("out", "panel.js")}"></script>
</body>
</html>`;
}
