// Observed response times beside their bounds: what a recording of `mauve run` says of each instance, and a table of it.
import type { GraphNode } from "./answers";
import { number, rows, signs } from "./panel/figures";

/** What was observed of an instance so far; times are in milliseconds. */
export interface Observed {
  periods: number;
  /** The greatest response time. */
  response: number;
}

/** A file of periods that grows: its header, and what was read of it so far. */
export class Periods {
  private rest = "";
  private header?: string[];
  readonly observed = new Map<string, Observed>();

  /** Reads the next part of the file; a last line that is not complete waits for the part after it. */
  add(part: string): void {
    const lines = (this.rest + part).split("\n");
    this.rest = lines.pop() ?? "";
    for (const line of lines) {
      const cells = line.split(",");
      if (this.header === undefined) {
        this.header = cells;
        continue;
      }
      const of = (name: string) => cells[this.header!.indexOf(name)];
      const response = (Number(of("end_ns")) - Number(of("release_ns"))) / 1e6;
      const instance = of("instance");
      if (instance !== undefined && Number.isFinite(response)) {
        const { periods, response: before } = this.observed.get(instance) ?? { periods: 0, response: 0 };
        this.observed.set(instance, { periods: periods + 1, response: Math.max(before, response) });
      }
    }
  }
}

/** What `mauve trace check --format json` says, as far as it is read. */
export interface Comparison {
  instances: { instance: string; periods: number; response: number | null }[];
  findings: { instance: string | null; message: string }[];
}

/** The observed response times of a comparison. */
export function observedOf({ instances }: Comparison): Map<string, Observed> {
  return new Map(instances.flatMap(({ instance, periods, response }) => (response === null ? [] : [[instance, { periods, response }]])));
}

/** The greatest width of a bar. */
export const width = 200;

/** The body of the page: a row for each activity, the worst first, and what contradicts the model. */
export function bodyOf(title: string, nodes: GraphNode[], observed: ReadonlyMap<string, Observed>, findings: string[]): string {
  const cells = rows(nodes).filter(({ status }) => status !== "none").map(({ node, status }) => {
    const { instance, response: bound, deadline, figure } = node;
    const seen = observed.get(instance);
    const isRefuted = seen !== undefined && seen.response > Math.min(bound ?? Infinity, deadline ?? Infinity);
    const end = Math.max(seen?.response ?? 0, bound ?? 0, deadline ?? 0) || 1;
    const filled = (((seen?.response ?? 0) / end) * width).toFixed(1);
    const at = (time: number) => ((time / end) * (width - 2) + 1).toFixed(1);
    const tick = (kind: string, time: number | null) =>
      time === null ? "" : `<line class="${kind}" x1="${at(time)}" x2="${at(time)}" y1="0" y2="14"><title>${kind} ${number(time)} ms</title></line>`;
    const bar = `<rect class="track" y="5" width="${width}" height="4"/><rect class="seen" y="3" width="${filled}" height="8"/>`;
    const words = seen === undefined ? "not observed" : `observed ${number(seen.response)} · bound ${number(bound)} · deadline ${number(deadline)} ms`;
    return `<tr class="${isRefuted ? "missed" : status}"><th scope="row">${escaped(instance)}</th>
<td>${isRefuted ? signs.missed : ""} ${seen === undefined ? "–" : `${number(Math.round(seen.response * 1e3) / 1e3)} ms`}</td>
<td>${escaped(figure ?? "–")}</td>
<td><svg viewBox="0 0 ${width} 14" preserveAspectRatio="none" height="14" role="img" aria-label="${escaped(`${instance}: ${words}`)}">${bar}${tick("bound", bound)}${tick("deadline", deadline)}</svg></td>
<td>${seen?.periods ?? 0}</td></tr>`;
  });
  const listed = findings.map((it) => `<li>${escaped(it)}</li>`).join("");
  return `<h1>${escaped(title)}</h1>
<table><thead><tr><th>activity</th><th>observed</th><th>bound / deadline</th><th><span class="key seen">▬</span> observed <span class="key bound">|</span> bound <span class="key deadline">|</span> deadline</th><th>periods</th></tr></thead>
<tbody>${cells.join("\n")}</tbody></table>
${listed === "" ? "" : `<h2>What contradicts the model</h2><ul>${listed}</ul>`}`;
}

function escaped(text: string): string {
  return text.replace(/[&<>"']/g, (it) => `&#${it.charCodeAt(0)};`);
}
