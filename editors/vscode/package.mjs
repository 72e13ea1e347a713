// Makes a package of the extension for VS Code:
//   npm run package                                          for every platform, without a server
//   npm run package -- --target linux-x64 --server PATH      for one platform, with its server
// `--out FILE` says where it goes.
import { execFileSync } from "node:child_process";
import { chmodSync, copyFileSync, cpSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import * as path from "node:path";
import { parseArgs } from "node:util";

const here = import.meta.dirname;
const { values: options } = parseArgs({
  options: { target: { type: "string" }, server: { type: "string" }, out: { type: "string" } },
});
if ((options.target === undefined) !== (options.server === undefined)) {
  console.error("package: --target and --server go together: a server runs on one platform");
  process.exit(2);
}
// npm changes to the folder of package.json; paths are relative to where the user is.
const given = (file) => path.resolve(process.env.INIT_CWD ?? process.cwd(), file);

// The licences stand at the top of the repository; a package must hold them.
const licences = ["LICENSE-APACHE", "LICENSE-MIT"];
// Of the sample project, which the walkthrough shows and opens.
const pictures = ["architecture.svg", "schedule.svg"];
const server = path.join(here, "server");
const program = path.join(server, options.target?.startsWith("win32") ? "mauve.exe" : "mauve");
process.chdir(here);
try {
  licences.forEach((file) => copyFileSync(path.join(here, "../..", file), file));
  cpSync("../schemas", "schemas", { recursive: true });
  cpSync("../../tests/models/p3dx", "sample", { recursive: true });
  pictures.forEach((file) => copyFileSync(path.join("../../tests/pictures", file), path.join("media/walkthrough", file)));
  if (options.server !== undefined) {
    mkdirSync(server, { recursive: true });
    copyFileSync(given(options.server), program);
    chmodSync(program, 0o755);
  }
  execFileSync("npm", ["run", "--silent", "build"], { stdio: "inherit", shell: process.platform === "win32" });
  writeFileSync("out/third-party.txt", licencesOfOthers());

  const vsce = ["node_modules/@vscode/vsce/vsce", "package", "--no-dependencies", "--allow-missing-repository", "--skip-license"];
  if (options.target !== undefined) {
    vsce.push("--target", options.target);
  }
  if (options.out !== undefined) {
    vsce.push("--out", given(options.out));
  }
  execFileSync(process.execPath, vsce, { stdio: "inherit" });
} finally {
  licences.forEach((file) => rmSync(file, { force: true }));
  pictures.forEach((file) => rmSync(path.join("media/walkthrough", file), { force: true }));
  rmSync("schemas", { recursive: true, force: true });
  rmSync("sample", { recursive: true, force: true });
  rmSync(server, { recursive: true, force: true });
}

/** Of the packages that esbuild put into out/extension.js. */
function licencesOfOthers() {
  const { inputs } = JSON.parse(readFileSync("out/meta.json", "utf8"));
  const packages = new Set();
  for (const input of Object.keys(inputs)) {
    // The last one: a package may have packages of its own.
    const [folder] = /^.*node_modules\/(?:@[^/]+\/)?[^/]+/.exec(input) ?? [];
    if (folder !== undefined) {
      packages.add(folder);
    }
  }
  return [...packages].sort().map(licence).join("\n");
}

function licence(folder) {
  const { name, version } = JSON.parse(readFileSync(path.join(folder, "package.json"), "utf8"));
  const file = readdirSync(folder).find((name) => /^licen[cs]e/i.test(name));
  if (file === undefined) {
    throw new Error(`${folder} has no licence`);
  }
  return `${name} ${version}\n\n${readFileSync(path.join(folder, file), "utf8")}\n`;
}
