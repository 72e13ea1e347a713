import assert from "node:assert";
import test from "node:test";
import type { Graph, Machine, WhatIf } from "./answers";
import { hasLost } from "./lost";

const graph = (statuses: Record<string, string | null>) =>
  ({ nodes: Object.entries(statuses).map(([instance, status]) => ({ instance, status })) }) as Graph;

test("an activity that is no longer analysed is a loss, a missed deadline or a removed instance is not", () => {
  const before = graph({ a: "met", b: "met", c: "background" });
  assert.ok(hasLost(before, graph({ a: "met", b: "not-analysed", c: "background" })));
  assert.ok(hasLost(before, graph({ a: "met", b: null, c: "background" })));
  assert.ok(!hasLost(before, graph({ a: "missed", b: "unbounded", c: "background" })));
  assert.ok(!hasLost(before, graph({ a: "met", new: "not-analysed" })));
  assert.ok(!hasLost(graph({ a: "not-analysed" }), graph({ a: "not-analysed" })));
});

test("a reason says that all times are unknown", () => {
  const machine = (reasons: string[]) => ({ reasons }) as Machine;
  assert.ok(hasLost(machine([]), machine(["a codel has no time"])));
  assert.ok(!hasLost(machine(["old"]), machine(["new"])));
  assert.ok(!hasLost(machine(["old"]), machine([])));
});

test("the same of figures before and after", () => {
  const answer = (status: string, isGone = false) =>
    ({ rows: [{ name: "eye", status, after: isGone ? null : {} }] }) as unknown as WhatIf;
  assert.equal(hasLost(answer("met"), answer("unknown")), true);
  assert.equal(hasLost(answer("unknown"), answer("unknown")), false);
  assert.equal(hasLost(answer("met"), answer("missed")), false);
  assert.equal(hasLost(answer("met"), answer("unknown", true)), false);
});
