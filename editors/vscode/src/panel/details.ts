// What a panel shows beside its drawing, by its kind.
import type { Answers, Graph, Item, Machine, PanelKind, Program } from "../answers";
import { bar, h } from "./dom";
import { cpus, number, percent, Row, rows, signs, statusOf, steps, summary } from "./figures";

/** What a part of the page does. */
export interface Actions {
  go(item: Item): void;
  hover(item?: Item): void;
  choose(value: string): void;
}

/** The parts of the page below the drawing. `selected` is the selected element of the drawing. */
export function details<Kind extends PanelKind>(
  kind: Kind,
  answer: Answers[Kind],
  actions: Actions,
  selected?: Item,
): HTMLElement[] {
  switch (kind) {
    case "architecture":
      return ofGraph(answer as Graph, actions);
    case "stateMachine":
      return ofMachine(answer as Machine, actions, selected);
    case "schedule":
      return ofSchedule(answer as Answers["schedule"], actions);
    default:
      return ofTimes(answer as Answers["executionTimes"]);
  }
}

/** What is most important, in a line with its status. */
export function headline(kind: PanelKind, answer: Answers[PanelKind]): { status: Row["status"]; text: string } {
  switch (kind) {
    case "architecture": {
      const { nodes, significance } = answer as Graph;
      const instances = nodes.length === 1 ? "1 instance" : `${nodes.length} instances`;
      return significance === null ? { status: "none", text: `${instances}; no deployment, so no times` } : summary(rows(nodes));
    }
    case "stateMachine": {
      const { worstTrace, edges, reasons } = answer as Machine;
      if (reasons.length > 0) {
        return { status: "unknown", text: "Execution times unknown" };
      }
      const greatest = Math.max(0, ...edges.map(({ time }) => time ?? 0));
      const total = steps(worstTrace, edges.map(({ time }) => time)).at(-1)?.total ?? 0;
      const trace = worstTrace.length > 1 ? `; ${number(total)} ms in the worst ${worstTrace.length} periods` : "";
      return { status: "none", text: `At most ${number(greatest)} ms per period${trace}` };
    }
    case "schedule": {
      const { instance, instances, bound, note } = answer as Answers["schedule"];
      const status = statusOf(instances.find((it) => it.instance === instance)?.status ?? null);
      return { status: note === null ? "unknown" : status, text: note ?? `No schedule; bound ${number(bound)} ms` };
    }
    default: {
      const { levels, shown, assumed } = answer as Answers["executionTimes"];
      const at = levels.find(({ significance }) => significance === shown);
      const text = at === undefined ? "No execution time" : `${number(at.time)} ms at level ${level(shown)}`;
      return { status: at === undefined ? "unknown" : "none", text: assumed ? `${text}, assumed` : text };
    }
  }
}

/** `1e-4`, as the server writes levels. */
export function level(significance: number): string {
  return significance.toExponential();
}

function ofGraph({ nodes, cpus: loads, lost, significance }: Graph, actions: Actions): HTMLElement[] {
  if (significance === null) {
    return [reasons("Not in the drawing", lost)];
  }
  const sorted = rows(nodes);
  const row = (row: Row) => {
    const item: Item = `instance:${row.index}`;
    const figures = [row.slack, row.load, row.priority, row.period, row.cpu];
    const tr = h(
      "tr",
      { class: row.status, "data-item": item },
      h("th", { scope: "row" }, link(row.instance, item, actions, row.component)),
      h("td", { class: "verdict" }, `${signs[row.status]} ${row.verdict}`),
      h(
        "td",
        { class: "response" },
        h("span", {}, row.response === "–" && row.deadline === "–" ? "–" : `${row.response} / ${row.deadline}`),
        row.status === "none" ? undefined : (bar(row.part === Infinity ? 1 : row.part, row.status) ),
      ),
      ...figures.map((figure) => h("td", { class: "figure" }, figure)),
   );
    tr.addEventListener("pointerenter", () => actions.hover(item));
    tr.addEventListener("pointerleave", () => actions.hover());
    return row.reasons.length === 0 ? [tr] : [tr, h("tr", { class: "why" }, h("td", { colspan: 8 }, row.reasons.join("; ")))];
  };
  const columns = ["Instance", "Status", "Response / deadline", "Slack", "Utilisation", "Priority", "Period", "CPU"];
  const head = columns.map((name, index) => h("th", { scope: "col", class: index < 2 ? undefined : "figure" }, name));
  const table = h(
    "table",
    { class: "activities" },
    h("caption", {}, "Response times in ms, the worst first"),
    h("thead", {}, h("tr", {}, ...head)),
    h("tbody", {}, ...sorted.flatMap(row)),
 );
  const cpu = ({ mask, utilisation, complete }: Graph["cpus"][number]) => {
    const status = utilisation === null ? "unknown" : utilisation > 1 ? "missed" : "met";
    const text = utilisation === null ? "utilisation unknown" : `${complete ? "" : "≥ "}${percent(utilisation)}`;
    return h("li", { class: status }, h("span", {}, cpus(mask)), bar(utilisation ?? 0, status) , h("strong", {}, text));
  };
  return [
    h("section", { class: "cpus" }, h("h2", {}, "Utilisation"), h("ul", {}, ...loads.map(cpu))),
    h("div", { class: "scroll" }, table),
    reasons("Not analysed", lost),
  ];
}

