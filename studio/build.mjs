// Build the front end into src/strapdown/studio/static: no names of this machine, no dates, the
// same bytes for the same sources and versions. `--out FOLDER` builds elsewhere, to compare.

import { createHash } from "node:crypto";
import { copyFileSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const given = process.argv.indexOf("--out");
const out = given > 0 ? process.argv[given + 1] : join(here, "../src/strapdown/studio/static");

const sources = [...readdirSync(join(here, "src")).map((name) => `src/${name}`), "build.mjs", "package.json", "package-lock.json", "tsconfig.json"].sort();
const digest = createHash("sha256");
for (const name of sources) {
  digest.update(name + "\n");
  digest.update(readFileSync(join(here, name)));
  digest.update("\n");
}

rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
await build({
  absWorkingDir: here,
  entryPoints: { app: "src/main.tsx", map: "src/map.ts", "map-worker": "node_modules/maplibre-gl/dist/maplibre-gl-worker.mjs" },
  outdir: out, bundle: true, minify: true, format: "esm", target: "es2022", charset: "utf8", legalComments: "none",
  logLevel: "warning",
});
for (const name of ["index.html", "icon.svg"]) copyFileSync(join(here, "src", name), join(out, name));

// One package states its license in its README alone.
const PLAIN = {
  "murmurhash-js": mit("Copyright (c) 2011 Gary Court"),
};

writeFileSync(join(out, "LICENSES.txt"), shipped().map(licenseOf).join(`\n${"-".repeat(78)}\n\n`));
writeFileSync(join(out, "build.json"), JSON.stringify({ sources: digest.digest("hex"), files: sources }, null, 1) + "\n");

/** All that is installed but for the tools and for types: MapLibre brings its own in its file. */
function shipped() {
  const { packages } = JSON.parse(readFileSync(join(here, "package-lock.json"), "utf8"));
  return Object.keys(packages).filter((path) => path && !packages[path].dev).map((path) => path.replace("node_modules/", "")).filter((name) => !name.startsWith("@types/")).sort();
}

function licenseOf(name) {
  const folder = join(here, "node_modules", name);
  const about = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const file = readdirSync(folder).find((one) => /^licen[cs]e/i.test(one));
  const text = file ? readFileSync(join(folder, file), "utf8") : PLAIN[name] ?? missing(name);
  return `${name} ${about.version} (${typeof about.license === "string" ? about.license : JSON.stringify(about.license)})\n\n${text.trim()}\n`;
}

function mit(copyright) {
  const text = readFileSync(join(here, "node_modules/preact/LICENSE"), "utf8");
  return text.replace(/^Copyright.*$/m, copyright);
}

function missing(name) {
  throw new Error(`${name} has no license file: write its text into build.mjs`);
}
