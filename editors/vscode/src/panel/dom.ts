// Builds the elements of a page. Texts are always texts: nothing of a model becomes markup.

type Child = Node | string | undefined;

type Attributes = Record<string, string | number | boolean | undefined | (() => void)>;

/** Creates an element of HTML with these attributes and children; functions listen to the events of their names. */
export function h<Name extends keyof HTMLElementTagNameMap>(
  name: Name,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[Name] {
  const element = document.createElement(name);
  set(element, attributes);
  element.append(...children.filter((it) => it !== undefined));
  return element;
}

/** Creates an element of SVG. */
export function s(name: string, attributes: Record<string, string | number> = {}, ...children: Node[]): SVGElement {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  set(element, attributes);
  element.append(...children);
  return element;
}

function set(element: Element, attributes: Attributes): void {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") {
      element.addEventListener(name, value);
    } else if (value !== undefined && value !== false) {
      element.setAttribute(name, value === true ? "" : String(value));
    }
  }
}

/** A horizontal bar that is filled to a part from 0 to 1, of this status. */
export function bar(part: number, status: string): SVGElement {
  const filled = (Math.min(1, Math.max(0, part)) * 100).toFixed(1);
  return s(
    "svg",
    { class: `bar ${status}`, viewBox: "0 0 100 4", preserveAspectRatio: "none", "aria-hidden": "true" },
    s("rect", { class: "bar-track", width: 100, height: 4 }),
    s("rect", { class: "bar-filled", width: filled, height: 4 }),
  );
}
