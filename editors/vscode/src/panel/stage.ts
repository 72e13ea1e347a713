import type { Item } from "../answers";
import { h } from "./dom";
import { Drawing, Drawn, drawingOf } from "./svg";
import { Area, clamped, initial, neighbour, Place, revealed, whole, zoomed } from "./view";

const directions = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down" } as const;
/** A zoom by a key or a button. */
export const step = 1.25;

/** What the user has chosen to see: a place, or all of it in each size of the window. */
export type Chosen = Place | "whole";

/** What the stage tells the panel. */
interface Listener {
  /** An element was clicked, or Enter was pressed on it. */
  go(item: Item): void;
  /** An element has the focus or was clicked. */
  select(item: Item): void;
  /** Escape: the focus goes elsewhere. */
  leave(): void;
  /** The user has zoomed or moved the drawing. */
  move(place: Chosen): void;
}

/** The part of the page with the drawing: zoom, pan, keyboard and search. */
export class Stage {
  readonly element = h("section", { class: "stage", "aria-label": "Drawing" });
  private drawing?: Drawing;
  private text?: string;
  private bounds: Area = { x: 0, y: 0, width: 1, height: 1 };
  private place?: Place;
  /** It stays as the window and the drawing change. */
  private chosen?: Chosen;
  private lit = new Set<Item>();
  private hovered?: Item;
  private query = "";
  private found: Drawn[] = [];
  private current = -1;
  private focusKey?: string;
  private drag?: { x: number; y: number; place: Place; isMoved: boolean };

  constructor(
    private readonly nonce: string,
    private readonly listener: Listener,
    chosen?: Chosen,
  ) {
    this.chosen = chosen;
    const { element } = this;
    element.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    element.addEventListener("pointerdown", (event) => this.press(event));
    element.addEventListener("pointermove", (event) => this.pull(event));
    element.addEventListener("pointerup", () => this.element.classList.remove("dragging"));
    element.addEventListener("click", (event) => this.click(event));
    element.addEventListener("keydown", (event) => this.type(event));
    element.addEventListener("focusin", (event) => this.focused(event.target as Element));
    new ResizeObserver(() => this.resize()).observe(element);
  }

  /** The size of the drawing, in its units. */
  get size(): { width: number; height: number } {
    return this.bounds;
  }

  /** Shows a drawing. The place, the focus and the search stay. */
  show(text: string | null): void {
    if (text === this.text) {
      return;
    }
    this.text = text ?? undefined;
    if (text === null) {
      this.drawing?.svg.remove();
      this.drawing = undefined;
      return;
    }
    const drawing = drawingOf(text, this.nonce);
    const hadFocus = this.element.contains(document.activeElement);
    const before = this.drawing?.svg;
    this.drawing = drawing;
    this.search(this.query, false);
    this.light([...this.lit]);
    this.roam(drawing.items.find(({ key }) => key === this.focusKey) ?? drawing.items[0]);
    if (before === undefined) {
      this.element.append(drawing.svg);
    } else {
      before.replaceWith(drawing.svg);
    }
    // Measuring has the page laid out at once: a drawing of the same size has other figures only.
    if (before?.dataset.size !== drawing.svg.dataset.size) {
      const { x, y, width, height } = drawing.svg.getBBox();
      const margin = 14;
      this.bounds = { x: x - margin, y: y - margin, width: width + 2 * margin, height: height + 2 * margin };
      this.place = undefined;
    }
    this.apply();
    if (hadFocus) {
      this.focus();
    }
  }

  /** Starts again with another drawing: it is seen from its start. */
  reset(): void {
    this.chosen = undefined;
    this.place = undefined;
  }

  zoom(factor: number): void {
    const { width, height } = this.window;
    this.moveTo(zoomed(this.placed, factor, { x: width / 2, y: height / 2 }));
  }

  fit(): void {
    this.chosen = "whole";
    this.resize();
    this.listener.move(this.chosen);
  }

