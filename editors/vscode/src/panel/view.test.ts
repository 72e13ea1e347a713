import assert from "node:assert";
import test from "node:test";
import { clamped, initial, neighbour, revealed, whole, zoomed } from "./view";

const window = { width: 700, height: 400 };

test("a drawing is seen as a whole if it is readable then, otherwise its top left", () => {
  assert.deepEqual(initial({ x: 10, y: 20, width: 1000, height: 200 }, window).scale, 0.7);
  assert.deepEqual(initial({ x: 10, y: 20, width: 2400, height: 600 }, window), { x: 10, y: 20, scale: 0.75 });
  // A small one is not enlarged, and is in the middle.
  assert.deepEqual(initial({ x: 0, y: 0, width: 100, height: 100 }, window), { x: -300, y: -150, scale: 1 });
  assert.equal(whole({ x: 0, y: 0, width: 2800, height: 100 }, window).scale, 0.25);
});

test("what is wrong is in sight from the start", () => {
  const bounds = { x: 0, y: 0, width: 2400, height: 600 };
  const one = { x: 2000, y: 500, width: 150, height: 60 };
  const { x, y, scale } = initial(bounds, window, [one]);
  assert.ok(scale === 0.75 && x <= one.x && x + window.width / scale >= one.x + one.width, `${x}`);
  assert.ok(y <= one.y && y + window.height / scale >= one.y + one.height, `${y}`);
  assert.deepEqual(initial(bounds, window, [one, { ...one, x: 0 }]), whole(bounds, window));
});

test("a zoom keeps the point under the pointer", () => {
  const before = { x: 50, y: 10, scale: 0.5 };
  const after = zoomed(before, 2, { x: 100, y: 40 });
  assert.equal(after.scale, 1);
  assert.equal(before.x + 100 / before.scale, after.x + 100 / after.scale);
  assert.equal(before.y + 40 / before.scale, after.y + 40 / after.scale);
  assert.equal(zoomed(before, 1000, { x: 0, y: 0 }).scale, 4);
});

test("a drawing cannot be moved out of sight", () => {
  const bounds = { x: 0, y: 0, width: 1000, height: 500 };
  assert.deepEqual(clamped({ x: 5000, y: -5000, scale: 1 }, bounds, window), { x: 940, y: -340, scale: 1 });
  assert.deepEqual(clamped({ x: 10, y: 20, scale: 1 }, bounds, window), { x: 10, y: 20, scale: 1 });
});

test("an element is brought into sight with as little movement as possible", () => {
  const place = { x: 0, y: 0, scale: 1 };
  const size = { width: 100, height: 50 };
  assert.deepEqual(revealed(place, { x: 50, y: 50, ...size }, window), place);
  assert.deepEqual(revealed(place, { x: 650, y: 50, ...size }, window), { x: 62, y: 0, scale: 1 });
  assert.deepEqual(revealed(place, { x: 50, y: -100, ...size }, window), { x: 0, y: -112, scale: 1 });
});

test("arrow keys lead to the nearest element in their direction", () => {
  const area = (x: number, y: number) => ({ x, y, width: 10, height: 10 });
  const others = [area(100, 0), area(200, 0), area(0, 100), area(90, 90)];
  assert.equal(neighbour(area(0, 0), others, "right"), 0);
  assert.equal(neighbour(area(0, 0), others, "down"), 2);
  assert.equal(neighbour(area(0, 0), others, "left"), undefined);
  assert.equal(neighbour(area(200, 0), others, "left"), 0);
});
