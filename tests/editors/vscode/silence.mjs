// What is seen of the figures while the server does not answer, and when it has ended: they are those of an earlier text, and say so.
import { spawnSync } from "node:child_process";

export async function checkSilence({ page, expect, command, run, status, statusItem, activity, openAt, server }) {
  const signal = (name) => spawnSync("pkill", [`-${name}`, "-f", `${server} lsp`]);
  const isMarked = (line) => line.includes("… ");
  await openAt("deployment.mal", "100   deadline = 100 }");

  signal("STOP");
  await page.keyboard.type("1");
  await page.keyboard.press("Control+Shift+Enter");
  await expect("a server that does not answer: figures are marked", () => activity("hokuyo"), isMarked);
  await expect("each is with its activity below a new line", () => activity("hokuyo"), (line) => line.includes("53 / 100"));
  signal("CONT");
  await expect("it answers: they are not", () => activity("hokuyo"), (line) => !isMarked(line) && line.includes("✓ 53 / 100"));
  await run("workbench.action.files.revert");

  signal("KILL");
  await expect("a server that has ended: figures are marked at once, or those of the next one", () => activity("hokuyo"), (line) => line.includes(" / 100"));
  await expect("another server runs", status, (label) => label === "MAUVE server: running");
  await expect("its figures", () => activity("hokuyo"), (line) => !isMarked(line) && line.includes("✓ 53 / 100"));

  // Five ends within three minutes are too many. A server that only starts may not be there to be ended.
  for (let kills = 0; kills < 20 && !(await statusItem()).endsWith(": error"); kills++) {
    signal("KILL");
    await page.waitForTimeout(1000);
  }
  await expect("no server: figures stay marked", () => activity("hokuyo"), isMarked);

  // Until it runs, the error of the last one may be shown.
  await command("MAUVE: Restart Server");
  await expect("the server runs again", statusItem, (label) => label === "MAUVE server: running");
  await run("workbench.action.files.revert");
  await expect("its figures", () => activity("hokuyo"), (line) => !isMarked(line) && line.includes("53 / 100"));
}
