// What VS Code itself has of the sample robot, asked by its own commands: so what its menus and keys work with. This is an
// extension, since only those can ask: it begins when check.mjs has made the file $MAUVE_TEST_RESULT.wanted, and what was
// found goes to $MAUVE_TEST_RESULT. Before, it does what check.mjs asks for at $MAUVE_TEST_SOCKET.
const { spawnSync } = require("node:child_process");
const { createServer } = require("node:http");
const { existsSync, readFileSync, renameSync, rmSync, symlinkSync, writeFileSync } = require("node:fs");
const assert = require("node:assert");
const path = require("node:path");
const vscode = require("vscode");

const folder = vscode.workspace.workspaceFolders?.[0].uri;
const generated = path.join(folder?.fsPath ?? "", "generated");

async function open(file) {
  const document = await vscode.workspace.openTextDocument(vscode.Uri.joinPath(folder, file));
  await vscode.window.showTextDocument(document);
  return document;
}

/** The place of `word` behind the first `text`, or of the text itself. */
function at(document, text, word = text) {
  const start = document.getText().indexOf(text);
  assert.notStrictEqual(start, -1, `no "${text}" in ${document.fileName}`);
  return document.positionAt(document.getText().indexOf(word, start));
}

/** The result of a command, asked again until it is as expected: what is shown first may be of an earlier moment. */
async function ask(command, isExpected, ...parameters) {
  const end = Date.now() + 120_000;
  let seen;
  do {
    seen = await vscode.commands.executeCommand(command, ...parameters);
    if (seen !== undefined && seen !== null && isExpected(seen)) {
      return seen;
    }
    await new Promise((resolve) => setTimeout(resolve, 100));
  } while (Date.now() < end);
  throw new Error(`${command} gives ${JSON.stringify(seen)?.slice(0, 2000)}`);
}

/** Changes a document, does something, and takes the change back. */
async function changed(document, place, text, body) {
  const edit = new vscode.WorkspaceEdit();
  edit.replace(document.uri, place, text);
  assert.ok(await vscode.workspace.applyEdit(edit));
  try {
    await body();
  } finally {
    await vscode.window.showTextDocument(document);
    await vscode.commands.executeCommand("workbench.action.files.revert");
  }
}

/** What `mauve generate --check` says, where something is not as it should be. */
function checkPackages() {
  const options = ["generate", "--check", "--out", generated];
  const { status, stdout, stderr } = spawnSync(process.env.MAUVE_TEST_SERVER, options, { cwd: folder.fsPath, encoding: "utf8" });
  return status === 0 ? undefined : stdout + stderr;
}

let lastEvent = 0;
if (folder !== undefined) {
  const watcher = vscode.workspace.createFileSystemWatcher(new vscode.RelativePattern(folder, "generated/**"));
  for (const event of [watcher.onDidCreate, watcher.onDidChange, watcher.onDidDelete]) {
    event(() => (lastEvent = Date.now()));
  }
}

