import assert from "node:assert/strict";
import { chmodSync, mkdirSync, mkdtempSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import * as path from "node:path";
import { test } from "node:test";
import { findServer, Places } from "./find";

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

function find(root: string, setting: string, more: Partial<Places> = {}) {
  return findServer({
    setting,
    folders: [root],
    isTrusted: true,
    extension: path.join(root, "extension"),
    PATH: ["", path.join(root, "nowhere"), path.join(root, "other"), path.join(root, "bin")].join(path.delimiter),
    platform: "linux",
    ...more,
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

test("a relative folder on PATH does not count: it would be one of the workspace", () =>
  installed(["bin/mauve"], (root) => {
    const before = process.cwd();
    process.chdir(path.join(root, "bin"));
    try {
      for (const folder of ["", ".", "../bin", "./", "..//bin"]) {
        const found = find(root, "", { PATH: [folder, path.join(root, "other")].join(path.delimiter) });
        assert.ok("problem" in found, folder);
        assert.deepEqual(
          found.lookedFor,
          ["extension/server", "other"].map((folder) => path.join(root, folder, "mauve")),
        );
      }
      assert.deepEqual(find(root, "", { PATH: [".", path.join(root, "bin")].join(path.delimiter) }), {
        path: path.join(root, "bin/mauve"),
      });
    } finally {
      process.chdir(before);
    }
  }));

test("a program in a workspace that is not trusted does not count", () =>
  installed(["bin/mauve", "model.mal"], (root) => {
    const [workspace, bin] = [path.join(root, "bin"), path.join(root, "bin/mauve")];
    mkdirSync(path.join(root, "links"));
    symlinkSync(bin, path.join(root, "links/mauve"));
    symlinkSync(workspace, path.join(root, "folder"));
    for (const [folder, opened] of [
      ["bin", "bin"],
      ["bin", "."],
      ["links", "bin"],
      ["bin", "folder"],
      ["folder", "bin"],
    ]) {
      const places = { folders: ["/nowhere", path.join(root, opened)], PATH: path.join(root, folder) };
      assert.ok("path" in find(root, "", places), `${folder} ${opened}`);
      assert.ok("problem" in find(root, "", { ...places, isTrusted: false }), `${folder} ${opened}`);
    }
    const others = { folders: [path.join(root, "bi"), path.join(root, "bin/mauve-2")], isTrusted: false };
    assert.deepEqual(find(root, "", others), { path: bin });
    const found = find(root, "mauve", { folders: [workspace], isTrusted: false });
    assert.ok("problem" in found);
    assert.match(found.problem, /mauve.server.path is "mauve", but .* is in a workspace that is not trusted/);
    assert.deepEqual(find(root, "mauve", { folders: [workspace] }), { path: bin });
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
