// The server's answers that panels and the tree show, as far as they are read, and the messages between a panel and the
// extension.
import type { Location, Position, WorkspaceEdit } from "vscode-languageclient";

/** What all answers have. */
interface Drawn {
  /** SVG; null without anything to draw. */
  drawing: string | null;
  /** Whether a text has syntax errors: the user may be typing. */
  incomplete: boolean;
}

/** The verdict on deployments in one line, and its worst part; `time` without a deadline. */
export interface Verdict {
  status: "missed" | "unknown" | "tight" | "met" | "time";
  text: string;
}

/** An instance of an architecture; times are in milliseconds. */
export interface GraphNode {
  instance: string;
  component: string;
  /** The computer that it runs on, where there are several; `affinity` is in its numbers. */
  host: string | null;
  load: number | null;
  affinity: number | null;
  priority: number | null;
  period: number | null;
  deadline: number | null;
  response: number | null;
  /** `✓ 53 / 100 ms`; null without an activity. */
  figure: string | null;
  status: string | null;
  reasons: string[];
  location: Location | null;
  activity: Location | null;
}

/** Of `mauve/graph`: a deployment, or an architecture. */
export interface Graph extends Drawn {
  name: string;
  root: string;
  /** Only deployments have it. */
  significance: number | null;
  verdict?: Verdict | null;
  nodes: GraphNode[];
  edges: { location: Location | null }[];
  cpus: { host?: string; mask: number; utilisation: number | null; complete: boolean; status: "met" | "tight" | "missed" | "unknown" }[];
  lost: string[];
}

export interface Program {
  program: string;
  time: number | null;
}

export interface MachineEdge {
  source: number;
  target: number;
  transition: string | null;
  time: number | null;
  /** So many programs of the source's `first` are executed, then those of `then`. */
  first: number;
  then: Program[];
  location: Location | null;
}

/** Of `mauve/stateMachine`. */
export interface Machine extends Drawn {
  component: string;
  /** The section of `mauve.toml` with the timing tables. */
  times: string | null;
  significance: number;
  states: { name: string; initial: boolean; first: Program[]; location: Location | null }[];
  edges: MachineEdge[];
  worstTrace: number[];
  assumed: string[];
  reasons: string[];
}

export interface Scheduled {
  instance: string;
  response: number | null;
  deadline: number | null;
  figure: string;
  status: string;
}

/** Of `mauve/schedule`. */
export interface Schedule extends Drawn {
  deployment: string;
  instance: string | null;
  instances: Scheduled[];
  significance: number;
  response: number | null;
  bound: number | null;
  note: string | null;
  activities: { index: number; instance: string; location: Location | null }[];
  reasons: string[];
}

/** Of `mauve/chains`; times are in milliseconds. */
export interface Chains extends Drawn {
  deployment: string;
  significance: number;
  chains: {
    name: string;
    figure: string;
    status: string;
    latency: number | null;
    limit: number | null;
    reasons: string[];
    location: Location | null;
  }[];
  /** The components of all chains. */
  hops: { chain: number; instance: string; wait: number; buffer: number; periods: number; run: number; location: Location | null }[];
  leftOut: number;
  reasons: string[];
}

/** Of `mauve/cpuBudget`: of each CPU, what executes there, the largest share first. */
export interface CpuBudget extends Drawn {
  deployment: string;
  significance: number;
  cpus: { name: string; figure: string; status: "met" | "tight" | "missed" | "unknown"; parts: { name: string; share: number; figure: string }[] }[];
  reasons: string[];
}

/** Of `mauve/executionTimes`. */
export interface ExecutionTimes extends Drawn {
  /** The codel, or the instance whose codels are compared. */
  codel: string | null;
  instance: string | null;
  /** What else can be shown. */
  codels: string[];
  instances: string[];
  compared: string[];
  /** The times of the compared codels, with the verdict on the project's deployments at each level. */
  levels: { significance: number; times: (number | null)[]; verdict: Verdict }[];
  /** `! ≤ 296 ms`: the longest time of one codel with which all deadlines are met, or why there is none. */
  limit: Verdict | null;
  shown: number;
  /** What was measured. */
  evidence: string[];
  source: string | null;
  assumed: boolean;
  location: Location | null;
  reasons: string[];
}

/** Of `mauve/probability`. */
export interface Probability extends Drawn {
  deployment: string;
  instance: string | null;
  instances: { instance: string; missPerHour: number; missPerJob: number | null; figures: (string | null)[]; words: string; conditions: string[]; reason: string | null; status: string }[];
  activities: { index: number; instance: string; location: Location | null }[];
  reasons: string[];
}

/** A figure in one of two states. */
interface InState {
  figure: string;
  status: string;
  reasons: string[];
}

/** Of `mauve/whatIf`. */
export interface WhatIf extends Drawn {
  deployment: string;
  significance: number;
  /** `8 → 9 of 9 deadlines met` */
  verdict: string;
  schedulable: boolean;
  rows: { name: string; figure: string; status: string; words: string; before: InState | null; after: InState | null; location: Location | null }[];
  /** The state that the figures are compared with, for the next request. */
  before: string;
  /** Writes the values; null without any. */
  edit: WorkspaceEdit | null;
  reasons: string[];
}

/** The answers of the kinds of panels. */
export interface Answers {
  architecture: Graph;
  stateMachine: Machine;
  schedule: Schedule;
  chains: Chains;
  cpuBudget: CpuBudget;
  executionTimes: ExecutionTimes;
  probability: Probability;
  whatIf: WhatIf;
}

export type PanelKind = keyof Answers;

/** What a panel shows: a document, and the names of what is selected in it. */
export interface Subject {
  uri: string;
  position?: Position;
  /** The deployment, component or codel. */
  name?: string;
  /** The project's root, where several projects have the document. */
  root?: string;
  /** The instance whose schedule is shown, or whose codels are compared. */
  instance?: string;
  /** The chain that is lit in the architecture. */
  chain?: string;
  /** Other values, which the text does not have, and the state that they are compared with. */
  values?: string[];
  before?: string;
}

/** An element of a drawing: its kind, as in the attribute `data-state`, and its number there, such as `state:3`. */
export type Item = `${string}:${number}`;

/** A choice that a panel offers. */
export interface Choice {
  label: string;
  value: string;
}

export type ToPanel =
  | { type: "show"; kind: PanelKind; answer: Answers[PanelKind]; choices: Choice[]; chosen: string; subject: Subject }
  /** Why the drawing is not that of the text; empty if it is. */
  | { type: "mark"; why: string }
  /** Why there is no drawing. */
  | { type: "problem"; message: string }
  /** The text with other values: they are in the model now. */
  | { type: "values"; text: string }
  /** The elements that are declared at the cursor. */
  | { type: "light"; items: Item[] };

export type FromPanel =
  /** Whether the page is narrow. */
  | { type: "ready" | "narrow"; narrow: boolean }
  | { type: "go"; item: Item }
  | { type: "choose"; value: string }
  | { type: "lightChain"; chain: string }
  | { type: "setLevel"; level: number }
  | { type: "values"; text: string }
  | { type: "apply" | "reset" }
  | { type: "chooseLevel" | "save" | "copy" };
