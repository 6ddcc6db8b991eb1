// The console in Chromium, as a user has it: files are dropped, work is watched and cancelled, meshes are looked at; a
// server that goes and comes back; hostile names; 400 pixels; the keyboard; axe-core. Wants the packages of tests/node
// and the programs of WELLSPACE_BIN_DIR.

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

const here = fileURLToPath(new URL(".", import.meta.url));
const require = createRequire(join(here, "../../node/package.json"));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const programs = process.env.WELLSPACE_BIN_DIR;
const environment = { ...process.env, BROWSER: "", DISPLAY: "", WAYLAND_DISPLAY: "", WELLSPACE_SERVER: "" };

/** Starts a program, and waits for the first match in what it prints. */
async function start(program, words, pattern) {
  const child = spawn(join(programs, program), words, { env: environment, stdio: ["ignore", "pipe", "pipe"] });
  let printed = "";
  const found = await new Promise((resolve, reject) => {
    const look = (part) => {
      printed += part;
      const match = pattern.exec(printed);
      if (match) resolve(match[0]);
    };
    child.stdout.on("data", look);
    child.stderr.on("data", look);
    child.on("exit", (code) => reject(new Error(`${program} ended with ${code}: ${printed}`)));
  });
  return { child, found };
}
const end = ({ child }, signal = "SIGTERM") =>
  new Promise((resolve) => {
    child.removeAllListeners("exit");
    child.on("exit", resolve);
    child.kill(signal);
  });
const startConsole = (...words) => start("wellspace", ["console", "--no-browser", ...words], /http:\S+/);

const browser = await chromium.launch({
  executablePath: execFileSync("sh", ["-c", "command -v chromium"], { encoding: "utf8" }).trim(),
  args: ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", ...(process.getuid() === 0 ? ["--no-sandbox"] : [])],
});
const folder = mkdtempSync(join(tmpdir(), "console-"));
test.after(async () => {
  await browser.close();
  rmSync(folder, { recursive: true });
});

/** Opens the page of a console, and runs `check` with it. What the page complains about is an error. */
async function open(url, check, options = {}, allowed = []) {
  const context = await browser.newContext({ viewport: { width: 1000, height: 800 }, ...options });
  const page = await context.newPage();
  const heard = [];
  page.on("console", (message) => message.type() === "error" && heard.push(message.text()));
  page.on("pageerror", (error) => heard.push(String(error)));
  page.on("dialog", (dialog) => heard.push(`dialog: ${dialog.message()}`));
  page.on("request", (request) => {
    if (!request.url().startsWith(url) && !request.url().startsWith("blob:")) heard.push(`request: ${request.url()}`);
  });
  page.setDefaultTimeout(60_000);
  await page.goto(url);
  await page.waitForSelector("html[data-state=ready]");
  await check(page);
  assert.deepEqual(heard.filter((text) => !allowed.some((one) => text.includes(one)) && !text.includes("GPU stall")), []);
  await context.close();
}

const card = (page, name) => page.locator("#sessions > li").filter({ has: page.getByRole("heading", { name, exact: true }) });
const ended = (page, name, state = "succeeded") => page.waitForSelector(`#sessions > li[data-state=${state}] >> text=${name}`);
const give = (page, name, text) =>
  page.setInputFiles("#file", { name, mimeType: "application/octet-stream", buffer: Buffer.from(text) });

/** Drops a file on the page, as a mouse does. */
const drop = (page, name, text) =>
  page.evaluate(
    ([fileName, content]) => {
      const data = new DataTransfer();
      data.items.add(new File([content], fileName));
      document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
    },
    [name, text],
  );

const lake = '{"type": "Polygon", "coordinates": [[[0,0],[4,0],[4,3],[1,2],[0,0]]]}';
const cloud = Array.from({ length: 60 }, (_, i) => [i % 5, (i * 7) % 11, (i * 3) % 13].join(",")).join("\n");

const corner = (i) => `vertex ${i & 1} ${(i >> 1) & 1} ${i >> 2}`;
const facet = (corners) => `facet normal 0 0 0\nouter loop\n${corners.map(corner).join("\n")}\nendloop\nendfacet\n`;
const sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
const part = `solid\n${sides.map(([a, b, c, d]) => facet([a, b, c]) + facet([a, c, d])).join("")}endsolid\n`;

