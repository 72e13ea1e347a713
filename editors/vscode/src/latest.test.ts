import assert from "node:assert";
import test from "node:test";
import { Latest } from "./latest";

/** A task whose runs end when the test says so. */
function controlled() {
  const ends: (() => void)[] = [];
  const outdated: boolean[] = [];
  const latest = new Latest(async (isOutdated) => {
    await new Promise<void>((resolve) => ends.push(resolve));
    outdated.push(isOutdated());
  });
  const end = async () => {
    ends.at(-1)!();
    await new Promise((resolve) => setImmediate(resolve));
  };
  return { latest, ends, outdated, end };
}

test("requests during a run are one more run", async () => {
  const { latest, ends, outdated, end } = controlled();
  void latest.request();
  for (let request = 0; request < 10; request++) {
    void latest.request();
  }
  assert.equal(ends.length, 1);
  await end();
  assert.equal(ends.length, 2);
  await end();
  assert.equal(ends.length, 2);
  assert.deepEqual(outdated, [true, false]);
  void latest.request();
  assert.equal(ends.length, 3);
});

test("an abandoned run holds up no other", async () => {
  const { latest, ends, outdated, end } = controlled();
  void latest.request();
  latest.abandon();
  void latest.request();
  assert.equal(ends.length, 2);
  ends[0]();
  await end();
  assert.deepEqual(outdated, [true, false]);
});
