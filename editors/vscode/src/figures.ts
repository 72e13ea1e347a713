import * as vscode from "vscode";
import { InlayHint, InlayHintRequest, InlayHintResolveRequest, Middleware } from "vscode-languageclient/node";

/** The statuses of hints that are drawn here: all but values, which are VS Code's inlay hints. */
const statuses = ["met", "tight", "missed", "unknown", "older", "time"] as const;
type Status = (typeof statuses)[number];

/** A hint with what the server says of it. */
interface Figure extends InlayHint {
  label: string;
  data: { status: Status; load?: number };
}

/** Asks the server; nothing where it cannot answer now. */
type Ask = <T>(method: string, parameters: object) => Promise<T | undefined>;

/** Documents up to this length are asked for as a whole. */
const mostLines = 3000;
/** Of longer ones, so many lines around the visible ones. */
const margin = 300;
/** A column behind all texts. */
const endOfLine = 2 ** 31 - 1;

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
  /** Documents for which an answer is awaited, and whether to ask again then. */
  private readonly asking = new Map<string, boolean>();
  private readonly listeners: vscode.Disposable;

  constructor(private readonly ask: Ask) {
    this.listeners = vscode.Disposable.from(
      vscode.window.onDidChangeVisibleTextEditors(() => this.update()),
      vscode.window.onDidChangeTextEditorVisibleRanges(({ textEditor }) => {
        if (textEditor.document.lineCount > mostLines) {
          this.updateDocument(textEditor.document);
        }
      }),
      vscode.workspace.onDidCloseTextDocument(({ uri }) => this.shown.delete(uri.toString())),
      vscode.workspace.onDidChangeConfiguration((change) => {
        if (change.affectsConfiguration("mauve.decorations") || change.affectsConfiguration("editor.inlayHints")) {
          this.update();
        }
      }),
    );
  }

  dispose(): void {
    this.listeners.dispose();
    this.type.dispose();
  }

  /** Takes the figures away, since no server stands behind them. */
  clear(): void {
    this.shown.clear();
    vscode.window.visibleTextEditors.forEach((editor) => this.draw(editor));
  }

  /** Parts of the client's middleware: what VS Code is told, and when the figures may be others. */
  readonly middleware: Middleware = {
    didOpen: async (document, next) => {
      await next(document);
      this.update();
    },
    // Figures of a deployment change with other models, and with tables.
    didChange: async (change, next) => {
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
    if (document.languageId !== "mauve") {
      return;
    }
    if (!isDrawn(document)) {
      this.shown.delete(key);
      this.drawAll(document);
      return;
    }
    if (this.asking.has(key)) {
      this.asking.set(key, true);
      return;
    }
    do {
      this.asking.set(key, false);
      const { version } = document;
      const parameters = { textDocument: { uri: key }, range: visible(document) };
      const hints = await this.ask<InlayHint[]>(InlayHintRequest.method, parameters);
      // The figures of another text stand at other places; the next answer is on its way.
      if (hints !== undefined && hints !== null && version === document.version && !document.isClosed) {
        this.shown.set(key, hints.filter(isFigure));
        this.drawAll(document);
      }
    } while (this.asking.get(key));
    this.asking.delete(key);
  }

  private drawAll(document: vscode.TextDocument): void {
    vscode.window.visibleTextEditors.filter((editor) => editor.document === document).forEach((it) => this.draw(it));
  }

  private draw(editor: vscode.TextEditor): void {
    const figures = this.shown.get(editor.document.uri.toString()) ?? [];
    editor.setDecorations(this.type, byPosition(figures).map(decoration));
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

/** The number of characters of a bar. */
const full = 5;

/** The label of a figure; of a CPU, with a bar. */
function text({ label, data: { load } }: Figure): string {
  if (load === undefined) {
    return label;
  }
  const used = Math.min(full, Math.round((load * full) / 100));
  return `${label} ${"━".repeat(used)}${"┄".repeat(full - used)}`;
}

/** The status of several figures at one place. */
function worst(figures: Figure[]): Status {
  const order: Status[] = ["older", "missed", "unknown", "tight", "met", "time"];
  return order.find((status) => figures.some(({ data }) => data.status === status)) ?? "time";
}

/** What is drawn of the figures at one place: VS Code does not keep the order of several decorations there. */
function decoration(figures: Figure[]): vscode.DecorationOptions {
  const { line } = figures[0].position;
  const status = worst(figures);
  return {
    // The end of the line, however long it is when VS Code draws: it may have a key more by then.
    range: new vscode.Range(line, endOfLine, line, endOfLine),
    renderOptions: {
      after: {
        contentText: figures.map(text).join(" · "),
        color: new vscode.ThemeColor(`mauve.figures.${status}`),
        fontStyle: status === "older" ? "italic" : undefined,
      },
    },
  };
}
