import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import * as path from "node:path";
import { test } from "node:test";
import { languageOf } from "./recognise";

test("the Meta Attack Language", () => {
  for (const text of [
    '#id: "org.example.lang"\n#version: "1.0.0"\n',
    '\uFEFF// a comment\n/* another\n   one */\ninclude "core.mal"\r\n\r\n#id : "x"',
    'category System {\n  abstract asset Machine {\n    | connect\n      -> access\n  }\n}\n',
    'category System user info: "library x {" {\n}',
    "associations {\n  Network [networks] * <-- Access --> * [machines] Machine\n}",
  ]) {
    assert.equal(languageOf(text), "mal", text);
  }
});

test("MAUVE", () => {
  for (const text of [
    "library arm {\n}",
    '// #id: "x"\n/* category X { */\ninclude "a.mal"\n\ndeployment Robot {',
    "codel category(in associations: int): bool",
    "component Arm(ArmShell, ArmCore)",
  ]) {
    assert.equal(languageOf(text), "mauve", text);
  }
});

test("a text that does not say", () => {
  for (const text of ["", "\n// category X {\n", 'include "a.mal"\n', "lib", "category", "/* library x {", 'include "a']) {
    assert.equal(languageOf(text), undefined, text);
  }
});

test("the sample models are MAUVE, or hold nothing but includes", () => {
  const models = path.join(__dirname, "../../../../tests/models");
  const files = readdirSync(models, { recursive: true, encoding: "utf8" }).filter((file) => file.endsWith(".mal"));
  assert.ok(files.length > 0);
  for (const file of files) {
    const text = readFileSync(path.join(models, file), "utf8");
    assert.equal(languageOf(text), /^library/m.test(text) ? "mauve" : undefined, file);
  }
});

test("a long text takes no time", () => {
  const text = " \n// x\n".repeat(100_000);
  const start = performance.now();
  assert.equal(languageOf(text + "library x"), "mauve");
  assert.ok(performance.now() - start < 1000);
});
