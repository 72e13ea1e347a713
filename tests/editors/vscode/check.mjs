// check.mjs HOST:PORT MODEL [SCREENSHOT.png]: opens MODEL, the sample robot, in the VS Code that is served there, edits it,
// and checks what a user sees; then what VS Code's own commands give, in its extension host (inside/checks.js). `run` beside
// this file starts it all.
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { spawnSync } from "node:child_process";
import { request } from "node:http";
import { createRequire } from "node:module";
import * as path from "node:path";
import { checkFirstRun } from "./firstrun.mjs";
import { checkPanels, cursor } from "./panels.mjs";
import { checkRecordings } from "./recordings.mjs";
import { checkSilence } from "./silence.mjs";
import { checkWhile } from "./typing.mjs";
import { checkWidths } from "./widths.mjs";

const [address, model, screenshot] = process.argv.slice(2);
const { chromium } = createRequire(path.join(process.env.MAUVE_TEST_DRIVER, "/"))("playwright-core");
const file = path.join(model, "deployment.mal");

const browser = await chromium.launch({
  executablePath: "/usr/bin/chromium",
  // Chromium is not to look for its maker's hosts. It has no sandbox where root runs it.
  args: [
    ...["--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"],
    ...["--disable-component-update", "--disable-sync", "--no-sandbox"],
  ],
});
const page = await browser.newPage({ viewport: { width: 1600, height: 900 } });

/** What the lines of the editor show, hints and decorations as well, with ordinary spaces; and which lines are underlined. */
function editor() {
  return page.evaluate(() => {
    // What the extension draws is the content of a style, in quotes.
    const drawn = (span) => {
      const { content } = getComputedStyle(span, "::after");
      return content.startsWith('"') ? content.slice(1, -1) : "";
    };
    const figures = (line) => [...line.querySelectorAll("span")].map(drawn).join("");
    const lines = [...document.querySelectorAll(".editor-instance .view-line")].map((line) => ({
      text: `${line.textContent}${figures(line)}`.replaceAll("\u00a0", " ").trim(),
      top: line.getBoundingClientRect().top,
    }));
    const squiggles = [...document.querySelectorAll(".editor-instance .squiggly-error, .editor-instance .squiggly-warning")];
    const underlined = squiggles.map((squiggle) => {
      const { top, bottom } = squiggle.getBoundingClientRect();
      const middle = (top + bottom) / 2;
      return lines.findLast((line) => line.top <= middle)?.text ?? "";
    });
    return { lines: lines.map(({ text }) => text), underlined };
  });
}

/** The line of an activity, as it is shown. */
async function activity(name) {
  const { lines } = await editor();
  return lines.find((line) => line.startsWith(`activity ${name} `)) ?? "no such line";
}

async function underlined() {
  return (await editor()).underlined;
}

/** The rows of the Problems panel. */
function problems() {
  return page.evaluate(() =>
    [...document.querySelectorAll(".markers-panel .monaco-list-row")].map((row) => row.textContent.replaceAll("\u00a0", " ")),
  );
}

/** What the server's item in the status bar says: the server's state, and the verdict on all deployments. */
function statusItems() {
  return page.evaluate(
    () => document.querySelector('.statusbar-item [aria-label^="MAUVE server"]')?.getAttribute("aria-label") ?? "no item",
  );
}

async function statusItem() {
  return (await statusItems()).split(", ")[0];
}

/** The same; what VS Code tells the user, where that is an error. */
async function status() {
  const label = await statusItem();
  if (!label.endsWith(": error")) {
    return label;
  }
  const told = await page.locator(".notification-list-item-message").allTextContents();
  throw new Error(`expected: the server runs\n  seen: ${label}\n  ${told.join("\n  ")}`);
}

/** The check that is running, and when the last one of its expectations was met. */
const progress = { check: "the start", at: performance.now() };
/** A slow machine takes minutes for a check. One that stands still for so long, in ms, has failed. */
const PATIENCE = 300_000;
setInterval(() => {
  if (performance.now() - progress.at > PATIENCE) {
    console.log(`expected: ${progress.check} goes on; nothing was seen for ${PATIENCE / 1000} s`);
    process.exit(1);
  }
}, 1000).unref();

