import * as vscode from "vscode";
import { ClientCapabilities, FeatureState, StaticFeature } from "vscode-languageclient/node";

/** What the server says of a document; nothing where it cannot answer now, which ends soon if it is only starting. */
export type AskForLenses = (document: vscode.TextDocument) => Promise<vscode.CodeLens[] | "later" | undefined>;

/** So often the server is asked again while it starts and reads the project, and so many milliseconds after each other. */
const [mostQuestions, pause] = [100, 30];

/**
 * Code lenses, together with the first figures. VS Code asks a provider a quarter of a second after it is registered. The
 * client would register its own when the server has started: its lenses would come after the figures, and move the text.
 */
export class Lenses implements vscode.CodeLensProvider, StaticFeature, vscode.Disposable {
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

  async provideCodeLenses(document: vscode.TextDocument, token: vscode.CancellationToken): Promise<vscode.CodeLens[]> {
    for (let question = 0; question < mostQuestions && !token.isCancellationRequested; question++) {
      const lenses = await this.ask(document);
      if (lenses !== "later") {
        this.isAnswered = true;
        this.tell();
        return lenses ?? [];
      }
      await new Promise((resolve) => setTimeout(resolve, pause));
    }
    return [];
  }

  /** The lenses may be others. Before the first answer, VS Code would only ask later. */
  refresh(): void {
    if (this.isAnswered) {
      this.changed.fire();
    }
  }

  fillClientCapabilities(capabilities: ClientCapabilities): void {
    capabilities.textDocument = { ...capabilities.textDocument, codeLens: {} };
    capabilities.workspace = { ...capabilities.workspace, codeLens: { refreshSupport: true } };
  }

  initialize(): void {}

  getState(): FeatureState {
    return { kind: "static" };
  }

  clear(): void {}

  dispose(): void {
    this.registration.dispose();
    this.changed.dispose();
  }
}
