import * as vscode from "vscode";
import { Layout, Look, room, widths } from "./columns";
import { Figure, Status, statuses, text, worst } from "./label";
import { moved } from "./moved";
import { languages } from "./recognise";
import { InlayHint, InlayHintRequest, InlayHintResolveRequest, Middleware } from "vscode-languageclient/node";

/** Asks the server; nothing where it cannot answer now. */
type Ask = <T>(method: string, parameters: object) => Promise<T | undefined>;

/** Documents up to this length are asked for as a whole. */
const mostLines = 3000;
/** Of longer ones, so many lines around the visible ones. */
const margin = 300;
/** A column behind all texts. */
const endOfLine = 2 ** 31 - 1;
/** So many milliseconds after a change without new figures, those on the screen are marked as older. */
const patience = 500;
/** So often, in milliseconds, the widths of editors are asked for: VS Code does not tell when they change. */
const pace = 1000;
/** So many milliseconds after the start the first figures wait for the first code lenses, which move the text. */
const together = 450;

/**
 * Figures of the server at the ends of lines, in the colour of their status. VS Code's inlay hints have one colour, and
 * disappear while a text is edited: decorations move with the text until the server has new ones.
 */
export class Figures implements vscode.Disposable {
  /** One type for all colours: an editor is given all figures at once, so that none is missing in between. */
  private readonly type = vscode.window.createTextEditorDecorationType({
    // Text that is typed at the end of the line stays before the figure.
    rangeBehavior: vscode.DecorationRangeBehavior.OpenOpen,
    after: { margin: "0 0 0 1ch" },
  });
  /** The figures in documents, by their addresses. */
  private readonly shown = new Map<string, Figure[]>();
  /** Documents for which an answer is awaited, and whether to ask again then. An answer counts only while its entry is here. */
  private readonly asking = new Map<string, { again: boolean }>();
  /** Documents that wait for the figures of a change, with what marks their figures as older. */
  private readonly waiting = new Map<string, NodeJS.Timeout>();
  /** Documents whose figures are those of an earlier text, as far as is known here. */
  private readonly late = new Set<string>();
  /** The widths of the editor groups in pixels, by their view columns from 1. */
  private groups: (number | undefined)[] = [];
  private readonly listeners: vscode.Disposable;

  /** The first figures wait for it. */
  private readonly start: Promise<unknown>;

  constructor(
    private readonly ask: Ask,
    lenses: Promise<void>,
  ) {
    this.start = Promise.race([lenses, new Promise((resolve) => setTimeout(resolve, together))]);
    void this.measure();
    const timer = setInterval(() => this.shown.size > 0 && vscode.window.state.focused && void this.measure(), pace);
    this.listeners = vscode.Disposable.from(
      { dispose: () => clearInterval(timer) },
      vscode.window.onDidChangeVisibleTextEditors(() => {
        void this.measure();
        this.update();
      }),
      // It is also sent when lines are wrapped in another way.
      vscode.window.onDidChangeTextEditorVisibleRanges(({ textEditor }) => {
        void this.measure();
        if (textEditor.document.lineCount > mostLines) {
          this.updateDocument(textEditor.document);
        }
      }),
      vscode.workspace.onDidCloseTextDocument(({ uri }) => this.forget(uri.toString())),
      vscode.workspace.onDidChangeConfiguration((change) => {
        if (change.affectsConfiguration("mauve.decorations") || change.affectsConfiguration("editor")) {
          this.update();
        }
      }),
    );
  }

  dispose(): void {
    this.listeners.dispose();
    this.waiting.forEach((timer) => clearTimeout(timer));
    this.type.dispose();
  }

  /** Takes the figures away, since no server stands behind them. */
  clear(): void {
    [...this.shown.keys(), ...this.asking.keys()].forEach((key) => this.forget(key));
    vscode.window.visibleTextEditors.forEach((editor) => this.draw(editor));
  }

  /** Marks the figures as older, since the server has ended: another may follow. */
  expire(): void {
    // It may never answer what it was asked.
    this.asking.clear();
    [...this.shown.keys()].forEach((key) => this.markLate(key));
  }

  private forget(key: string): void {
    this.shown.delete(key);
    this.asking.delete(key);
    this.confirm(key);
  }

  /** The figures of a document are those of its text, or there are none. */
  private confirm(key: string): void {
    clearTimeout(this.waiting.get(key));
    this.waiting.delete(key);
    this.late.delete(key);
  }

