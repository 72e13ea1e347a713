import { accessSync, constants, statSync } from "node:fs";
import { homedir } from "node:os";
import * as path from "node:path";

/** Where a server may be. */
export interface Places {
  /** `mauve.server.path`; empty when not set. A relative one is relative to `folder`. */
  setting: string;
  /** The first folder of the workspace. */
  folder: string;
  /** Where the extension is installed; a package for one target holds a server. */
  extension: string;
  /** The search path of the environment. */
  PATH: string;
  platform: NodeJS.Platform;
}

/** A server, or why there is none, said to the user. */
export type Found = { path: string } | { problem: string; lookedFor: string[] };

/**
 * The setting, the server inside the extension, the first `mauve` on PATH. Who sets a path means that path: there is no
 * falling back to another server, which would answer in the wrong one's place.
 */
export function findServer(places: Places): Found {
  const name = places.platform === "win32" ? "mauve.exe" : "mauve";
  if (places.setting !== "") {
    const set = path.resolve(places.folder, places.setting.replace(/^~(?=[/\\])/, homedir()));
    if (isProgram(set)) {
      return { path: set };
    }
    const what = exists(set) ? `${set} is not a program` : `there is no file ${set}`;
    return {
      problem: `The MAUVE server was not found: the setting mauve.server.path is "${places.setting}", but ${what}. Correct it, or clear it to use the server that comes with the extension or is on PATH.`,
      lookedFor: [set],
    };
  }
  const bundled = path.join(places.extension, "server", name);
  const onPath = places.PATH.split(path.delimiter)
    .filter((folder) => folder !== "")
    .map((folder) => path.join(folder, name));
  const server = [bundled, ...onPath].find(isProgram);
  if (server !== undefined) {
    return { path: server };
  }
  return {
    problem: `The MAUVE server was not found: there is no ${name} in the extension (${bundled}) or on PATH. Install it (in MAUVE's sources: cargo install --path server) and restart VS Code, or say where it is in the setting mauve.server.path.`,
    lookedFor: [bundled, ...onPath],
  };
}

function exists(file: string): boolean {
  return statSync(file, { throwIfNoEntry: false }) !== undefined;
}

function isProgram(file: string): boolean {
  try {
    accessSync(file, constants.X_OK);
    return statSync(file).isFile();
  } catch {
    return false;
  }
}
