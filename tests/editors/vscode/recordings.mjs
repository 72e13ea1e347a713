// A recording beside the model: the panel of `MAUVE: Check Recording…`, and the samples of `MAUVE: Import Recording…`.
import { mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import * as path from "node:path";

/** The texts of the panel, which is a page inside of others. */
async function panel(page) {
  const text = (frame) => frame.evaluate(() => document.querySelector("main")?.innerText).catch(() => undefined);
  return (await Promise.all(page.frames().map(text))).find((it) => it?.includes("observed")) ?? "no panel";
}

/** Checks a recording in which pose responds later than its bound. */
export async function checkRecordings({ page, expect, command, run, openAt, model }) {
  const recording = path.join(path.dirname(model), "recording");
  mkdirSync(recording);
  const pose = [0, 1, 2].map((job) => `pose,${job}00000000,${job}56000000,${job}58000000,1000000,7,1,0,${job}`);
  writeFileSync(path.join(recording, "periods.csv"), `instance,release_ns,begin_ns,end_ns,execution_ns,priority,cpus,cpu,order\n${pose.join("\n")}\n`);
  const codels = [0, 1, 2].map((job) => `localisation.odometry_pose,400000,pose,${job + 1},${job}56500000,${job},,,`);
  writeFileSync(path.join(recording, "executions.csv"), `codel,execution_ns,instance,elapsed_ns,time_ns,order,waits,blocked_ns,status\n${codels.join("\n")}\n`);

  await openAt("deployment.mal", "activity pose");
  const samples = path.join(model, `${path.basename(model)}.samples`);
  const ask = async (name, button) => {
    await command(name, { asks: true });
    const row = page.locator(".quick-input-widget .monaco-list-row", { hasText: "Folder" });
    await row.click();
    await row.waitFor({ state: "hidden" });
    const input = page.locator(".quick-input-widget input").first();
    const first = () => page.locator(".quick-input-widget .monaco-list-row").first().textContent();
    await expect("a dialog for the recording", first, (text) => text.startsWith(".."));
    await input.fill(`${recording}/`);
    await page.locator(".quick-input-widget .monaco-button", { hasText: button }).click();
  };
  await ask("MAUVE: Check Recording", "Check");
  await expect("pose beyond its bound in the panel", () => panel(page), (text) => /pose\s+✗ 58 ms\s+✓ 57 \/ 100 ms/.test(text) && text.includes("contradicts"));
  await run("workbench.action.closeAllEditors");
  await openAt("deployment.mal", "activity pose");
  await run("notifications.clearAll");
  await ask("MAUVE: Import Recording", "Import");
  const proposed = () => page.locator(".quick-input-widget input").first().inputValue();
  await expect("a dialog for the samples, beside the model", proposed, (name) => name === samples);
  await page.locator(".quick-input-widget .monaco-button", { hasText: "OK" }).click();
  await page.locator(".notification-list-item", { hasText: "imported 3 executions in 1 run" }).getByRole("button", { name: "Show What Was Observed" }).click();
  const observed = samples.replace(/samples$/, "observed.toml");
  await expect("what was observed, in the editor", () => page.locator(".tab.active").getAttribute("data-resource-name"), (name) => name === path.basename(observed));
  await expect("of its codel", () => readFileSync(observed, "utf8"), (text) => text.includes("localisation.odometry_pose"));
  await run("workbench.action.closeAllEditors");
  await openAt("deployment.mal", "activity pose");
  await run("notifications.clearAll");
  [samples, observed].forEach((it) => rmSync(it));
  rmSync(recording, { recursive: true });
}
