import type { Answers, Choice, Graph, Machine, PanelKind, Subject } from "./answers";

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
export interface Kind<Answer> {
  title(answer: Answer): string;
  load(request: Request, subject: Subject): Promise<Loaded<Answer>>;
  /** The subject after a choice. */
  choose(subject: Subject, value: string): Subject;
}

/** The kinds of panels. */
export const kinds: { [Name in PanelKind]: Kind<Answers[Name]> } = {
  architecture: {
    title: ({ name }) => `Architecture: ${name}`,
    load: loadGraph,
    choose: (subject, value) => {
      const [root, name] = JSON.parse(value) as [string, string];
      return { uri: subject.uri, root, name };
    },
  },
  stateMachine: {
    title: ({ component }) => `State machine: ${component}`,
    load: async (request, subject) => {
      const answer = await named(request, "mauve/stateMachine", "component", subject, (it: Machine) => it.component);
      return { answer, subject: { ...subject, name: answer.component }, choices: [], chosen: "" };
    },
    choose: (subject) => subject,
  },
  schedule: {
    title: ({ deployment, instance }) => `Schedule: ${instance ?? deployment}`,
    load: loadSchedule,
    choose: (subject, instance) => ({ ...subject, instance }),
  },
  executionTimes: {
    title: ({ codel }) => `Execution times: ${codel}`,
    load: async (request, subject) => {
      const method = "mauve/executionTimes";
      const answer = await named<Answers["executionTimes"]>(request, method, "codel", subject, (it) => it.codel);
      const choices = answer.codels.map((codel) => ({ label: codel, value: codel }));
      return { answer, subject: { ...subject, name: answer.codel }, choices, chosen: answer.codel };
    },
    choose: ({ uri }, name) => ({ uri, name }),
  },
};

/** The deployments of a document, and the one of the subject: by its name, else where it was, else the first. */
async function loadGraph(request: Request, subject: Subject): Promise<Loaded<Graph>> {
  const textDocument = { uri: subject.uri };
  let { name, root, position } = subject;
  if (name === undefined && position !== undefined) {
    // Elsewhere in the document, it selects none.
    const at = await request<Graph[]>("mauve/graph", { textDocument, position, drawing: "dot" }).catch(() => []);
    ({ name, root } = at[0] ?? {});
  }
  const graphs = await request<Graph[]>("mauve/graph", { textDocument });
  const isIt = (graph: Graph) => graph.name === name && (root === undefined || graph.root === root);
  let answer = graphs.find(isIt);
  if (answer === undefined && name !== undefined) {
    // A deployment of another file, such as one of the tree view; else it was renamed or removed.
    answer = (await request<Graph[]>("mauve/graph", { textDocument, name }).catch(() => [])).find(isIt);
    const isRenamed = answer === undefined && graphs.length > 1 && position !== undefined;
    const at = isRenamed ? await request<Graph[]>("mauve/graph", { textDocument, position }).catch(() => []) : [];
    answer ??= graphs.find(({ name, root }) => name === at[0]?.name && root === at[0]?.root);
  }
  answer ??= graphs[0];
  const value = (graph: Graph) => JSON.stringify([graph.root, graph.name]);
  const all = graphs.includes(answer) ? graphs : [answer, ...graphs];
  const isAmbiguous = ({ name }: Graph) => all.filter((graph) => graph.name === name).length > 1;
  const label = (graph: Graph) => (isAmbiguous(graph) ? `${graph.name} (${graph.root})` : graph.name);
  return {
    answer,
    subject: { uri: subject.uri, position, name: answer.name, root: answer.root },
    choices: all.map((graph) => ({ label: label(graph), value: value(graph) })),
    chosen: value(answer),
  };
}

/** The schedule of an instance, by the names; where these are outdated, at the position. */
async function loadSchedule(request: Request, subject: Subject): Promise<Loaded<Answers["schedule"]>> {
  const { uri, position, name: deployment, instance } = subject;
  const ask = (parameters: object) =>
    request<Answers["schedule"]>("mauve/schedule", { textDocument: { uri }, ...parameters });
  const answer =
    deployment === undefined
      ? await ask({ position, instance })
      : await ask({ deployment, instance }).catch(() => ask({ position }));
  const choices = answer.instances.map(({ instance, response, deadline }) => ({
    label: deadline === null ? instance : `${instance} (${response} of ${deadline} ms)`,
    value: instance,
  }));
  const chosen = answer.instance ?? "";
  return { answer, subject: { uri, position, name: answer.deployment, instance: answer.instance ?? instance }, choices, chosen };
}

/**
 * Asks for a declaration at the subject's position. Its name counts more, where both are known and the position may have moved;
 * but a declaration that was renamed has only its position.
 */
async function named<T>(
  request: Request,
  method: string,
  parameter: string,
  { uri, position, name }: Subject,
  nameOf: (answer: T) => string,
): Promise<T> {
  const byName = () => request<T>(method, { textDocument: { uri }, [parameter]: name });
  if (position === undefined) {
    return byName();
  }
  const atPosition = request<T>(method, { textDocument: { uri }, position });
  if (name === undefined) {
    return atPosition;
  }
  const answer = await atPosition.catch(byName);
  return nameOf(answer) === name ? answer : byName().catch(() => answer);
}
