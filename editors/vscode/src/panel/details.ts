// What a panel shows beside its drawing, by its kind.
import type { Answers, Chains, Graph, Item, Machine, PanelKind, Program, Scheduled, Verdict } from "../answers";
import { bar, h } from "./dom";
import { cpus, number, percent, Row, rows, Said, statusOf, Step, steps, summary } from "./figures";

/** What a part of the page does. */
export interface Actions {
  go(item: Item): void;
  hover(item?: Item): void;
  choose(value: string): void;
  lightChain(chain: string): void;
  setLevel(level: number): void;
}

/** The parts of the page below the drawing. `selected` is the selected element of the drawing. */
export function details<Kind extends PanelKind>(
  kind: Kind,
  answer: Answers[Kind],
  actions: Actions,
  selected?: Item,
): HTMLElement[] {
  return sections[kind](answer, actions, selected);
}

const sections: { [Kind in PanelKind]: (answer: Answers[Kind], actions: Actions, selected?: Item) => HTMLElement[] } = {
  architecture: ofGraph,
  stateMachine: ofMachine,
  schedule: ofSchedule,
  chains: ofChains,
  // The drawing has all of it.
  cpuBudget: () => [],
  executionTimes: ofTimes,
  probability: ofProbability,
  whatIf: ofWhatIf,
};

/** What is most important, in a line: its parts with their statuses. */
export function headline<Kind extends PanelKind>(kind: Kind, answer: Answers[Kind]): Said[] {
  const said = headlines[kind](answer);
  return Array.isArray(said) ? said : [said];
}

const headlines: { [Kind in PanelKind]: (answer: Answers[Kind]) => Said | Said[] } = {
  architecture: ({ nodes, significance }) => {
    const instances = nodes.length === 1 ? "1 instance" : `${nodes.length} instances`;
    return significance === null ? { status: "none", text: `${instances}; no deployment, so no times` } : summary(rows(nodes));
  },
  stateMachine: ({ worstTrace, edges, reasons }) => {
    if (reasons.length > 0) {
      return { status: "unknown", text: "Execution times unknown" };
    }
    const greatest = Math.max(0, ...edges.map(({ time }) => time ?? 0));
    const total = steps(worstTrace, edges.map(({ time }) => time)).at(-1)?.total ?? 0;
    const trace = worstTrace.length > 1 ? `; ${number(total)} ms in the worst ${worstTrace.length} periods` : "";
    return { status: "none", text: `At most ${number(greatest)} ms per period${trace}` };
  },
  cpuBudget: ({ cpus }) => {
    const order = ["missed", "unknown", "tight", "met"] as const;
    const worst = order.map((status) => cpus.find((cpu) => cpu.status === status)).find((cpu) => cpu !== undefined);
    const { status, figure } = worst ?? { status: "none", figure: "No CPU is used" };
    return { status, text: figure.replace(/^[✓!✗?] /, "") };
  },
  schedule: ({ instance, instances, bound, note }) => {
    const shown = instances.find((it) => it.instance === instance);
    const status = statusOf(shown?.status ?? null, shown?.figure);
    const none = bound === null ? `${instance ?? "No activity"} has no response time, so no schedule` : `No schedule; bound ${number(bound)} ms`;
    return { status: note === null && status !== "missed" ? "unknown" : status, text: note ?? none };
  },
  chains: ({ chains }) => {
    const late = chains.filter(({ status }) => status === "missed");
    const lost = chains.filter(({ latency }) => latency === null);
    const count = (of: Chains["chains"], what: string) => (of.length === 0 ? [] : [`${of.length} of ${chains.length} ${what}`]);
    const parts = [...count(late, "above the limit"), ...count(lost, "without a bound")];
    const status = late.length > 0 ? "missed" : lost.length > 0 ? "unknown" : chains.some(({ limit }) => limit !== null) ? "met" : "none";
    const chain = chains.length === 1 ? "1 chain" : `${chains.length} chains`;
    return { status, text: parts.length === 0 ? chain : parts.join("; ") };
  },
  executionTimes: ({ levels, shown, assumed, compared, limit }) => {
    const at = levels.find(({ significance }) => significance === shown);
    const what = compared.length > 1 ? `${compared.length} codels` : `${number(at?.times[0] ?? 0)} ms`;
    if (at === undefined) {
      return { status: "unknown", text: "No execution time" };
    }
    const up = limit === null ? "" : limit.text.replace(/^[✓!✗?–] ?/, ": ").replace("≤", "deadlines hold up to");
    const time: Verdict = { status: limit?.status ?? "time", text: `${what} at level ${level(shown)}${assumed ? ", assumed" : ""}${up}` };
    // The page writes the mark of what is unknown.
    const verdict = { ...at.verdict, text: at.verdict.text.replace(/^\? /, "") };
    return [time, verdict].map(({ status, text }) => ({ status: status === "time" ? "none" : status, text }));
  },
  probability: ({ instance, instances }) => {
    const shown = instances.find((it) => it.instance === instance);
    return { status: statusOf(shown?.status ?? null), text: shown === undefined ? "No probability" : `${shown.instance}: ${shown.words}` };
  },
  whatIf: ({ verdict, schedulable, rows }) => {
    const isMissed = rows.some(({ status }) => status === "missed");
    return { status: schedulable ? "met" : isMissed ? "missed" : "unknown", text: verdict };
  },
};

