// Makes the pages of the viewer and of the console, each of its page.html.in and src/, with three.js. The same bits
// wherever it runs, by package-lock.json.
//
//   node build.mjs           writes each page.html
//   node build.mjs --check   compares each with the one that is there; exit code 1 if one differs

import { build, transform } from "esbuild";
import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";

const here = fileURLToPath(new URL(".", import.meta.url));
const read = (name) => readFileSync(here + name, "utf8");
const sourceOf = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;

// Folders, and the permissions of their pages beside running their own script and style.
const pages = [
  { folder: "", allowed: [] },
  { folder: "../console/", allowed: ["connect-src 'self'", "frame-src 'self'"] },
];

const { devDependencies } = JSON.parse(read("package.json"));
const notice = `This page contains three.js ${devDependencies.three}, under this licence:

${read("node_modules/three/LICENSE").trim()}`;

async function pageOf({ folder, allowed }) {
  const bundle = await build({
    absWorkingDir: here,
    entryPoints: [`${folder}src/main.ts`],
    bundle: true,
    minify: true,
    format: "iife",
    target: "es2022",
    charset: "ascii",
    legalComments: "none", // The notice of the page has them.
    write: false,
  });
  const style = await transform(read(`${folder}src/style.css`), { loader: "css", minify: true, charset: "ascii" });
  // Text that would end the element, or begin a comment in it, is only in strings.
  const script = bundle.outputFiles[0].text.trim().replace(/<\/(script)/gi, "<\\/$1").replace(/<!--/g, "<\\!--");
  const css = style.code.trim();
  const policy = [
    "default-src 'none'",
    `script-src ${sourceOf(script)}`,
    `style-src ${sourceOf(css)}`,
    ...allowed,
    "base-uri 'none'",
    "form-action 'none'",
  ].join("; ");
  const values = { POLICY: policy, NOTICE: notice, STYLE: css, SCRIPT: script };
  return read(`${folder}page.html.in`).replace(/@([A-Z]+)@/g, (_, name) => values[name]);
}

for (const one of pages) {
  const name = `${one.folder}page.html`;
  const page = await pageOf(one);
  if (!process.argv.includes("--check")) {
    writeFileSync(here + name, page);
    console.log(`${name}: ${Math.round(page.length / 1000)} kB`);
  } else if (read(name) !== page) {
    console.error(`client/viewer/${name} is not what its sources make; run: npm run build --prefix client/viewer`);
    process.exitCode = 1;
  } else {
    console.log(`client/viewer/${name} is what its sources make`);
  }
}
