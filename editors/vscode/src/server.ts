import { ChildProcess, spawn } from "node:child_process";
import { once } from "node:events";
import * as path from "node:path";
import * as vscode from "vscode";
import {
  CloseAction,
  CodeLens,
  CodeLensRefreshRequest,
  CodeLensRequest,
  DocumentSelector,
  DynamicFeature,
  InlayHintRefreshRequest,
  LanguageClient,
  Location,
  LSPErrorCodes,
  Position,
  ResponseError,
  RevealOutputChannelOn,
  State as ClientState,
  StaticFeature,
  WorkspaceEdit,
} from "vscode-languageclient/node";
import { ownCapabilities } from "./capabilities";
import { Figures } from "./figures";
import { findServer, Found } from "./find";
import { Lenses } from "./lenses";
import { openServerSetting } from "./settings";
import { complete } from "./walkthrough";

/** A request is sent at most so often, so many milliseconds after each other, while it is refused for reasons that end soon. */
const [mostAttempts, pause] = [200, 50];
const outdated: number[] = [LSPErrorCodes.ContentModified, LSPErrorCodes.RequestCancelled, LSPErrorCodes.ServerCancelled];

/** What the status bar shows. */
export type State =
  | { kind: "starting" | "stopped" }
  | { kind: "running"; path: string; version?: string }
  | { kind: "error"; problem: string };

/** `mauve lsp`, and the client that talks to it. */
export class Server {
  private client?: LanguageClient;
  private process?: ChildProcess;
  private state: State = { kind: "stopped" };
  /** Starts and stops follow each other: a client that is half started cannot be stopped. */
  private queue: Promise<void> = Promise.resolve();
  private readonly lenses = new Lenses((document) => this.lensesOf(document));
  private readonly edited = new vscode.EventEmitter<vscode.TextDocumentChangeEvent>();
  private readonly updated = new vscode.EventEmitter<void>();
  private readonly ended = new vscode.EventEmitter<void>();
  /** A text that the server has was changed: until the server answers, what is shown may be that of the earlier text. */
  readonly onDidEdit = this.edited.event;
  /** The answers of the server may be others. */
  readonly onDidUpdate = this.updated.event;
  /** The server has ended; another may follow. */
  readonly onDidEnd = this.ended.event;
  private readonly figures = new Figures((method, parameters) => this.answer(method, parameters), this.lenses.shown);

  constructor(
    private readonly extension: string,
    private readonly log: vscode.OutputChannel,
    private readonly show: (state: State) => void,
    /** Commands of the server that are done here instead. */
    private readonly commands: Record<string, (...parameters: any[]) => Promise<unknown>>,
  ) {}

  get current(): State {
    return this.state;
  }

  restart(): Promise<void> {
    return this.enqueue(async () => {
      await this.shutDown();
      await this.start();
    });
  }

  async stop(): Promise<void> {
    await this.enqueue(() => this.shutDown());
    this.figures.dispose();
    this.lenses.dispose();
    [this.edited, this.updated, this.ended].forEach((it) => it.dispose());
  }

  /** The answer to a request of ours, which waits while edits overtake it, or a project is read. Throws the reason for none. */
  async request<T>(method: string, parameters?: object): Promise<T> {
    for (let attempt = 1; ; attempt++) {
      if (!this.client?.isRunning()) {
        throw new Error("The MAUVE server is not running.");
      }
      try {
        return await this.client.sendRequest<T>(method, parameters);
      } catch (error) {
        if (attempt === mostAttempts || !(error instanceof ResponseError && outdated.includes(error.code))) {
          throw error;
        }
        await new Promise((resolve) => setTimeout(resolve, pause));
      }
    }
  }

  /** The answer to a request of ours; nothing where there is none now. */
  private async answer<T>(method: string, parameters: object): Promise<T | undefined> {
    const client = this.client;
    return client?.isRunning() ? client.sendRequest<T>(method, parameters).catch(() => undefined) : undefined;
  }

  /** The user has turned to this window, perhaps from one where files changed: the server looks at them. */
  focused(): void {
    if (this.client?.isRunning()) {
      void this.client.sendNotification("mauve/focus").catch(() => undefined);
    }
  }

  /** The code lenses of a document, as soon as the server has started and read the project. */
  private async lensesOf(document: vscode.TextDocument): Promise<vscode.CodeLens[]> {
    await this.queue;
    const { code2ProtocolConverter, protocol2CodeConverter } = this.client ?? {};
    const parameters = code2ProtocolConverter?.asCodeLensParams(document);
    const lenses = await this.request<CodeLens[] | null>(CodeLensRequest.method, parameters).catch(() => null);
    return (await protocol2CodeConverter?.asCodeLenses(lenses)) ?? [];
  }