/** Looks until what is seen is as expected. */
async function expect(what, look, isExpected, seconds = 240) {
  const start = performance.now();
  let seen;
  do {
    try {
      seen = await look();
    } catch (error) {
      // VS Code has made the frame of a panel again meanwhile.
      if (!/detached|context was destroyed/.test(error.message)) {
        throw error;
      }
      seen = undefined;
    }
    if (seen !== undefined && isExpected(seen)) {
      progress.at = performance.now();
      console.log(`seen: ${what} (${Math.round(progress.at - start)} ms)`);
      return;
    }
    // To look costs VS Code time.
    await page.waitForTimeout(Math.min(200, 25 + (performance.now() - start) / 4));
  } while (performance.now() - start < seconds * 1000);
  throw new Error(`expected: ${what}\n  seen: ${JSON.stringify(seen, undefined, 2).replaceAll("\n", "\n  ")}`);
}

/** Writes a text into the quick input, all at once, since VS Code searches at each key; and waits until the row that is chosen has all words of `wanted`. */
async function fillQuickInput(text, wanted) {
  await page.waitForSelector(".quick-input-widget input");
  await page.locator(".quick-input-widget input").first().fill(text);
  // That one is chosen; rows of before may still be there.
  const first = () => page.evaluate(() => document.querySelector(".quick-input-widget .monaco-list-row.focused")?.textContent.replaceAll("\u00a0", " ") ?? "");
  await expect(`the quick input has ${wanted}`, first, (row) => wanted.split(" ").every((word) => row.toLowerCase().includes(word.toLowerCase())));
}

/** Puts the cursor somewhere, as a user who knows the line does. */
async function goTo(line, column) {
  await page.keyboard.press("Control+g");
  await fillQuickInput(`:${line}:${column}`, `line ${line}`);
  await page.keyboard.press("Enter");
  await page.waitForSelector(".quick-input-widget", { state: "hidden" });
  await expect("the cursor is there", () => cursor(page), (label) => label.startsWith(`Ln ${line}, Col ${column}`));
}

/** Opens the model in VS Code, which starts anew. */
async function openModel() {
  const payload = JSON.stringify([["openFile", `vscode-remote://${address}${file}`]]);
  const query = new URLSearchParams({ folder: model, payload });
  await page.goto(`http://${address}/?${query}`);
  await page.waitForSelector(".editor-instance .view-line");
}

async function check() {
  await openModel();
  await expect("the status bar: the server runs", status, (label) => label === "MAUVE server: running");
  await expect("the status bar: the verdict", statusItems, (label) => label === "MAUVE server: running, ! 9 met · 1 tight");
  await expect("the hint at navigation: ! 997 / 1000", () => activity("navigation"), (line) => line.includes("! 997 / 1000"));
  await expect("nothing underlined", underlined, (lines) => lines.length === 0);

  // Control, twice as often, and to be done in half the time: it is not, and nothing is left for navigation.
  const saved = readFileSync(file, "utf8");
  const text = saved.split("\n");
  const line = text.findIndex((line) => line.includes("activity control "));
  await goTo(line + 1, text[line].indexOf("period") + 1);
  await page.keyboard.press("Shift+End");
  await page.keyboard.type("period = 50  deadline = 50 }", { delay: 15 });

  await expect("the hint at control: missed", () => activity("control"), (line) => /deadline = 50 \}.*✗|✗.*deadline = 50 \}/.test(line));
  await expect(
    "the hint at navigation: no longer 997 / 1000",
    () => activity("navigation"),
    (line) => !line.includes("! 997 / 1000") && line.includes("✗"),
  );
  await expect(
    "control and navigation underlined, nothing else",
    underlined,
    (lines) =>
      ["activity control ", "activity navigation "].every((begin) => lines.some((line) => line.startsWith(begin))) &&
      lines.every((line) => /^activity (control|navigation) /.test(line)),
  );
  await page.keyboard.press("Control+Shift+m");
  await expect("the deadline of control and the overload in Problems, as deadline-missed", problems, (rows) =>
    ["`control`", "CPU 1 overloaded"].every((text) => rows.some((row) => row.includes("deadline-missed") && row.includes(text))),
  );
  await expect("the status bar: late", statusItems, (label) => /^MAUVE server: running, ✗ \d late/.test(label));
  await expect("the status bar: in the colour of errors", () => page.locator(".statusbar-item.error-kind", { hasText: "MAUVE" }).count(), (count) => count === 1);
  await page.click('.statusbar-item [aria-label^="MAUVE server"]');
  const listed = () => page.evaluate(() => [...document.querySelectorAll(".quick-input-widget .monaco-list-row")].map((row) => row.ariaLabel ?? row.textContent));
  await expect(
    "a click: the problems, each with its fixes",
    listed,
    (rows) => ["control ✗", "navigation ✗"].every((text) => rows.some((row) => row.includes(text))) && rows.filter((row) => /→/.test(row)).length >= 2,
  );
  await page.keyboard.press("Escape");
  if (screenshot !== undefined) {
    // Without the file explorer, there is room for the longest hint.
    await page.keyboard.press("Control+b");
    await page.waitForTimeout(500);
    await page.screenshot({ path: screenshot });
    for (const suffix of ["-dark", undefined]) {
      await run("workbench.action.toggleLightDarkThemes");
      await page.waitForTimeout(1000);
      if (suffix !== undefined) {
        await page.screenshot({ path: screenshot.replace(/(\.png)?$/, `${suffix}.png`) });
      }
    }
  }

  await page.keyboard.press("Control+1");
  for (let undone = 0; undone < 60 && !(await activity("control")).includes("deadline = 100"); undone++) {
    await page.keyboard.press("Control+z");
    await page.waitForTimeout(50);
  }
  await expect("after undo, the hint at navigation: ! 997 / 1000", () => activity("navigation"), (line) => line.includes("! 997 / 1000"));
  await expect("after undo, nothing underlined", underlined, (lines) => lines.length === 0);
  await expect("after undo, no problems", problems, (rows) => rows.length === 0);
  await expect("after undo, nothing to be saved", () => page.locator(".tab.dirty").count(), (count) => count === 0);
  await expect("the file as it was", () => readFileSync(file, "utf8"), (it) => it === saved);
}

