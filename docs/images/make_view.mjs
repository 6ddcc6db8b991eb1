#!/usr/bin/env node
// Makes the pictures of docs/view.md with Chromium, of meshes of examples/:
//
//   npm ci --prefix tests/node && deploy/install-deps.sh browser && docs/images/make_view.mjs
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

async function take(input, name, up, steps) {
  const mesh = join(folder, `${name}.npz`);
  wellspace("mesh", join(root, "examples", input), "-o", mesh, "--quiet");
  wellspace("view", mesh, "-o", `${mesh}.html`, "--up", up);
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, reducedMotion: "reduce" });
  await page.goto(pathToFileURL(`${mesh}.html`).href);
  await page.waitForSelector("html[data-state=ready]");
  await steps(page);
  await page.waitForTimeout(500);
  return page;
}

const cut = await take("spot.csv", "spot", "y", async (page) => {
  await page.check("input[value=flat]", { force: true });
  await page.selectOption("#colour", "size");
  await page.evaluate(() => document.activeElement.blur());
});
await cut.screenshot({ path: join(root, "docs/images/view-cut.png") });

const map = await take("land-110m.geojson.gz", "land", "z", async (page) => {
  await page.mouse.move(505, 420);
  for (let i = 0; i < 4; ++i) await page.mouse.wheel(0, -180);
  await page.waitForTimeout(500);
  await page.mouse.click(560, 350);
  await page.mouse.move(480, 450);
});
await map.screenshot({ path: join(root, "docs/images/view-map.png") });

await browser.close();
rmSync(folder, { recursive: true });
