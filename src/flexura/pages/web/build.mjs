// Bundles src/main.ts, with its style sheets as text, into one ES module, and sets the licences of the packages in it
// beside it: node build.mjs [OUT]
import { readFile, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { build } from "esbuild";

const out = process.argv[2] ?? "dist/flexura.js";

const { metafile } = await build({
  entryPoints: ["src/main.ts"],
  outfile: out,
  bundle: true,
  minify: true,
  format: "esm",
  target: ["es2022", "chrome103", "firefox113", "safari16.4"],
  charset: "ascii",
  loader: { ".css": "text" },
  legalComments: "eof",
  logLevel: "warning",
  metafile: true,
});

const found = Object.keys(metafile.inputs).map((path) => path.match(/^node_modules\/((?:@[^/]+\/)?[^/]+)/)?.[1]);
const packages = [...new Set(found.filter((name) => name !== undefined))].sort();
const texts = packages.map(async (name) => {
  const { version } = JSON.parse(await readFile(join("node_modules", name, "package.json"), "utf8"));
  return `${name} ${version}\n\n${await readFile(join("node_modules", name, "LICENSE"), "utf8")}`;
});
const intro = "flexura.js contains these packages, each under its own licence.\n\n";
await writeFile(join(dirname(out), "THIRD-PARTY.txt"), intro + (await Promise.all(texts)).join("\n\n"));