/** A console with a server of its own, so that no test finds what another has left. */
async function openAlone(check, options = {}, allowed = []) {
  const local = await startConsole();
  try {
    await open(local.found, check, options, allowed);
  } finally {
    await end(local);
  }
}

test("files that are dropped become meshes, which are shown and downloaded", async () => {
  await openAlone(async (page) => {
    assert.ok(await page.isVisible("#none"));
    await drop(page, "lake.geojson", lake);
    await ended(page, "lake.geojson");
    await drop(page, "cloud.csv", cloud);
    await ended(page, "cloud.csv");
    await drop(page, "part.stl", part);
    await ended(page, "part.stl");
    assert.match(await card(page, "part.stl").locator(".facts").innerText(), /8 points · 12 triangles · \d+ vertices/);
    assert.match(await card(page, "lake.geojson").locator(".facts").innerText(), /4 points · 4 segments · \d+ vertices/);
    await card(page, "cloud.csv").getByRole("button", { name: "View" }).click();
    const frame = page.frameLocator("#frame");
    await frame.locator("html[data-state=ready]").waitFor();
    assert.equal(await frame.locator("#name").innerText(), "cloud.csv");
    // The histogram of its mesh, of which a bar selects.
    await frame.locator("#colour").selectOption("angle");
    const counts = await frame.locator(".bar").evaluateAll((bars) =>
      bars.map((bar) => Number(/: ([\d\s]+) elements/.exec(bar.getAttribute("aria-label"))[1].replace(/\s/g, ""))),
    );
    const elements = Number(/· ([\d\s]+) tetrahedra/.exec(await frame.locator("#summary").innerText())[1].replace(/\s/g, ""));
    assert.equal(counts.reduce((sum, one) => sum + one), elements);
    const fullest = counts.indexOf(Math.max(...counts));
    await frame.locator(".bar").nth(fullest).click();
    await frame.locator("#clear").waitFor();
    assert.match(await frame.locator("#selection-text").innerText(), new RegExp(`^${counts[fullest]} of`));
    await page.getByRole("button", { name: "Close" }).click();
    await page.waitForSelector("#frame:not([src])", { state: "attached" });
    await card(page, "lake.geojson").getByRole("button", { name: "Statistics" }).click();
    await page.waitForSelector("#statistics[open]");
    assert.match(await page.locator("#statistics-figures").innerText(), /min angle deg/);
    await page.keyboard.press("Escape");
    await card(page, "lake.geojson").locator("select").selectOption("msh41");
    const [download] = await Promise.all([
      page.waitForEvent("download"),
      card(page, "lake.geojson").getByRole("link", { name: "Download" }).click(),
    ]);
    assert.equal(download.suggestedFilename(), "mesh.msh");
    assert.match(readFileSync(await download.path(), "latin1"), /^\$MeshFormat/);
    // Formats of several files come as archives; such as cannot hold the mesh are not offered.
    const formats = (name) => card(page, name).locator("select option").allInnerTexts();
    assert.ok((await formats("lake.geojson")).includes("adcirc") && !(await formats("part.stl")).includes("adcirc"));
    for (const [format, members] of [
      ["node", ["mesh.ele", "mesh.face", "mesh.node"]],
      ["xdmf", ["mesh.h5", "mesh.xdmf", "mesh_boundary.h5", "mesh_boundary.xdmf"]],
    ]) {
      await card(page, "part.stl").locator("select").selectOption(format);
      const [archive] = await Promise.all([
        page.waitForEvent("download"),
        card(page, "part.stl").getByRole("link", { name: "Download" }).click(),
      ]);
      assert.equal(archive.suggestedFilename(), `mesh.${format}.zip`);
      const code = "import sys, zipfile; print('\\n'.join(sorted(zipfile.ZipFile(sys.argv[1]).namelist())))";
      const names = execFileSync("python3", ["-c", code, await archive.path()], { encoding: "utf8" });
      assert.deepEqual(names.split("\n").filter((name) => members.includes(name)), members, names);
    }
    for (const name of ["lake.geojson", "cloud.csv", "part.stl"]) await card(page, name).getByRole("button", { name: "Delete" }).click();
    await page.waitForSelector("#none:visible");
  });
});

