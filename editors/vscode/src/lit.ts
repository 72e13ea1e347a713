import type { Location } from "vscode-languageclient";
import type { Answers, Item, PanelKind } from "./answers";

/** The declarations of the elements of a drawing, by their items. */
export type Places = Map<Item, (Location | null)[]>;

/** Returns the declarations of the elements of a drawing; those to go to first. */
export function placesOf<Kind extends PanelKind>(kind: Kind, answer: Answers[Kind]): Places {
  const places: Places = new Map();
  const add = (part: string, all: (Location | null)[][]) => all.forEach((at, index) => places.set(`${part}:${index}`, at));
  switch (kind) {
    case "architecture": {
      const { nodes, edges } = answer as Answers["architecture"];
      add("instance", nodes.map(({ activity, location }) => [activity, location]));
      add("edge", edges.map(({ location }) => [location]));
      break;
    }
    case "stateMachine": {
      const { states, edges } = answer as Answers["stateMachine"];
      add("state", states.map(({ location }) => [location]));
      // The period in which no transition is taken is declared with its state.
      add("edge", edges.map(({ location, source }) => [location ?? states[source]?.location ?? null]));
      break;
    }
    case "schedule": {
      const { activities } = answer as Answers["schedule"];
      activities.forEach(({ index, location }) => places.set(`activity:${index}`, [location]));
      break;
    }
    case "executionTimes": {
      const { levels, location } = answer as Answers["executionTimes"];
      add("level", levels.map(() => [location]));
      places.set("codel:0", [location]);
    }
  }
  return places;
}

/**
 * Returns the elements that are declared at a line of a document. States and transitions reach to the next one: their
 * places are only their names.
 */
export function litAt(kind: PanelKind, places: Places, uri: string, line: number): Item[] {
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
  const isMachine = kind === "stateMachine" && found.length === 0 && nearest !== undefined;
  return isMachine ? [nearest!.item] : found;
}