/** Runs a command of MAUVE by its name, as a user does; one that asks something leaves the quick input open. */
async function command(name, { asks = false } = {}) {
  await page.keyboard.press("F1");
  await fillQuickInput(`>${name}`, name);
  await page.keyboard.press("Enter");
  if (!asks) {
    await page.waitForSelector(".quick-input-widget", { state: "hidden" });
  }
}

/** Has the extension in inside/ do something at once: to search for a file or a command takes half a second of the processor. */
function inside(what, ...operands) {
  return new Promise((resolve, reject) => {
    const asked = request({ socketPath: process.env.MAUVE_TEST_SOCKET, method: "POST" }, async (answer) => {
      const said = (await answer.setEncoding("utf8").toArray()).join("");
      said === "fine" ? resolve() : reject(new Error(`${what} ${operands.join(" ")}: ${said}`));
    });
    asked.on("error", reject);
    asked.end(JSON.stringify([what, ...operands]));
  });
}

/** Runs a command of VS Code itself, by its id. */
function run(id) {
  return inside("run", id);
}

/** Opens a file of the project, with the cursor before the first `text`. */
async function openAt(name, text) {
  const lines = readFileSync(path.join(model, name), "utf8").split("\n");
  const line = lines.findIndex((it) => it.includes(text));
  const column = lines[line].indexOf(text);
  await inside("open", name, line, column);
  const tab = () => page.locator(".editor-group-container.active .tab.active").textContent();
  await expect(`${name} is open`, tab, (label) => label.startsWith(path.basename(name)));
  await expect("the cursor is there", () => cursor(page), (label) => label.startsWith(`Ln ${line + 1}, Col ${column + 1}`));
}

/** Selects to the end of a line, which may be wrapped. */
async function selectToEnd() {
  await page.keyboard.press("Shift+End");
  await page.keyboard.press("Shift+End");
}

/** Types in the deployment, and beside it in a program and in a table. */
async function checkTyping() {
  const revert = async () => {
    await run("workbench.action.files.revert");
    await expect("nothing to be saved", () => page.locator(".tab.dirty").count(), (count) => count === 0);
  };
  await openAt("deployment.mal", "activity control");
  // VS Code shows the lenses some time after the text, in a row of their own.
  await page.waitForSelector(".editor-instance .codelens-decoration");
  await selectToEnd();
  await checkWhile(page, "an activity", (type) => type("activity control { affinity = 1 priority = 5 period = 50 }"));
  await revert();
  await openAt("deployment.mal", "1  priority = 5");
  await checkWhile(page, "an affinity", async (type) => {
    await page.keyboard.press("Delete");
    await page.waitForTimeout(1000);
    await type("2");
  });
  await revert();
  await run("workbench.action.splitEditorRight");
  await openAt("components/control.mal", "write(command");
  await checkWhile(page, "a program", (type) => type("write(command, standstill(base_frame)); "));
  await revert();
  await openAt("timing/p3dx.toml", "0.3");
  await selectToEnd();
  await checkWhile(page, "a table", (type) => type("0.35"));
  await revert();
  await run("workbench.action.closeEditorsInGroup");
  await run("workbench.action.focusFirstEditorGroup");
}