/** `1e-4`, as the server writes levels. */
export function level(significance: number): string {
  return significance.toExponential();
}

/** A table; `columns` has the classes of its columns. */
function table(name: string, caption: string, columns: Record<string, "" | "figure">, rows: HTMLElement[]): HTMLElement {
  const head = Object.entries(columns).map(([column, kind]) => h("th", { scope: "col", class: kind }, column));
  const parts = [h("caption", {}, caption), h("thead", {}, h("tr", {}, ...head)), h("tbody", {}, ...rows)];
  return rows.length === 0 ? h("div") : h("div", { class: "scroll" }, h("table", { class: name }, ...parts));
}

function figure(...children: (Node | string)[]): HTMLElement {
  return h("td", { class: "figure" }, ...children);
}

function name(...children: (Node | string | undefined)[]): HTMLElement {
  return h("th", { scope: "row" }, ...children);
}

/** A response time and its deadline, `✓ 53 / 100 ms`, with the part of the one in the other. */
function response(figure: string | null, status: Row["status"], part: number): HTMLElement {
  const share = Number.isFinite(part) && part >= 0 ? h("small", {}, percent(part)) : undefined;
  const shown = h("span", { class: "verdict" }, figure ?? "no activity");
  return h("td", { class: "response" }, shown, status === "none" ? undefined : bar(part, status), share);
}

/** A row whose element in the drawing is lit while the pointer is on it. */
function rowOf(item: Item, actions: Actions, status: string | undefined, ...cells: HTMLElement[]): HTMLElement {
  const light = { pointerenter: () => actions.hover(item), pointerleave: () => actions.hover() };
  return h("tr", { class: status, "data-item": item, ...light }, ...cells);
}

/** A row of an instance that can be chosen. */
function choosable(of: { instance: string; status: string; figure?: string }, chosen: string | null, actions: Actions, ...cells: HTMLElement[]): HTMLElement {
  const isChosen = of.instance === chosen;
  const button = h("button", { class: "link", "aria-pressed": String(isChosen), "data-key": of.instance, click: () => actions.choose(of.instance) }, of.instance);
  return h("tr", { class: `${statusOf(of.status, of.figure)}${isChosen ? " chosen" : ""}` }, name(button), ...cells);
}