  /** An edit of VS Code's, of one that is given as the protocol writes it. */
  asEdit(edit: WorkspaceEdit): Promise<vscode.WorkspaceEdit> {
    return this.client!.protocol2CodeConverter.asWorkspaceEdit(edit);
  }

  /** Shows places, given as the protocol writes them. */
  async showReferences(uri: string, position: Position, locations: Location[]): Promise<void> {
    const { asUri, asPosition, asLocation } = this.client!.protocol2CodeConverter;
    await vscode.commands.executeCommand(
      "editor.action.showReferences",
      asUri(uri),
      asPosition(position),
      locations.map((location) => asLocation(location)),
    );
  }

  /** The path of the program `mauve`; nothing if it is not found, which the user is told. */
  program(): string | undefined {
    const found = findProgram(this.extension);
    if ("problem" in found) {
      this.tell(found.problem);
      return undefined;
    }
    return found.path;
  }

  private enqueue(step: () => Promise<void>): Promise<void> {
    if (!this.client?.isRunning()) {
      // A server that does not answer would hold up the queue for ever.
      this.process?.kill();
    }
    this.queue = this.queue.then(step).catch((error) => this.fail(`The MAUVE server failed: ${messageOf(error)}`));
    return this.queue;
  }

  private async start(): Promise<void> {
    this.set({ kind: "starting" });
    const found = findProgram(this.extension);
    if ("problem" in found) {
      this.log.appendLine("Searched for the server in:");
      found.lookedFor.forEach((file) => this.log.appendLine(`  ${file}`));
      return this.fail(found.problem);
    }

    const settings = vscode.workspace.getConfiguration("mauve.server");
    const outside = settings.get("allowOutside", false) && vscode.workspace.isTrusted;
    const allowed = outside ? ["--allow-outside"] : [];
    const commandLine = [found.path, "lsp", ...allowed, ...settings.get<string[]>("arguments", [])];
    this.log.appendLine(`Starting ${commandLine.join(" ")}`);
    let ended: string | undefined;
    const run = async (): Promise<ChildProcess> => {
      const [program, ...args] = commandLine;
      const server = spawn(program, args, { cwd: folders()[0] });
      this.process = server;
      server.on("exit", (code, signal) => {
        ended = signal === null ? `exit code ${code}` : `signal ${signal}`;
        this.log.appendLine(`The server ended: ${ended}.`);
      });
      await once(server, "spawn");
      // The client sees what goes wrong from here on; an error without a listener would end the extension host.
      server.on("error", (error) => this.log.appendLine(messageOf(error)));
      return server;
    };

    let started = false;
    const client: QuietClient = new QuietClient("mauve", "MAUVE", run, {
      documentSelector: await documentSelector(),
      outputChannel: this.log,
      revealOutputChannelOn: RevealOutputChannelOn.Never,
      initializationFailedHandler: () => false,
      middleware: {
        ...this.figures.middleware,
        didOpen: async (document, next) => {
          await this.figures.middleware.didOpen!(document, next);
          this.updated.fire();
        },
        didChange: async (change, next) => {
          this.edited.fire(change);
          await this.figures.middleware.didChange!(change, next);
          this.updated.fire();
        },
        provideHover: async (document, position, token, next) => {
          const hover = await this.figures.middleware.provideHover!(document, position, token, next);
          if (hover && /^\s*activity\b/.test(document.lineAt(position.line).text)) {
            complete("hovered");
          }
          return hover;
        },
        executeCommand: (command, parameters, next) => {
          const own = this.commands[command];
          return own === undefined ? next(command, parameters) : own(...parameters);
        },
      },
      errorHandler: {
        error: (error, message, count) => restarts.error(error, message, count),
        closed: async () => {
          // One that dies while it starts would only do so again, and one that was replaced must not come back.
          const again = started && this.client === client;
          const result = again ? await restarts.closed() : { action: CloseAction.DoNotRestart };
          if (again && result.action === CloseAction.DoNotRestart) {
            this.fail("The MAUVE server has ended too often, and is not restarted. See its log for the reason.");
          }
          return { ...result, handled: true };
        },
      },
    });
    client.registerFeature(ownCapabilities);
    client.onRequest(CodeLensRefreshRequest.type, () => this.lenses.refresh());
    client.onRefresh = () => this.updated.fire();
    const restarts = client.createDefaultErrorHandler();
    this.client = client;
    client.onDidChangeState(({ newState }) => {
      if (this.client !== client) {
        return;
      }
      if (newState !== ClientState.Running) {
        this.figures.expire();
        this.ended.fire();
      }
      if (newState === ClientState.Running) {
        this.set({ kind: "running", path: found.path, version: client.initializeResult?.serverInfo?.version });
        this.updated.fire();
      } else if (newState === ClientState.Starting) {
        this.set({ kind: "starting" });
      } else if (this.state.kind !== "error") {
        this.set({ kind: "stopped" });
      }
    });
    const problem = await client.start().catch(messageOf);
    // It also returns normally when the server ends at once.
    started = client.isRunning();
    const server = this.process;
    if (started || server?.killed) {
      return; // killed by a restart, which follows
    }
    await exit(server);
    this.fail(
      `The MAUVE server could not be started: ${commandLine.join(" ")}: ${ended ?? problem}. See its log. The setting mauve.server.path selects the server.`,
    );
    server?.kill();
  }

