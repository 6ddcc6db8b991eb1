// The controls beside the picture. Names from a file are text, never markup.

import { Vector3 } from "three";
import { categoryColour, cssColour, PLAIN, rampColour } from "./colours.js";
import { BINS, formatCount, formatNumber, Histogram } from "./histogram.js";
import { worstElements, type Measure } from "./measures.js";
import type { Hit, View } from "./view.js";

const WORST = 10;
/** Seconds that a flight to an element takes. */
const FLIGHT = 0.4;

export function byId<T extends HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  text = "",
  className = "",
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  if (text) made.textContent = text;
  if (className) made.className = className;
  return made;
}

/** A list of names with a box for each, that hides. */
class Legend {
  private readonly boxes: HTMLInputElement[] = [];

  constructor(
    private readonly list: HTMLElement,
    private readonly all: HTMLButtonElement,
    private readonly hidden: Uint8Array,
    private readonly changed: () => void,
  ) {
    all.addEventListener("click", () => {
      const hide = this.boxes.some((box) => box.checked);
      for (const box of this.boxes) {
        box.checked = !hide;
        this.hidden[Number(box.value)] = hide ? 1 : 0;
      }
      this.tell();
    });
  }

  add(index: number, name: string, count: string, colour: string): void {
    const box = element("input");
    box.type = "checkbox";
    box.checked = true;
    box.value = `${index}`;
    box.addEventListener("change", () => {
      this.hidden[index] = box.checked ? 0 : 1;
      this.tell();
    });
    const swatch = element("span", "", "swatch");
    swatch.style.background = colour;
    const label = element("label");
    label.append(box, swatch, element("span", name, "label"), element("span", count, "count"));
    const item = element("li");
    item.append(label);
    this.list.append(item);
    this.boxes.push(box);
  }

  private tell(): void {
    this.all.textContent = this.boxes.some((box) => box.checked) ? "Hide all" : "Show all";
    this.changed();
  }
}

export class Panel {
  private readonly histogram: Histogram;
  private flight = 0;

  constructor(private readonly view: View) {
    this.histogram = new Histogram(byId("bars"), (bins) => this.select(bins));
    byId("clear").addEventListener("click", () => {
      this.histogram.clear();
      this.select(null);
    });
    this.fillColours();
    this.fillLegends();
    this.listenToCut();
    this.listenToElements();
    byId("forget").addEventListener("click", () => {
      this.choose(null);
      byId("canvas").focus();
    });
    view.onShown = () => this.tellShown();
  }

  private fillColours(): void {
    const { view } = this;
    const select = byId<HTMLSelectElement>("colour");
    const groups = new Map<string, HTMLElement>();
    const add = (group: string, id: string, label: string): void => {
      let parent = groups.get(group);
      if (!parent) {
        const made = element("optgroup");
        made.label = group;
        select.append(made);
        groups.set(group, (parent = made));
      }
      const option = element("option", label);
      option.value = id;
      parent.append(option);
    };
    if (view.dimension === 3) add("Names", "boundary", "Boundary");
    if (view.mesh.regions.length > 0) add("Names", "region", "Region");
    for (const { id, label, group } of view.measures) add(group, id, label);
    const hasParts = view.dimension === 3 && view.mesh.boundary.length > 1 && !view.isBox;
    view.colouring = hasParts ? "boundary" : view.mesh.regions.length > 1 ? "region" : "angle";
    select.value = view.colouring;
    select.addEventListener("change", () => {
      view.colouring = select.value;
      this.colouringChanged();
    });
  }

  /** Brings all that shows colours up to date. */
  colouringChanged(): void {
    const { view } = this;
    const coloured = view.coloured;
    view.picture.setColours(coloured ? "ramp" : "categories");
    if (view.bins) {
      view.bins = null;
      view.change("shown");
    }
    view.change("values");
    byId("panel").dataset.colouring = view.colouring;
    byId("numbers").hidden = coloured === null;
    if (coloured) this.showNumbers();
    this.fillWorst(coloured?.measure.worst ? coloured.measure : view.measure("angle").measure);
    this.tellShown();
  }

  private showNumbers(): void {
    const coloured = this.view.coloured;
    if (!coloured) return;
    const { measure, scale } = coloured;
    this.histogram.show(scale, measure.unit, this.view.counts());
    const stops = Array.from({ length: 11 }, (_, i) => cssColour(rampColour(i / 10)));
    byId("ramp").style.background = `linear-gradient(90deg, ${stops.join(", ")})`;
    byId("low").textContent = formatNumber(scale.low, measure.unit);
    byId("high").textContent = formatNumber(scale.high, measure.unit);
    byId("scale-kind").textContent = scale.isLogarithmic ? "logarithmic" : "";
  }

