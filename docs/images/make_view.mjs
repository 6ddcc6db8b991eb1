#!/usr/bin/env node
// Makes the pictures of README.md and docs/view.md with Chromium, of the pages that scripts/demo leaves in demo/, and of
// a mesh of examples/:
//
//   scripts/demo && npm ci --prefix tests/node && deploy/install-deps.sh browser && docs/images/make_view.mjs
//
// The tool is build/release/bin/wellspace.

import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const root = fileURLToPath(new URL("../..", import.meta.url));
const { chromium } = createRequire(join(root, "tests/node/package.json"))("playwright-core");
const folder = mkdtempSync(join(tmpdir(), "view-"));
const wellspace = (...words) => execFileSync(join(root, "build/release/bin/wellspace"), words, { stdio: "inherit" });
const browser = await chromium.launch({
  executablePath: execFileSync("sh", ["-c", "command -v chromium"], { encoding: "utf8" }).trim(),
  args: ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", ...(process.getuid() === 0 ? ["--no-sandbox"] : [])],
});

const image = (name) => join(root, "docs/images", name);
const demo = (name) => join(root, "demo", `${name}.html`);

async function take(path, steps, height = 800) {
  const page = await browser.newPage({ viewport: { width: 1280, height }, reducedMotion: "reduce" });
  await page.goto(pathToFileURL(path).href);
  await page.waitForSelector("html[data-state=ready]");
  await steps(page);
  await page.waitForTimeout(500);
  return page;
}

/** The picture that the page saves, with its legend. */
async function save(page, name) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#save")]);
  await download.saveAs(image(name));
}

const part = await take(demo("bracket"), async (page) => {
  await page.selectOption("#colour", "angle");
  await page.check("#cut", { force: true });
  await page.locator("#offset").fill("650");
});
await save(part, "bracket.png");

const ocean = await take(demo("ocean"), async (page) => page.selectOption("#colour", "angle"), 600);
await save(ocean, "ocean.png");

const cut = await take(demo("spot"), async (page) => {
  await page.check("input[value=flat]", { force: true });
  await page.selectOption("#colour", "size");
  await page.evaluate(() => document.activeElement.blur());
});
await cut.screenshot({ path: image("view-cut.png") });

const land = join(folder, "land.npz");
wellspace("mesh", join(root, "examples/land-110m.geojson.gz"), "-o", land, "--quiet");
wellspace("view", land, "-o", `${land}.html`);
const map = await take(`${land}.html`, async (page) => {
  await page.mouse.move(505, 420);
  for (let i = 0; i < 4; ++i) await page.mouse.wheel(0, -180);
  await page.waitForTimeout(500);
  await page.mouse.click(560, 350);
  await page.mouse.move(480, 450);
});
await map.screenshot({ path: image("view-map.png") });

await browser.close();
rmSync(folder, { recursive: true });