  /** Lights elements: those at the cursor. */
  light(items: Item[]): void {
    this.lit = new Set(items);
    this.mark();
  }

  /** Lights an element while the pointer is on its row in a table. */
  hover(item?: Item): void {
    this.hovered = item;
    this.mark();
  }

  /** Lights the elements whose names have a text; returns how many there are. */
  search(query: string, isNew = true): number {
    this.query = query;
    const wanted = query.trim().toLowerCase();
    const items = this.drawing?.items ?? [];
    this.found = wanted === "" ? [] : items.filter(({ name }) => name.toLowerCase().includes(wanted));
    if (isNew) {
      this.current = -1;
    }
    this.mark();
    return this.found.length;
  }

  /** Goes to the next element that was found; returns its number from 1, and 0 if none was. */
  next(by: number): number {
    if (this.found.length === 0) {
      return 0;
    }
    this.current = (this.current + by + this.found.length) % this.found.length;
    const drawn = this.found[this.current];
    this.roam(drawn);
    this.reveal(drawn);
    this.mark();
    return this.current + 1;
  }

  /** Gives the focus to the element that had it last. */
  focus(): void {
    this.drawing?.items.find(({ key }) => key === this.focusKey)?.element.focus({ preventScroll: true });
  }

  private mark(): void {
    const items = this.drawing?.items ?? [];
    const isSearching = this.query.trim() !== "";
    for (const drawn of items) {
      const isFound = this.found.includes(drawn);
      for (const element of [drawn.element, drawn.line]) {
        element?.classList.toggle("lit", this.lit.has(drawn.item));
        element?.classList.toggle("hovered", this.hovered === drawn.item);
        element?.classList.toggle("found", isFound);
        element?.classList.toggle("current", isFound && this.found[this.current] === drawn);
        element?.classList.toggle("aside", isSearching && !isFound);
      }
    }
  }

  /** One element can be reached by Tab: the last that had the focus. */
  private roam(drawn?: Drawn): void {
    this.drawing?.items.forEach(({ element }) => element.setAttribute("tabindex", "-1"));
    drawn?.element.setAttribute("tabindex", "0");
    this.focusKey = drawn?.key;
  }

  private drawnAt(target: EventTarget | null): Drawn | undefined {
    if (!(target instanceof Element)) {
      return undefined;
    }
    const items = this.drawing?.items ?? [];
    const own = target.closest(".item");
    // A line of transitions is that of its first one.
    const link = target.closest(".link");
    return items.find(({ element }) => element === own) ?? items.find(({ line }) => line !== undefined && line === link);
  }

  private focused(target: Element): void {
    const drawn = this.drawnAt(target);
    if (drawn !== undefined) {
      this.roam(drawn);
      this.reveal(drawn);
      this.listener.select(drawn.item);
    }
  }

  private click({ target }: MouseEvent): void {
    const drawn = this.drag?.isMoved ? undefined : this.drawnAt(target);
    this.drag = undefined;
    if (drawn !== undefined) {
      this.roam(drawn);
      this.listener.select(drawn.item);
      this.listener.go(drawn.item);
    }
  }

