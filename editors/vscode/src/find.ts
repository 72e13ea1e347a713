import { accessSync, constants, realpathSync, statSync } from "node:fs";
import { homedir } from "node:os";
import * as path from "node:path";

/** Where a server may be. */
export interface Places {
  /** `mauve.server.path`; empty when not set. A relative one is relative to the first folder of the workspace. */
  setting: string;
  /** The folders of the workspace. */
  folders: string[];
  /** Does the user trust whoever wrote what is in them? */
  isTrusted: boolean;
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
 *
 * A workspace may have come from a stranger, with a program of that name in it. A relative folder on PATH, such as `.` or
 * `node_modules/.bin`, would be one in there, and does not count; nor does any program in a workspace that is not trusted.
 */
export function findServer(places: Places): Found {
  const name = places.platform === "win32" ? "mauve.exe" : "mauve";
  const isStrange = (file: string) => !places.isTrusted && places.folders.some((folder) => isInside(file, folder));
  if (places.setting !== "") {
    const setting = places.setting.replace(/^~(?=[/\\])/, homedir());
    const set = path.resolve(places.folders[0] ?? "", setting);
    // Who sets a whole path knows where it leads.
    const isRefused = !path.isAbsolute(setting) && isStrange(set);
    if (isProgram(set) && !isRefused) {
      return { path: set };
    }
    const what = !exists(set)
      ? `there is no file ${set}`
      : isRefused
        ? `${set} is in a workspace that is not trusted`
        : `${set} is not a program`;
    return {
      problem: `The MAUVE server was not found: the setting mauve.server.path is "${places.setting}", but ${what}. Correct it, or clear it to use the server in the extension or on PATH.`,
      lookedFor: [set],
    };
  }
  const bundled = path.join(places.extension, "server", name);
  const onPath = places.PATH.split(path.delimiter)
    .filter((folder) => path.isAbsolute(folder))
    .map((folder) => path.join(folder, name))
    .filter((file) => !isStrange(file));
  const server = [bundled, ...onPath].find(isProgram);
  if (server !== undefined) {
    return { path: server };
  }
  return {
    problem: `The MAUVE server was not found: ${name} is neither in the extension (${bundled}) nor on PATH. Install it (in MAUVE's sources: cargo install --locked --path server) and restart VS Code, or set its path in mauve.server.path.`,
    lookedFor: [bundled, ...onPath],
  };
}

/** Is a file in a folder, or behind links to there? */
function isInside(file: string, folder: string): boolean {
  const isBelow = (file: string, folder: string) => {
    const way = path.relative(folder, file);
    return way !== ".." && !way.startsWith(`..${path.sep}`) && !path.isAbsolute(way);
  };
  return isBelow(file, folder) || isBelow(behindLinks(file), behindLinks(folder));
}

/** Where a file is behind all links, be it there or not. */
export function behindLinks(file: string): string {
  try {
    return realpathSync(file);
  } catch {
    const folder = path.dirname(file);
    return folder === file ? file : path.join(behindLinks(folder), path.basename(file));
  }
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
