import assert from "node:assert/strict";
import { test } from "node:test";
import { columns, lastRow, Look, room, widths } from "./columns";

const look: Look = { width: 541, fontFamily: "monospace", fontSize: 14, tabSize: 2, hasMinimap: true, isWrapped: true };
const activity = "    activity p3dx_driver { affinity = 1  priority = 10  period = 100   deadline = 100 }";

test("editors show so many columns", () => {
  // The first ones as VS Code on Linux shows them.
  const of = (more: Partial<Look>) => Math.floor(columns({ ...look, ...more }));
  assert.equal(of({ width: 1082 }), 104);
  assert.equal(of({}), 47);
  assert.equal(of({ width: 781 }), 72);
  assert.equal(of({ hasMinimap: false }), 53);
  assert.equal(of({ fontSize: 18 }), 36);
  assert.equal(of({ fontFamily: "Consolas, monospace" }), 51);
  assert.equal(of({ width: undefined }), 104);
  assert.equal(of({ width: 3 }), 1);
});

test("the last row of a wrapped line", () => {
  // The rows that VS Code shows end with `1  `, `deadline = ` and `100 }`.
  assert.equal(lastRow(activity, 47, 2), "    100 }".length);
  assert.equal(lastRow(activity, activity.length, 2), activity.length);
  assert.equal(lastRow(activity, activity.length - 1, 2), "    100 }".length);
  assert.equal(lastRow(activity, 44, 2), "    = 100 }".length);
  assert.equal(lastRow("", 47, 2), 0);
  assert.equal(lastRow("\tx y", 10, 4), "    x y".length);
  // A word that is longer than a row.
  assert.equal(lastRow("x".repeat(25), 10, 2), 5);
  assert.equal(lastRow(`${" ".repeat(20)}x y z`, 10, 2), 5);
});

test("the room behind a line", () => {
  assert.equal(room("library l {", look), 47 - 11);
  // Wherever it is wrapped: here, fewer columns give the same row.
  assert.equal(room(activity, look), 47 - "    100 }".length);
  assert.ok(room(activity, { ...look, isWrapped: false }) < 0);
  assert.equal(room(activity, { ...look, width: 1082 }), 104 - activity.length);
});

test("the widths of editor groups", () => {
  const [a, b, c] = [{ size: 1 }, { size: 2 }, { size: 3 }];
  assert.deepEqual(widths({ orientation: 0, groups: [a, b] }), [1, 2]);
  // Two groups below each other, right of another.
  assert.deepEqual(widths({ orientation: 0, groups: [a, { size: 5, groups: [b, c] }] }), [1, 5, 5]);
  assert.deepEqual(widths({ orientation: 1, groups: [{ size: 9, groups: [b, c] }, a] }), [2, 3, undefined]);
  assert.deepEqual(widths({ orientation: 0, groups: [{}] }), [undefined]);
});
