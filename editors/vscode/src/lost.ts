import type { Answers, PanelKind } from "./answers";

/** So many milliseconds after an edit, an earlier drawing gives way to one in which figures are unknown: the user may be typing. */
export const typingTime = 3000;

/** What has figures in an answer: instances, or all of it. */
function known(answer: Answers[PanelKind]): string[] {
  if (!("nodes" in answer)) {
    return answer.reasons.length === 0 ? ["all"] : [];
  }
  return answer.nodes.filter(({ status }) => status !== null && status !== "not-analysed").map(({ instance }) => instance);
}

/** Returns whether figures are unknown in an answer that an earlier one has: the text may have an error that will be gone soon. */
export function hasLost(before: Answers[PanelKind], after: Answers[PanelKind]): boolean {
  const isThere = (of: string) => !("nodes" in after) || after.nodes.some(({ instance }) => instance === of);
  const now = known(after);
  return known(before).some((of) => isThere(of) && !now.includes(of));
}
