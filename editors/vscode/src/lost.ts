import type { Answers, PanelKind } from "./answers";

/** So many milliseconds after an edit, an earlier drawing gives way to one in which figures are unknown: the user may be typing. */
export const typingTime = 3000;

/** What an answer is about, instances or all of it, and whether it has figures. */
function parts(answer: Answers[PanelKind]): Map<string, boolean> {
  if ("nodes" in answer) {
    return new Map(answer.nodes.map(({ instance, status }) => [instance, status !== null && status !== "not-analysed"]));
  }
  if ("rows" in answer) {
    return new Map(answer.rows.filter(({ after }) => after !== null).map(({ name, status }) => [name, status !== "unknown"]));
  }
  return new Map([["all", answer.reasons.length === 0]]);
}

/** Returns whether figures are unknown in an answer that an earlier one has: the text may have an error that will be gone soon. */
export function hasLost(before: Answers[PanelKind], after: Answers[PanelKind]): boolean {
  const now = parts(after);
  return [...parts(before)].some(([of, isKnown]) => isKnown && now.get(of) === false);
}
