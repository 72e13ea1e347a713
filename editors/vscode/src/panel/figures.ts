import type { GraphNode, Scheduled } from "../answers";

/** An activity in a table. */
export interface Row<Node = GraphNode> {
  /** Its number in the answer. */
  index: number;
  node: Node;
  /** A class of the styles. */
  status: "missed" | "unknown" | "tight" | "met" | "none";
  /** The response time as a part of the deadline; infinite without a bound. */
  part: number;
}

/** A number without needless decimals. */
export function number(value: number | null | undefined): string {
  return value === null || value === undefined ? "–" : String(Math.round(value * 1e6) / 1e6);
}

export function percent(part: number | null | undefined): string {
  return part === null || part === undefined ? "–" : `${(part * 100).toFixed(1)} %`;
}

/** `CPU 1`, `CPUs 1 and 2`: the lowest bit is CPU 1; with several computers, `CPU 1 of eyes`. */
export function cpus(mask: number | null, host?: string | null): string {
  const of = host ? ` of ${host}` : "";
  const names: number[] = [];
  for (let cpu = 0; mask !== null && cpu < 53; cpu++) {
    if (Math.floor(mask / 2 ** cpu) % 2 === 1) {
      names.push(cpu + 1);
    }
  }
  if (names.length < 2) {
    return names.length === 0 ? "–" : `CPU ${names[0]}${of}`;
  }
  return `CPUs ${names.slice(0, -1).join(", ")} and ${names.at(-1)}${of}`;
}

/** The status of a deadline as a class; a response time without a bound misses its deadline. The figure's mark says what is tight. */
export function statusOf(status: string | null, figure?: string | null): Row["status"] {
  const others = { met: figure?.startsWith("!") ? "tight" : "met", "not-analysed": "unknown", background: "none" } as const;
  return status === null ? "none" : (others[status as keyof typeof others] ?? "missed");
}

/** The marks of the statuses, the worst first. */
export const signs: Record<Row["status"], string> = { missed: "✗", unknown: "?", tight: "!", met: "✓", none: "–" };

/** The rows of the activities, the worst first: by their statuses, then by the response time as a part of the deadline. */
export function rows<Node extends Scheduled | GraphNode>(nodes: Node[]): Row<Node>[] {
  const found = nodes.map((node, index): Row<Node> => {
    const { response, deadline } = node;
    const isKnown = response !== null && deadline !== null;
    const status = statusOf(node.status, node.figure);
    const part = status === "none" ? -1 : isKnown ? response / Math.max(deadline, Number.MIN_VALUE) : Infinity;
    return { index, node, status, part };
  });
  const order = Object.keys(signs);
  const byStatus = (one: Row<Node>, other: Row<Node>) => order.indexOf(one.status) - order.indexOf(other.status);
  const byPart = (one: Row<Node>, other: Row<Node>) => (one.part === other.part ? 0 : one.part > other.part ? -1 : 1);
  const byName = (one: Row<Node>, other: Row<Node>) => one.node.instance.localeCompare(other.node.instance);
  return found.sort((one, other) => byStatus(one, other) || byPart(one, other) || byName(one, other));
}

/** A part of a sentence. */
export interface Said {
  status: Row["status"];
  text: string;
}

/** The deployment in one sentence: its parts with their statuses. */
export function summary(all: Row[]): Said[] {
  const of = (status: Row["status"]) => all.filter((row) => row.status === status);
  const [missed, unknown, met] = [of("missed"), of("unknown"), [...of("tight"), ...of("met")]];
  const names = (rows: Row[]) => {
    const shown = rows.slice(0, 3).map(({ node }) => node.instance).join(", ");
    return rows.length > 3 ? `${shown} and ${rows.length - 3} more` : shown;
  };
  const deadlines = (count: number) => (count === 1 ? "1 deadline" : `${count} deadlines`);
  const parts: Said[] = [];
  if (missed.length > 0) {
    parts.push({ status: "missed", text: `${deadlines(missed.length)} missed: ${names(missed)}` });
  }
  if (unknown.length > 0) {
    parts.push({ status: "unknown", text: `${unknown.length} not analysed: ${names(unknown)}` });
  }
  if (parts.length > 0) {
    return parts;
  }
  if (met.length === 0) {
    return [{ status: "none", text: "No activity has a deadline" }];
  }
  const least = met.reduce((one, other) => (other.part > one.part ? other : one));
  const deadlinesMet = met.length === 1 ? "The deadline is met" : `All ${met.length} deadlines are met`;
  return [
    { status: "met", text: deadlinesMet },
    { status: least.status, text: `least slack: ${least.node.instance}, ${least.node.figure}` },
  ];
}

/** A step of the worst periods: the same edge several times in a row is one. */
export interface Step {
  edge: number;
  count: number;
  /** The execution time of all of them, and of all up to here. */
  time: number;
  total: number;
}

/** The steps of a trace; times are those of the edges. */
export function steps(trace: number[], times: (number | null)[]): Step[] {
  const found: Step[] = [];
  let total = 0;
  for (const edge of trace) {
    const time = times[edge] ?? 0;
    total += time;
    const last = found.at(-1);
    if (last?.edge === edge) {
      found.splice(-1, 1, { edge, count: last.count + 1, time: last.time + time, total });
    } else {
      found.push({ edge, count: 1, time, total });
    }
  }
  return found;
}
