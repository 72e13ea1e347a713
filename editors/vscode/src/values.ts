/** The values in a text: one on each line, or after a comma. A comma inside a value, as in `imu.cpus=1,2`, ends none. */
export function valuesOf(text: string): string[] {
  const values = text.split(/[\n;]|,(?=[^,\n;]*=)/).map((it) => it.trim().replace(/,$/, ""));
  return values.filter((it) => it !== "");
}
