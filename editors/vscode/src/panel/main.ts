// The page of a panel: it shows what the extension sends, and says what the user does.
import type { Answers, FromPanel, Item, PanelKind, Subject, ToPanel } from "../answers";
import { nameOf } from "../kinds";
import { details, headline, level } from "./details";
import { h } from "./dom";
import { signs } from "./figures";
import { Chosen, Stage, step } from "./stage";

interface State {
  subject?: Subject;
  place?: Chosen;
  /** What is typed as other values. */
  text?: string;
}

declare function acquireVsCodeApi(): {
  postMessage(message: FromPanel): void;
  getState(): State | undefined;
  setState(state: State): void;
};

const vscode = acquireVsCodeApi();
const post = (message: FromPanel) => vscode.postMessage(message);
const keep = (state: State) => vscode.setState({ ...vscode.getState(), ...state });
const nonce = (document.currentScript as HTMLScriptElement).nonce;

let shown: { kind: PanelKind; answer: Answers[PanelKind]; name: string } | undefined;
/** The sources of parts of the page, to leave alone what is the same. */
const parts = new Map<string, string>();
let selected: Item | undefined;
/** What is declared at the cursor in the editor. */
let lit: Item | undefined;

const stage = new Stage(
  nonce,
  {
    go: (item) => post({ type: "go", item }),
    select: (item) => {
      selected = item;
      showDetails();
    },
    leave: () => (searchField.value === "" ? levelButton : searchField).focus(),
    move: (place) => keep({ place }),
  },
  vscode.getState()?.place,
);

const title = h("h1", {}, "MAUVE");
const levelButton = button("level", "", "Choose the significance level", () => post({ type: "chooseLevel" }));
const choice = h("select", { class: "choice", "aria-label": "Shown", hidden: true });
const searchField = h("input", { type: "search", class: "search", placeholder: "Search", "aria-label": "Search in the drawing" });
const count = h("span", { class: "count", role: "status" });
const valuesField = h("textarea", { class: "values", rows: 1, spellcheck: "false", "aria-label": "Other values, such as imu.period=5" });
const valuesForm = h(
  "div",
  { class: "what-if", role: "group", "aria-label": "What if", hidden: true },
  valuesField,
  button("", "Apply to the text", "Write these values into the model and its tables", () => post({ type: "apply" })),
  button("", "Reset baseline", "Compare with the text as it is now", () => post({ type: "reset" })),
);
const headlineText = h("p", { class: "headline", role: "status" });
const mark = h("p", { class: "note", role: "status", hidden: true });
const problem = h("p", { class: "problem", role: "alert", hidden: true });
const below = h("section", { class: "details", "aria-label": "Figures", tabindex: 0 });
const content = h("div", { class: "content" }, stage.element, below);
const tools = h(
  "div",
  { class: "tools" },
  h("span", { class: "group" }, searchField, count),
  h(
    "span",
    { class: "group zoom", role: "group", "aria-label": "Zoom" },
    button("", "−", "Zoom out (-)", () => stage.zoom(1 / step)),
    button("fit", "Fit", "Show all (0)", () => stage.fit()),
    button("", "+", "Zoom in (+)", () => stage.zoom(step)),
  ),
  h(
    "span",
    { class: "group export", role: "group", "aria-label": "Export" },
    button("", "Save", "Save the drawing as SVG", () => post({ type: "save" })),
    button("", "Copy", "Copy the drawing as SVG", () => post({ type: "copy" })),
  ),
);
document.body.append(
  h("header", {}, h("div", { class: "bar-of-tools" }, title, choice, levelButton, tools), h("div", { class: "says" }, headlineText, mark), valuesForm),
  h("main", {}, problem, content),
);
content.hidden = true;

valuesForm.hidden = document.body.dataset.kind !== "whatIf";
valuesField.value = vscode.getState()?.text ?? "";
new ResizeObserver(growValues).observe(valuesForm);
/** All lines are in sight. */
function growValues(): void {
  valuesField.style.height = "auto";
  valuesField.style.height = `${valuesField.scrollHeight + 2}px`;
}
let typed: ReturnType<typeof setTimeout> | undefined;
/** Asks for the figures with the values, soon. */
function sendValues(delay: number): void {
  const text = valuesField.value;
  keep({ text });
  growValues();
  clearTimeout(typed);
  typed = setTimeout(() => post({ type: "values", text }), delay);
}
valuesField.addEventListener("input", () => sendValues(300));
valuesField.addEventListener("keydown", (event) => {
  if (event.key === "Enter" && !event.shiftKey && !event.isComposing) {
    event.preventDefault();
    sendValues(0);
  }
});