  private markLate(key: string): void {
    this.late.add(key);
    this.drawAll(key);
  }

  /** From a change on, the figures on the screen may be those of an earlier text. */
  private expect({ document, contentChanges }: vscode.TextDocumentChangeEvent): void {
    // VS Code has moved the figures with their lines.
    const key = document.uri.toString();
    const figures = this.shown.get(key);
    if (figures !== undefined) {
      const moves = figures.map((figure) => ({ ...figure, position: contentChanges.reduce(moved, figure.position) }));
      this.shown.set(key, moves);
      if (this.late.has(key)) {
        // They were drawn when VS Code may have known of this change already: then each stands beside another line.
        this.drawAll(key);
      }
    }
    // An answer that is on its way may be older than the change.
    this.asking.forEach((asked) => (asked.again = true));
    for (const key of this.shown.keys()) {
      if (!this.waiting.has(key)) {
        this.waiting.set(key, setTimeout(() => this.markLate(key), patience));
      }
    }
  }

  /** Asks VS Code how wide the editors are. */
  private async measure(): Promise<void> {
    const ask = () => vscode.commands.executeCommand<{ orientation: number; groups: Layout[] }>("vscode.getEditorLayout");
    let layout = await ask();
    if (layout.orientation === 1 && layout.groups.length === 1 && layout.groups[0].groups === undefined) {
      // It says how high the only group is. That it stands beside others, of which there are none, changes nothing but this.
      await vscode.commands.executeCommand("vscode.setEditorLayout", { orientation: 0, groups: [{}] });
      layout = await ask();
    }
    const groups = widths(layout);
    if (groups.join() !== this.groups.join()) {
      this.groups = groups;
      vscode.window.visibleTextEditors.forEach((editor) => this.draw(editor));
    }
  }

  /** Parts of the client's middleware: what VS Code is told, and when the figures may be others. */
  readonly middleware: Middleware = {
    didOpen: async (document, next) => {
      await next(document);
      this.update();
    },
    // Figures of a deployment change with other models, and with tables.
    didChange: async (change, next) => {
      this.expect(change);
      await next(change);
      this.update();
    },
    provideInlayHints: async (document, range, token, next) => {
      // The server has new ones, or another part is visible.
      this.updateDocument(document);
      const hints = await next(document, range, token);
      return isDrawn(document) ? hints?.filter((hint) => !isFigure(hint)) : hints;
    },
    provideHover: async (document, position, token, next) =>
      (await this.explanation(document, position)) ?? next(document, position, token),
  };

  private update(): void {
    new Set(vscode.window.visibleTextEditors.map(({ document }) => document)).forEach((it) => this.updateDocument(it));
  }

  private async updateDocument(document: vscode.TextDocument): Promise<void> {
    const key = document.uri.toString();
    if (!languages.includes(document.languageId)) {
      return;
    }
    if (!isDrawn(document)) {
      this.forget(key);
      this.drawAll(key);
      return;
    }
    void this.measure();
    const before = this.asking.get(key);
    if (before !== undefined) {
      before.again = true;
      return;
    }
    const asked = { again: false };
    this.asking.set(key, asked);
    do {
      asked.again = false;
      const { version } = document;
      const parameters = { textDocument: { uri: key }, range: visible(document) };
      const hints = await this.ask<InlayHint[]>(InlayHintRequest.method, parameters);
      await this.start;
      if (this.asking.get(key) !== asked) {
        return;
      }
      // The figures of another text stand at other places; the next answer is on its way.
      if (hints !== undefined && hints !== null && version === document.version && !document.isClosed) {
        this.shown.set(key, hints.filter(isFigure));
        if (!asked.again) {
          this.confirm(key);
        }
        this.drawAll(key);
      }
    } while (asked.again);
    this.asking.delete(key);
  }

  private drawAll(key: string): void {
    vscode.window.visibleTextEditors.filter(({ document }) => document.uri.toString() === key).forEach((it) => this.draw(it));
  }

  private draw(editor: vscode.TextEditor): void {
    const key = editor.document.uri.toString();
    const figures = byPosition(this.shown.get(key) ?? []);
    const look = this.lookOf(editor);
    const decorations = figures.map((all) => decoration(all, editor.document, look, this.late.has(key)));
    editor.setDecorations(this.type, decorations);
  }

