import assert from "node:assert";
import test from "node:test";
import type { Graph, Machine } from "./answers";
import { litAt, placesOf } from "./lit";

const at = (uri: string, line: number) => ({
  uri,
  range: { start: { line, character: 2 }, end: { line, character: 8 } },
});

test("an instance is lit at its activity and at its declaration", () => {
  const nodes = [
    { activity: at("d", 4), location: at("a", 1) },
    { activity: null, location: at("a", 2) },
  ];
  const places = placesOf({ nodes, edges: [{ location: at("a", 7) }] } as Graph);
  assert.deepEqual(litAt(places, "d", 4), ["instance:0"]);
  assert.deepEqual(litAt(places, "a", 1), ["instance:0"]);
  assert.deepEqual(litAt(places, "a", 2), ["instance:1"]);
  assert.deepEqual(litAt(places, "a", 7), ["edge:0"]);
  assert.deepEqual(litAt(places, "a", 4), []);
  assert.deepEqual(litAt(places, "other", 4), []);
});

test("a state is lit down to the next one, a transition on its line", () => {
  const states = [{ location: at("c", 3) }, { location: at("c", 10) }];
  const edges = [
    { source: 0, location: at("c", 5) },
    { source: 1, location: null },
  ];
  const places = placesOf({ states, edges } as Machine);
  assert.deepEqual(litAt(places, "c", 2), []);
  assert.deepEqual(litAt(places, "c", 4), ["state:0"]);
  assert.deepEqual(litAt(places, "c", 5), ["edge:0"]);
  assert.deepEqual(litAt(places, "c", 6), ["state:0"]);
  assert.deepEqual(litAt(places, "c", 12), ["state:1"]);
  // The edge without a transition is declared with its state.
  assert.deepEqual(litAt(places, "c", 10), ["state:1", "edge:1"]);
});