  private select(bins: { first: number; last: number } | null): void {
    const all = bins !== null && bins.first === 0 && bins.last === BINS - 1;
    this.view.bins = all ? null : bins;
    this.view.change("shown");
  }

  private tellShown(): void {
    const { view } = this;
    const total = formatCount(view.elements);
    const some = view.shownCount < view.elements;
    const text = some ? `${formatCount(view.shownCount)} of ${total} elements shown` : `All ${total} elements shown`;
    const coloured = view.coloured;
    let range = "";
    if (coloured && view.bins) {
      const { scale, measure } = coloured;
      const low = formatNumber(scale.value(view.bins.first / BINS), measure.unit);
      const high = formatNumber(scale.value((view.bins.last + 1) / BINS), measure.unit);
      range = `, ${low} to ${high}`;
    }
    byId("selection-text").textContent = text + range;
    byId("clear").hidden = view.bins === null;
    byId("status").textContent = some ? text : "";
  }

  private fillLegends(): void {
    const { view } = this;
    const { mesh } = view;
    if (mesh.boundary.length > 0 || view.untagged > 0) {
      byId("parts-section").hidden = false;
      const what = view.dimension === 3 ? "surface" : "lines";
      const change = (): void => view.change(what === "surface" ? "surface" : "lines");
      const parts = new Legend(byId("parts"), byId("parts-all"), view.hiddenParts, change);
      mesh.boundary.forEach((part, i) => {
        const name = part.name || `Tag ${part.tag}`;
        parts.add(i + 1, name, formatCount(part.facets), cssColour(categoryColour(i)));
      });
      if (view.untagged > 0) parts.add(0, "Without a tag", formatCount(view.untagged), cssColour(PLAIN));
    }
    if (mesh.regions.length > 1) {
      byId("regions-section").hidden = false;
      const regions = new Legend(byId("regions"), byId("regions-all"), view.hiddenRegions, () => {
        this.showNumbers();
        view.bins = null;
        view.change("shown");
      });
      const sizes = view.regionSizes();
      mesh.regions.forEach((region, i) => {
        const name = region.name || `Region ${region.id}`;
        regions.add(i, name, formatCount(sizes[i]), cssColour(categoryColour(i)));
      });
    }
  }

  private listenToCut(): void {
    const { view } = this;
    const { cut } = view;
    byId("cut-section").hidden = view.dimension === 2;
    const on = byId<HTMLInputElement>("cut");
    on.checked = cut.on;
    const offset = byId<HTMLInputElement>("offset");
    const changed = (): void => {
      byId("cut-controls").classList.toggle("off", !cut.on);
      byId("offset-text").textContent = view.planeText();
      offset.setAttribute("aria-valuetext", view.planeText());
      view.change("surface");
    };
    /** A user who moves the plane wants to see it. */
    const turnOn = (): void => {
      on.checked = cut.on = true;
      changed();
    };
    on.addEventListener("change", () => {
      cut.on = on.checked;
      changed();
    });
    offset.addEventListener("input", () => {
      cut.place = Number(offset.value) / 1000;
      turnOn();
    });
    byId<HTMLInputElement>("flip").addEventListener("change", (event) => {
      cut.flip = (event.target as HTMLInputElement).checked;
      turnOn();
    });
    for (const radio of document.querySelectorAll<HTMLInputElement>("input[name=axis]")) {
      const take = (): void => {
        if (radio.value === "view") {
          const [x, y, z] = view.camera.direction().toArray();
          cut.normal = [x, y, z];
        } else {
          cut.normal = [0, 0, 0];
          cut.normal[Number(radio.value)] = 1;
        }
        turnOn();
      };
      radio.addEventListener("change", take);
      if (radio.value === "view") radio.addEventListener("click", take); // Also once more.
    }
    for (const radio of document.querySelectorAll<HTMLInputElement>("input[name=cut-kind]")) {
      radio.addEventListener("change", () => {
        cut.kind = radio.value === "flat" ? "flat" : "whole";
        turnOn();
      });
    }
    changed();
  }

  private listenToElements(): void {
    const { view } = this;
    const shrink = byId<HTMLInputElement>("shrink");
    shrink.addEventListener("input", () => {
      view.size = 1 - Number(shrink.value) / 100;
      byId("shrink-text").textContent = `${shrink.value} %`;
      view.change("surface");
    });
    const edges = byId<HTMLInputElement>("edges");
    edges.addEventListener("change", () => {
      view.picture.edges = edges.checked ? 0.6 : 0;
      view.change("camera");
    });
    const up = byId<HTMLSelectElement>("up");
    byId("up-field").hidden = view.dimension === 2;
    up.value = `${view.camera.up}`;
    up.addEventListener("change", () => {
      view.camera.up = Number(up.value);
      view.change("camera");
    });
  }

