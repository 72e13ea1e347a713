/**
 * `.mal` is also the extension of the Meta Attack Language, which describes how computer systems are attacked. Its files
 * hold `#id: "…"` and `#version: "…"`, `category Name { … }` and `associations { … }`, and, as in MAUVE, `include "…"`
 * and comments. So the first thing that is neither tells.
 */

/** The languages of a project: models, tables and `mauve.toml`, and what an executor of ROS 2 reads. */
export const languages = ["mauve", "toml", "yaml"];

/** Whose language a `.mal` text is in, or `undefined` where it does not say, as while it is empty. */
export function languageOf(text: string): "mauve" | "mal" | undefined {
  const rest = text.replace(/^\uFEFF?(?:\s+|\/\/.*|\/\*[^]*?\*\/|include\s*"[^"\n]*")*/, "");
  if (/^(?:#\w+\s*:|category\s+\w+|associations\s*\{)/.test(rest)) {
    return "mal";
  }
  if (/^(?:library|use|codel|shell|core|component|architecture|deployment)\s+\w/.test(rest)) {
    return "mauve";
  }
  return undefined;
}