test("work is watched and cancelled, by parameters of the form", async () => {
  await openAlone(async (page) => {
    await page.click("#options > summary");
    await page.fill("#field-max_circumradius", "0.0015");
    await give(page, "long.geojson", lake);
    const long = card(page, "long.geojson");
    await long.locator("progress:visible").waitFor();
    const before = await long.locator("progress").evaluate((bar) => bar.value);
    await page.waitForFunction((value) => document.querySelector("#sessions progress").value > value, before);
    // Rate and time left, and a curve that grows.
    const speed = /\d+ %, [\d\u2009]+ vertices, [\d\u2009]+\/s, [\d hmins]+ left/;
    await page.waitForFunction((source) => new RegExp(source).test(document.querySelector("#sessions .state").textContent), speed.source);
    assert.match(await long.locator(".growth").getAttribute("aria-label"), /^Vertices over \d+ s, up to [\d\u2009]+$/);
    const places = () => long.locator(".growth polyline").evaluate((line) => line.points.numberOfItems);
    const some = await places();
    assert.ok(some > 2, `${some}`);
    await page.waitForFunction((least) => document.querySelector(".growth polyline").points.numberOfItems > least, some);
    await long.getByRole("button", { name: "Cancel" }).click();
    await ended(page, "long.geojson", "cancelled");
    await page.fill("#field-max_circumradius", "0.5");
    await long.getByRole("button", { name: "Refine" }).click();
    await ended(page, "long.geojson");
    await long.getByRole("button", { name: "Delete" }).click();
    await page.waitForSelector("#none:visible");
  });
});

test("wrong files are told, and names are no markup", async () => {
  await openAlone(
    async (page) => {
      await give(page, "points.csv", "0,0\n1,x\n");
      await page.waitForSelector("#uploads .failed");
      assert.match(await page.locator("#uploads li").first().innerText(), /^points\.csv: points\.csv:2: /);
      const hostile = "<img src=x onerror=alert(1)>.csv";
      await give(page, hostile, cloud);
      await ended(page, hostile);
      assert.equal(await page.locator("#sessions img, #uploads img").count(), 0);
      await card(page, hostile).getByRole("button", { name: "View" }).click();
      await page.frameLocator("#frame").locator("html[data-state=ready]").waitFor();
      assert.equal(await page.frameLocator("#frame").locator("#name").innerText(), hostile);
      await page.getByRole("button", { name: "Close" }).click();
      await card(page, hostile).getByRole("button", { name: "Delete" }).click();
      await page.waitForSelector("#none:visible");
    },
    {},
    ["400 (Bad Request)"],
  );
});

test("two tenants over TLS see their own sessions alone", async () => {
  const file = (name) => join(folder, name);
  execFileSync("openssl", ["req", "-x509", "-days", "2", "-subj", "/CN=localhost", "-addext",
    "subjectAltName=IP:127.0.0.1,DNS:localhost", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes",
    "-keyout", file("key.pem"), "-out", file("cert.pem")], { stdio: "ignore" });
  const tenants = ["acme", "globex"];
  const hash = (text) => createHash("sha256").update(text).digest("hex");
  const tokenOf = (name) => `a-token-of-${name}-of-more-than-32-characters`;
  for (const name of [...tenants, "nobody"]) writeFileSync(file(`${name}.token`), tokenOf(name), { mode: 0o600 });
  writeFileSync(file("tokens"), tenants.map((name) => `${name} sha256:${hash(tokenOf(name))}\n`).join(""), { mode: 0o600 });
  const daemon = await start("wellspaced", ["--listen", "127.0.0.1:0", "--ephemeral", "--tls-cert", file("cert.pem"), "--tls-key",
    file("key.pem"), "--token-file", file("tokens")], /127\.0\.0\.1:\d+/);
  const consoleOf = (name) =>
    startConsole("--server", daemon.found, "--tls-ca", file("cert.pem"), "--token-file", file(`${name}.token`));
  const consoles = await Promise.all(tenants.map(consoleOf));
  await open(consoles[0].found, async (acme) => {
    await open(consoles[1].found, async (globex) => {
      await give(acme, "acme.csv", cloud);
      await ended(acme, "acme.csv");
      await give(globex, "globex.geojson", lake);
      await ended(globex, "globex.geojson");
      for (const [page, own, other] of [[acme, "acme.csv", consoles[1]], [globex, "globex.geojson", consoles[0]]]) {
        await page.reload();
        await page.waitForSelector("html[data-state=ready]");
        assert.deepEqual(await page.locator("#sessions h3").allInnerTexts(), [own]);
        // Nor by the name of the session that the other one's page has.
        const name = await (await fetch(`${other.found}api/sessions`)).json();
        const foreign = name.sessions[0].session.name;
        const statuses = await page.evaluate(
          async (session) => [
            (await fetch(`api/${session}/statistics`)).status,
            (await fetch(`${session}/view`)).status,
            (await fetch(`${session}/mesh?format=vtu`)).status,
            (await fetch(`api/${session}`, { method: "DELETE" })).status,
          ],
          foreign,
        );
        assert.deepEqual(statuses, [404, 404, 404, 404]);
      }
    }, {}, ["404 (Not Found)"]);
  }, {}, ["404 (Not Found)"]);
  // A token that the server does not know.
  const stranger = await consoleOf("nobody");
  const page = await browser.newPage();
  await page.goto(stranger.found);
  await page.waitForSelector("html[data-state=lost]");
  assert.match(await page.locator("#server").innerText(), /token/);
  assert.ok(!(await page.content()).includes(tokenOf("nobody")));
  await page.close();
  for (const one of [stranger, ...consoles, daemon]) await end(one);
});

