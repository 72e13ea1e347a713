import assert from "node:assert/strict";
import { test } from "node:test";
import { Figure, text, worst } from "./label";

const figure = (status: Figure["data"]["status"], labels: string[], load?: number): Figure => ({
  position: { line: 0, character: 0 },
  label: labels[0],
  data: { status, labels, load },
});
const slack = figure("met", ["47 ms slack · 53 ms", "47 ms slack", "+47 ms"]);
const deployment = [
  figure("met", ["9 of 9 met at 1e-4", "9 of 9 met", "9/9"]),
  figure("tight", ["CPU 1 nearly full (99.7 %)", "CPU 1 99.7 %"], 100),
  { ...figure("met", [], 79), label: "CPU 2 78.9 %", data: { status: "met" as const, load: 79 } },
];

test("the first text that fits is drawn", () => {
  assert.equal(text([slack], 19), "47 ms slack · 53 ms");
  assert.equal(text([slack], 18), "47 ms slack");
  assert.equal(text([slack], 6), "+47 ms");
  assert.equal(text([slack], -40), "+47 ms");
});

test("figures that share a line", () => {
  const bars = "9 of 9 met at 1e-4 · CPU 1 nearly full (99.7 %) ━━━━━ · CPU 2 78.9 % ━━━━┄";
  assert.equal(text(deployment, bars.length), bars);
  const all = bars.replace(/ [━┄]+/g, "");
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

test("figures without an answer of the server are marked", () => {
  assert.equal(text([slack], 27, true), "47 ms slack · 53 ms earlier");
  assert.equal(text([slack], 26, true), "47 ms slack earlier");
  assert.equal(text([slack], 14, true), "+47 ms earlier");
  assert.equal(text([slack], 7, true), "earlier");
  assert.equal(text([slack], 0, true), "…");
  assert.equal(text([slack], 100, true), "47 ms slack · 53 ms earlier");
  const older = figure("older", ["53 ms before this edit", "53 ms earlier"]);
  assert.equal(text([older], 40, true), "53 ms before this edit");
  assert.equal(text(deployment, 40, true), "9 of 9 met at 1e-4 earlier");
  assert.equal(text(deployment, 18, true), "9 of 9 met earlier");
  assert.equal(text(deployment, 8, true), "earlier");
});
