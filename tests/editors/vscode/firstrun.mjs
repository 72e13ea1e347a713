// The first run: what the extension offers a user who has just installed it. check.mjs calls `checkFirstRun` at the end.
import { mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import * as path from "node:path";

/** Looks at the extension as a new user does. `tools` are the page and the functions of check.mjs. */
export async function checkFirstRun(tools) {
  await checkMenu(tools);
  await checkIcon(tools);
  await checkNewProject(tools);
  await checkColours(tools);
  await checkEdits(tools);
  await checkTable(tools);
  await checkWalkthrough(tools);
}

/** The rows of the quick pick. */
function rows(page) {
  return page.evaluate(() =>
    [...document.querySelectorAll(".quick-input-widget .monaco-list-row")].map((row) => row.textContent.replaceAll("\u00a0", " ")),
  );
}

/** Opens the menu in the status bar and chooses the row with a text. */
async function choose({ page, expect }, text) {
  await page.click('.statusbar-item [aria-label^="MAUVE server"]');
  await expect(`the menu has ${text}`, () => rows(page), (seen) => seen.some((row) => row.includes(text)));
  // By the label: rows are used again, with a hidden text of before.
  const row = page.locator(`.quick-input-widget .monaco-list-row[aria-label*=${JSON.stringify(text)}]`);
  await row.click();
  await page.waitForSelector(".quick-input-widget", { state: "hidden" });
}

async function checkMenu(tools) {
  const { page, expect, server } = tools;
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.click('.statusbar-item [aria-label^="MAUVE server"]');
  const wanted = [server, "Restart Server", "Show Log", "Choose Significance Level", "Reload Models", "Generate Orocos Packages", "Open Settings"];
  await expect("a click on MAUVE: its menu", () => rows(page), (seen) => wanted.every((text) => seen.some((row) => row.includes(text))));
  await page.keyboard.press("Escape");
  await choose(tools, server);
  const copied = () => page.evaluate(() => navigator.clipboard.readText());
  await expect("the server's path and version, copied", copied, (text) => text.startsWith(`${server} (mauve `) && /\d/.test(text));

  // `run` writes the path to the settings of the machine.
  await choose(tools, "Open Settings");
  const settings = () =>
    page.evaluate(() => ({
      tab: document.querySelector(".settings-tabs-widget .action-label.checked")?.textContent ?? "none",
      settings: [...document.querySelectorAll(".settings-editor .setting-item-contents")].map((it) => it.textContent),
    }));
  await expect(
    "the path of the server in the remote settings",
    settings,
    (seen) => seen.tab.startsWith("Remote") && seen.settings.some((it) => it.includes("Server: Path")),
  );
  await page.keyboard.press("Escape");
}

/** Creates a project, which VS Code opens: the last check. */
async function checkNewProject({ page, expect, status, command, model }) {
  const input = page.locator(".quick-input-widget input").first();
  const message = () => page.evaluate(() => document.querySelector(".quick-input-message")?.textContent ?? "");
  const title = () => page.evaluate(() => document.querySelector(".quick-input-title")?.textContent ?? "");

  const parent = path.dirname(model);
  await command("MAUVE: New Project", { asks: true });
  await expect("a dialog for the folder", title, (text) => text.includes("New project"));
  // The model is beside the home folder.
  await expect("it begins at the home folder", () => rows(page), (seen) => seen[0]?.startsWith(".."));
  await page.locator(".quick-input-widget .monaco-list-row").first().click();
  await expect("it shows the folder above", () => input.inputValue(), (text) => text === `${parent}/`);
  await page.locator(".quick-input-widget .monaco-button", { hasText: "Create Here" }).click();
  await expect("the name of the project is asked for", title, (text) => text === `New project in ${parent}`);
  await input.fill(path.basename(model));
  await expect("a folder with files is refused", message, (text) => text.includes("is not empty"));
  await input.fill("first-robot");
  await expect("a new name is accepted", message, (text) => !text.includes("is not empty"));
  await page.keyboard.press("Enter");
  await page.locator(".monaco-dialog-box .monaco-button", { hasText: /^Open$/ }).click();
  await page.waitForURL(/first-robot/);
  await page.waitForSelector(".editor-instance .view-line");
  await expect("the model of the new project", () => page.locator(".tab.active").textContent(), (text) => text.includes("robot.mal"));
  await expect("the server runs in the new project", status, (label) => label === "MAUVE server: running");
  const problems = () => page.locator(".editor-instance .squiggly-error, .editor-instance .squiggly-warning").count();
  await expect("the new project has no problems", problems, (count) => count === 0);
}

async function checkIcon({ page, expect }) {
  const icon = () =>
    page.evaluate(() => {
      const label = document.querySelector(".tab.active .monaco-icon-label");
      return label === null ? "no tab" : getComputedStyle(label, "::before").backgroundImage;
    });
  await expect("the icon of models in the tab", icon, (image) => /model-(light|dark)\.svg/.test(image));
}

/** Looks at the timing table of the new project: no other extension in this VS Code knows TOML. */
async function checkTable({ page, expect, fillQuickInput }) {
  await page.keyboard.press("Control+p");
  await fillQuickInput("timing.toml", "timing.toml");
  await page.keyboard.press("Enter");
  const colours = () =>
    page.evaluate(() => {
      const line = [...document.querySelectorAll(".view-line")].find((it) => it.textContent.startsWith("levels"));
      return [...(line?.querySelectorAll("span > span") ?? [])].map((span) => getComputedStyle(span).color);
    });
  await expect("a timing table, coloured", colours, (seen) => new Set(seen).size >= 3);
}

const THEMES = ["Dark Modern", "Light Modern", "Default High Contrast", "Default High Contrast Light", "Dark 2026", "Light 2026"];

/** Looks at the names in the new project, in VS Code's own themes: each kind of name has its own look. */
async function checkColours({ page, expect, goTo, model }) {
  await goTo(43, 1);
  const looks = () =>
    page.evaluate(() => {
      const look = (line, name) => {
        const row = [...document.querySelectorAll(".view-line")].find((it) => it.textContent.replaceAll("\u00a0", " ").includes(line));
        const span = [...(row?.querySelectorAll("span") ?? [])].find((it) => it.children.length === 0 && it.textContent.trim() === name);
        const { color, fontWeight } = getComputedStyle(span ?? document.body);
        return span === undefined ? `no ${name}` : `${color} ${fontWeight}`;
      };
      return {
        variable: look("var seen", "seen"),
        port: look("laser.ranges", "ranges"),
        instance: look("instance laser", "laser"),
        state: look("state Turning", "Turning"),
        transition: look("transition blocked", "blocked"),
      };
    });
  const folder = path.join(path.dirname(model), "first-robot/.vscode");
  mkdirSync(folder, { recursive: true });
  let before = "";
  const isDistinct = (names) => {
    const all = Object.values(names);
    // With the colours of the theme before, VS Code has not switched yet.
    return JSON.stringify(names) !== before && all.every((it) => it.startsWith("rgb")) && new Set(all).size === all.length;
  };
  await expect("five kinds of names, told apart in the default theme", looks, isDistinct);
  for (const theme of THEMES) {
    before = JSON.stringify(await looks());
    writeFileSync(path.join(folder, "settings.json"), JSON.stringify({ "workbench.colorTheme": theme }));
    await expect(`five kinds of names, told apart in ${theme}`, looks, isDistinct);
  }
  rmSync(folder, { recursive: true });
}

/** Does what the walkthrough says in the new project: types, hovers and fixes a deadline; looks at a page on the way. */
async function checkEdits({ page, expect, goTo, model }) {
  const lines = readFileSync(path.join(path.dirname(model), "first-robot/robot.mal"), "utf8").split("\n");
  const line = lines.findIndex((it) => it.includes("deadline = 80"));
  await goTo(line + 1, lines[line].indexOf("80") + 1);
  await page.keyboard.press("Delete");
  await page.keyboard.press("Delete");
  await page.keyboard.type("35", { delay: 30 });
  await expect("the missed deadline", () => page.locator(".squiggly-error").count(), (count) => count > 0);
  await page.keyboard.press("Control+Shift+m");
  await page.locator(".markers-panel a", { hasText: "deadline-missed" }).click();
  // The preview is in frames, which VS Code replaces while it opens.
  const title = (frame) => frame.evaluate(() => document.querySelector("h1")?.textContent).catch(() => undefined);
  const titles = () => Promise.all(page.frames().map(title));
  await expect("a click on the code of a diagnostic: its page, rendered", titles, (seen) => seen.includes("deadline-missed"));

  await page.locator(".tab", { hasText: "robot.mal" }).click();
  // The mouse may be there before the editor is.
  const hovers = async () => {
    await page.mouse.move(0, 0);
    await page.locator(".view-line", { hasText: "activity pilot" }).hover();
    await page.waitForTimeout(1000);
    return page.locator(".monaco-hover:not(.hidden)").count();
  };
  await expect("a hover", hovers, (count) => count > 0);
  await page.keyboard.press("Control+.");
  await page.waitForSelector(".action-widget");
  await page.waitForTimeout(300);
  await page.keyboard.press("Enter");
  await expect("the deadline fixed", () => page.locator(".squiggly-error").count(), (count) => count === 0);
}

async function checkWalkthrough({ page, expect, command }) {
  await command("MAUVE: Open Walkthrough");
  const steps = () =>
    page.evaluate(() => {
      const boxes = [...document.querySelectorAll(".getting-started-step [role=checkbox]")];
      return boxes.map((box) => `${box.dataset.doneStepId.replace(/.*#/, "")}: ${box.ariaChecked}`);
    });
  const done = (check) => `create: true,type: true,hover: true,fix: true,panels: false,run: false,measure: false,generate: false,check: ${check}`;
  await expect("the walkthrough, with the steps that were done", steps, (seen) => seen.join() === done(false));
  await page.locator(".getting-started-step", { hasText: "Check in CI" }).click();
  await page.locator(".getting-started-step .monaco-button", { hasText: "Check Project" }).click();
  await expect("the last step, done by its button", steps, (seen) => seen.join() === done(true));
}
