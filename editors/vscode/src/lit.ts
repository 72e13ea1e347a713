import type { Location } from "vscode-languageclient";
import type { Answers, Item, PanelKind } from "./answers";

/** The declarations of the elements of a drawing, by their items. */
export type Places = Map<Item, (Location | null)[]>;

/** The parts of answers that have elements in the drawing, and the kinds of these. */
const parts = { nodes: "instance", states: "state", edges: "edge", activities: "activity", levels: "level", chains: "chain", hops: "hop", rows: "row" };

/** What a part of an answer may have. */
interface Part {
  location?: Location | null;
  activity?: Location | null;
  source?: number;
}

/** Returns the declarations of the elements of a drawing; those to go to first. */
export function placesOf(answer: Answers[PanelKind]): Places {
  const all = answer as Partial<Record<keyof typeof parts, Part[]>> & Part;
  const places: Places = new Map();
  for (const [part, kind] of Object.entries(parts)) {
    all[part as keyof typeof parts]?.forEach(({ activity = null, location, source = -1 }, index) => {
      // The period in which no transition is taken is declared with its state; a level with its codel.
      const own = location ?? all.states?.[source]?.location ?? all.location ?? null;
      places.set(`${kind}:${index}`, activity === null ? [own] : [activity, own]);
    });
  }
  return all.location === undefined ? places : places.set("codel:0", [all.location]);
}

/**
 * Returns the elements that are declared at a line of a document. States and transitions reach to the next one: their
 * places are only their names.
 */
export function litAt(places: Places, uri: string, line: number): Item[] {
  const found: Item[] = [];
  let nearest: { item: Item; line: number } | undefined;
  for (const [item, locations] of places) {
    for (const location of locations) {
      if (location === null || location.uri !== uri) {
        continue;
      }
      const { start, end } = location.range;
      if (start.line <= line && line <= end.line && !found.includes(item)) {
        found.push(item);
      }
      if (item.startsWith("state:") && start.line <= line && (nearest === undefined || nearest.line <= start.line)) {
        nearest = { item, line: start.line };
      }
    }
  }
  return found.length === 0 && nearest !== undefined ? [nearest.item] : found;
}
