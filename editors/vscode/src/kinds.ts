import type { Answers, Chains, Choice, CpuBudget, ExecutionTimes, Graph, Machine, PanelKind, Probability, Schedule, Subject, WhatIf } from "./answers";

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
  stateMachine: declaration<Machine>("State machine", "mauve/stateMachine", "component"),
  schedule: ofInstance<Schedule>("Schedule", "mauve/schedule", (asked, shown) => shown ?? asked),
  chains: declaration<Chains>("Chains", "mauve/chains", "deployment"),
  cpuBudget: declaration<CpuBudget>("CPU budget", "mauve/cpuBudget", "deployment"),
  executionTimes: {
    ...declaration<ExecutionTimes>("Execution times", "mauve/executionTimes", "codel", ({ codel, instance, codels, instances }, { uri, position }) => ({
      subject: { uri, position, name: codel ?? undefined, instance: instance ?? undefined },
      choices: [
        ...instances.map((instance) => ({ label: `${instance}: all codels`, value: JSON.stringify({ instance }) })),
        ...codels.map((name) => ({ label: name, value: JSON.stringify({ name }) })),
      ],
      chosen: JSON.stringify(instance === null ? { name: codel } : { instance }),
    })),
    choose: ({ uri }, value) => ({ uri, ...(JSON.parse(value) as object) }),
  },
  probability: ofInstance<Probability>("Probability of a late job", "mauve/probability", (asked, shown) => asked ?? shown),
  whatIf: declaration<WhatIf>("What if", "mauve/whatIf", "deployment", ({ before }, subject) => ({ subject: { ...subject, before } })),
};

/** A kind of panel about a declaration, whose name is a parameter and in the answer; `more` is what else an answer loads. */
function declaration<Answer>(
  title: string,
  method: string,
  parameter: keyof Answer & string,
  more: (answer: Answer, subject: Subject) => Partial<Loaded<Answer>> = () => ({}),
): Kind<Answer> {
  return {
    title,
    load: async (request, asked) => {
      const answer = await named<Answer>(request, method, parameter, asked);
      const subject = { ...asked, name: answer[parameter] as string };
      return { answer, subject, choices: [], chosen: "", ...more(answer, subject) };
    },
    choose: (subject) => subject,
  };
}

/** A kind of panel about an instance of a deployment; `subjectOf` names the chosen one. Its page lists what is known of the others. */
function ofInstance<Answer extends Schedule | Probability>(
  title: string,
  method: string,
  subjectOf: (asked: string | undefined, shown: string | undefined) => string | undefined,
): Kind<Answer> {
  return {
    title,
    load: async (request, subject) => {
      const ask = (of: Subject) => named<Answer>(request, method, "deployment", of);
      // An instance that is gone was renamed or removed.
      const answer = await ask(subject).catch(() => ask({ ...subject, instance: undefined }));
      const choices = answer.instances.map(({ instance }) => ({ label: instance, value: instance }));
      const instance = subjectOf(subject.instance, answer.instance ?? undefined);
      return { answer, subject: { ...subject, name: answer.deployment, instance }, choices, chosen: answer.instance ?? "" };
    },
    choose: (subject, instance) => ({ ...subject, instance }),
  };
}

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
  parameter: keyof T & string,
  { uri, position, name, instance, values, before }: Subject,
): Promise<T> {
  const ask = (parameters: object) => request<T>(method, { textDocument: { uri }, instance, values, before, ...parameters });
  const byName = () => ask({ [parameter]: name });
  if (position === undefined) {
    return byName();
  }
  const atPosition = ask({ position });
  if (name === undefined) {
    return atPosition;
  }
  const answer = await atPosition.catch(byName);
  return answer[parameter] === name ? answer : byName().catch(() => answer);
}
