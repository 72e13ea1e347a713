// What is seen of the figures on a small screen with the explorer and the minimap, in one editor and in two: each is whole,
// and the verdict of every activity is in sight.
import { mkdirSync, rmSync, writeFileSync } from "node:fs";
import * as path from "node:path";

/** The figures in each editor, and the texts that reach behind its right edge. */
function seen(page) {
  return page.evaluate(() =>
    [...document.querySelectorAll(".editor-instance")].map((editor) => {
      const map = editor.querySelector(".minimap").getBoundingClientRect();
      const edge = map.width > 0 ? map.left : editor.querySelector(".editor-scrollable").getBoundingClientRect().right;
      const figures = [];
      const cut = [];
      for (const span of editor.querySelectorAll(".view-line span")) {
        const { content } = getComputedStyle(span, "::after");
        const text = content.startsWith('"') ? content.slice(1, -1) : "";
        if (text !== "") {
          figures.push(text);
        }
        if (span.getBoundingClientRect().right > edge + 1) {
          cut.push(span.textContent + text);
        }
      }
      return { figures, cut };
    }),
  );
}

const VERDICTS = /overloaded|–|✓|✗|!|\?|…/;

/** Looks at the sample robot: as it is, with an overloaded CPU, and with a text that is incomplete. */
export async function checkWidths({ page, expect, command, openAt, selectToEnd, model }) {
  const viewport = page.viewportSize();
  const settings = path.join(model, ".vscode");
  mkdirSync(settings, { recursive: true });
  writeFileSync(path.join(settings, "settings.json"), JSON.stringify({ "editor.minimap.enabled": true }));
  await page.setViewportSize({ width: 1440, height: 1600 });
  await command("View: Show Explorer");
  await openAt("deployment.mal", "activity control");
  await expect("the minimap", () => page.locator(".minimap").first().boundingBox(), (box) => box !== null && box.width > 0);

  const texts = [
    ["as it is", undefined, /^! 997 \/ 1000( ms)?$/],
    ["overloaded", "control { affinity = 1 priority = 5 period = 50 deadline = 50 }", /^✗ CPU 1 overloaded|^✗ overloaded/],
    ["incomplete", "control { affinity = 1 priority = 5 period = }", /…/],
  ];
  for (const editors of [1, 2]) {
    if (editors > 1) {
      await command("View: Split Editor Right");
    }
    for (const [name, text, navigation] of texts) {
      await openAt("deployment.mal", "control  ");
      if (text !== undefined) {
        await selectToEnd();
        await page.keyboard.type(text, { delay: 5 });
      }
      await expect(
        `${editors} editor(s), ${name}: every figure in sight, none cut`,
        () => seen(page),
        (all) =>
          all.length === editors &&
          all.every(({ figures, cut }) => cut.length === 0 && figures.filter((it) => VERDICTS.test(it)).length >= 10) &&
          (editors > 1 || all[0].figures.some((it) => navigation.test(it))),
      );
      await command("File: Revert File");
    }
  }
  await command("View: Close All Editors in Group");
  await command("View: Focus First Editor Group");
  rmSync(settings, { recursive: true });
  await page.setViewportSize(viewport);
}