test("another page gets no answer", async () => {
  const local = await startConsole();
  const context = await browser.newContext();
  const page = await context.newPage();
  await page.goto("data:text/html,<title>other</title>");
  const answer = await page.evaluate(async (url) => {
    try {
      return (await fetch(`${url}api/sessions`, { method: "POST", body: "0,0" })).status;
    } catch (error) {
      return String(error);
    }
  }, local.found);
  assert.match(String(answer), /TypeError/);
  const framed = await page.evaluate(
    (url) =>
      new Promise((done) => {
        const frame = document.createElement("iframe");
        frame.onload = () => done(frame.contentDocument === null);
        frame.src = url;
        document.body.append(frame);
      }),
    local.found,
  );
  assert.ok(framed);
  await context.close();
  await end(local);
});

test("a server that is killed and comes back", async () => {
  const daemon = await start("wellspaced", ["--listen", "127.0.0.1:0", "--ephemeral"], /127\.0\.0\.1:\d+/);
  const address = daemon.found;
  const remote = await startConsole("--server", address);
  await open(
    remote.found,
    async (page) => {
      await give(page, "cloud.csv", cloud);
      await ended(page, "cloud.csv");
      assert.match(await page.locator("#server").innerText(), new RegExp(address));
      await end(daemon, "SIGKILL");
      await page.waitForSelector("html[data-state=lost]");
      const again = await start("wellspaced", ["--listen", address, "--ephemeral"], /127\.0\.0\.1:\d+/);
      await page.waitForSelector("html[data-state=ready]");
      await page.waitForSelector("#none:visible");
      await end(again);
    },
    {},
    ["503 (Service Unavailable)"],
  );
  await end(remote);
});

test("keyboard, 400 pixels, and axe-core", async () => {
  for (const [width, colorScheme] of [[1000, "light"], [400, "dark"]]) {
    await openAlone(
      async (page) => {
        await give(page, "cloud.csv", cloud);
        await ended(page, "cloud.csv");
        await page.focus("#options > summary");
        await page.keyboard.press("Enter");
        await page.waitForSelector("#field-rho:visible");
        await page.keyboard.press("Tab");
        assert.match(await page.evaluate(() => document.activeElement.id), /^field-/);
        const overflow = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
        assert.ok(overflow <= 0, `${overflow} pixels wider than the window`);
        await page.evaluate(axe);
        const { violations } = await page.evaluate(() => axe.run(document, { iframes: false }));
        assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.html)}`), []);
        if (process.env.WELLSPACE_PICTURES) {
          await page.screenshot({ path: join(process.env.WELLSPACE_PICTURES, `console-${width}.png`), fullPage: true });
        }
        await card(page, "cloud.csv").getByRole("button", { name: "Delete" }).press("Enter");
        await page.waitForSelector("#none:visible");
      },
      { viewport: { width, height: 800 }, colorScheme },
    );
  }
});

test("the console ends, and says so", async () => {
  const short = await startConsole();
  await open(
    short.found,
    async (page) => {
      await end(short, "SIGINT");
      await page.waitForSelector("html[data-state=lost]");
      assert.match(await page.locator("#server").innerText(), /does not answer/);
    },
    {},
    ["ERR_CONNECTION"],
  );
});