/** The rows of what VS Code shows before it changes files, and whether each is chosen. */
function previewed() {
  return page.evaluate(() =>
    [...document.querySelectorAll(".bulk-edit-panel .monaco-list-row")].map((row) => ({
      text: row.textContent.replaceAll("\u00a0", " "),
      chosen: row.querySelector("[role=checkbox]")?.ariaChecked,
    })),
  );
}

/** Generates the packages as a user does, and looks at what is shown before. */
async function checkGeneration() {
  const generated = path.join(model, "generated");
  await command("MAUVE: Generate Orocos Packages", { asks: true });
  await expect("a preview, in which nothing is left out", previewed, (rows) => rows.filter(({ chosen }) => chosen === "true").length >= 5 && rows.every(({ chosen }) => chosen !== "false"));
  await expect("nothing written before that is confirmed", () => existsSync(generated), (it) => !it);
  if (screenshot !== undefined) {
    await page.screenshot({ path: screenshot.replace(/(\.png)?$/, "-generate.png") });
  }
  await page.locator(".bulk-edit-panel .monaco-button", { hasText: "Apply" }).click();
  await expect("the packages written", () => existsSync(path.join(generated, "motion/.mauve-manifest.json")), (it) => it);
  const check = () => {
    const command = ["generate", "--check", "--out", generated];
    const { status, stdout, stderr } = spawnSync(process.env.MAUVE_TEST_SERVER, command, { cwd: model, encoding: "utf8" });
    return { status, said: stdout + stderr };
  };
  await expect("mauve generate --check: all is as it should be", check, ({ status }) => status === 0);
  await expect("no editor with a text to be saved", () => page.locator(".tab.dirty").count(), (count) => count === 0);
}

/** Has the extension in inside/ check what it can, and looks at what it has found. */
async function checkInside() {
  const result = process.env.MAUVE_TEST_RESULT;
  writeFileSync(`${result}.wanted`, "");
  for (const start = performance.now(); !existsSync(result); await page.waitForTimeout(100)) {
    if (performance.now() - start > PATIENCE) {
      throw new Error("expected: the extension in inside/ says what it has found");
    }
    progress.at = performance.now();
  }
  const found = Object.entries(JSON.parse(readFileSync(result, "utf8")));
  found.forEach(([name, said]) => console.log(`inside: ${name}: ${said}`));
  if (found.length === 0 || found.some(([, said]) => said !== "fine")) {
    throw new Error("expected: all is fine inside");
  }
}

/** The YAML of an executor has the figures of its threads, and no other YAML. */
async function checkThreads() {
  spawnSync(path.join(import.meta.dirname, "../threads"), [model]);
  const group = () => editor().then(({ lines }) => lines.find((line) => line.includes("id: /gmapping")) ?? "no such line");
  await openAt("threads.yaml", "priority: 3");
  await expect("the hint at the callback group: ✓ 789 / 1000", group, (line) => line.includes("✓ 789 / 1000 ms"));
  await openAt("other.yaml", "priority: 3");
  await page.waitForTimeout(500);
  await expect("none in another YAML", editor, ({ lines, underlined }) => lines.every((line) => !line.includes("✓")) && underlined.length === 0);
  await openAt("deployment.mal", "activity gmapping");
}

/** Starts VS Code once more, with the path of a server that does not exist: it says so, and shows no figure. */
async function checkNoServer() {
  writeFileSync(process.env.MAUVE_TEST_SETTINGS, JSON.stringify({ "mauve.server.path": "/no/such/server" }));
  await openModel();
  const told = () => page.locator(".notification-list-item-message").allTextContents();
  const isTold = (texts) => texts.some((text) => text.includes("The MAUVE server was not found") && text.includes("/no/such/server"));
  await expect("without a server: an error, which says why", told, isTold);
  await expect("the status bar: an error", statusItem, (label) => label === "MAUVE server: error");
  await expect("no figure", () => activity("navigation"), (line) => line.endsWith("}") && line.includes("deadline = 1000"));
}

try {
  const tools = { page, expect, command, run, status, statusItem, fillQuickInput, goTo, openAt, selectToEnd, activity, model, server: process.env.MAUVE_TEST_SERVER };
  for (const part of [check, checkTyping, checkWidths, checkSilence, checkPanels, checkRecordings, checkGeneration, checkInside, checkThreads, checkFirstRun, checkNoServer]) {
    progress.check = part.name;
    const start = performance.now();
    await part(tools);
    console.log(`seen: all of ${part.name}, in ${Math.round((performance.now() - start) / 1000)} s`);
  }
} catch (error) {
  console.log(error.message);
  if (screenshot !== undefined) {
    await page.screenshot({ path: screenshot }).catch(() => {});
  }
  process.exitCode = 1;
} finally {
  await browser.close();
}
