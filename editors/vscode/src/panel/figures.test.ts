import assert from "node:assert";
import test from "node:test";
import type { GraphNode } from "../answers";
import { cpus, number, rows, steps, summary } from "./figures";

const node = (instance: string, status: string, response: number | null, deadline: number | null): GraphNode => ({
  instance,
  component: "C",
  host: null,
  load: 0.1,
  affinity: 1,
  priority: 2,
  period: 100,
  deadline,
  response,
  figure: `${response !== null && deadline !== null && response > 0.9 * deadline ? "!" : "✓"} ${response} / ${deadline} ms`,
  status,
  reasons: [],
  location: null,
  activity: null,
});

test("the worst activity is first", () => {
  const nodes = [
    node("b", "met", 50, 100),
    node("idle", "background", null, null),
    node("late", "missed", 110, 100),
    node("a", "met", 50, 100),
    node("endless", "unbounded", null, 100),
    node("new", "not-analysed", null, 100),
    node("near", "met", 91, 100),
  ];
  const sorted = rows(nodes).map(({ node, index }) => [node.instance, index]);
  assert.deepEqual(sorted, [["endless", 4], ["late", 2], ["new", 5], ["near", 6], ["a", 3], ["b", 0], ["idle", 1]]);
});

test("a row has the response time as a part of the deadline", () => {
  const [row] = rows([node("a", "met", 52.5, 100)]);
  assert.equal(row.part, 0.525);
  const [unknown] = rows([node("a", "not-analysed", null, 100)]);
  assert.deepEqual([unknown.part, unknown.status], [Infinity, "unknown"]);
});

test("the summary names missed deadlines, then unknown ones, then the least slack as a part of the deadline", () => {
  const met = [node("a", "met", 9, 10), node("b", "met", 997, 1000)];
  assert.deepEqual(summary(rows(met)), [
    { status: "met", text: "All 2 deadlines are met" },
    { status: "tight", text: "least slack: b, ! 997 / 1000 ms" },
  ]);
  const missed = summary(rows([...met, node("c", "missed", 101, 100), node("d", "not-analysed", null, 1)]));
  assert.deepEqual(missed, [
    { status: "missed", text: "1 deadline missed: c" },
    { status: "unknown", text: "1 not analysed: d" },
  ]);
  assert.equal(summary(rows([]))[0].status, "none");
});

test("numbers and CPUs", () => {
  assert.equal(number(0.1 + 0.2), "0.3");
  assert.equal(number(null), "–");
  assert.deepEqual([cpus(1, "eyes"), cpus(3, null)], ["CPU 1 of eyes", "CPUs 1 and 2"]);
  assert.deepEqual([cpus(1), cpus(3), cpus(7), cpus(0), cpus(null), cpus(2 ** 40)], ["CPU 1", "CPUs 1 and 2", "CPUs 1, 2 and 3", "–", "–", "CPU 41"]);
});

test("repeated periods of a trace are one step", () => {
  assert.deepEqual(steps([5, 5, 2], [0, 0, 7, 0, 0, 3]), [
    { edge: 5, count: 2, time: 6, total: 6 },
    { edge: 2, count: 1, time: 7, total: 13 },
  ]);
  assert.deepEqual(steps([], []), []);
});
