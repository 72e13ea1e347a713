import type { Answers, PanelKind } from "./answers";

/** So many milliseconds after an edit, an earlier drawing gives way to one in which figures are unknown: the user may be typing. */
export const typingTime = 3000;

/** Returns whether figures are unknown in an answer that an earlier one has: the text may have an error that will be gone soon. */
export function hasLost<Kind extends PanelKind>(kind: Kind, before: Answers[Kind], after: Answers[Kind]): boolean {
  switch (kind) {
    case "architecture": {
      const statuses = (graph: Answers["architecture"]) => new Map(graph.nodes.map(({ instance, status }) => [instance, status]));
      const earlier = statuses(before as Answers["architecture"]);
      const isKnown = (status?: string | null) => status !== undefined && status !== null && status !== "not-analysed";
      const now = statuses(after as Answers["architecture"]);
      return [...now].some(([instance, status]) => !isKnown(status) && isKnown(earlier.get(instance)));
    }
    case "stateMachine": {
      const reasons = (machine: object) => (machine as Answers["stateMachine"]).reasons.length;
      return reasons(before) === 0 && reasons(after) > 0;
    }
    case "schedule":
      return before.drawing !== null && after.drawing === null;
    default: {
      const levels = (times: object) => (times as Answers["executionTimes"]).levels.length;
      return levels(before) > 0 && levels(after) === 0;
    }
  }
}
