// The server's drawing as elements of the page, whose policy leaves it no scripts and nothing from elsewhere.
import type { Item } from "../answers";
import { s } from "./dom";

const parts = ["instance", "edge", "state", "activity", "level", "codel", "chain", "hop", "row"];

/** An element of a drawing that has a place in the source. */
export interface Drawn {
  item: Item;
  /** It is unique in the drawing: an activity has several slices. */
  key: string;
  name: string;
  element: SVGElement;
  /** What is lit with the text of a transition: its line. */
  line?: SVGElement;
}

export interface Drawing {
  svg: SVGSVGElement;
  items: Drawn[];
}

/** Makes a drawing of the server's text. Throws if it is not SVG. */
export function drawingOf(text: string, nonce: string): Drawing {
  // The page's policy is that of the parsed document, too. Names of a model cannot contain the tag.
  const permitted = text.replace("<style>", `<style nonce="${nonce}">`);
  const parsed = new DOMParser().parseFromString(permitted, "image/svg+xml").documentElement;
  if (parsed.localName !== "svg") {
    throw new Error("The drawing of the server is not SVG.");
  }
  const svg = document.importNode(parsed, true) as unknown as SVGSVGElement;
  svg.setAttribute("data-size", `${svg.getAttribute("width")} ${svg.getAttribute("height")}`);
  svg.setAttribute("width", "100%");
  svg.setAttribute("height", "100%");
  return { svg, items: itemsOf(svg) };
}

/** Finds the elements with a place, in reading order, and makes them operable. */
function itemsOf(svg: SVGElement): Drawn[] {
  const items: Drawn[] = [];
  const counts = new Map<Item, number>();
  const names = new Map<string, string>();
  svg.querySelectorAll("[data-state]").forEach((state) => names.set(state.getAttribute("data-state")!, nameOf(state)));
  let line: SVGElement | undefined;
  for (const element of svg.querySelectorAll<SVGElement>("g, text, circle")) {
    if (element.matches(".link") && !element.hasAttribute("data-edge")) {
      line = element;
    }
    if (element.matches(".link")) {
      addHit(element);
    }
    const part = parts.find((it) => element.hasAttribute(`data-${it}`));
    if (part === undefined) {
      continue;
    }
    const item: Item = `${part}:${Number(element.getAttribute(`data-${part}`))}`;
    const count = counts.get(item) ?? 0;
    counts.set(item, count + 1);
    const isTransition = part === "edge" && element.localName === "text";
    let name = nameOf(element);
    if (isTransition && line !== undefined) {
      const end = (which: string) => names.get(line!.getAttribute(`data-${which}`) ?? "")?.replace(/,.*/, "") ?? "";
      name = `${end("source")} → ${end("target")}, ${name} ms`;
    }
    element.setAttribute("tabindex", "-1");
    element.setAttribute("role", "button");
    element.setAttribute("aria-label", name);
    element.classList.add("item");
    items.push({ item, key: `${item}:${count}`, name, element, line: isTransition ? line : undefined });
  }
  return ordered(items);
}

function nameOf(element: Element): string {
  const title = [...element.children].find(({ localName }) => localName === "title");
  return (title ?? element).textContent?.trim() ?? "";
}

/** A wide invisible line over a thin one: it is easier to point at. */
function addHit(link: SVGElement): void {
  const wire = link.querySelector(".wire");
  if (wire !== null) {
    link.append(s("path", { class: "hit", d: wire.getAttribute("d") ?? "" }));
  }
}

/** Boxes in columns from left to right, each followed by its lines; others as they are drawn. */
function ordered(items: Drawn[]): Drawn[] {
  const boxes = items.filter(({ item }) => /^(instance|state):/.test(item));
  if (boxes.length === 0) {
    return items;
  }
  const at = ({ element }: Drawn) => {
    const frame = element.querySelector("rect");
    return { x: Number(frame?.getAttribute("x")), y: Number(frame?.getAttribute("y")) };
  };
  boxes.sort((one, other) => at(one).x - at(other).x || at(one).y - at(other).y);
  const sourceOf = ({ element, line }: Drawn) => (line ?? element).getAttribute("data-source");
  const lines = items.filter((it) => !boxes.includes(it));
  const found = boxes.flatMap((box) => [box, ...lines.filter((line) => sourceOf(line) === box.item.replace(/.*:/, ""))]);
  return [...found, ...lines.filter((line) => !found.includes(line))];
}
