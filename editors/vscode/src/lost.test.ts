import assert from "node:assert";
import test from "node:test";
import type { ExecutionTimes, Graph, Machine, Schedule } from "./answers";
import { hasLost } from "./lost";

const graph = (statuses: Record<string, string | null>) =>
  ({ nodes: Object.entries(statuses).map(([instance, status]) => ({ instance, status })) }) as Graph;

test("an activity that is no longer analysed is a loss, a missed deadline or a removed instance is not", () => {
  const before = graph({ a: "met", b: "met", c: "background" });
  assert.ok(hasLost("architecture", before, graph({ a: "met", b: "not-analysed", c: "background" })));
  assert.ok(hasLost("architecture", before, graph({ a: "met", b: null, c: "background" })));
  assert.ok(!hasLost("architecture", before, graph({ a: "missed", b: "unbounded", c: "background" })));
  assert.ok(!hasLost("architecture", before, graph({ a: "met", new: "not-analysed" })));
  assert.ok(!hasLost("architecture", graph({ a: "not-analysed" }), graph({ a: "not-analysed" })));
});

test("times and schedules can be lost as well", () => {
  const machine = (reasons: string[]) => ({ reasons }) as Machine;
  assert.ok(hasLost("stateMachine", machine([]), machine(["a codel has no time"])));
  assert.ok(!hasLost("stateMachine", machine(["old"]), machine(["new"])));
  const schedule = (drawing: string | null) => ({ drawing }) as Schedule;
  assert.ok(hasLost("schedule", schedule("<svg/>"), schedule(null)));
  assert.ok(!hasLost("schedule", schedule(null), schedule("<svg/>")));
  const times = (count: number) => ({ levels: Array(count).fill({}) }) as ExecutionTimes;
  assert.ok(hasLost("executionTimes", times(2), times(0)));
  assert.ok(!hasLost("executionTimes", times(2), times(1)));
});