function ofGraph({ nodes, cpus: loads, lost, significance }: Graph, actions: Actions): HTMLElement[] {
  if (significance === null) {
    return [reasons("Not in the drawing", lost)];
  }
  const row = ({ index, node, status, part }: Row) => {
    const item: Item = `instance:${index}`;
    const cpu = cpus(node.affinity, node.host).replace(/^CPUs? /, "");
    const figures = [percent(node.load), number(node.priority), number(node.period), cpu];
    const more = `${figures[0]} · priority ${figures[1]} · ${figures[2]} ms · CPU ${cpu}`;
    const cells = [
      // In a narrow page, the figures of the other columns are below the name.
      name(link(node.instance, item, actions, node.component), h("small", { class: "more" }, more)),
      response(node.figure, status, part),
      ...figures.map((text) => figure(text)),
    ];
    const tr = rowOf(item, actions, status, ...cells);
    return node.reasons.length === 0 ? [tr] : [tr, h("tr", { class: "why" }, h("td", { colspan: 6 }, node.reasons.join("; ")))];
  };
  const figures = { Utilisation: "figure", Priority: "figure", "Period ms": "figure", CPU: "figure" } as const;
  const columns = { Instance: "", "Response / deadline": "figure", ...figures } as const;
  const cpu = ({ host, mask, utilisation, complete, status }: Graph["cpus"][number]) => {
    const text = utilisation === null ? "utilisation unknown" : `${complete ? "" : "≥ "}${percent(utilisation)}`;
    return h("li", { class: status }, h("span", {}, cpus(mask, host)), bar(utilisation ?? 0, status), h("strong", {}, text));
  };
  return [
    h("section", { class: "cpus" }, h("h2", {}, "Utilisation"), h("ul", {}, ...loads.map(cpu))),
    table("activities instances", "Response times, the worst first", columns, rows(nodes).flatMap(row)),
    reasons("Not analysed", lost),
  ];
}

function ofMachine(machine: Machine, actions: Actions, selected?: Item): HTMLElement[] {
  const { states, edges, worstTrace, assumed } = machine;
  const edgeName = (edge: number) => {
    const { source, target, transition } = edges[edge];
    const to = source === target ? "stays" : `→ ${states[target].name}`;
    return `${states[source].name} ${to}${transition === null ? "" : ` (${transition})`}`;
  };
  let period = 0;
  const row = ({ edge, count, time, total }: Step) => {
    const item: Item = `edge:${edge}`;
    const first = period + 1;
    period += count;
    return rowOf(
      item,
      actions,
      undefined,
      figure(count === 1 ? `${first}` : `${first} to ${period}`),
      name(link(edgeName(edge), item, actions)),
      figure(count === 1 ? number(time) : `${count} × ${number(time / count)}`),
      figure(h("strong", {}, number(total))),
    );
  };
  const trace = steps(worstTrace, edges.map(({ time }) => time));
  const columns = { Period: "figure", "From state to state": "", "Time ms": "figure", "Total ms": "figure" } as const;
  return [
    reasons("Times are unknown", machine.reasons),
    table("trace", "Periods with the greatest total", columns, trace.map(row)),
    programs(machine, selected),
    reasons("Assumed times", assumed),
  ];
}

/** The programs that a state or an edge executes; those of the initial state if nothing is selected. */
function programs({ states, edges }: Machine, selected?: Item): HTMLElement {
  const [part, at] = selected?.split(":") ?? ["state", String(states.findIndex(({ initial }) => initial))];
  const edge = part === "edge" ? edges[Number(at)] : undefined;
  const state = states[edge?.source ?? Number(at)];
  if (state === undefined) {
    return h("div");
  }
  const all: Program[] = edge === undefined ? state.first : [...state.first.slice(0, edge.first), ...edge.then];
  const title =
    edge === undefined
      ? `Programs of state ${state.name}`
      : `Programs from ${state.name} to ${states[edge.target]?.name}${edge.transition === null ? "" : ` (${edge.transition})`}`;
  const executed = all.map(({ program, time }) => h("tr", {}, name(program), figure(number(time))));
  if (edge !== undefined && edge.time !== null) {
    executed.push(h("tr", { class: "total" }, name("in total"), figure(number(edge.time))));
  }
  return table("programs", title, { Program: "", "Time ms": "figure" }, executed);
}

function ofSchedule({ instance, instances, reasons: why }: Answers["schedule"], actions: Actions): HTMLElement[] {
  const row = ({ node, status, part }: Row<Scheduled>) => choosable(node, instance, actions, response(node.figure, status, part));
  const caption = "Response times, the worst first: show the schedule of";
  const columns = { Instance: "", "Response / deadline": "figure" } as const;
  return [reasons("No schedule", why), table("activities", caption, columns, rows(instances).map(row))];
}