  private lookOf({ document, options, viewColumn }: vscode.TextEditor): Look {
    const settings = vscode.workspace.getConfiguration("editor", document);
    return {
      width: viewColumn === undefined ? undefined : this.groups[viewColumn - 1],
      fontFamily: settings.get("fontFamily", ""),
      fontSize: settings.get("fontSize", 14),
      tabSize: Number(options.tabSize ?? 2),
      hasMinimap: settings.get("minimap.enabled", true),
      isWrapped: settings.get("wordWrap") === "on",
    };
  }

  /** What the server says of the figures at the end of a line: the pointer is on them. */
  private async explanation(
    document: vscode.TextDocument,
    position: vscode.Position,
  ): Promise<vscode.Hover | undefined> {
    const isHere = ({ position: { line, character } }: Figure) =>
      line === position.line && character <= position.character;
    const figures = (this.shown.get(document.uri.toString()) ?? []).filter(isHere);
    const tooltips: vscode.MarkdownString[] = [];
    for (const figure of figures) {
      const resolved = await this.ask<InlayHint>(InlayHintResolveRequest.method, figure);
      const tooltip = resolved?.tooltip;
      const markdown = typeof tooltip === "string" ? tooltip : tooltip?.value;
      if (markdown !== undefined && !tooltips.some((known) => known.value === markdown)) {
        tooltips.push(new vscode.MarkdownString(markdown));
      }
    }
    return tooltips.length === 0 ? undefined : new vscode.Hover(tooltips);
  }
}

/** Whether the figures of a document are drawn here: otherwise, VS Code shows them as it shows all inlay hints. */
function isDrawn(document: vscode.TextDocument): boolean {
  const hints = vscode.workspace.getConfiguration("editor.inlayHints", document).get("enabled", "on");
  return hints.startsWith("on") && vscode.workspace.getConfiguration("mauve.decorations", document).get("enable", true);
}

function isFigure(hint: object): hint is Figure {
  const { data } = hint as Partial<Figure>;
  return statuses.includes(data?.status as Status);
}

/** The range to ask for: around what is visible. */
function visible(document: vscode.TextDocument): object {
  const lines = document.lineCount;
  let [first, last] = [0, lines];
  if (lines > mostLines) {
    const editors = vscode.window.visibleTextEditors.filter((editor) => editor.document === document);
    const ranges = editors.flatMap(({ visibleRanges }) => visibleRanges);
    first = Math.max(0, Math.min(...ranges.map(({ start }) => start.line)) - margin);
    last = Math.min(lines, Math.max(...ranges.map(({ end }) => end.line)) + margin);
  }
  return { start: { line: first, character: 0 }, end: { line: last, character: 0 } };
}

/** The figures of each position, in their order. */
function byPosition(figures: Figure[]): Figure[][] {
  const found = new Map<string, Figure[]>();
  for (const figure of figures) {
    const key = `${figure.position.line}:${figure.position.character}`;
    found.set(key, [...(found.get(key) ?? []), figure]);
  }
  return [...found.values()];
}

/** What is drawn of the figures at one place: VS Code does not keep the order of several decorations there. */
function decoration(
  figures: Figure[],
  document: vscode.TextDocument,
  look: Look,
  isLate: boolean,
): vscode.DecorationOptions {
  // The line may be gone: a change is told before the figures follow.
  const line = Math.min(figures[0].position.line, document.lineCount - 1);
  // One column is left before the figure.
  const written = document.lineAt(line).text;
  const left = room(written, look) - 1;
  const status = isLate ? "older" : worst(figures);
  const style = { color: new vscode.ThemeColor(`mauve.figures.${status}`), fontStyle: status === "older" ? "italic" : undefined };
  const contentText = text(figures, left, isLate);
  const indentation = written.length - written.trimStart().length;
  const width = contentText.length + 1;
  if (contentText.length > left && indentation >= width) {
    // Behind the last row, not even the mark has room: it goes into the indentation, and moves nothing.
    const before = { ...style, contentText, width: `${width}ch`, margin: `0 0 0 -${width}ch` };
    return { range: new vscode.Range(line, indentation, line, indentation), renderOptions: { before } };
  }
  return {
    // The end of the line, however long it is when VS Code draws: it may have a key more by then.
    range: new vscode.Range(line, endOfLine, line, endOfLine),
    renderOptions: { after: { ...style, contentText } },
  };
}
