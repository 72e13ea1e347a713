import assert from "node:assert";
import test from "node:test";
import { moved } from "./moved";

const at = (line: number, character: number) => ({ line, character });
const change = (start: [number, number], end: [number, number], text: string) => ({
  range: { start: at(...start), end: at(...end) },
  text,
});

test("a position stays where a change is behind it", () => {
  assert.deepStrictEqual(moved(at(3, 5), change([3, 6], [4, 0], "\n\n")), at(3, 5));
  assert.deepStrictEqual(moved(at(3, 5), change([3, 2], [3, 9], "")), at(3, 5));
});

test("a position moves with its line", () => {
  assert.deepStrictEqual(moved(at(3, 5), change([1, 0], [1, 0], "one\ntwo\n")), at(5, 5));
  assert.deepStrictEqual(moved(at(3, 5), change([0, 4], [2, 1], "")), at(1, 5));
});

test("a position moves with the text before it in its line", () => {
  assert.deepStrictEqual(moved(at(3, 5), change([3, 5], [3, 5], "ab")), at(3, 7));
  assert.deepStrictEqual(moved(at(3, 5), change([3, 1], [3, 4], "")), at(3, 2));
  assert.deepStrictEqual(moved(at(3, 5), change([3, 2], [3, 3], "x\nyz")), at(4, 4));
  assert.deepStrictEqual(moved(at(3, 5), change([2, 4], [3, 1], "")), at(2, 8));
});
