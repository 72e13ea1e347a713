import type { Answers, Chains, Choice, ExecutionTimes, Graph, Machine, PanelKind, Probability, Schedule, Subject, WhatIf } from "./answers";

/** Sends a request to the server. */
export type Request = <T>(method: string, parameters: object) => Promise<T>;

/** What a panel shows, with what else can be chosen, and the subject by its names. */
export interface Loaded<Answer> {
  answer: Answer;
  subject: Subject;
  choices: Choice[];
  chosen: string;
}

/** A kind of panel. */
interface Kind<Answer> {
  title: string;
  load(request: Request, subject: Subject): Promise<Loaded<Answer>>;
  /** The subject after a choice. */
  choose(subject: Subject, value: string): Subject;
}

/** The kinds of panels. */
export const kinds: { [Name in PanelKind]: Kind<Answers[Name]> } = {
  architecture: {
    title: "Architecture",
    load: loadGraph,
    choose: ({ uri }, value) => {
      const [root, name] = JSON.parse(value) as [string, string];
      return { uri, root, name };
    },
  },
  stateMachine: {
    title: "State machine",
    load: async (request, subject) => {
      const answer = await named(request, "mauve/stateMachine", "component", subject, (it: Machine) => it.component);
      return { answer, subject: { ...subject, name: answer.component }, choices: [], chosen: "" };
    },
    choose: (subject) => subject,
  },
  schedule: {
    title: "Schedule",
    load: async (request, subject) => {
      const ask = (of: Subject) => named(request, "mauve/schedule", "deployment", of, (it: Schedule) => it.deployment);
      // An instance that is gone was renamed or removed.
      const answer = await ask(subject).catch(() => ask({ ...subject, instance: undefined }));
      const choices = answer.instances.map(({ instance, figure }) => ({
        label: `${instance}: ${figure}`,
        value: instance,
      }));
      const instance = answer.instance ?? subject.instance;
      return { answer, subject: { ...subject, name: answer.deployment, instance }, choices, chosen: answer.instance ?? "" };
    },
    choose: (subject, instance) => ({ ...subject, instance }),
  },
  chains: {
    title: "Chains",
    load: async (request, subject) => {
      const answer = await named(request, "mauve/chains", "deployment", subject, (it: Chains) => it.deployment);
      return { answer, subject: { ...subject, name: answer.deployment }, choices: [], chosen: "" };
    },
    choose: (subject) => subject,
  },
  executionTimes: {
    title: "Execution times",
    load: async (request, subject) => {
      const answer = await named(request, "mauve/executionTimes", "codel", subject, (it: ExecutionTimes) => it.codel);
      const choices = answer.codels.map((codel) => ({ label: codel, value: codel }));
      return { answer, subject: { ...subject, name: answer.codel }, choices, chosen: answer.codel };
    },
    choose: ({ uri }, name) => ({ uri, name }),
  },
  probability: {
    title: "Probability of a late job",
    load: async (request, subject) => {
      const ask = (of: Subject) => named(request, "mauve/probability", "deployment", of, (it: Probability) => it.deployment);
      const answer = await ask(subject).catch(() => ask({ ...subject, instance: undefined }));
      const choices = answer.instances.map(({ instance, words }) => ({ label: `${instance}: ${words}`, value: instance }));
      // While it is typed, an activity may have no probability: then another one is shown, and not kept.
      const instance = subject.instance ?? answer.instance ?? undefined;
      return { answer, subject: { ...subject, name: answer.deployment, instance }, choices, chosen: answer.instance ?? "" };
    },
    choose: (subject, instance) => ({ ...subject, instance }),
  },
  whatIf: {
    title: "What if",
    load: async (request, subject) => {
      const { values = [], before } = subject;
      const withValues: Request = (method, parameters) => request(method, { ...parameters, values, before });
      const answer = await named(withValues, "mauve/whatIf", "deployment", subject, (it: WhatIf) => it.deployment);
      return { answer, subject: { ...subject, name: answer.deployment, before: answer.before }, choices: [], chosen: "" };
    },
    choose: (subject) => subject,
  },
};

/** The name of what a panel shows. */
export function nameOf({ name, instance }: Subject): string {
  return instance ?? name ?? "";
}

/** The deployments of a document, and the one of the subject: by its name, else where it was, else the first. */
async function loadGraph(request: Request, subject: Subject): Promise<Loaded<Graph>> {
  const { uri, name, root, position, chain } = subject;
  const ask = (parameters: object) => request<Graph[]>("mauve/graph", { textDocument: { uri }, chain, ...parameters });
  const isIt = (graph: Graph) => graph.name === name && (root === undefined || graph.root === root);
  const graphs = await ask({});
  let answer = graphs.find(isIt);
  if (answer === undefined && name !== undefined) {
    // A deployment of another file, such as one of the tree view.
    answer = (await ask({ name }).catch(() => [])).find(isIt);
  }
  if (answer === undefined && position !== undefined) {
    // Elsewhere in the document, it selects none.
    const [at] = await ask({ position }).catch(() => []);
    answer = graphs.find(({ name, root }) => name === at?.name && root === at.root) ?? at;
  }
  answer ??= graphs[0];
  const value = (graph: Graph) => JSON.stringify([graph.root, graph.name]);
  const all = graphs.includes(answer) ? graphs : [answer, ...graphs];
  const isAmbiguous = ({ name }: Graph) => all.filter((graph) => graph.name === name).length > 1;
  const label = (graph: Graph) => (isAmbiguous(graph) ? `${graph.name} (${graph.root})` : graph.name);
  return {
    answer,
    subject: { uri, position, name: answer.name, root: answer.root, chain },
    choices: all.map((graph) => ({ label: label(graph), value: value(graph) })),
    chosen: value(answer),
  };
}

/**
 * Asks for a declaration at the subject's position. Its name counts more, where both are known and the position may have moved;
 * but a declaration that was renamed has only its position.
 */
async function named<T>(
  request: Request,
  method: string,
  parameter: string,
  { uri, position, name, instance }: Subject,
  nameOf: (answer: T) => string,
): Promise<T> {
  const ask = (parameters: object) => request<T>(method, { textDocument: { uri }, instance, ...parameters });
  const byName = () => ask({ [parameter]: name });
  if (position === undefined) {
    return byName();
  }
  const atPosition = ask({ position });
  if (name === undefined) {
    return atPosition;
  }
  const answer = await atPosition.catch(byName);
  return nameOf(answer) === name ? answer : byName().catch(() => answer);
}
