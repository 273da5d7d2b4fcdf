// Bundles src/main.ts, with its style sheets as text, into one ES module: node build.mjs [OUT]
import { build } from "esbuild";

await build({
  entryPoints: ["src/main.ts"],
  outfile: process.argv[2] ?? "dist/flexura.js",
  bundle: true,
  minify: true,
  format: "esm",
  target: ["es2022", "chrome103", "firefox113", "safari16.4"],
  charset: "ascii",
  loader: { ".css": "text" },
  legalComments: "eof",
  logLevel: "warning",
});