  private fillWorst(measure: Measure): void {
    const worst = worstElements(measure, WORST);
    byId("worst-section").hidden = worst.length === 0;
    byId("worst-title").textContent = `Worst elements: ${measure.label.toLowerCase()}`;
    byId("worst").replaceChildren(
      ...worst.map((t) => {
        const button = element("button");
        button.type = "button";
        const value = formatNumber(measure.values[t], measure.unit);
        button.append(element("span", value, "label"), element("span", `element ${t}`, "count"));
        button.addEventListener("click", () => {
          this.choose({ element: t, part: 0, facet: [] });
          this.fly(t);
        });
        const item = element("li");
        item.append(button);
        return item;
      }),
    );
  }

  /** Shows the data of an element, and marks it; null: of none. */
  choose(hit: Hit | null): void {
    const { view } = this;
    view.chosen = hit;
    view.change("marks");
    byId("chosen-section").hidden = hit === null;
    if (!hit) return;
    const rows: Array<[string, string]> = [["Element", `${hit.element}`]];
    if (hit.facet.length > 0 && view.mesh.boundary.length > 0) {
      const part = hit.part > 0 ? view.mesh.boundary[hit.part - 1] : null;
      rows.push(["Facet", part ? `${part.name || "no name"}, tag ${part.tag}` : "no tag"]);
      rows.push(["Its vertices", hit.facet.join(", ")]);
    }
    if (view.mesh.regions.length > 0) {
      const region = view.mesh.regions[view.regionOf(hit.element)];
      rows.push(["Region", `${region.name || "no name"}, ${region.id}`]);
    }
    for (const { id } of view.measures.filter(({ isOfVertices }) => !isOfVertices)) {
      const { measure } = view.measure(id);
      rows.push([measure.label, formatNumber(measure.values[hit.element], measure.unit)]);
    }
    byId("chosen").replaceChildren(
      ...rows.flatMap(([term, text]) => [element("dt", term), element("dd", text)]),
    );
    const data = view.coloured?.measure.ofVertices;
    const heads = ["Vertex", ..."xyz".slice(0, view.dimension), ...(data ? [view.coloured!.measure.label] : [])];
    byId("corner-head").replaceChildren(
      ...heads.map((text) => {
        const head = element("th", text);
        head.scope = "col";
        return head;
      }),
    );
    byId("corner-rows").replaceChildren(
      ...view.cornersOf(hit.element).map((vertex) => {
        const row = element("tr");
        const numbers = [...view.pointOf(vertex), ...(data ? [data[vertex]] : [])];
        row.append(element("td", `${vertex}`), ...numbers.map((x) => this.numberCell(x, numbers.length > 3 ? 4 : 6)));
        return row;
      }),
    );
  }

  private numberCell(x: number, digits: number): HTMLElement {
    const short = `${Number(x.toPrecision(digits))}`;
    const text = short.includes("e") ? x.toExponential(digits > 4 ? 3 : 1) : short;
    const cell = element("td", text.replace(/-/g, "−"));
    cell.title = `${x}`;
    return cell;
  }

  /** Turns the camera to an element. */
  private fly(t: number): void {
    const { view } = this;
    const points = view.cornersOf(t).map((vertex) => view.pointOf(vertex));
    const middle = [0, 1, 2].map((i) => points.reduce((sum, point) => sum + (point[i] ?? 0) / points.length, 0));
    const corners = points.map((point) => view.toFrame(point));
    const centre = view.toFrame(middle);
    const radius = Math.max(1e-9, ...corners.map((corner) => corner.distanceTo(centre)));
    const { camera } = view;
    const from = { target: view.toMesh(camera.target), distance: camera.distance };
    const distance = radius * 14;
    const start = performance.now();
    const quick = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const flight = ++this.flight;
    const step = (): void => {
      if (flight !== this.flight) return;
      const passed = quick ? 1 : Math.min(1, (performance.now() - start) / 1000 / FLIGHT);
      const eased = passed * passed * (3 - 2 * passed);
      const place = from.target.map((x, i) => x + (middle[i] - x) * eased);
      camera.target.copy(view.toFrame(place));
      camera.distance = from.distance * (distance / from.distance) ** eased;
      view.change("camera");
      if (passed < 1) requestAnimationFrame(step);
    };
    step();
  }

  /** The place of the pointer on a map, as text. */
  placeText(x: number, y: number): string {
    const point = new Vector3(x, y, 0).unproject(this.view.camera.three);
    const place = this.view.toMesh(point);
    const digits = Math.min(15, Math.max(0, Math.ceil(-Math.log10(this.view.pixel))));
    return place
      .slice(0, 2)
      .map((value) => (digits > 12 ? `${value}` : value.toFixed(digits)).replace("-", "−"))
      .join(",  ");
  }
}
