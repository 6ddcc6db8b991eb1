// Decorations beside the mesh: axes, a scale for maps, and the legend of a saved picture.

import { Vector3 } from "three";
import { categoryColour, cssColour, rampColour } from "./colours.js";
import { formatNumber } from "./histogram.js";
import type { View } from "./view.js";

const AXES: ReadonlyArray<readonly [string, string]> = [
  ["x", "#e5484d"],
  ["y", "#30a46c"],
  ["z", "#4c8dff"],
];

/** Draws the directions of the axes. */
export function drawAxes(canvas: HTMLCanvasElement, view: View): void {
  const context = canvas.getContext("2d");
  if (!context) return;
  const half = canvas.width / 2;
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.lineWidth = 4;
  context.lineCap = "round";
  context.font = "600 26px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  const inverse = view.camera.three.matrixWorldInverse;
  AXES.map(([name, colour], i) => ({
    name,
    colour,
    to: new Vector3().setComponent(i, 1).transformDirection(inverse),
  }))
    .sort((a, b) => a.to.z - b.to.z)
    .forEach(({ name, colour, to }) => {
      context.strokeStyle = context.fillStyle = colour;
      context.beginPath();
      context.moveTo(half, half);
      context.lineTo(half + to.x * half * 0.6, half - to.y * half * 0.6);
      context.stroke();
      context.fillText(name, half + to.x * half * 0.82, half - to.y * half * 0.82);
    });
}

/** A length of 1, 2 or 5 times a power of ten, and its pixels: between 50 and 125 of them. */
export function rulerOf(view: View): { text: string; pixels: number } {
  const wanted = 125 * view.pixel;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const length = power * ([5, 2].find((factor) => factor * power <= wanted) ?? 1);
  return { text: formatNumber(length), pixels: length / view.pixel };
}

function drawLegend(context: CanvasRenderingContext2D, view: View, size: number, colour: string): void {
  const [left, bottom] = [size * 1.5, context.canvas.height - size * 1.5];
  context.fillStyle = colour;
  const coloured = view.coloured;
  if (coloured) {
    const { measure, scale } = coloured;
    const width = size * 16;
    for (let i = 0; i < width; ++i) {
      context.fillStyle = cssColour(rampColour(i / width));
      context.fillRect(left + i, bottom - size * 2.4, 1.5, size);
    }
    context.fillStyle = colour;
    context.fillText(measure.label, left, bottom - size * 3);
    context.fillText(formatNumber(scale.low, measure.unit), left, bottom);
    context.textAlign = "right";
    context.fillText(formatNumber(scale.high, measure.unit), left + width, bottom);
    context.textAlign = "left";
    return;
  }
  const { boundary, regions } = view.mesh;
  const names =
    view.colouring === "region"
      ? regions.map((region) => region.name || `Region ${region.id}`)
      : boundary.map((part) => part.name || `Tag ${part.tag}`);
  const listed = names.slice(0, 12);
  listed.forEach((name, i) => {
    const y = bottom - (listed.length - 1 - i) * size * 1.6;
    context.fillStyle = cssColour(categoryColour(i));
    context.fillRect(left, y - size * 0.85, size, size);
    context.fillStyle = colour;
    context.fillText(name, left + size * 1.6, y);
  });
}

/** Saves the picture with name and legend as a file. */
export function savePicture(view: View): void {
  view.drawNow();
  const { canvas } = view.picture;
  const copy = document.createElement("canvas");
  copy.width = canvas.width;
  copy.height = canvas.height;
  const context = copy.getContext("2d");
  if (!context) return;
  context.drawImage(canvas, 0, 0);
  const size = Math.max(10, Math.round(copy.height / 48));
  const colour = getComputedStyle(document.documentElement).color;
  context.font = `${size}px system-ui, sans-serif`;
  drawLegend(context, view, size, colour);
  copy.toBlob((blob) => {
    if (!blob) return;
    const link = document.createElement("a");
    const stem = view.mesh.name.replace(/\.[^.]*$/, "").replace(/[^\p{L}\p{N} ._-]+/gu, "_") || "mesh";
    link.href = URL.createObjectURL(blob);
    link.download = `${stem}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  }, "image/png");
}