  private type(event: KeyboardEvent): void {
    const items = this.drawing?.items ?? [];
    const index = items.findIndex(({ key }) => key === this.focusKey);
    const to = (drawn: Drawn | undefined) => {
      if (drawn !== undefined) {
        event.preventDefault();
        drawn.element.focus({ preventScroll: true });
      }
    };
    if (event.ctrlKey || event.metaKey || event.altKey) {
      return;
    }
    if (event.key in directions) {
      const direction = directions[event.key as keyof typeof directions];
      const areas = items.map(({ element }) => element.getBoundingClientRect());
      const isBox = ({ item }: Drawn) => /^(instance|state):/.test(item);
      // Boxes lead to boxes, and lines to lines.
      const others = items.filter((it, at) => at !== index && (index < 0 || isBox(it) === isBox(items[index])));
      const at = neighbour(areas[index], others.map((it) => areas[items.indexOf(it)]), direction);
      event.preventDefault();
      to(at === undefined ? undefined : others[at]);
    } else if (event.key === "Tab") {
      // In reading order; behind the last one, and before the first, Tab leaves.
      to(items[index + (event.shiftKey ? -1 : 1)]);
    } else if (event.key === "Home" || event.key === "End") {
      to(event.key === "Home" ? items[0] : items.at(-1));
    } else if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      this.listener.go(items[index].item);
    } else if (event.key === "Escape") {
      event.preventDefault();
      this.listener.leave();
    }
  }

  private wheel(event: WheelEvent): void {
    if (this.drawing === undefined) {
      return;
    }
    event.preventDefault();
    const { left, top } = this.element.getBoundingClientRect();
    const at = { x: event.clientX - left, y: event.clientY - top };
    if (event.ctrlKey || event.metaKey) {
      this.moveTo(zoomed(this.placed, Math.exp(-event.deltaY * 0.002), at));
    } else {
      const { x, y, scale } = this.placed;
      const [dx, dy] = event.shiftKey ? [event.deltaY, event.deltaX] : [event.deltaX, event.deltaY];
      this.moveTo({ x: x + dx / scale, y: y + dy / scale, scale });
    }
  }

  private press(event: PointerEvent): void {
    if (event.button === 0 && this.drawing !== undefined) {
      this.drag = { x: event.clientX, y: event.clientY, place: this.placed, isMoved: false };
    }
  }

  private pull(event: PointerEvent): void {
    const { drag } = this;
    if (drag === undefined || (event.buttons & 1) === 0) {
      return;
    }
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    if (!drag.isMoved && Math.hypot(dx, dy) < 4) {
      return;
    }
    if (!drag.isMoved) {
      drag.isMoved = true;
      this.element.setPointerCapture(event.pointerId);
      this.element.classList.add("dragging");
    }
    const { x, y, scale } = drag.place;
    this.moveTo({ x: x - dx / scale, y: y - dy / scale, scale });
  }

  private get window(): { width: number; height: number } {
    return { width: this.element.clientWidth || 1, height: this.element.clientHeight || 1 };
  }

  private get placed(): Place {
    this.place ??= this.chosen === "whole" ? whole(this.bounds, this.window) : (this.chosen ?? initial(this.bounds, this.window, this.wrong));
    return this.place;
  }

  /** Where the drawing says what is worst, and when a response begins and ends. */
  private get wrong(): Area[] {
    const all = (selector: string) => [...(this.drawing?.svg.querySelectorAll<SVGGraphicsElement>(selector) ?? [])];
    const worst = [".box.missed, .instant", ".box.unknown", ".box.tight"].map(all).find((it) => it.length > 0);
    return (worst ?? []).map((it) => it.getBBox());
  }

  private moveTo(place: Place): void {
    this.place = clamped(place, this.bounds, this.window);
    this.chosen = this.place;
    this.apply();
    this.listener.move(this.place);
  }

  private reveal({ element }: Drawn): void {
    const box = element.getBoundingClientRect();
    const { left, top } = this.element.getBoundingClientRect();
    const { x, y, scale } = this.placed;
    const area = { x: x + (box.left - left) / scale, y: y + (box.top - top) / scale, width: box.width / scale, height: box.height / scale };
    const place = revealed(this.placed, area, this.window);
    if (place.x !== x || place.y !== y) {
      // Not by hand: in another size, the drawing is fitted again.
      this.place = place;
      this.apply();
    }
  }

  private resize(): void {
    this.place = undefined;
    this.apply();
  }

  private apply(): void {
    if (this.drawing === undefined) {
      return;
    }
    const { x, y, scale } = this.placed;
    const { width, height } = this.window;
    this.drawing.svg.setAttribute("viewBox", [x, y, width / scale, height / scale].map((it) => it.toFixed(2)).join(" "));
  }
}