function ofMachine(machine: Machine, actions: Actions, selected?: Item): HTMLElement[] {
  const { states, edges, worstTrace, assumed } = machine;
  const trace = steps(worstTrace, edges.map(({ time }) => time));
  const name = (edge: number) => {
    const { source, target, transition } = edges[edge];
    const to = source === target ? "stays" : `→ ${states[target].name}`;
    return `${states[source].name} ${to}${transition === null ? "" : ` (${transition})`}`;
  };
  let period = 0;
  const row = ({ edge, count, time, total }: (typeof trace)[number]) => {
    const item: Item = `edge:${edge}`;
    const first = period + 1;
    period += count;
    const tr = h(
      "tr",
      { "data-item": item },
      h("td", { class: "figure" }, count === 1 ? `${first}` : `${first} to ${period}`),
      h("th", { scope: "row" }, link(name(edge), item, actions)),
      h("td", { class: "figure" }, count === 1 ? number(time) : `${count} × ${number(time / count)}`),
      h("td", { class: "figure" }, h("strong", {}, number(total))),
   );
    tr.addEventListener("pointerenter", () => actions.hover(item));
    tr.addEventListener("pointerleave", () => actions.hover());
    return tr;
  };
  const head = ["Period", "From state to state", "Time ms", "Total ms"];
  const worst = h(
    "table",
    { class: "trace" },
    h("caption", {}, "Periods with the greatest total"),
    h("thead", {}, h("tr", {}, ...head.map((it, index) => h("th", { scope: "col", class: index === 1 ? undefined : "figure" }, it)))),
    h("tbody", {}, ...trace.map(row)),
 );
  return [
    reasons("Times are unknown", machine.reasons),
    ...(trace.length === 0 ? [] : [h("div", { class: "scroll" }, worst)]),
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
  const total = edge === undefined || edge.time === null ? undefined : h("tr", { class: "total" }, h("th", { scope: "row" }, "in total"), h("td", { class: "figure" }, number(edge.time)));
  const row = ({ program, time }: Program) => h("tr", {}, h("th", { scope: "row" }, program), h("td", { class: "figure" }, number(time)));
  return h(
    "div",
    { class: "scroll" },
    h(
      "table",
      { class: "programs" },
      h("caption", {}, title),
      h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Program"), h("th", { scope: "col", class: "figure" }, "Time ms"))),
      h("tbody", {}, ...all.map(row), total),
    ),
 );
}

function ofSchedule({ instance, instances, reasons: why }: Answers["schedule"], actions: Actions): HTMLElement[] {
  const part = ({ response, deadline }: (typeof instances)[number]) => (deadline === null ? 0 : response / Math.max(deadline, Number.MIN_VALUE));
  const sorted = [...instances].sort((one, other) => part(other) - part(one));
  const row = (it: (typeof instances)[number]) => {
    const status = statusOf(it.status);
    const button = h("button", { class: "link", "aria-pressed": String(it.instance === instance), "data-key": it.instance }, it.instance);
    button.addEventListener("click", () => actions.choose(it.instance));
    return h(
      "tr",
      { class: `${status}${it.instance === instance ? " chosen" : ""}` },
      h("th", { scope: "row" }, button),
      h("td", { class: "verdict" }, `${signs[status]} ${it.status.replaceAll("-", " ")}`),
      h("td", { class: "response" }, h("span", {}, `${number(it.response)} / ${number(it.deadline)}`), bar(part(it), status) ),
   );
  };
  const table = h(
    "table",
    { class: "activities" },
    h("caption", {}, "Response times in ms, the worst first: show the schedule of"),
    h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Instance"), h("th", { scope: "col" }, "Status"), h("th", { scope: "col", class: "figure" }, "Response / deadline"))),
    h("tbody", {}, ...sorted.map(row)),
 );
  return [reasons("No schedule", why), ...(instances.length === 0 ? [] : [h("div", { class: "scroll" }, table)])];
}

function ofTimes({ levels, shown, source, reasons: why }: Answers["executionTimes"]): HTMLElement[] {
  const row = ({ significance, time }: (typeof levels)[number]) =>
    h(
      "tr",
      { class: significance === shown ? "chosen" : undefined },
      h("th", { scope: "row" }, level(significance), significance === shown ? h("small", {}, " shown") : undefined),
      h("td", { class: "figure" }, number(time)),
   );
  const table = h(
    "table",
    { class: "levels" },
    h("caption", {}, source === null ? "Execution times" : `Execution times of ${source}`),
    h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Level"), h("th", { scope: "col", class: "figure" }, "Time ms"))),
    h("tbody", {}, ...levels.map(row)),
 );
  return [reasons("Times are missing", why), ...(levels.length === 0 ? [] : [h("div", { class: "scroll" }, table)])];
}

/** A button that goes to the source. */
function link(text: string, item: Item, actions: Actions, below?: string): HTMLElement {
  const button = h("button", { class: "link", "data-key": item, title: "Go to the source" }, text);
  button.addEventListener("click", () => actions.go(item));
  button.addEventListener("focus", () => actions.hover(item));
  button.addEventListener("blur", () => actions.hover());
  return below === undefined ? button : h("span", {}, button, h("small", {}, below));
}

function reasons(title: string, all: string[]): HTMLElement {
  return all.length === 0 ? h("div") : h("section", { class: "reasons" }, h("h2", {}, title), h("ul", {}, ...all.map((it) => h("li", {}, it))));
}
