import * as vscode from "vscode";

/** The steps of the walkthrough that no command of VS Code completes. */
type Step = "project" | "typed" | "hovered" | "fixed";

/** When each step was last completed, in milliseconds. */
const completed = new Map<Step, number>();

/**
 * Completes a step. VS Code notices it only after it has first shown a walkthrough, so the event is repeated, but not for each
 * key.
 */
export function complete(step: Step): void {
  const now = Date.now();
  if (now - (completed.get(step) ?? 0) > 10_000) {
    completed.set(step, now);
    void fire(step);
  }
}

export async function openWalkthrough(): Promise<void> {
  await vscode.commands.executeCommand("workbench.action.openWalkthrough", "mauve.mauve#start", false);
  await Promise.all([...completed.keys()].map(fire));
}

/** Fires the completion event of a step: the change of a context key. VS Code ignores a key that is set before it listens. */
async function fire(step: Step): Promise<void> {
  for (const value of [true, false]) {
    await vscode.commands.executeCommand("setContext", `mauve.walkthrough.${step}`, value);
  }
}

/** Completes the steps that change texts. */
export function watchSteps(): vscode.Disposable {
  // The versions of the texts when a missed deadline was last reported: only an edit meets it, not the end of the server.
  const missed = new Map<string, number>();
  const watches = vscode.Disposable.from(
    vscode.workspace.onDidChangeTextDocument(({ document, contentChanges }) => {
      if (document.languageId === "mauve" && contentChanges.length > 0 && /\bdeployment\b/.test(document.getText())) {
        complete("typed");
      }
    }),
    vscode.languages.onDidChangeDiagnostics(({ uris }) => {
      for (const document of vscode.workspace.textDocuments.filter(({ languageId }) => languageId === "mauve")) {
        const key = document.uri.toString();
        if (!uris.some((uri) => uri.toString() === key)) {
          continue;
        }
        const version = missed.get(key);
        if (vscode.languages.getDiagnostics(document.uri).some(isMissed)) {
          missed.set(key, document.version);
        } else if (version !== undefined) {
          missed.delete(key);
          if (document.version > version) {
            complete("fixed");
          }
        }
      }
    }),
  );
  void vscode.workspace.findFiles("**/mauve.toml", undefined, 1).then(({ length }) => length > 0 && complete("project"));
  return watches;
}

function isMissed({ code }: vscode.Diagnostic): boolean {
  return (typeof code === "object" ? code.value : code) === "deadline-missed";
}
