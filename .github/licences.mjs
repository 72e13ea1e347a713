// licences.mjs FILE: writes the licences of all packages that are linked into the program, from their sources.
import { execFileSync } from "node:child_process";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import * as path from "node:path";

const target = "x86_64-unknown-linux-gnu";
const cargo = (...options) => execFileSync("cargo", options, { encoding: "utf8", maxBuffer: 1 << 28 });
const { packages } = JSON.parse(cargo("metadata", "--format-version=1", "--locked", `--filter-platform=${target}`));
const linked = cargo("tree", "--package=mauve", "--edges=normal", `--target=${target}`, "--prefix=none", "--format={p}", "--locked");
const names = new Set(linked.split("\n").map((line) => line.replace(/ \(.*/, "").replace(" v", "@")));
const texts = packages
  .filter(({ name, version, source }) => source !== null && names.has(`${name}@${version}`))
  .sort((a, b) => (a.name < b.name ? -1 : 1))
  .map(({ name, version, license, manifest_path: manifest }) => {
    const folder = path.dirname(manifest);
    const files = readdirSync(folder).filter((file) => /^(licen[cs]e|copying|copyright|notice)/i.test(file));
    const all = files.sort().map((file) => {
      try {
        return readFileSync(path.join(folder, file), "utf8");
      } catch {
        return ""; // A folder of licences.
      }
    });
    return `${name} ${version}: ${license}\n\n${all.join("\n")}`;
  });
if (texts.length === 0) {
  throw new Error("no package is linked into the program");
}
const libc = `The program is linked with the GNU C Library, which is under the GNU Lesser General Public License, version 2.1 or later. The
sources of MAUVE, from which the program can be linked with another version of it, have the same version number.
`;
writeFileSync(process.argv[2], [libc, ...texts].join("\n----------------------------------------\n\n"));
