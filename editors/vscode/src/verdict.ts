import * as vscode from "vscode";
import type { Verdict as Answer } from "./answers";
import { Server, State } from "./server";

/** So many milliseconds after a change the verdict is asked for, and again while the server works. */
const pause = 300;

/** The item in the status bar: the verdict on the deadlines of all deployments. That a server runs is no verdict. */
export class Verdict implements vscode.Disposable {
  private readonly item = vscode.window.createStatusBarItem("mauve.server", vscode.StatusBarAlignment.Left);
  private due?: NodeJS.Timeout;
  /** The last verdict, as the title of the list of problems. */
  text = "";

  constructor(private readonly server: () => Server | undefined) {
    this.item.name = "MAUVE";
    this.item.command = "mauve.showMenu";
    this.item.show();
  }

  dispose(): void {
    clearTimeout(this.due);
    this.item.dispose();
  }

  /** Shows the state of the server, until it has a verdict. */
  showState(state: State): void {
    const icon = { starting: "$(loading~spin) ", running: "", stopped: "$(circle-slash) ", error: "$(error) " }[state.kind];
    const detail = state.kind === "running" ? `${state.path} ${state.version ?? ""}` : state.kind === "error" ? state.problem : "";
    this.text = "";
    this.show(`${icon}MAUVE`, `MAUVE server: ${state.kind}`, state.kind === "error" ? "error" : undefined);
    this.item.tooltip = `MAUVE server: ${state.kind}\n${detail}\nClick for the problems, and for its menu.`;
    if (state.kind === "running") {
      this.update();
    }
  }

  /** Asks for the verdict when the last change is some time ago. */
  update(): void {
    clearTimeout(this.due);
    this.due = setTimeout(() => void this.ask(), pause);
  }

  private async ask(): Promise<void> {
    try {
      const { verdict } = await this.server()!.request<{ verdict: Answer | null }>("mauve/status");
      if (verdict === null) {
        this.update();
        return;
      }
      this.text = verdict.text;
      const colour = { missed: "error", unknown: "warning", tight: undefined, met: undefined, time: undefined } as const;
      this.show(`MAUVE ${verdict.text}`, `MAUVE server: running, ${verdict.text}`, colour[verdict.status]);
    } catch {
      // A server that stops shows its state.
    }
  }

  private show(text: string, label: string, colour: "error" | "warning" | undefined): void {
    this.item.text = text;
    this.item.backgroundColor = colour && new vscode.ThemeColor(`statusBarItem.${colour}Background`);
    this.item.accessibilityInformation = { label };
  }
}