/** The components of the selected chain, otherwise of the first one with a latency, and why chains have none. */
function ofChains({ chains, hops, leftOut }: Chains, actions: Actions, selected?: Item): HTMLElement[] {
  const [part, at] = selected?.split(":") ?? [];
  const chosen = part === "chain" ? Number(at) : hops[part === "hop" ? Number(at) : 0]?.chain;
  const row = ({ instance, wait, buffer, periods, run }: Chains["hops"][number], index: number) => {
    const item: Item = `hop:${index}`;
    const times = [wait, buffer, periods, run, wait + buffer + periods + run];
    return rowOf(item, actions, undefined, name(link(instance, item, actions)), ...times.map((it) => figure(it === 0 ? "" : number(it))));
  };
  const rows = hops.flatMap((hop, index) => (hop.chain === chosen ? [row(hop, index)] : []));
  const columns = { Component: "", Wait: "figure", Buffer: "figure", Periods: "figure", Run: "figure", "Total ms": "figure" } as const;
  const chain = chains[chosen ?? 0];
  const why = chains.filter(({ reasons }) => reasons.length > 0).map((it) => `${it.name}: ${it.reasons.join("; ")}`);
  const more = leftOut === 0 ? [] : [`${leftOut} more chains are not shown: they are longer ways between the same ends`];
  const light = h("button", { "data-key": "light", click: () => actions.lightChain(chain?.name ?? "") }, "Show in the architecture");
  return [h("section", {}, ...(chain === undefined ? [] : [light])), table("hops", `${chain?.name ?? ""}: ${chain?.figure ?? ""}`, columns, rows), reasons("Without a bound", why), reasons("Left out", more)];
}

function ofProbability({ instance, instances, reasons: why }: Answers["probability"], actions: Actions): HTMLElement[] {
  const row = (it: (typeof instances)[number]) => choosable(it, instance, actions, ...it.figures.map((of) => figure(of ?? "")));
  const sorted = [...instances].sort((one, other) => other.missPerHour - one.missPerHour);
  const columns = { Instance: "", "In an hour": "figure", "Of a job": "figure" } as const;
  const shown = instances.find((it) => it.instance === instance);
  return [reasons("No probability", why), table("activities", "Late with a probability of at most", columns, sorted.map(row)), reasons("If", shown?.conditions ?? []), reasons("Note", shown?.reason ? [shown.reason] : [])];
}

/** Why figures are missing: all others are in the drawing. */
function ofWhatIf({ rows, reasons: why }: Answers["whatIf"]): HTMLElement[] {
  const lost = rows.flatMap(({ name, after }) => (after?.reasons ?? []).map((reason) => `${name}: ${reason}`));
  return [reasons("Nothing is analysed", why), reasons("Without a figure", lost)];
}

function ofTimes({ levels, shown, source, evidence, reasons: why, compared }: Answers["executionTimes"], actions: Actions): HTMLElement[] {
  // Compared times are in the drawing, and the headline has one that is the same at all levels.
  const hasTimes = compared.length === 1 && levels.some(({ times: [time] }) => time !== levels[0].times[0]);
  const row = ({ significance, times, verdict }: (typeof levels)[number]) => {
    const isShown = significance === shown;
    const text = level(significance);
    const choose = { class: "link", "data-key": text, "aria-pressed": String(isShown), title: `Show all figures at ${text}`, click: () => actions.setLevel(significance) };
    const time = figure(number(times[0] ?? 0));
    const cells = [...(hasTimes ? [time] : []), h("td", { class: `verdict-at ${verdict.status}` }, verdict.text)];
    return h("tr", { class: isShown ? "chosen" : undefined }, name(h("button", choose, text)), ...cells);
  };
  const caption = source === null ? "Execution times, and the deadlines at each level" : `Execution times of ${source}, and the deadlines at each level`;
  const columns = { Level: "" as const, ...(hasTimes && { "Time ms": "figure" as const }), "The project at this level": "" as const };
  return [reasons("Times are missing", why), table("levels", caption, columns, levels.map(row)), reasons("Evidence", evidence.flatMap((it) => it.split("\n")))];
}

/** A button that goes to the source. */
function link(text: string, item: Item, actions: Actions, below?: string): HTMLElement {
  const events = { click: () => actions.go(item), focus: () => actions.hover(item), blur: () => actions.hover() };
  const button = h("button", { class: "link", "data-key": item, title: "Go to the source", ...events }, text);
  return below === undefined ? button : h("span", {}, button, h("small", {}, below));
}

function reasons(title: string, all: string[]): HTMLElement {
  return all.length === 0 ? h("div") : h("section", { class: "reasons" }, h("h2", {}, title), h("ul", {}, ...all.map((it) => h("li", {}, it))));
}
