// Makes page.html of page.html.in, src/ and three.js. The same bits wherever it runs, by package-lock.json.
//
//   node build.mjs           writes page.html
//   node build.mjs --check   compares it with the one that is there; exit code 1 if they differ

import { build, transform } from "esbuild";
import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";

const here = fileURLToPath(new URL(".", import.meta.url));
const read = (name) => readFileSync(here + name, "utf8");
const sourceOf = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;

const bundle = await build({
  absWorkingDir: here,
  entryPoints: ["src/main.ts"],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "ascii",
  legalComments: "none", // The notice of the page has them.
  write: false,
});
const style = await transform(read("src/style.css"), { loader: "css", minify: true, charset: "ascii" });
// What would end the element, or begin a comment in it, is only in strings.
const script = bundle.outputFiles[0].text.trim().replace(/<\/(script)/gi, "<\\/$1").replace(/<!--/g, "<\\!--");
const css = style.code.trim();
const policy = [
  "default-src 'none'",
  `script-src ${sourceOf(script)}`,
  `style-src ${sourceOf(css)}`,
  "base-uri 'none'",
  "form-action 'none'",
].join("; ");
const { devDependencies } = JSON.parse(read("package.json"));
const notice = `This page contains three.js ${devDependencies.three}, under this licence:

${read("node_modules/three/LICENSE").trim()}`;
const values = { POLICY: policy, NOTICE: notice, STYLE: css, SCRIPT: script };
const page = read("page.html.in").replace(/@([A-Z]+)@/g, (_, name) => values[name]);

if (process.argv.includes("--check")) {
  if (read("page.html") !== page) {
    console.error("client/viewer/page.html is not what its sources make; run: npm run build --prefix client/viewer");
    process.exit(1);
  }
  console.log("client/viewer/page.html is what its sources make");
} else {
  writeFileSync(here + "page.html", page);
  console.log(`page.html: ${Math.round(page.length / 1000)} kB`);
}
