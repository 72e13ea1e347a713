// What a user sees of the panels and of the tree view: their texts, what a click and a key do, how they follow an edit, and how
// they look in the colours of the themes. The page of a panel is a frame in a frame of the workbench.
import { mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import * as path from "node:path";

const THEMES = ["Default Light Modern", "Default High Contrast", "Default High Contrast Light", "Default Dark Modern"];
/** So many drawings are shown to see whether they leave something in the heap. */
const UPDATES = 300;

/** The frame with the page of a panel of this kind; none if it is not open. */
async function frameOf(page, kind) {
  for (const frame of page.frames()) {
    const found = await frame.evaluate(() => document.body?.dataset.kind).catch(() => undefined);
    if (found === kind) {
      return frame;
    }
  }
  return undefined;
}

/** What the page of a panel shows. */
async function seen(page, kind) {
  const frame = await frameOf(page, kind);
  return frame?.evaluate(() => {
    const isShown = (it) => it !== null && !it.hidden && it.getClientRects().length > 0;
    const texts = (selector) => [...document.querySelectorAll(selector)].filter(isShown).map((it) => it.textContent.trim());
    return {
      title: texts("h1")[0] ?? document.querySelector("select")?.selectedOptions[0]?.textContent ?? "",
      headline: texts(".headline")[0] ?? "",
      drawing: texts(".stage text"),
      rows: texts(".details tr"),
      cpus: texts(".cpus li"),
      mark: texts(".note")[0] ?? "",
      problem: texts(".problem")[0] ?? "",
      lit: [...document.querySelectorAll(".stage .item.lit")].map((it) => it.getAttribute("aria-label")),
      current: [...document.querySelectorAll(".stage .item.current")].map((it) => it.getAttribute("aria-label")),
      focus: document.activeElement?.getAttribute("aria-label") ?? "",
      view: document.querySelector(".stage > svg")?.getAttribute("viewBox") ?? "",
      boxes: [...document.querySelectorAll(".stage .box > .frame")].map((it) => ["x", "y", "width", "height"].map((name) => it.getAttribute(name)).join(" ")),
    };
  });
}

/** Texts of a drawing that are not in their boxes, and those that overlap: their geometry on the screen. */
function misplaced() {
  const found = [];
  const within = (inner, outer) => inner.left >= outer.left - 1 && inner.right <= outer.right + 1 && inner.top >= outer.top - 1 && inner.bottom <= outer.bottom + 1;
  for (const box of document.querySelectorAll(".stage .box")) {
    const frame = box.querySelector(".frame, .row")?.getBoundingClientRect() ?? box.getBoundingClientRect();
    for (const text of [...box.querySelectorAll("text")].filter((it) => it.textContent !== "")) {
      if (!within(text.getBoundingClientRect(), frame)) {
        found.push(`${text.textContent} is not in its box`);
      }
    }
  }
  const texts = [...document.querySelectorAll(".stage text")].filter((it) => it.textContent !== "" && it.getClientRects().length > 0);
  const areas = texts.map((it) => it.getBoundingClientRect());
  areas.forEach((one, at) =>
    areas.slice(at + 1).forEach((other, next) => {
      const width = Math.min(one.right, other.right) - Math.max(one.left, other.left);
      const height = Math.min(one.bottom, other.bottom) - Math.max(one.top, other.top);
      // Glyphs do not fill the height of a line.
      if (width > 1 && height > 0.35 * Math.min(one.height, other.height)) {
        found.push(`${texts[at].textContent} overlaps ${texts[at + 1 + next].textContent}`);
      }
    }),
  );
  return { texts: texts.length, found };
}

/** Texts of a drawing with a contrast below 4.5: axe looks at HTML only. */
function faint() {
  const context = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d", { willReadFrequently: true });
  const rgb = (colour, below = [0, 0, 0]) => {
    context.fillStyle = `rgb(${below.join(" ")})`;
    context.fillRect(0, 0, 1, 1);
    context.fillStyle = colour;
    context.fillRect(0, 0, 1, 1);
    return [...context.getImageData(0, 0, 1, 1).data.slice(0, 3)];
  };
  const luminance = (colour) => {
    const [r, g, b] = colour.map((it) => (it / 255 <= 0.03928 ? it / 255 / 12.92 : ((it / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const paper = rgb(getComputedStyle(document.body).backgroundColor);
  const found = [];
  for (const text of document.querySelectorAll(".stage text")) {
    const below = text.parentElement.querySelector(text.matches(".inner") ? ":scope > .slice" : ":scope > .frame");
    const ground = below === null ? paper : rgb(getComputedStyle(below).fill, paper);
    const [one, other] = [luminance(rgb(getComputedStyle(text).fill, ground)), luminance(ground)];
    const contrast = (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
    if (text.getClientRects().length > 0 && contrast < 4.5) {
      found.push(`${text.textContent}: ${contrast.toFixed(2)}`);
    }
  }
  return found;
}

/** What a user sees of a panel before a click: what is cut or not in sight, and how many rows the toolbar has. */
function firstView() {
  const stage = document.querySelector(".stage").getBoundingClientRect();
  const isIn = (it) => {
    const { left, right, top, bottom } = it.getBoundingClientRect();
    return left >= stage.left - 1 && right <= stage.right + 1 && top >= stage.top - 1 && bottom <= stage.bottom + 1;
  };
  const all = (selector) => [...document.querySelectorAll(selector)].filter((it) => it.getClientRects().length > 0);
  const widthOf = (it, text) => {
    const context = document.createElement("canvas").getContext("2d");
    context.font = getComputedStyle(it).font;
    return context.measureText(text).width;
  };
  const bar = document.querySelector(".bar-of-tools");
  const middles = all(".bar-of-tools :is(h1, button, input, select)").map((it) => it.getBoundingClientRect()).map(({ top, bottom }) => Math.round((top + bottom) / 8));
  const note = document.querySelector(".note").getBoundingClientRect();
  return {
    rows: new Set(middles).size + (bar.scrollWidth > bar.clientWidth + 1 ? 1 : 0),
    missed: all(".stage .box.missed").length,
    hidden: all(".stage .box.missed, .stage .instant").filter((it) => !isIn(it)).map((it) => it.textContent),
    ports: all(".stage .label").length,
    outside: all(".stage .box").filter((it) => !isIn(it)).length,
    instants: all(".stage .instant text").map((it) => it.textContent),
    cut: [
      ...all(".scroll, .bar-of-tools :is(h1, button)").filter((it) => it.scrollWidth > it.clientWidth + 1).map((it) => it.textContent.slice(0, 60)),
      // The browser does not tell that these have more text than room.
      ...all(".bar-of-tools select").filter((it) => widthOf(it, it.selectedOptions[0].textContent) + 20 > it.clientWidth).map((it) => it.value),
      ...all(".bar-of-tools input").filter((it) => widthOf(it, it.placeholder) + 12 > it.clientWidth).map((it) => it.placeholder),
    ],
    least: Math.min(...all(".stage .box text").map((it) => parseFloat(getComputedStyle(it).fontSize) * it.getScreenCTM().a)),
    covered: note.height > 0 && note.bottom > stage.top,
  };
}

/** Looks at the panels and at the tree view of the sample robot. `tools` are the page and the functions of check.mjs. */
export async function checkPanels(tools) {
  const { page, expect, run, openAt, model } = tools;
  const start = performance.now();
  const refused = [];
  const listen = (message) => /Content Security Policy|Refused to/.test(message.text()) && refused.push(message.text());
  page.on("console", listen);
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await run("workbench.action.closeAllEditors");

  await checkTree(tools);
  await checkArchitecture(tools);
  await checkKeyboard(tools);
  await checkMemory(tools);
  await checkOthers(tools);
  await checkWhatIf(tools);
  await checkFirstView(tools);
  await checkThemes(tools);

  const isAbsent = (texts) => texts.length === 0;
  await expect("no policy of a page was violated", () => refused, isAbsent);
  page.off("console", listen);

  rmSync(path.join(model, ".vscode"), { recursive: true, force: true });
  await openAt("deployment.mal", "activity control");
  console.log(`seen: the panels, in ${Math.round((performance.now() - start) / 1000)} s`);
}

/** The place of the cursor, as the status bar says it: `Ln 3, Col 1`. */
export function cursor(page) {
  return page.evaluate(() => document.querySelector(".statusbar-item [aria-label^='Ln ']")?.getAttribute("aria-label") ?? "");
}

/** The line of the cursor. */
function line(page) {
  return cursor(page).then((text) => Number(/Ln (\d+)/.exec(text)?.[1] ?? 0));
}

/** The number of the line with a text, from 1. */
function lineOf(model, name, text) {
  return readFileSync(path.join(model, name), "utf8").split("\n").findIndex((it) => it.includes(text)) + 1;
}

async function checkTree({ page, expect, command, run, model }) {
  await run("workbench.view.explorer");
  const pane = page.locator(".pane-header", { hasText: "MAUVE" });
  if ((await pane.getAttribute("aria-expanded")) !== "true") {
    await pane.click();
  }
  const rows = () =>
    page.evaluate(() =>
      [...document.querySelectorAll(".customview-tree .monaco-list-row")].map((row) => row.getAttribute("aria-label").replaceAll("\u00a0", " ")),
    );
  const wanted = ["P3dxDeployment, ! 9 met · 1 tight", "CPU 1, 99.4 % utilisation", "navigation, ! 997 / 1000 ms"];
  await expect("the tree view: the deployment, its CPUs and instances", rows, (all) => wanted.every((it) => all.includes(it)));
  await page.locator(".customview-tree .monaco-list-row[aria-label^='navigation,']").click();
  const expected = lineOf(model, "deployment.mal", "activity navigation");
  await expect("a click in the tree goes to the activity", () => line(page), (it) => it === expected);
  await pane.click();
}

async function checkArchitecture({ page, expect, command, run, openAt, model }) {
  await openAt("deployment.mal", "activity control");
  await page.locator(".editor-actions a[aria-label^='Show Architecture'], .editor-actions a[aria-label^='MAUVE: Show Architecture']").first().click();
  const look = () => seen(page, "architecture");
  await expect(
    "a click on the icon in the title: the architecture, its CPUs and response times, the worst first",
    look,
    (it) =>
      it?.drawing.includes("! 997 / 1000 ms") === true &&
      it.headline === "✓ All 9 deadlines are met; least slack: navigation, ! 997 / 1000 ms" &&
      it.cpus.join() === "CPU 199.4 %,CPU 278.9 %" &&
      it.rows[1].startsWith("navigationNavigation29.4 % · priority 2 · 1000 ms · CPU 1! 997 / 1000 ms99.7 %"),
  );
  await expect("the activity at the cursor is lit", look, ({ lit }) => lit.length === 1 && lit[0].startsWith("control: "));
  const frame = await frameOf(page, "architecture");
  await expect("texts in their boxes, none over another", () => frame.evaluate(misplaced), ({ texts, found }) => texts >= 20 && found.length === 0);

  const click = async (name) => frame.locator(`.stage .item[aria-label^="${name}: "] .name`).click();
  await click("gmapping");
  const gmapping = lineOf(model, "deployment.mal", "activity gmapping");
  await expect("a click on a box goes to its activity", () => line(page), (it) => it === gmapping);
  await expect("the box is lit", look, ({ lit }) => lit.length === 1 && lit[0].startsWith("gmapping: "));

  // The period of hokuyo gets another digit, again and again.
  await openAt("deployment.mal", "100   deadline = 100 }");
  const before = await look();
  await frame.evaluate(() => {
    window.changes = [];
    new MutationObserver(() => window.changes.push(Date.now())).observe(document.querySelector(".stage"), { childList: true });
  });
  const delays = [];
  for (let key = 0; key < 12; key++) {
    const from = await page.evaluate(() => {
      addEventListener("keydown", () => (window.typed = Date.now()), { capture: true, once: true });
      return window.typed ?? 0;
    });
    const count = await frame.evaluate(() => window.changes.length);
    await page.keyboard.press(key % 2 === 0 ? "1" : "Backspace");
    await expect("the panel follows a key", () => frame.evaluate(() => window.changes.length), (it) => it > count);
    const [typed, changed] = [await page.evaluate(() => window.typed), await frame.evaluate((count) => window.changes[count], count)];
    delays.push(changed - typed);
    if (typed === from) {
      throw new Error("expected: a key was typed");
    }
    if (key === 0) {
      await expect("after an edit, other figures at the same places", look, (it) => it.boxes.join() === before.boxes.join() && it.view === before.view && it.drawing.join() !== before.drawing.join());
    }
  }
  delays.sort((one, other) => one - other);
  console.log(`seen: the panel shows an edit ${delays[Math.floor(delays.length / 2)]} ms after the key (median), ${delays.at(-1)} ms at most`);
  await expect("the figures as before", look, (it) => it.drawing.join() === before.drawing.join() && it.mark === "");

  // Broken: without the value of the period.
  await openAt("deployment.mal", "100   deadline = 100 }");
  for (let key = 0; key < 3; key++) {
    await page.keyboard.press("Delete");
  }
  await expect("a broken text: the drawing stays, with a mark", look, (it) => it.mark.startsWith("Earlier drawing") && it.drawing.join() === before.drawing.join());
  await page.keyboard.type("100", { delay: 20 });
  await expect("a text that is no longer broken: no mark", look, (it) => it.mark === "" && it.drawing.join() === before.drawing.join());
  await run("workbench.action.files.revert");
  await expect("nothing to be saved", () => page.locator(".tab.dirty").count(), (count) => count === 0);
}

async function checkKeyboard({ page, expect, model }) {
  const look = () => seen(page, "architecture");
  const frame = await frameOf(page, "architecture");
  const press = (key) => page.keyboard.press(key);
  await frame.locator("header .headline").click();
  for (let tabs = 0; tabs < 12 && !(await frame.evaluate(() => document.activeElement.matches(".item"))); tabs++) {
    await press("Tab");
  }
  await expect("Tab: an element of the drawing has the focus", look, ({ focus }) => /: .*ms|→/.test(focus));
  await press("Home");
  const { focus: first } = await look();
  await press("ArrowDown");
  await expect("an arrow key: its neighbour", look, ({ focus }) => focus !== first && /^\w+: \w+/.test(focus));
  await press("Home");
  await press("Tab");
  await expect("Tab: the next element, a connection of the first", look, ({ focus }) => focus.startsWith(`${first.split(":")[0]}.`) && focus.includes(" → "));
  await press("Home");
  const { view } = await look();
  await press("+");
  const scale = (view) => Number(view.split(" ")[2]);
  await expect("+: nearer", look, (it) => scale(it.view) < scale(view));
  const { view: nearer } = await look();
  await press("0");
  await expect("0: all of it", look, (it) => scale(it.view) > scale(nearer) && scale(it.view) >= scale(view));
  await press("/");
  await page.keyboard.type("teleop", { delay: 5 });
  await expect("/: the search", look, ({ focus }) => focus === "Search in the drawing");
  await press("Enter");
  const { current } = await look();
  await press("Enter");
  await expect("Enter: the elements that were found, one after the other", look, (it) => current.length === 1 && it.current.length === 1 && it.current[0] !== current[0] && it.current[0].includes("teleop"));
  await press("Shift+Enter");
  await press("Escape");
  await expect("Escape: back in the drawing, at the one that was found", look, ({ focus }) => focus === current[0]);
  await press("Enter");
  const names = { "teleop: ": ["deployment.mal", "activity teleop"], "teleop.": ["navigation_architecture.mal", "teleop.command"] };
  const [name, text] = names[Object.keys(names).find((it) => current[0].startsWith(it))] ?? ["deployment.mal", "no such element"];
  const expected = lineOf(model, name, text);
  await expect("Enter: its source", () => line(page), (it) => it === expected);
}

/** Shows many drawings, and compares the heap before and after. */
async function checkMemory({ page, expect, command, run, openAt }) {
  const frame = await frameOf(page, "architecture");
  // The extension's own message, with other figures each time.
  await frame.evaluate(() => addEventListener("message", ({ data }) => data.type === "show" && (window.message = data)));
  await openAt("deployment.mal", "100   deadline = 100 }");
  await page.keyboard.press("1");
  await expect("a message of the extension", () => frame.evaluate(() => window.message !== undefined), (it) => it);
  await run("workbench.action.files.revert");
  const update = (count) =>
    frame.evaluate(async (count) => {
      const { message } = window;
      for (let update = 0; update < count; update++) {
        const drawing = message.answer.drawing.replaceAll("997", String(100 + (update % 900)));
        const nodes = message.answer.nodes.map((node) => ({ ...node, response: node.response === null ? null : node.response + (update % 7) }));
        dispatchEvent(new MessageEvent("message", { data: { ...message, answer: { ...message.answer, drawing, nodes } } }));
        if (update % 50 === 0) {
          await new Promise(requestAnimationFrame);
        }
      }
      dispatchEvent(new MessageEvent("message", { data: message }));
      await new Promise(requestAnimationFrame);
    }, count);
  const session = await page.context().newCDPSession(page);
  await session.send("Performance.enable");
  const measure = async () => {
    await session.send("HeapProfiler.collectGarbage");
    await page.waitForTimeout(200);
    await session.send("HeapProfiler.collectGarbage");
    const { metrics } = await session.send("Performance.getMetrics");
    const of = (name) => metrics.find((it) => it.name === name).value;
    const own = await frame.evaluate(() => document.querySelectorAll("*").length);
    return { megabytes: of("JSHeapUsedSize") / 2 ** 20, nodes: of("Nodes"), own };
  };
  await update(100);
  const before = await measure();
  const start = performance.now();
  await update(UPDATES);
  const duration = performance.now() - start;
  const after = await measure();
  await session.detach();
  await page.keyboard.press("Escape");
  const text = ({ megabytes, nodes }) => `${megabytes.toFixed(1)} MB, ${nodes} nodes`;
  console.log(`seen: ${UPDATES} updates in ${Math.round(duration)} ms; before: ${text(before)}; after: ${text(after)}`);
  // A drawing has 300 elements: one that is kept for each update would be 90 000.
  await expect("the heap as before", () => ({ before, after }), () => after.megabytes < before.megabytes + 4 && after.nodes < before.nodes + 600 && after.own === before.own, 0);
}

async function checkOthers({ page, expect, command, run, openAt, model }) {
  await run("workbench.action.closeAllEditors");
  await openAt("components/navigation.mal", "component Navigation");
  await command("MAUVE: Show State Machine");
  const machine = () => seen(page, "stateMachine");
  await expect(
    "the state machine with its times, and the worst periods",
    machine,
    (it) => it?.drawing.includes("already_there: 297") === true && it.headline.startsWith("At most 297 ms per period") && it.rows.some((row) => row.startsWith("1 to 11Planning stays11 × 294.13235.1")),
  );
  const frame = await frameOf(page, "stateMachine");
  await expect("texts in their boxes, none over another", () => frame.evaluate(misplaced), ({ texts, found }) => texts > 10 && found.length === 0);
  await frame.locator('.stage .item[aria-label="Planning"] .name').click();
  const planning = lineOf(model, "components/navigation.mal", "state Planning");
  await expect("a click on a state goes to it", () => line(page), (it) => it === planning);
  await expect("its programs", machine, (it) => it.rows.includes("Planning.run297") && it.lit.includes("Planning"));
  await run("workbench.action.closeAllEditors");

  await openAt("deployment.mal", "activity teleop");
  await command("MAUVE: Show Schedule");
  const schedule = () => seen(page, "schedule");
  await expect("the schedule of the activity at the cursor", schedule, (it) => it?.drawing.includes("deadline 100 ms") === true && it.title.startsWith("teleop"));
  const chart = await frameOf(page, "schedule");
  await chart.selectOption("select", "navigation");
  await expect("another one that is chosen", schedule, (it) => it.title.startsWith("navigation") && it.headline.includes("997"));
  await command("MAUVE: Copy Drawing");
  const copied = () => page.evaluate(() => navigator.clipboard.readText());
  await expect("the drawing as SVG, copied", copied, (text) => text.startsWith("<svg ") && text.includes("navigation"));
  await run("workbench.action.closeAllEditors");

  await openAt("deployment.mal", "activity hokuyo");
  await command("MAUVE: Show Probability of a Late Job");
  const probability = () => seen(page, "probability");
  const late = (words) => (it) => it?.headline === `✓ hokuyo: late at most ${words} times an hour` && it.drawing.includes("1e-9") && it.drawing.includes("a job that responds later, in an hour") && it.rows.some((row) => row.startsWith(`hokuyo${words}`));
  await expect("how probable it is that the activity at the cursor is late", probability, late("1.5e-4"));
  const plot = await frameOf(page, "probability");
  await expect("texts of the drawing, none over another", () => plot.evaluate(misplaced), ({ texts, found }) => texts > 15 && found.length === 0);
  // With twice the period, half as many jobs.
  await openAt("deployment.mal", "100   deadline = 100 }");
  for (let key = 0; key < 3; key++) {
    await page.keyboard.press("Delete");
  }
  await page.keyboard.type("200", { delay: 20 });
  await expect("another period, another probability", probability, (it) => it.mark === "" && /^✓ hokuyo: late at most \S+ times an hour$/.test(it.headline) && !late("1.5e-4")(it));
  await run("workbench.action.files.revert");
  await expect("the probability as before", probability, late("1.5e-4"));
  await plot.selectOption("select", "navigation");
  await expect("another activity that is chosen", probability, (it) => it.headline.endsWith("navigation: late at most 2.9e-4 times an hour"));
  await run("workbench.action.closeAllEditors");

  const config = path.join(model, "mauve.toml");
  writeFileSync(config, readFileSync(config, "utf8").replace('latency = "600 ms"', 'latency = "500 ms"'));
  await openAt("deployment.mal", "deployment P3dxDeployment");
  await command("MAUVE: Show Chains");
  const chains = () => seen(page, "chains");
  await expect(
    "the chains, their bars, and the components of the first one",
    chains,
    (it) => it?.headline.includes("above the limit") === true && it.drawing.includes("limit 500 ms") && it.rows.some((row) => row.startsWith("guidance100")),
  );
  const bars = await frameOf(page, "chains");
  await bars.locator('.stage .item[data-hop="1"]').focus();
  await page.keyboard.press("Enter");
  const connection = lineOf(model, "exploration_architecture.mal", "guidance.scan");
  await expect("Enter on a component goes to its connection", () => line(page), (it) => it === connection);
  await bars.getByRole("button", { name: "Show in the architecture" }).click();
  await expect("the chain in the architecture", async () => (await frameOf(page, "architecture"))?.locator(".passed").count(), (it) => it === 4);
  await run("workbench.action.closeAllEditors");

  await openAt("components/navigation_shell.mal", "astar");
  await command("MAUVE: Show Execution Times");
  const times = () => seen(page, "executionTimes");
  await expect("the execution times of the codel at the cursor", times, (it) => it?.drawing.filter((text) => text.startsWith("293 ms")).join() === "293 ms at 1e-4" && it.headline.startsWith("! 293 ms at level 1e-4: deadlines hold up to 296 ms; ✗ 1 chain late") && it.rows.some((row) => row.startsWith("1e-4✗ 1 chain late · 1 tight")));
  await run("workbench.action.closeAllEditors");
  await openAt("deployment.mal", "activity hokuyo");
  await command("MAUVE: Show Execution Times");
  await expect("at an activity, the times of its codels beside each other", times, (it) => it?.headline.startsWith("4 codels at level 1e-4; ✗ 1 chain late") === true && it.drawing.includes("drivers.mask_robot: 0.7 ms at 1e-4"));
  await (await frameOf(page, "executionTimes")).locator("select").selectOption({ label: "gmapping: all codels" });
  await expect("another activity", times, (it) => it?.headline.startsWith("5 codels at level 1e-4") === true);
  await expect("texts of the drawing, none over another", async () => (await frameOf(page, "executionTimes")).evaluate(misplaced), ({ texts, found }) => texts > 15 && found.length === 0);
  await run("workbench.action.closeAllEditors");
  await openAt("deployment.mal", "library");
  await command("MAUVE: Show Execution Times");
  await expect("without a codel, a message", times, (it) => it?.problem === "no codel here");
  await run("workbench.action.closeAllEditors");
}

/** Other values in a panel, written into the text, and an edit beside the state at the beginning. */
async function checkWhatIf({ page, expect, command, run, openAt }) {
  await openAt("deployment.mal", "activity hokuyo");
  await command("MAUVE: What If");
  const look = () => seen(page, "whatIf");
  await expect("the figures as they are", look, (it) => it?.headline === "✓ 9 of 9 deadlines met, as before" && it.drawing.includes("✓ 53 / 100 ms") && it.lit.length === 1);
  const frame = await frameOf(page, "whatIf");
  const outlines = () => frame.locator(".stage .item .outline").count();
  await expect("no bar has moved", outlines, (count) => count === 0);
  const field = frame.locator("textarea");
  await field.click();
  await page.keyboard.type("hokuyo.deadline=50, teleop.period=200", { delay: 5 });
  const isMissed = (it) => it.headline === "✗ 9 → 8 of 9 deadlines met" && it.drawing.includes("✓ 53 / 100 → ✗ 53 / 50 ms") && it.drawing.includes("no longer met");
  await expect("values: the figures beside those before", look, (it) => isMissed(it) && it.mark === "");
  await expect("a bar has moved", outlines, (count) => count > 0);
  await expect("texts of the drawing, none over another", () => frame.evaluate(misplaced), ({ texts, found }) => texts > 15 && found.length === 0);
  await page.keyboard.type(", hokuyo.perod=1", { delay: 5 });
  await expect("a wrong value: what to write, and the last figures stay", look, (it) => it.mark.includes("did you mean `hokuyo.period`") && isMissed(it));
  for (let key = 0; key < ", hokuyo.perod=1".length; key++) {
    await page.keyboard.press("Backspace");
  }
  await expect("without it, as before", look, (it) => it.mark === "" && isMissed(it));
  await frame.getByRole("button", { name: "Apply to the text" }).click();
  const text = () => page.evaluate(() => [...document.querySelectorAll(".editor-instance .view-line")].map((it) => it.textContent.replaceAll("\u00a0", " ")).join("\n"));
  await expect("the values are in the text", text, (all) => all.includes("deadline = 50 }") && /=\s*200/.test(all));
  await expect("beside the same state as before", look, (it) => it.mark === "" && isMissed(it));
  await expect("no values are left", () => field.inputValue(), (it) => it === "");

  await run("workbench.action.focusFirstEditorGroup");
  await openAt("deployment.mal", "100   deadline = 100 }");
  const { drawing } = await look();
  await page.keyboard.type("2");
  await expect("an edit: the bars follow", look, (it) => isMissed(it) && it.mark === "" && it.drawing.join() !== drawing.join());
  await page.keyboard.press("Backspace");
  await expect("the edit is undone: as before", look, (it) => it.drawing.join() === drawing.join());
  await frame.getByRole("button", { name: "Reset baseline" }).click();
  await expect("another state to compare with", look, (it) => it.headline === "✗ 8 of 9 deadlines met, as before");
  await expect("then no bar has moved", outlines, (count) => count === 0);
  await run("workbench.action.focusFirstEditorGroup");
  await run("workbench.action.files.revert");
  await expect("an edit: the bar has moved", look, (it) => it.headline === "✓ 8 → 9 of 9 deadlines met" && it.drawing.includes("met now"));
  await run("workbench.action.closeAllEditors");
}

/** Opens panels in windows of two sizes, with two missed deadlines: what is in sight without a click. */
async function checkFirstView({ page, expect, command, run, openAt, model }) {
  const before = page.viewportSize();
  await run("workbench.action.closeAllEditors");
  if (await page.locator(".part.panel .composite").first().isVisible()) {
    await run("workbench.action.closePanel");
  }
  const file = path.join(model, "deployment.mal");
  const text = readFileSync(file, "utf8");
  const late = (text, name, deadline) => text.replace(new RegExp(`(activity ${name} .*deadline = )100`), `$1${deadline}`);
  writeFileSync(file, late(late(text, "hokuyo", 50), "p3dx_driver", 9));
  const panels = [["architecture", "MAUVE: Show Architecture"], ["schedule", "MAUVE: Show Schedule"], ["whatIf", "MAUVE: What If"]];
  for (const [width, height] of [[1440, 900], [1000, 700]]) {
    await page.setViewportSize({ width, height });
    for (const [kind, show] of panels) {
      await openAt("deployment.mal", "activity hokuyo");
      await command(show);
      // Until the page is there, nothing.
      const look = async () => (await frameOf(page, kind))?.evaluate(firstView).catch(() => undefined);
      const isSeen = ({ rows, hidden, cut, covered }) => rows === 1 && hidden.length === 0 && cut.length === 0 && !covered;
      const isAll = { architecture: (it) => it.missed === 2 && it.outside === 0 && it.least >= 10, schedule: (it) => it.instants.join() === "release 0 ms,deadline 50 ms,end 53 ms", whatIf: (it) => it.outside === 0 }[kind];
      await expect(`${kind} in ${width} × ${height}: one row of tools, and what is missed in sight`, look, (it) => it !== undefined && isSeen(it) && isAll(it));
      if (kind === "architecture") {
        // Names of ports are in the wide drawing only.
        for (const [other, isWide] of [[800, false], [2400, true], [width, false]]) {
          await page.setViewportSize({ width: other, height });
          await expect(`a window of ${other} pixels: the drawing for its width, fitted again`, look, (it) => it.outside === 0 && it.ports > 0 === isWide);
        }
        await (await frameOf(page, kind)).getByRole("button", { name: "Fit" }).click();
        await page.setViewportSize({ width: width - 120, height: height - 100 });
        await expect("another size: still all of it", look, (it) => it.outside === 0);
        await page.setViewportSize({ width, height });
      }
      await openAt("deployment.mal", "activity hokuyo");
      await run("workbench.action.closeEditorsInOtherGroups");
    }
  }
  await page.setViewportSize(before);
  await run("workbench.action.closeAllEditors");
  writeFileSync(file, text);
}

/** Looks for what not everybody can see or reach, in each theme. */
async function checkThemes({ page, expect, command, run, openAt, model }) {
  const axe = readFileSync(process.env.MAUVE_TEST_AXE, "utf8");
  const settings = path.join(model, ".vscode");
  mkdirSync(settings, { recursive: true });
  const panels = [
    ["architecture", "deployment.mal", "activity hokuyo", "MAUVE: Show Architecture"],
    ["stateMachine", "components/navigation.mal", "component Navigation", "MAUVE: Show State Machine"],
    ["schedule", "deployment.mal", "activity navigation", "MAUVE: Show Schedule"],
    ["probability", "deployment.mal", "activity navigation", "MAUVE: Show Probability of a Late Job"],
    ["chains", "deployment.mal", "deployment P3dxDeployment", "MAUVE: Show Chains"],
    ["whatIf", "deployment.mal", "activity hokuyo", "MAUVE: What If"],
    ["executionTimes", "components/navigation_shell.mal", "astar", "MAUVE: Show Execution Times"],
  ];
  for (const [kind, file, text, show] of panels) {
    await openAt(file, text);
    await command(show);
    await expect(`the panel ${kind}`, () => seen(page, kind), (it) => (it?.drawing.length ?? 0) > 5);
    const frame = await frameOf(page, kind);
    await frame.evaluate(axe);
    // Their parts are the same: two themes are enough for the others.
    for (const theme of kind === "architecture" ? THEMES : THEMES.slice(0, 2)) {
      writeFileSync(path.join(settings, "settings.json"), JSON.stringify({ "workbench.colorTheme": theme }));
      const isLight = theme.includes("Light");
      const paper = () => frame.evaluate(() => getComputedStyle(document.body).backgroundColor);
      const wanted = { "Default Light Modern": "rgb(255, 255, 255)", "Default Dark Modern": "rgb(31, 31, 31)" }[theme] ?? (isLight ? "rgb(255, 255, 255)" : "rgb(0, 0, 0)");
      const isHigh = () => frame.evaluate(() => document.body.className.includes("high-contrast"));
      await expect(`${kind} in ${theme}`, async () => [await paper(), await isHigh()], ([colour, high]) => colour === wanted && high === theme.includes("High"));
      const violations = await frame.evaluate(async () => {
        const { violations } = await window.axe.run(document, { runOnly: ["wcag2a", "wcag2aa"] });
        return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html, failureSummary }) => `${html.slice(0, 150)} ${failureSummary.slice(0, 200)}`).join("; ")}`);
      });
      const pale = await frame.evaluate(faint);
      await expect(`${kind} in ${theme}: all can be seen and reached`, () => [...violations, ...pale], (all) => all.length === 0, 0);
    }
    await run("workbench.action.closeAllEditors");
  }
}
