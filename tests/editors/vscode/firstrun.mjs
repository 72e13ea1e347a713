// The first run: what the extension offers a user who has just installed it. check.mjs calls `checkFirstRun` at the end.

/** Looks at the extension as a new user does. `tools` are the page and the functions of check.mjs. */
export async function checkFirstRun(tools) {
  await checkMenu(tools);
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
  const row = page.locator(".quick-input-widget .monaco-list-row", { hasText: text });
  await row.click();
  await page.waitForSelector(".quick-input-widget", { state: "hidden", timeout: 5000 });
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
