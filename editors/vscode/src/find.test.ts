import assert from "node:assert/strict";
import { chmodSync, mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import * as path from "node:path";
import { test } from "node:test";
import { findServer } from "./find";

/** A folder with an extension that has a server in it, one on PATH, and a file that is no program. */
function installed(files: string[], check: (root: string) => void): void {
  const root = mkdtempSync(path.join(tmpdir(), "mauve-find-"));
  try {
    for (const file of ["extension/server/mauve", "bin/mauve", "other/mauve-dev", "model.mal"]) {
      mkdirSync(path.dirname(path.join(root, file)), { recursive: true });
      if (files.includes(file)) {
        writeFileSync(path.join(root, file), "");
        chmodSync(path.join(root, file), file === "model.mal" ? 0o644 : 0o755);
      }
    }
    check(root);
  } finally {
    rmSync(root, { recursive: true });
  }
}

function find(root: string, setting: string) {
  return findServer({
    setting,
    folder: root,
    extension: path.join(root, "extension"),
    PATH: ["", path.join(root, "nowhere"), path.join(root, "other"), path.join(root, "bin")].join(path.delimiter),
    platform: "linux",
  });
}

const all = ["extension/server/mauve", "bin/mauve", "other/mauve-dev", "model.mal"];

test("the setting comes first, absolute or in the workspace", () =>
  installed(all, (root) => {
    const server = path.join(root, "other/mauve-dev");
    assert.deepEqual(find(root, server), { path: server });
    assert.deepEqual(find(root, "other/mauve-dev"), { path: server });
  }));

test("then the server in the extension, then the one on PATH", () => {
  installed(all, (root) => assert.deepEqual(find(root, ""), { path: path.join(root, "extension/server/mauve") }));
  installed(["bin/mauve"], (root) => assert.deepEqual(find(root, ""), { path: path.join(root, "bin/mauve") }));
});

test("a setting that is wrong is said, and nothing else is taken", () =>
  installed(all, (root) => {
    for (const [setting, what] of [
      ["nowhere/mauve", "there is no file"],
      ["model.mal", "is not a program"],
      ["bin", "is not a program"],
    ]) {
      const found = find(root, setting);
      assert.ok("problem" in found);
      assert.match(found.problem, new RegExp(`mauve.server.path is "${setting}".*${what}`));
      assert.deepEqual(found.lookedFor, [path.join(root, setting)]);
    }
  }));

test("nowhere: the places are told", () =>
  installed([], (root) => {
    const found = find(root, "");
    assert.ok("problem" in found);
    assert.match(found.problem, /not found.*mauve\.server\.path/);
    assert.deepEqual(
      found.lookedFor,
      ["extension/server", "nowhere", "other", "bin"].map((folder) => path.join(root, folder, "mauve")),
    );
  }));
