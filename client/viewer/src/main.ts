// A page that shows a mesh: its start, once it has loaded.

import { DataError, readMesh } from "./data.js";
import { drawAxes, rulerOf, savePicture } from "./decorations.js";
import { listen } from "./gestures.js";
import { formatCount } from "./histogram.js";
import { byId, Panel } from "./panel.js";
import { Picture } from "./picture.js";
import { View } from "./view.js";

/** Milliseconds without a change after which the address has the camera. */
const QUIET = 300;

function fail(text: string): void {
  const status = byId("status");
  status.textContent = text;
  status.classList.add("failed");
  byId("panel").hidden = true;
  document.documentElement.dataset.state = "failed";
}

function summaryOf(view: View): string {
  const kind = view.dimension === 3 ? "tetrahedra" : "triangles";
  const vertices = view.mesh.points.length / view.dimension;
  const regions = view.mesh.regions.length;
  return `${formatCount(vertices)} vertices · ${formatCount(view.elements)} ${kind}${
    regions > 1 ? ` · ${formatCount(regions)} regions` : ""
  }`;
}

/** The camera of the address, "#view=yaw,pitch,distance,x,y,z" with a place of the mesh. */
function takeAddress(view: View): boolean {
  const found = /^#view=([-+.\de]+(?:,[-+.\de]+){5})$/i.exec(location.hash);
  const numbers = found?.[1].split(",").map(Number);
  if (!numbers?.every(Number.isFinite) || !(numbers[2] > 0)) return false;
  const { camera } = view;
  camera.yaw = numbers[0];
  camera.pitch = Math.min(1.57, Math.max(-1.57, numbers[1]));
  camera.distance = Math.min(20, Math.max(1e-9, numbers[2]));
  camera.target.copy(view.toFrame(numbers.slice(3)));
  return true;
}

function putAddress(view: View): void {
  const { camera } = view;
  const numbers = [camera.yaw, camera.pitch, camera.distance, ...view.toMesh(camera.target)];
  try {
    history.replaceState(null, "", `#view=${numbers.join(",")}`);
  } catch {
    // The page is inside of another one, which has the address.
  }
}

function applyTheme(view: View): void {
  const style = getComputedStyle(document.documentElement);
  const colour = (name: string): string => style.getPropertyValue(name).trim();
  view.picture.setTheme({ background: colour("--stage"), edge: colour("--edge"), accent: colour("--mark") });
  view.change("camera");
}

function listenToTools(view: View): void {
  const { camera } = view;
  const dark = matchMedia("(prefers-color-scheme: dark)");
  byId("fit").addEventListener("click", () => view.fit());
  byId("save").addEventListener("click", () => savePicture(view));
  const zoom = (factor: number) => (): void => {
    camera.zoom(factor);
    view.change("camera");
  };
  byId("zoom-in").addEventListener("click", zoom(0.7));
  byId("zoom-out").addEventListener("click", zoom(1 / 0.7));
  byId("theme").addEventListener("click", () => {
    const root = document.documentElement;
    const isDark = root.dataset.theme ? root.dataset.theme === "dark" : dark.matches;
    root.dataset.theme = isDark ? "light" : "dark";
    applyTheme(view);
  });
  dark.addEventListener("change", () => applyTheme(view));
}

function start(): void {
  const mesh = readMesh();
  const canvas = byId<HTMLCanvasElement>("canvas");
  document.title = mesh.name;
  byId("name").textContent = mesh.name;
  canvas.setAttribute("aria-label", `Picture of ${mesh.name}`);
  let picture: Picture;
  try {
    picture = new Picture(canvas, mesh.dimension === 2);
  } catch {
    throw new DataError("This browser has no WebGL 2, which the picture needs. Another browser may have it.");
  }
  const view = new View(mesh, picture);
  byId("app").classList.toggle("map", mesh.dimension === 2);
  byId("summary").textContent = summaryOf(view);
  const panel = new Panel(view);
  applyTheme(view);
  const stage = byId("stage");
  const resize = (): void => {
    const { clientWidth, clientHeight } = stage;
    if (clientWidth > 0 && clientHeight > 0) {
      view.resize(clientWidth, clientHeight, Math.min(2, devicePixelRatio));
      view.drawNow();
    }
  };
  let written = 0;
  const axes = byId<HTMLCanvasElement>("axes");
  axes.hidden = mesh.dimension === 2;
  byId("ruler").hidden = mesh.dimension === 3;
  view.onFrame = () => {
    if (mesh.dimension === 3) {
      drawAxes(axes, view);
    } else {
      const ruler = rulerOf(view);
      byId("ruler-text").textContent = ruler.text;
      byId("ruler-bar").style.width = `${ruler.pixels}px`;
    }
    clearTimeout(written);
    written = window.setTimeout(() => putAddress(view), QUIET);
  };
  if (view.colouring === "boundary" || view.colouring === "region") picture.setColours("categories");
  view.resize(stage.clientWidth || 1, stage.clientHeight || 1, Math.min(2, devicePixelRatio));
  view.fit();
  takeAddress(view);
  listen(
    canvas,
    view,
    (x, y) => panel.choose(view.hitAt(x, y)),
    (place) => {
      byId("readout").textContent = place && mesh.dimension === 2 ? panel.placeText(place.x, place.y) : "";
    },
  );
  listenToTools(view);
  view.drawNow();
  document.documentElement.dataset.firstPicture = `${Math.round(performance.now())}`;
  new ResizeObserver(resize).observe(stage);
  // The picture comes first. Histogram and worst elements want numbers of all elements.
  requestAnimationFrame(() =>
    setTimeout(() => {
      panel.colouringChanged();
      document.documentElement.dataset.state = "ready";
    }),
  );
}

try {
  start();
} catch (error) {
  if (!(error instanceof DataError)) {
    fail("The page cannot show this mesh.");
    throw error;
  }
  fail(error.message);
}
