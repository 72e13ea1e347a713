import * as vscode from "vscode";

/** What the server says of a document, as soon as it has started and read the project. */
export type AskForLenses = (document: vscode.TextDocument) => Promise<vscode.CodeLens[]>;

/**
 * Code lenses, together with the first figures. VS Code asks a provider a quarter of a second after it is registered. The
 * client would register its own when the server has started: its lenses would come after the figures, and move the text.
 */
export class Lenses implements vscode.CodeLensProvider, vscode.Disposable {
  private readonly changed = new vscode.EventEmitter<void>();
  private readonly registration: vscode.Disposable;
  private isAnswered = false;
  private tell: () => void = () => undefined;
  /** Fulfilled when VS Code has the first lenses. */
  readonly shown = new Promise<void>((resolve) => (this.tell = resolve));
  readonly onDidChangeCodeLenses = this.changed.event;

  constructor(private readonly ask: AskForLenses) {
    this.registration = vscode.languages.registerCodeLensProvider(
      ["file", "untitled"].map((scheme) => ({ language: "mauve", scheme })),
      this,
    );
  }

  async provideCodeLenses(document: vscode.TextDocument): Promise<vscode.CodeLens[]> {
    const lenses = await this.ask(document);
    this.isAnswered = true;
    this.tell();
    return lenses;
  }

  /** The lenses may be others. Before the first answer, VS Code would only ask later. */
  refresh(): void {
    if (this.isAnswered) {
      this.changed.fire();
    }
  }

  dispose(): void {
    this.registration.dispose();
    this.changed.dispose();
  }
}
