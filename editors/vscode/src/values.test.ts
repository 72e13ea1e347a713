import assert from "node:assert/strict";
import test from "node:test";
import { valuesOf } from "./values";

test("values stand on lines, or after commas", () => {
  assert.deepEqual(valuesOf("imu.period=5, nav.plan = 12ms\n\nimu.cpus=1,2,\neye.cpus=[1, 2], a.b=1"), [
    "imu.period=5",
    "nav.plan = 12ms",
    "imu.cpus=1,2",
    "eye.cpus=[1, 2]",
    "a.b=1",
  ]);
  assert.deepEqual(valuesOf(" ,\n"), []);
  // Half-typed.
  assert.deepEqual(valuesOf("imu.period"), ["imu.period"]);
});