choice.addEventListener("change", () => {
  stage.reset();
  post({ type: "choose", value: choice.value });
});
searchField.addEventListener("input", () => {
  const found = stage.search(searchField.value);
  count.textContent = searchField.value.trim() === "" ? "" : `${found} found`;
});
searchField.addEventListener("keydown", (event) => {
  if (event.key === "Enter") {
    event.preventDefault();
    const at = stage.next(event.shiftKey ? -1 : 1);
    count.textContent = at === 0 ? count.textContent : `${at} of ${stage.search(searchField.value, false)}`;
  } else if (event.key === "Escape") {
    event.preventDefault();
    searchField.value = "";
    count.textContent = "";
    stage.search("");
    stage.focus();
  }
});
// Keys of the whole page.
addEventListener("keydown", (event) => {
  const isTyping = event.target instanceof HTMLInputElement || event.target instanceof HTMLTextAreaElement || event.target instanceof HTMLSelectElement;
  const isFind = (event.ctrlKey || event.metaKey) && event.key === "f";
  const action = { "+": () => stage.zoom(step), "=": () => stage.zoom(step), "-": () => stage.zoom(1 / step), "0": () => stage.fit() }[event.key];
  if (isFind || (event.key === "/" && !isTyping)) {
    event.preventDefault();
    event.stopPropagation();
    searchField.focus();
    searchField.select();
  } else if (action !== undefined && !isTyping && !event.ctrlKey && !event.metaKey && !event.altKey) {
    event.preventDefault();
    action();
  }
});
addEventListener("message", ({ data }: MessageEvent<ToPanel>) => receive(data));
/** In a narrow page, drawings go from top to bottom. */
const narrow = matchMedia("not (min-width: 980px)");
narrow.addEventListener("change", () => {
  stage.reset();
  post({ type: "narrow", narrow: narrow.matches });
});
post({ type: "ready", narrow: narrow.matches });

function button(name: string, text: string, title: string, action: () => void): HTMLButtonElement {
  // Signs have a name; words are their own.
  const label = /\w/.test(text) || name !== "" ? undefined : title.replace(/ \(.*/, "");
  return h("button", { class: name, title, "aria-label": label, click: action }, text);
}

function receive(message: ToPanel): void {
  switch (message.type) {
    case "show":
      show(message);
      break;
    case "mark":
      mark.hidden = message.why === "";
      mark.textContent = message.why;
      mark.title = message.why;
      document.body.classList.toggle("earlier", message.why !== "");
      break;
    case "problem":
      problem.hidden = false;
      problem.textContent = message.message;
      content.hidden = true;
      break;
    case "values":
      valuesField.value = message.text;
      growValues();
      keep({ text: message.text });
      break;
    case "light":
      stage.light(message.items);
      if (message.items.length > 0 && message.items[0] !== lit) {
        selected = message.items[0];
        showDetails();
      }
      lit = message.items[0];
      below.querySelectorAll("[data-item]").forEach((row) => {
        row.classList.toggle("lit", message.items.includes(row.getAttribute("data-item") as Item));
      });
  }
}

function show({ kind, answer, choices, chosen, subject }: Extract<ToPanel, { type: "show" }>): void {
  const name = nameOf(subject);
  if (shown !== undefined && shown.name !== name) {
    stage.reset();
    selected = undefined;
  }
  shown = { kind, answer, name };
  keep({ subject });
  problem.hidden = true;
  content.hidden = false;
  title.textContent = name;
  title.hidden = choices.length > 1;
  choice.hidden = choices.length < 2;
  unlessSame("choice", { choices, chosen }, () => {
    const options = choices.map(({ label, value }) => h("option", { value, selected: value === chosen }, label));
    choice.replaceChildren(...options);
  });
  if ("rows" in answer) {
    valuesField.placeholder = `Other values, such as ${answer.rows[0]?.name ?? "imu"}.period=50`;
  }
  const significance = "significance" in answer ? answer.significance : "shown" in answer ? answer.shown : null;
  levelButton.hidden = significance === null;
  // In a narrow page, the figure alone.
  levelButton.replaceChildren(h("span", { class: "word" }, "Level "), significance === null ? "" : level(significance));
  const parts = headline(kind, answer).map(({ status, text }, index) => {
    const sign = status === "none" || (index > 0 && status !== "unknown") ? "" : `${signs[status]} `;
    return [index > 0 ? "; " : "", h("span", { class: status }, sign + text)];
  });
  headlineText.replaceChildren(...parts.flat());
  stage.element.hidden = answer.drawing === null;
  stage.show(answer.drawing);
  arrange();
  showDetails();
}

function showDetails(): void {
  if (shown === undefined) {
    return;
  }
  const { kind, answer } = shown;
  unlessSame("details", { ...answer, drawing: "", selected }, () => {
    const focused = document.activeElement?.getAttribute("data-key");
    const actions = {
      go: (item: Item) => post({ type: "go", item }),
      hover: (item?: Item) => stage.hover(item),
      choose: (value: string) => post({ type: "choose", value }),
      lightChain: (chain: string) => post({ type: "lightChain", chain }),
      setLevel: (level: number) => post({ type: "setLevel", level }),
    };
    const lit = new Set([...below.querySelectorAll(".lit")].map((row) => row.getAttribute("data-item")));
    const { scrollTop } = below;
    below.replaceChildren(...details(kind, answer, actions, selected).filter((it) => it.childElementCount > 0));
    below.querySelectorAll("[data-item]").forEach((row) => row.classList.toggle("lit", lit.has(row.getAttribute("data-item"))));
    below.hidden = below.childElementCount === 0;
    below.scrollTop = scrollTop;
    if (focused) {
      below.querySelector<HTMLElement>(`[data-key="${CSS.escape(focused)}"]`)?.focus({ preventScroll: true });
    }
  });
}

/** Does something unless its source is the same as the last time. */
function unlessSame(part: string, source: object, action: () => void): void {
  const text = JSON.stringify(source);
  if (parts.get(part) !== text) {
    parts.set(part, text);
    action();
  }
}

/** A drawing that is not wide stands beside its figures, where there is room for both; otherwise above them, as high as it is. */
function arrange(): void {
  const { width, height } = stage.size;
  stage.element.style.setProperty("--height", `${height}px`);
  document.body.classList.toggle("tall", width < 1.7 * height || width < 760);
}
