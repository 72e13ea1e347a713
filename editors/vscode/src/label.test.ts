import assert from "node:assert/strict";
import { test } from "node:test";
import { Figure, text, worst } from "./label";

const figure = (status: Figure["data"]["status"], labels: string[], load?: number): Figure => ({
  position: { line: 0, character: 0 },
  label: labels[0],
  data: { status, labels, load },
});
const met = figure("met", ["✓ 53 / 100 ms", "✓ 53 / 100", "✓ 53", "✓"]);
const deployment = [
  figure("met", ["9 of 9 met at 1e-4", "9 of 9 met", "9/9"]),
  figure("tight", ["CPU 1 nearly full (99.7 %)", "CPU 1 99.7 %"], 100),
  { ...figure("met", [], 79), label: "CPU 2 78.9 %", data: { status: "met" as const, load: 79 } },
];

test("the first text that fits is drawn", () => {
  assert.equal(text([met], 13), "✓ 53 / 100 ms");
  assert.equal(text([met], 12), "✓ 53 / 100");
  assert.equal(text([met], 9), "✓ 53");
  assert.equal(text([met], 3), "✓");
  assert.equal(text([met], -40), "✓");
});

test("figures that share a line", () => {
  const bars = "9 of 9 met at 1e-4 · CPU 1 nearly full (99.7 %) ████▉ · CPU 2 78.9 % ███▌░";
  assert.equal(text(deployment, bars.length), bars);
  const all = bars.replace(/ [█▉▌░]+/g, "");
  assert.equal(text(deployment, bars.length - 1), all);
  const shorter = "9 of 9 met · CPU 1 99.7 % · CPU 2 78.9 %";
  assert.equal(text(deployment, all.length - 1), shorter);
  assert.equal(text(deployment, shorter.length - 1), "9/9 · CPU 1 99.7 % · CPU 2 78.9 %");
  assert.equal(text(deployment, 25), "9 of 9 met · CPU 1 99.7 %");
  assert.equal(text(deployment, 18), "9/9 · CPU 1 99.7 %");
  assert.equal(text(deployment, 17), "9 of 9 met");
  assert.equal(text(deployment, 10), "9 of 9 met");
  assert.equal(text(deployment, 0), "9/9");
  assert.equal(worst(deployment), "tight");
});

test("the last per cents differ", () => {
  const of = (load: number) => text([figure("met", ["CPU 1"], load)], 99);
  assert.deepEqual([0, 45, 90, 94, 100, 101].map(of), ["CPU 1 ░░░░░", "CPU 1 ██░░░", "CPU 1 ████░", "CPU 1 ████▍", "CPU 1 ████▉", "CPU 1 █████"]);
});

test("figures without an answer of the server are marked", () => {
  assert.equal(text([met], 13, true), "… 53 / 100 ms");
  assert.equal(text([met], 4, true), "… 53");
  assert.equal(text([met], 0, true), "…");
  const older = figure("older", ["… 53 / 100 ms", "…"]);
  assert.equal(text([older], 40, true), "… 53 / 100 ms");
  assert.equal(text([figure("unknown", ["? no time for astar"])], 40, true), "… no time for astar");
  assert.equal(text(deployment, 40, true), "… 9 of 9 met · … CPU 1 99.7 %");
  assert.equal(text(deployment, 18, true), "… 9 of 9 met");
  assert.equal(text(deployment, 4, true), "…");
});
