import * as vscode from "vscode";
import type { Location } from "vscode-languageclient/node";
import type { Graph, GraphNode } from "./answers";
import { Latest } from "./latest";
import { hasLost, typingTime } from "./lost";
import { cpus, percent, Row, rows, statusOf } from "./panel/figures";
import { showLocation } from "./panels";
import { Server } from "./server";

/** So many projects are shown at most. */
const mostProjects = 20;
/** The icons of the statuses. */
export const icons: Record<Row["status"], string> = { missed: "error", unknown: "question", tight: "warning", met: "pass", none: "circle-outline" };

/** An element of the tree. */
interface Entry {
  id: string;
  label: string;
  description: string;
  status: Row["status"];
  icon?: string;
  tooltip?: string;
  location?: Location | null;
  children: Entry[];
}

/** The tree view: deployments, their CPUs and instances, with figures. */
export class Tree implements vscode.TreeDataProvider<Entry>, vscode.Disposable {
  private entries: Entry[] = [];
  private graphs = new Map<string, Graph>();
  private readonly changed = new vscode.EventEmitter<void>();
  readonly onDidChangeTreeData = this.changed.event;
  private readonly view: vscode.TreeView<Entry>;
  private readonly registrations: vscode.Disposable;
  private readonly latest = new Latest(() => this.load());
  /** Until then the user may be typing, and unknown figures are not shown. */
  private typingEnds = 0;
  private again?: NodeJS.Timeout;

  constructor(private readonly server: Server) {
    this.view = vscode.window.createTreeView("mauve.deployments", { treeDataProvider: this, showCollapseAll: true });
    this.registrations = vscode.Disposable.from(
      this.view,
      this.changed,
      vscode.commands.registerCommand("mauve.showLocation", showLocation),
      this.view.onDidChangeVisibility(() => this.update()),
      server.onDidEdit(() => (this.typingEnds = Date.now() + typingTime)),
      server.onDidUpdate(() => this.update()),
      server.onDidEnd(() => {
        this.latest.abandon();
        this.view.description = "earlier";
      }),
      vscode.window.onDidChangeActiveTextEditor(() => this.update()),
    );
  }

  dispose(): void {
    this.registrations.dispose();
    clearTimeout(this.again);
  }

  getChildren(entry?: Entry): Entry[] {
    return entry === undefined ? this.entries : entry.children;
  }

  getTreeItem({ id, label, description, status, icon, tooltip, location, children }: Entry): vscode.TreeItem {
    const { Collapsed, Expanded, None } = vscode.TreeItemCollapsibleState;
    const isDeployment = icon === "server-process";
    const item = new vscode.TreeItem(label, children.length === 0 ? None : isDeployment && this.entries.length > 3 ? Collapsed : Expanded);
    const colour = status === "none" ? undefined : new vscode.ThemeColor(`mauve.figures.${status}`);
    item.id = id;
    item.description = description;
    item.tooltip = tooltip ?? `${label}: ${description}`;
    item.iconPath = new vscode.ThemeIcon(icon ?? icons[status], colour);
    item.accessibilityInformation = { label: `${label}, ${description}` };
    if (location) {
      item.command = { command: "mauve.showLocation", title: "Go to the source", arguments: [location] };
    }
    return item;
  }

  private update(): void {
    if (this.view.visible) {
      void this.latest.request();
    }
  }

  private async load(): Promise<void> {
    const found = new Map<string, Graph>();
    const left = this.typingEnds - Date.now();
    let isEarlier = false;
    clearTimeout(this.again);
    for (const uri of await documents()) {
      const parameters = { textDocument: { uri }, drawing: "dot" };
      const graphs = await this.server.request<Graph[]>("mauve/graph", parameters).catch(() => undefined);
      for (const graph of graphs ?? []) {
        const key = `${graph.root} ${graph.name}`;
        const before = this.graphs.get(key);
        // Of an incomplete text, the last figures say more.
        const isLost = before !== undefined && left > 0 && hasLost(before, graph);
        const isKept = before !== undefined && (graph.incomplete || isLost);
        found.set(key, isKept ? before : graph);
        isEarlier ||= isKept;
      }
    }
    if (found.size === 0) {
      // It may only be busy; the next update follows.
      return;
    }
    this.view.description = isEarlier ? "earlier" : "";
    if (isEarlier && left > 0) {
      this.again = setTimeout(() => this.update(), left);
    }
    this.graphs = found;
    const entries = [...found].filter(([, graph]) => graph.significance !== null).map(([key, graph]) => deployment(key, graph));
    if (JSON.stringify(entries) !== JSON.stringify(this.entries)) {
      this.entries = entries;
      this.changed.fire();
    }
  }
}

/** The files whose projects are shown: all with a mauve.toml, otherwise that of the text in the active editor. */
export async function documents(): Promise<string[]> {
  const projects = await vscode.workspace.findFiles("**/mauve.toml", undefined, mostProjects);
  const active = vscode.window.activeTextEditor?.document;
  const uris = projects.filter(({ scheme }) => scheme === "file").map((uri) => uri.toString()).sort();
  return uris.length > 0 || active?.languageId !== "mauve" ? uris : [active.uri.toString()];
}

function deployment(id: string, graph: Graph): Entry {
  const sorted = rows(graph.nodes);
  const text = graph.verdict?.text ?? "";
  const places = new Map(graph.nodes.map(({ host, affinity: mask }) => [`${host ?? ""} ${mask}`, { host, mask }]));
  const order = (it: { host: string | null; mask: number | null }) => it.mask ?? Infinity;
  const sortedPlaces = [...places.values()].sort((one, other) => (one.host ?? "").localeCompare(other.host ?? "") || order(one) - order(other));
  const children = sortedPlaces.map(({ host, mask }): Entry => {
    const load = graph.cpus.find((cpu) => cpu.mask === mask && (cpu.host ?? null) === host);
    const utilisation = load?.utilisation ?? null;
    return {
      id: `${id} ${host === null ? "" : `${host} `}${mask}`,
      label: mask === null || mask === 0 ? "No CPU" : cpus(mask, host),
      description: utilisation === null ? "" : `${load?.complete ? "" : "≥ "}${percent(utilisation)} utilisation`,
      status: load?.status ?? "none",
      icon: "chip",
      children: sorted.filter(({ node }) => node.affinity === mask && node.host === host).map(({ index }) => instance(id, graph.nodes[index])),
    };
  });
  return { id, label: graph.name, description: text, status: partOf(graph), icon: "server-process", tooltip: `${graph.name}: ${text}\n${graph.root}`, children };
}

/** The worst part of a deployment's verdict. */
function partOf({ verdict }: Graph): Row["status"] {
  return verdict === null || verdict === undefined || verdict.status === "time" ? "none" : verdict.status;
}

function instance(id: string, { instance, component, figure, status, reasons, activity, location }: GraphNode): Entry {
  const description = figure ?? "no activity";
  return {
    id: `${id} ${instance}`,
    label: instance,
    description,
    status: statusOf(status, figure),
    tooltip: [`${instance}: ${component}`, description, ...reasons].join("\n"),
    location: activity ?? location,
    children: [],
  };
}
