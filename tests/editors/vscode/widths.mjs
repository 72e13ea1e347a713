// What is seen of the figures beside the explorer and the minimap, above the panel, on a small screen and on a smaller one, in one
// editor, in two and in three: each is whole, and so is the verdict of each activity in sight.
import { mkdirSync, rmSync, writeFileSync } from "node:fs";
import * as path from "node:path";

const SIZES = [{ width: 1440, height: 900 }, { width: 1000, height: 700 }];
/** In editors that are as wide, in pixels, the response time or the reason is in sight, too. */
const WIDE = 290;

/** In each editor: its width, the activities in sight with the figures at their ends, and the texts that reach behind the right edge. */
function seen(page) {
  return page.evaluate(() =>
    [...document.querySelectorAll(".editor-instance")].map((editor) => {
      const map = editor.querySelector(".minimap").getBoundingClientRect();
      const { top, bottom, right, width } = editor.querySelector(".editor-scrollable").getBoundingClientRect();
      const edge = map.width > 0 ? map.left : right;
      const activities = {};
      const cut = [];
      let [activity, drawn] = ["", ""];
      const rows = [...editor.querySelectorAll(".view-line")].map((row) => ({ row, box: row.getBoundingClientRect() }));
      const inSight = rows.filter(({ box }) => box.top >= top - 1 && box.bottom <= bottom + 1).sort((one, other) => one.box.top - other.box.top);
      for (const { row } of inSight) {
        const text = row.textContent.replaceAll("\u00a0", " ");
        // A line may be wrapped, also before the name.
        activity = /^\s*activity\b/.test(text) || activity !== "" ? activity + text : "";
        for (const span of row.querySelectorAll("span")) {
          const text = (end) => (/^"(.*)"$/.exec(getComputedStyle(span, end).content)?.[1] ?? "");
          // In the indentation, where there is no room behind the line.
          const figure = text("::before") + text("::after");
          drawn += figure;
          if (span.getBoundingClientRect().right > edge + 1) {
            cut.push(span.textContent + figure);
          }
        }
        const [, name] = /^\s*activity\s+(\w+)/.exec(activity) ?? [];
        if ((text.includes("}") || drawn !== "") && name !== undefined) {
          activities[name] = drawn;
        }
        if (text.includes("}") || activity === "") {
          [activity, drawn] = ["", ""];
        }
      }
      return { width, activities, cut };
    }),
  );
}

const VERDICT = /^(✓|✗|!|\?|–|…)/;
/** A mark with what stands behind it. */
const FIGURE = /^(✓|✗|!|\?|–|…) \S/;

/** Looks at the sample robot: as it is, with an overloaded CPU, and with a text that is incomplete. */
export async function checkWidths({ page, expect, command, run, openAt, selectToEnd, model }) {
  const viewport = page.viewportSize();
  const settings = path.join(model, ".vscode");
  mkdirSync(settings, { recursive: true });
  writeFileSync(path.join(settings, "settings.json"), JSON.stringify({ "editor.minimap.enabled": true }));
  await page.setViewportSize(SIZES[0]);
  await run("workbench.view.explorer");
  await run("workbench.action.problems.focus");
  await openAt("deployment.mal", "activity control");
  await expect("the minimap", () => page.locator(".minimap").first().boundingBox(), (box) => box !== null && box.width > 0);

  const texts = [
    ["as it is", undefined, /^✓ 63/],
    ["overloaded", "control { affinity = 1 priority = 5 period = 50 deadline = 50 }", /^✗ 63/],
    ["incomplete", "control { affinity = 1 priority = 5 period = }", /^…/],
  ];
  for (const editors of [1, 2, 3]) {
    if (editors > 1) {
      await run("workbench.action.splitEditorRight");
    }
    for (const size of SIZES) {
      await page.setViewportSize(size);
      await openAt("deployment.mal", "deployment P3dxDeployment");
      await expect(`${size.width}×${size.height}, ${editors} editor(s): the figures of the deployment, none cut`, () => seen(page), (all) => all.every(({ cut }) => cut.length === 0));
      for (const [name, text, control] of texts) {
        await openAt("deployment.mal", "control  ");
        if (text !== undefined) {
          await selectToEnd();
          await page.keyboard.insertText(text);
        }
        await expect(
          `${size.width}×${size.height}, ${editors} editor(s), ${name}: the verdict of each activity in sight, and none cut`,
          () => seen(page),
          (all) =>
            all.length === editors &&
            all.every(({ width, activities, cut }) => {
              const figures = Object.values(activities);
              return cut.length === 0 && figures.every((it) => (width < WIDE || name === "incomplete" ? VERDICT : FIGURE).test(it));
            }) &&
            // The rows of one line may fill a narrow editor.
            all.some(({ width, activities: { control: it } }) => width < WIDE || (it !== undefined && control.test(it))),
        );
        await run("workbench.action.files.revert");
      }
    }
  }
  await run("workbench.action.joinAllGroups");
  await run("workbench.action.closePanel");
  rmSync(settings, { recursive: true });
  await page.setViewportSize(viewport);
}
