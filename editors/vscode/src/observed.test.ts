import assert from "node:assert";
import test from "node:test";
import type { GraphNode } from "./answers";
import { bodyOf, Periods } from "./observed";

const node = (instance: string, response: number | null): GraphNode => ({
  ...{ instance, component: "C", host: null, load: 0.1, affinity: 1, priority: 2, period: 100, deadline: 100, response },
  ...{ figure: `✓ ${response} / 100 ms`, status: "met", reasons: [], location: null, activity: null },
});

test("a file of periods is read while it grows", () => {
  const periods = new Periods();
  periods.add("instance,release_ns,begin_ns,end_ns\na,1000000,2000000,6000000\na,1");
  assert.deepEqual([...periods.observed], [["a", { periods: 1, response: 5 }]]);
  periods.add("1000000,0,12000000\nb,0,0,\nbroken\n");
  assert.deepEqual(periods.observed.get("a"), { periods: 2, response: 5 });
});

test("a response time above its bound is marked, and names are escaped", () => {
  const observed = new Map([["<b>", { periods: 3, response: 54 }], ["fine", { periods: 3, response: 40 }]]);
  const body = bodyOf("Run", [node("<b>", 53), node("fine", 53), node("none", 53)], observed, ["a < b"]);
  assert.ok(!body.includes("<b>") && body.includes("&#60;b&#62;: observed 54 · bound 53 · deadline 100 ms"));
  assert.equal(body.match(/class="missed"/g)?.length, 1);
  assert.ok(body.includes("none: not observed") && body.includes("a &#60; b"));
});