  private async shutDown(): Promise<void> {
    const { client, process } = this;
    this.client = undefined;
    this.process = undefined;
    this.figures.clear();
    if (client?.isRunning()) {
      // It waits two seconds for the server, and then throws.
      await client.dispose().catch((error) => this.log.appendLine(messageOf(error)));
    }
    await exit(process);
    process?.kill();
    this.set({ kind: "stopped" });
  }

  private set(state: State): void {
    this.state = state;
    this.show(state);
  }

  private fail(problem: string): void {
    this.log.appendLine(problem);
    this.set({ kind: "error", problem });
    this.tell(problem);
  }

  private tell(problem: string): void {
    void vscode.window.showErrorMessage(problem, "Open Settings", "Show Log").then((choice) => {
      if (choice === "Open Settings") {
        void openServerSetting();
      } else if (choice === "Show Log") {
        this.log.show();
      }
    });
  }
}

/** The folders of the workspace that are on a disk. */
function folders(): string[] {
  const opened = vscode.workspace.workspaceFolders?.filter(({ uri }) => uri.scheme === "file") ?? [];
  return opened.map(({ uri }) => uri.fsPath);
}

/** Searches for the program `mauve` where the settings and the trust in the workspace allow it. */
function findProgram(extension: string): Found {
  return findServer({
    setting: vscode.workspace.getConfiguration("mauve.server").get("path", "").trim(),
    folders: folders(),
    isTrusted: vscode.workspace.isTrusted,
    extension,
    PATH: process.env.PATH ?? "",
    platform: process.platform,
  });
}

/** What fails is in the log; the user is told by `Server.fail`, once and with what to do. Code lenses are `Lenses`. */
class QuietClient extends LanguageClient {
  override registerFeature(feature: StaticFeature | DynamicFeature<unknown>): void {
    const isOfLenses = "registrationType" in feature && feature.registrationType.method === CodeLensRequest.method;
    if ("registrationType" in feature && /formatting|foldingRange/i.test(feature.registrationType.method)) {
      // Of models alone: in TOML and YAML, VS Code would ask the user whose formatter to take, and not fold by indentation.
      const { initialize } = feature;
      feature.initialize = (capabilities) => initialize.call(feature, capabilities, models);
    }
    if (!isOfLenses) {
      super.registerFeature(feature);
    }
  }

  /** Called when the server says that its hints are others: all that is shown may be. */
  onRefresh?: () => void;

  override onRequest(type: any, handler: any): vscode.Disposable {
    const isOfHints = type.method === InlayHintRefreshRequest.method;
    const withRefresh = (...parameters: unknown[]) => {
      this.onRefresh?.();
      return handler(...parameters);
    };
    return super.onRequest(type, isOfHints ? withRefresh : handler);
  }

  override error(message: string, data?: unknown): void {
    super.error(message, data, false);
  }
}

const models = [
  { language: "mauve", scheme: "file" },
  { language: "mauve", scheme: "untitled" },
];

/**
 * Models, and TOML and YAML files below a `mauve.toml`: which of them the project names only the server knows. Those of other
 * folders are nobody's business.
 */
async function documentSelector(): Promise<DocumentSelector> {
  const projects = await vscode.workspace.findFiles("**/mauve.toml");
  const folders = new Set(projects.filter(({ scheme }) => scheme === "file").map(({ fsPath }) => path.dirname(fsPath)));
  const tables = [...folders].map((folder) => ({
    scheme: "file",
    pattern: new vscode.RelativePattern(vscode.Uri.file(folder), "**/*.{toml,yaml,yml}"),
  }));
  // The client hands patterns on to VS Code as they are; only its type wants a string.
  return [...models, ...tables] as DocumentSelector;
}

/** Waits for the end of a process that is about to end: half a second. */
async function exit(process: ChildProcess | undefined): Promise<void> {
  if (process?.pid !== undefined && process.exitCode === null && process.signalCode === null) {
    await Promise.race([once(process, "exit"), new Promise((resolve) => setTimeout(resolve, 500))]);
  }
}

export function messageOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