/** Waits until VS Code has seen all that was written: it refuses a change of what it hears of while it shows the change. */
async function quiet() {
  lastEvent = Date.now();
  while (Date.now() < lastEvent + 3_000) {
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}

/** Says yes to the change that VS Code shows, and waits until nothing is left to complain of, nor to be saved. */
async function confirmed(complaint) {
  for (const end = Date.now() + 240_000; ; await new Promise((resolve) => setTimeout(resolve, 100))) {
    await vscode.commands.executeCommand("refactorPreview.apply");
    const dirty = vscode.workspace.textDocuments.filter((it) => it.isDirty).map((it) => it.fileName);
    const said = complaint();
    if (said === undefined && dirty.length === 0) {
      return;
    }
    assert.ok(Date.now() < end, `${said}, not saved: ${dirty.join()}`);
  }
}

const files = (locations) => new Set(locations.map((it) => path.basename((it.uri ?? it.targetUri).path)));
const label = (item) => (typeof item.label === "string" ? item.label : item.label.label);

const checks = {
  async "inlay hints"() {
    // Figures are drawn by the extension, and are inlay hints where the user wants that. Values always are.
    const document = await open("deployment.mal");
    const everything = new vscode.Range(0, 0, document.lineCount, 0);
    const text = (hint) => (typeof hint.label === "string" ? hint.label : hint.label.map((part) => part.value).join(""));
    const ofFigures = (it) => it.filter((hint) => /\d ms|met at|CPU \d/.test(text(hint)));
    const inlay = (isExpected) => ask("vscode.executeInlayHintProvider", isExpected, document.uri, everything);
    await inlay((it) => it.some((hint) => text(hint).startsWith("overrides")) && ofFigures(it).length === 0);
    const settings = vscode.workspace.getConfiguration("mauve.decorations");
    await settings.update("enable", false, vscode.ConfigurationTarget.Workspace);
    await inlay((it) => it.some((hint) => text(hint).startsWith("! 997 / 1000")));
    await settings.update("enable", undefined, vscode.ConfigurationTarget.Workspace);
    await inlay((it) => ofFigures(it).length === 0);
  },
  async hover() {
    const document = await open("deployment.mal");
    const text = (hovers) => hovers.flatMap((it) => it.contents).map((it) => it.value ?? it).join("\n");
    await ask("vscode.executeHoverProvider", (it) => text(it).includes("997 ms"), document.uri, at(document, "activity navigation", "navigation"));
  },
  async definition() {
    const document = await open("deployment.mal");
    await ask("vscode.executeDefinitionProvider", (it) => files(it).has("navigation_architecture.mal"), document.uri, at(document, "activity navigation", "navigation"));
  },
  async references() {
    const document = await open("navigation_architecture.mal");
    const isExpected = (it) => ["navigation_architecture.mal", "deployment.mal"].every((file) => files(it).has(file));
    await ask("vscode.executeReferenceProvider", isExpected, document.uri, at(document, "instance navigation:", "navigation"));
  },
  async highlights() {
    const document = await open("navigation_architecture.mal");
    // VS Code has highlights of its own, of equal words: they do not know what is written to.
    const isExpected = (it) => it.length >= 4 && it.some((one) => one.kind !== vscode.DocumentHighlightKind.Text);
    await ask("vscode.executeDocumentHighlights", isExpected, document.uri, at(document, "instance navigation:", "navigation"));
  },
  async rename() {
    const document = await open("deployment.mal");
    const place = at(document, "activity navigation", "navigation");
    const edit = await ask("vscode.executeDocumentRenameProvider", (it) => it.size >= 2, document.uri, place, "planner");
    const changed = new Set(edit.entries().map(([uri]) => path.basename(uri.path)));
    assert.ok(changed.has("deployment.mal") && changed.has("navigation_architecture.mal"), [...changed].join());
    assert.ok(await vscode.workspace.applyEdit(edit));
    assert.ok(document.getText().includes("activity planner "), document.getText());
    for (const file of changed) {
      await open(vscode.workspace.textDocuments.find((it) => path.basename(it.uri.path) === file).uri.path.slice(folder.path.length + 1));
      await vscode.commands.executeCommand("workbench.action.files.revert");
    }
  },
  async completion() {
    const document = await open("deployment.mal");
    const line = document.lineAt(at(document, "activity teleop").line);
    await changed(document, line.range, "    activity ", async () => {
      // Only the instance that has no activity any more. VS Code's own completions are words of the text.
      const isExpected = (it) =>
        it.items.some((item) => label(item) === "teleop") && !it.items.some((item) => label(item) === "navigation");
      const end = new vscode.Position(line.lineNumber, 13);
      await ask("vscode.executeCompletionItemProvider", isExpected, document.uri, end);
    });
  },
  async "signature help"() {
    const document = await open("components/navigation.mal");
    await ask("vscode.executeSignatureHelpProvider", (it) => it.signatures.some((one) => one.label.includes("astar")), document.uri, at(document, "astar(").translate(0, 6));
  },
  async "quick fixes"() {
    const document = await open("components/navigation.mal");
    const place = at(document, "astar(");
    await changed(document, new vscode.Range(place, place.translate(0, 5)), "astra", async () => {
      const there = new vscode.Range(place, place.translate(0, 5));
      const isExpected = (it) => it.some((action) => action.title.includes("astar") && action.kind?.value.startsWith("quickfix"));
      await ask("vscode.executeCodeActionProvider", isExpected, document.uri, there, undefined, 20);
    });
  },
  async "packages from the source action"() {
    const document = await open("deployment.mal");
    const place = at(document, "activity navigation", "navigation");
    const isExpected = (it) => it.some((action) => action.kind?.value === "source.generate.mauve");
    await ask("vscode.executeCodeActionProvider", isExpected, document.uri, new vscode.Range(place, place), "source.generate");
    rmSync(generated, { recursive: true, force: true });
    await quiet();
    vscode.window.activeTextEditor.selection = new vscode.Selection(place, place);
    void vscode.commands.executeCommand("editor.action.sourceAction", { kind: "source.generate", apply: "first" });
    // It is shown before it is done.
    await new Promise((resolve) => setTimeout(resolve, 2_000));
    assert.ok(!existsSync(generated), "what was not confirmed is written");
    await confirmed(checkPackages);
  },
  async "packages that change, from the lens"() {
    const document = await open("deployment.mal");
    const isExpected = (it) => it.some((lens) => lens.command?.title === "Generate Orocos");
    const lenses = await ask("vscode.executeCodeLensProvider", isExpected, document.uri, 20);
    const { command } = lenses.find((lens) => lens.command?.title === "Generate Orocos");
    const read = (file) => readFileSync(path.join(generated, "motion", file), "utf8");
    const model = await open("components/switch.mal");
    for (const [before, now] of [["double", "float"], ["float", "double"]]) {
      const edit = new vscode.WorkspaceEdit();
      const place = at(model, `in width: double): ${before}`).translate(0, "in width: double): ".length);
      edit.replace(model.uri, new vscode.Range(place, place.translate(0, before.length)), now);
      assert.ok(await vscode.workspace.applyEdit(edit));
      assert.ok(await model.save());
      await quiet();
      void vscode.commands.executeCommand(command.command, ...command.arguments);
      await confirmed(() => {
        const prototype = new RegExp(`^${now} clearance\\(`, "m").test(read("include/motion/motion-codels.hpp"));
        // The stub follows: nobody has edited it.
        const stub = new RegExp(`^${now} clearance\\(`, "m").test(read("src/codels/clearance.cpp"));
        return prototype && stub ? undefined : `${prototype} ${stub}`;
      });
    }
    assert.strictEqual(checkPackages(), undefined);
  },
  async "packages with a file that is not saved, open by another name"() {
    const link = `${folder.fsPath}-link`;
    symlinkSync(folder.fsPath, link);
    const inside = path.join(generated, "motion", "package.xml");
    const text = readFileSync(inside, "utf8");
    const file = vscode.Uri.file(path.join(link, "generated", "motion", "package.xml"));
    const document = await vscode.workspace.openTextDocument(file);
    await vscode.window.showTextDocument(document);
    const edit = new vscode.WorkspaceEdit();
    edit.insert(file, new vscode.Position(0, 0), "<!-- Mine. -->");
    assert.ok(await vscode.workspace.applyEdit(edit));
    rmSync(inside);
    const model = vscode.Uri.joinPath(folder, "deployment.mal").toString();
    const made = vscode.commands.executeCommand("mauve.generateOrocos", model, "P3dxDeployment");
    const waited = new Promise((resolve) => setTimeout(resolve, 30_000, "asked the user"));
    assert.strictEqual(await Promise.race([made, waited]), false);
    writeFileSync(inside, text);
    await vscode.commands.executeCommand("workbench.action.revertAndCloseActiveEditor");
  },
  async formatting() {
    const document = await open("deployment.mal");
    const place = at(document, "priority = background");
    await changed(document, new vscode.Range(place, place.translate(0, 8)), "priority    ", async () => {
      await ask("vscode.executeFormatDocumentProvider", (it) => it.length > 0, document.uri, { tabSize: 2, insertSpaces: true });
      await vscode.commands.executeCommand("editor.action.formatDocument");
      assert.ok(document.getText().includes("priority = background"), document.getText());
    });
    // Nothing that would replace another extension, or folds by indentation.
    const { uri } = await open("mauve.toml");
    assert.strictEqual(await vscode.commands.executeCommand("vscode.executeFormatDocumentProvider", uri, { tabSize: 2, insertSpaces: true }), undefined);
  },
  async "semantic tokens"() {
    const document = await open("components/navigation.mal");
    const legend = await ask("vscode.provideDocumentSemanticTokensLegend", (it) => it.tokenTypes.length > 0, document.uri);
    const tokens = await ask("vscode.provideDocumentSemanticTokens", (it) => it.data.length > 0, document.uri);
    assert.ok(tokens.data.length % 5 === 0 && tokens.data.every((it, index) => index % 5 !== 3 || it < legend.tokenTypes.length));
  },
  async "document symbols"() {
    const document = await open("deployment.mal");
    await ask("vscode.executeDocumentSymbolProvider", (it) => it[0].children[0].name === "P3dxDeployment", document.uri);
  },
  async "workspace symbols"() {
    await ask("vscode.executeWorkspaceSymbolProvider", (it) => it.some((symbol) => symbol.name === "NavigationCore"), "NavigationCore");
  },
  async folding() {
    const document = await open("deployment.mal");
    await ask("vscode.executeFoldingRangeProvider", (it) => it.some((fold) => fold.start === 2), document.uri);
  },
  async "selection ranges"() {
    const document = await open("deployment.mal");
    const place = at(document, "deadline = 1000");
    await ask("vscode.executeSelectionRangeProvider", (it) => it[0].parent?.parent !== undefined, document.uri, [place]);
  },
  async "document links"() {
    const document = await open("exploration.mal");
    await ask("vscode.executeLinkProvider", (it) => it.some((link) => link.target?.path.endsWith("components/pose.mal")), document.uri);
  },
};

/** What check.mjs may ask for, as `["open", "deployment.mal", 0, 0]`. */
const requests = {
  async open(file, line, column) {
    const document = await vscode.workspace.openTextDocument(vscode.Uri.joinPath(folder, file));
    const place = new vscode.Position(line, column);
    // A file that has just been written is read again, and that moves the cursor.
    while (!document.isDirty && document.getText() !== readFileSync(document.fileName, "utf8")) {
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
    await vscode.window.showTextDocument(document, { preview: false, selection: new vscode.Range(place, place) });
  },
  async run(command) {
    await vscode.commands.executeCommand(command);
  },
};

function serve() {
  const socket = process.env.MAUVE_TEST_SOCKET;
  rmSync(socket, { force: true });
  const server = createServer(async (request, response) => {
    try {
      const [what, ...operands] = JSON.parse((await request.setEncoding("utf8").toArray()).join(""));
      await requests[what](...operands);
      response.end("fine");
    } catch (error) {
      response.end(error.message);
    }
  });
  server.listen(socket);
}

async function run() {
  const result = process.env.MAUVE_TEST_RESULT;
  while (!existsSync(`${result}.wanted`)) {
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  const results = {};
  for (const [name, check] of Object.entries(checks)) {
    try {
      await check();
      results[name] = "fine";
    } catch (error) {
      results[name] = `${error.message}`;
    }
  }
  writeFileSync(`${result}.new`, JSON.stringify(results));
  renameSync(`${result}.new`, result);
}

exports.activate = () => {
  serve();
  void run();
};
