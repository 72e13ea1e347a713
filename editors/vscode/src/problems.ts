import * as path from "node:path";
import * as vscode from "vscode";
import type { Graph } from "./answers";
import { Row, rows } from "./panel/figures";
import { Server } from "./server";
import { documents, icons } from "./tree";

/** So many problems are listed, and the first ones with so many of their fixes: the server computes what each fix would give. */
const [mostProblems, mostFixes] = [30, 3];
export const mostWithFixes = 4;

/** A row of the list in the status bar. */
export interface Entry extends vscode.QuickPickItem {
  run?: () => unknown;
}

/** What is wrong at a place: an activity with its figure, or a diagnostic. */
export interface Problem {
  status: Row["status"];
  name: string;
  place: vscode.Location;
  /** The diagnostics that say why, the worst first. */
  why: vscode.Diagnostic[];
  /** The place of the first diagnostic, whose fixes are offered. */
  cause: vscode.Location;
}

/** Returns the problems of all files, the worst first: activities in the order of their statuses, then what else is reported. */
export async function problemsOf(server: Server): Promise<Problem[]> {
  const ask = (uri: string) => server.request<Graph[]>("mauve/graph", { textDocument: { uri }, drawing: "dot" }).catch(() => []);
  const graphs = (await Promise.all((await documents()).map(ask))).flat();
  const reported = vscode.languages.getDiagnostics().flatMap(([uri, all]) => all.filter(isOurs).map((it) => ({ uri, it })));
  reported.sort((one, other) => one.it.severity - other.it.severity);
  const explained = new Set<vscode.Diagnostic>();
  const activities = rows(graphs.flatMap(({ nodes }) => nodes)).flatMap(({ status, node }): Problem[] => {
    const at = node.activity;
    if (at === null || status === "met" || status === "none") {
      return [];
    }
    const { start, end } = at.range;
    const place = new vscode.Location(vscode.Uri.parse(at.uri), new vscode.Range(start.line, start.character, end.line, end.character));
    const isAt = (uri: vscode.Uri, { start }: vscode.Range) =>
      uri.toString() === place.uri.toString() && place.range.start.line <= start.line && start.line <= place.range.end.line;
    const why = reported.filter(
      ({ uri, it }) => isAt(uri, it.range) || it.relatedInformation?.some(({ location }) => isAt(location.uri, location.range)),
    );
    why.forEach(({ it }) => explained.add(it));
    const cause = why.length === 0 ? place : new vscode.Location(why[0].uri, why[0].it.range);
    return [{ status, name: `${node.instance} ${node.figure ?? ""}`, place, why: why.map(({ it }) => it), cause }];
  });
  const others = reported.filter(({ it }) => !explained.has(it)).map(({ uri, it }): Problem => {
    const status = it.severity === vscode.DiagnosticSeverity.Error ? "missed" : "tight";
    const place = new vscode.Location(uri, it.range);
    return { status, name: String(typeof it.code === "object" ? it.code.value : it.code), place, why: [it], cause: place };
  });
  // Without a deadline that it concerns, an error leaves all without a proof: it is first.
  const [errors, warnings] = [others.filter(({ status }) => status === "missed"), others.filter(({ status }) => status !== "missed")];
  return [...errors, ...activities, ...warnings].slice(0, mostProblems);
}

function isOurs({ source, severity }: vscode.Diagnostic): boolean {
  return source === "mauve" && severity <= vscode.DiagnosticSeverity.Warning;
}

/** Returns the rows of the problems; a row goes to its place. The first ones have rows with their fixes below, once these are known. */
export function entriesOf(problems: Problem[], fixes: Map<Problem, vscode.CodeAction[]>): Entry[] {
  return problems.flatMap((problem): Entry[] => {
    const { status, name, place, why } = problem;
    const { start } = place.range;
    const entry: Entry = {
      label: `$(${icons[status]}) ${name}`,
      description: `${path.basename(place.uri.fsPath)}:${start.line + 1}`,
      detail: why[0]?.message,
      run: () => show(place),
    };
    const actions = (fixes.get(problem) ?? []).slice(0, mostFixes).map(({ title }): Entry => ({ label: `      $(lightbulb) ${title}`, run: () => apply(problem, title) }));
    return [entry, ...actions];
  });
}

/** The fixes of a problem; `resolved` of them with their edits. */
export async function fixesOf({ cause: { uri, range } }: Problem, resolved = 0): Promise<vscode.CodeAction[]> {
  await vscode.workspace.openTextDocument(uri);
  const kind = vscode.CodeActionKind.QuickFix.value;
  return (await vscode.commands.executeCommand<vscode.CodeAction[]>("vscode.executeCodeActionProvider", uri, range, kind, resolved)) ?? [];
}

async function show({ uri, range }: vscode.Location): Promise<void> {
  await vscode.window.showTextDocument(uri, { selection: range });
}

/** Applies a fix, and shows where. The text may have changed since it was listed: its edit is asked for now. */
async function apply(problem: Problem, title: string): Promise<void> {
  const action = (await fixesOf(problem, 20)).find((it) => it.title === title);
  if (action === undefined) {
    void vscode.window.showInformationMessage(`No longer offered for this text: ${title}`);
    return;
  }
  const [changed] = action.edit?.entries() ?? [];
  if (action.edit !== undefined) {
    await vscode.workspace.applyEdit(action.edit);
  }
  if (action.command !== undefined) {
    await vscode.commands.executeCommand(action.command.command, ...(action.command.arguments ?? []));
  }
  if (changed !== undefined) {
    await show(new vscode.Location(changed[0], changed[1][0]?.range ?? problem.place.range));
  }
}
