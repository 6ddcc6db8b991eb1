// The state of a page, and the picture that follows from it. Changes are drawn with the next frame of the browser.

import { Vector3 } from "three";
import { Camera } from "./camera.js";
import { categoryValue } from "./colours.js";
import type { MeshData } from "./data.js";
import { BINS, Scale } from "./histogram.js";
import { measuresOf, type Measure } from "./measures.js";
import { Picture, pick } from "./picture.js";
import {
  facePositions,
  heightsOver,
  keptBelow,
  sectionOf,
  shownTriangles,
  shrunkFaces,
  trianglePositions,
  visibleFaces,
  type Frame,
  type Section,
} from "./surface.js";
import { TET_FACES, topologyOf, type Topology } from "./topology.js";

export interface Cut {
  on: boolean;
  normal: [number, number, number];
  /** Of the plane: 0 where it begins to cut the mesh, 1 where it ends. */
  place: number;
  flip: boolean;
  kind: "whole" | "flat";
}

/** The element that was clicked. */
export interface Hit {
  readonly element: number;
  /** 1 + the index of the facet's part, or 0. */
  readonly part: number;
  readonly facet: readonly number[];
}

const AXIS_NAMES = ["x", "y", "z"];
const BOX_NAMES = AXIS_NAMES.flatMap((axis) => [`${axis}min`, `${axis}max`]);
/** Where a corner of a triangle has no number, the triangle has none: numbers between would be made up. */
function plainIfOneIs(values: Float32Array, at: number): void {
  if (values[at] < 0 || values[at + 1] < 0 || values[at + 2] < 0) values.fill(-1, at, at + 3);
}

/** So many pixels beside a segment it is still meant. */
const NEAR_SEGMENT = 5;
/** The corners of the faces of a tetrahedron as they are drawn; then those of a triangle. */
const FACES: ReadonlyArray<readonly number[]> = [...TET_FACES, [0, 1, 2]];
/** Where numbers of 32 bits get too coarse for the visible part, the frame is moved there. */
const FAR_FROM_ORIGIN = 2000;

export class View {
  readonly dimension: 2 | 3;
  readonly elements: number;
  /** Whether all of the boundary is the box about a cloud, which says little: such a mesh is shown cut open. */
  readonly isBox: boolean;
  readonly camera: Camera;
  readonly measures: ReturnType<typeof measuresOf>;
  /** 1 for each part that is hidden; the first entry stands for facets without a part. */
  readonly hiddenParts: Uint8Array;
  readonly hiddenRegions: Uint8Array;
  readonly cut: Cut = { on: false, normal: [1, 0, 0], place: 0.5, flip: false, kind: "whole" };
  /** "boundary", "region" or the id of a measure. */
  colouring = "";
  bins: { first: number; last: number } | null = null;
  /** Of the elements, 1 or less. */
  size = 1;
  chosen: Hit | null = null;
  shownCount = 0;
  /** Facets without a part, which are on the boundary all the same. */
  untagged = 0;
  onFrame: () => void = () => {};
  onShown: () => void = () => {};

  private readonly low: number[] = [];
  private readonly high: number[] = [];
  private frame: Frame;
  private readonly topology: Topology | null;
  private readonly made = new Map<string, { measure: Measure; scale: Scale }>();
  private shown: Uint8Array;
  private drawn: Uint32Array = new Uint32Array(0);
  private section: Section | null = null;
  private positions: Float32Array = new Float32Array(0);
  private stale = { shown: true, surface: true, values: true, lines: true, marks: true };
  private scheduled = false;
  private width = 1;
  private height = 1;

  constructor(
    readonly mesh: MeshData,
    readonly picture: Picture,
  ) {
    const d = mesh.dimension;
    this.dimension = d;
    this.elements = mesh.simplices.length / (d + 1);
    for (let axis = 0; axis < d; ++axis) {
      let low = Infinity;
      let high = -Infinity;
      for (let i = axis; i < mesh.points.length; i += d) {
        const x = mesh.points[i];
        if (x < low && Number.isFinite(x)) low = x;
        if (x > high && Number.isFinite(x)) high = x;
      }
      this.low.push(low <= high ? low : 0);
      this.high.push(low <= high ? high : 0);
    }
    this.frame = { origin: this.centre(), scale: 1 / (Math.max(...this.high.map((x, i) => x - this.low[i])) || 1) };
    this.camera = new Camera(d === 2, mesh.up);
    this.measures = measuresOf(mesh);
    this.hiddenParts = new Uint8Array(mesh.boundary.length + 1);
    this.hiddenRegions = new Uint8Array(Math.max(1, mesh.regions.length));
    this.shown = new Uint8Array(this.elements);
    this.topology = d === 3 ? topologyOf(mesh) : null;
    this.isBox = d === 3 && mesh.boundary.length > 0 && mesh.boundary.every((part) => BOX_NAMES.includes(part.name));
    this.cut.on = this.isBox;
    if (this.topology) {
      const { neighbours, partOf } = this.topology;
      for (let f = 0; f < neighbours.length; ++f) this.untagged += neighbours[f] < 0 && partOf[f] === 0 ? 1 : 0;
    }
  }

  /** The middle of the mesh's box. */
  private centre(): [number, number, number] {
    const middle = (i: number): number => (i < this.dimension ? this.low[i] / 2 + this.high[i] / 2 : 0);
    return [middle(0), middle(1), middle(2)];
  }

  /** The measure of this id, and how its numbers become colours. */
  measure(id: string): { measure: Measure; scale: Scale } {
    let found = this.made.get(id);
    if (!found) {
      const measure = this.measures.find((candidate) => candidate.id === id)!.make();
      found = { measure, scale: new Scale(measure) };
      this.made.set(id, found);
    }
    return found;
  }

  /** The measure that colours are of, or null. */
  get coloured(): { measure: Measure; scale: Scale } | null {
    return this.colouring === "boundary" || this.colouring === "region" ? null : this.measure(this.colouring);
  }

  /** How many elements of the regions that are shown lie in each bin. */
  counts(): Uint32Array {
    const counts = new Uint32Array(BINS);
    const coloured = this.coloured;
    if (!coloured) return counts;
    const { measure, scale } = coloured;
    for (let t = 0; t < this.elements; ++t) {
      const bin = this.hiddenRegions[this.regionOf(t)] ? -1 : scale.bin(measure.values[t]);
      if (bin >= 0) ++counts[bin];
    }
    return counts;
  }

  regionOf(t: number): number {
    return this.mesh.regionOf.length > 0 ? this.mesh.regionOf[t] : 0;
  }

  /** How many elements each region has. */
  regionSizes(): Uint32Array {
    const sizes = new Uint32Array(this.hiddenRegions.length);
    for (let t = 0; t < this.elements; ++t) ++sizes[this.regionOf(t)];
    return sizes;
  }

  /** Tells what has changed; all that follows from it is drawn with the next frame. */
  change(what: "shown" | "surface" | "values" | "lines" | "marks" | "camera"): void {
    const s = this.stale;
    if (what === "shown") s.shown = s.surface = s.values = true;
    if (what === "surface") s.surface = s.values = true;
    if (what === "values") s.values = true;
    if (what === "values" && this.isFlat) s.surface = true;
    if (what === "lines") s.lines = true;
    if (what === "marks") s.marks = true;
    if (!this.scheduled) {
      this.scheduled = true;
      requestAnimationFrame(() => {
        if (this.scheduled) this.drawNow();
      });
    }
  }

  resize(width: number, height: number, ratio: number): void {
    this.width = width;
    this.height = height;
    this.picture.resize(width, height, ratio);
    this.change("camera");
  }

  fit(): void {
    this.moveOrigin(this.centre());
    const extents = [0, 1, 2].map((i) => (i < this.dimension ? (this.high[i] - this.low[i]) * this.frame.scale : 0));
    this.camera.fit(extents, this.width, this.height);
    this.change("camera");
  }

  /** Lengths of the mesh that a pixel has at the target. */
  get pixel(): number {
    return this.camera.pixel / this.frame.scale;
  }

  /** A point of the frame in the coordinates of the mesh. */
  toMesh(point: Vector3): [number, number, number] {
    const { origin, scale } = this.frame;
    return [origin[0] + point.x / scale, origin[1] + point.y / scale, origin[2] + point.z / scale];
  }

  toFrame(point: readonly number[]): Vector3 {
    const { origin, scale } = this.frame;
    const at = (i: number): number => ((point[i] ?? 0) - origin[i]) * scale;
    return new Vector3(at(0), at(1), at(2));
  }

  private moveOrigin(origin: [number, number, number]): void {
    if (origin.every((x, i) => x === this.frame.origin[i])) return;
    const target = this.toMesh(this.camera.target);
    this.frame = { origin, scale: this.frame.scale };
    this.camera.target.copy(this.toFrame(target));
    this.stale.surface = this.stale.values = this.stale.lines = this.stale.marks = true;
  }

  /** The plane of the cut in the coordinates of the mesh. */
  plane(): { normal: [number, number, number]; offset: number } {
    const { normal, place, flip } = this.cut;
    let [low, high] = [0, 0];
    for (let i = 0; i < 3; ++i) {
      low += Math.min(normal[i] * this.low[i], normal[i] * this.high[i]);
      high += Math.max(normal[i] * this.low[i], normal[i] * this.high[i]);
    }
    const offset = low + (high - low) * place;
    const sign = flip ? -1 : 1;
    return { normal: [sign * normal[0], sign * normal[1], sign * normal[2]], offset: sign * offset };
  }

  /** Whether the plane goes through elements. Shrunk ones are whole. */
  private get isFlat(): boolean {
    return this.topology !== null && this.cut.on && this.cut.kind === "flat" && this.size === 1;
  }

  /** The plane in words. */
  planeText(): string {
    const { normal, offset } = this.plane();
    const axis = normal.findIndex((x) => Math.abs(x) === 1);
    const number = Number(offset.toPrecision(4));
    return axis >= 0 ? `${AXIS_NAMES[axis]} = ${normal[axis] * number}` : `n·x = ${number}`;
  }

  /** Draws what has changed; a frame that was asked for draws nothing then. */
  drawNow(): void {
    this.scheduled = false;
    if (this.camera.distance < 1e-2 && this.camera.target.length() > FAR_FROM_ORIGIN * this.camera.distance) {
      this.moveOrigin(this.toMesh(this.camera.target));
    }
    const { stale } = this;
    if (stale.shown) this.findShown();
    if (stale.surface) this.findSurface();
    if (stale.values) this.picture.setSurfaceValues(this.surfaceValues());
    if (stale.lines && this.dimension === 2) this.findLines();
    if (stale.marks) this.findMarks();
    const told = stale.shown;
    this.stale = { shown: false, surface: false, values: false, lines: false, marks: false };
    this.camera.update(this.width, this.height);
    this.picture.draw(this.camera);
    if (told) this.onShown();
    this.onFrame();
  }

  private findShown(): void {
    const shown = new Uint8Array(this.elements);
    const coloured = this.bins ? this.coloured : null;
    const bins = this.bins;
    let count = 0;
    for (let t = 0; t < shown.length; ++t) {
      if (this.hiddenRegions[this.regionOf(t)]) continue;
      if (coloured && bins) {
        const bin = coloured.scale.bin(coloured.measure.values[t]);
        if (bin < bins.first || bin > bins.last) continue;
      }
      shown[t] = 1;
      ++count;
    }
    this.shown = shown;
    this.shownCount = count;
  }

  private findSurface(): void {
    const { mesh, frame, topology } = this;
    if (!topology) {
      this.drawn = shownTriangles(this.shown);
      this.positions = trianglePositions(mesh, this.drawn, frame, this.size);
      this.picture.setSurface(this.positions, this.surfaceValues());
      this.stale.values = false;
      return;
    }
    const plane = this.plane();
    const heights = this.cut.on ? heightsOver(mesh, plane) : null;
    const kept = heights && !this.isFlat ? keptBelow(mesh, this.shown, heights) : this.shown;
    const seen = visibleFaces(topology, kept, this.hiddenParts);
    this.drawn = this.size < 1 ? shrunkFaces(topology, kept, seen) : seen;
    this.positions = facePositions(mesh, this.drawn, frame, this.size);
    this.picture.setSurface(this.positions, this.surfaceValues());
    this.stale.values = false;
    if (heights && this.isFlat) {
      const { origin, scale } = frame;
      const [x, y, z] = plane.normal;
      this.picture.setClip(plane.normal, (plane.offset - x * origin[0] - y * origin[1] - z * origin[2]) * scale);
      const section = sectionOf(mesh, this.shown, heights, frame);
      this.section = section;
      this.picture.setSection(section.positions, this.sectionValues(section), section.inner);
    } else {
      this.section = null;
      this.picture.setClip(null, 0);
      this.picture.setSection(new Float32Array(0), new Float32Array(0), new Uint8Array(0));
    }
  }

  private elementValue(t: number): number {
    if (this.colouring === "region") return this.mesh.regions.length > 0 ? categoryValue(this.regionOf(t)) : -1;
    const coloured = this.coloured;
    return coloured ? coloured.scale.colourAt(coloured.measure.values[t]) : -1;
  }

  private surfaceValues(): Float32Array {
    const { drawn, mesh, topology } = this;
    const values = new Float32Array(3 * drawn.length);
    const coloured = this.coloured;
    const smooth = coloured?.measure.ofVertices;
    const corners = this.dimension + 1;
    const tagged = this.colouring === "boundary" && topology;
    for (let i = 0; i < drawn.length; ++i) {
      const element = topology ? drawn[i] >> 2 : drawn[i];
      if (smooth && coloured) {
        // The corners in the order of facePositions.
        const face = topology ? FACES[drawn[i] & 3] : FACES[4];
        for (let k = 0; k < 3; ++k) {
          values[3 * i + k] = coloured.scale.colourAt(smooth[mesh.simplices[corners * element + face[k]]]);
        }
        plainIfOneIs(values, 3 * i);
      } else {
        const value = tagged ? categoryValue(tagged.partOf[drawn[i]] - 1) : this.elementValue(element);
        values[3 * i] = values[3 * i + 1] = values[3 * i + 2] = value;
      }
    }
    return values;
  }

  private sectionValues(section: Section): Float32Array {
    const values = new Float32Array(3 * section.elements.length);
    const coloured = this.coloured;
    const smooth = coloured?.measure.ofVertices;
    for (let c = 0; c < values.length; ++c) {
      if (smooth && coloured) {
        const [a, b] = [smooth[section.ends[2 * c]], smooth[section.ends[2 * c + 1]]];
        values[c] = coloured.scale.colourAt(a + section.weights[c] * (b - a));
        if (c % 3 === 2) plainIfOneIs(values, c - 2);
      } else {
        values[c] = this.elementValue(section.elements[Math.floor(c / 3)]);
      }
    }
    return values;
  }

  /** Facets in the plane. */
  private findLines(): void {
    const { mesh } = this;
    const count = mesh.facets.length / 2;
    const ends = new Float32Array(6 * count);
    const values = new Float32Array(count);
    let [to, facet] = [0, 0];
    mesh.boundary.forEach((part, i) => {
      for (const end = facet + part.facets; facet < end; ++facet) {
        if (this.hiddenParts[i + 1]) continue;
        for (let k = 0; k < 2; ++k) this.put(ends, 6 * to + 3 * k, mesh.facets[2 * facet + k]);
        values[to++] = categoryValue(i);
      }
    });
    this.picture.setLines(ends.subarray(0, 6 * to), values.subarray(0, to));
  }

  private put(positions: Float32Array, at: number, vertex: number): void {
    const { origin, scale } = this.frame;
    for (let axis = 0; axis < this.dimension; ++axis) {
      positions[at + axis] = (this.mesh.points[this.dimension * vertex + axis] - origin[axis]) * scale;
    }
  }

  private findMarks(): void {
    const ends: number[][] = [];
    if (this.chosen) {
      const corners = this.cornersOf(this.chosen.element);
      for (let i = 0; i < corners.length; ++i) {
        for (let j = i + 1; j < corners.length; ++j) ends.push([corners[i], corners[j]]);
      }
    }
    const positions = new Float32Array(6 * ends.length);
    ends.forEach(([a, b], i) => {
      this.put(positions, 6 * i, a);
      this.put(positions, 6 * i + 3, b);
    });
    this.picture.setMarks(positions);
  }

  cornersOf(t: number): number[] {
    const corners = this.dimension + 1;
    return Array.from(this.mesh.simplices.subarray(corners * t, corners * (t + 1)));
  }

  pointOf(vertex: number): number[] {
    return Array.from(this.mesh.points.subarray(this.dimension * vertex, this.dimension * (vertex + 1)));
  }

  /** The element seen at this place of the canvas, from −1 to 1 to the right and upward. */
  hitAt(x: number, y: number): Hit | null {
    this.camera.update(this.width, this.height);
    const from = new Vector3(x, y, -1).unproject(this.camera.three);
    const direction = new Vector3(x, y, 1).unproject(this.camera.three).sub(from).normalize();
    const plane = this.plane();
    const keeps = (point: Vector3): boolean => {
      const [px, py, pz] = this.toMesh(point);
      return plane.normal[0] * px + plane.normal[1] * py + plane.normal[2] * pz <= plane.offset;
    };
    const found = pick(this.positions, from, direction, this.isFlat ? keeps : () => true);
    if (this.section) {
      const inside = pick(this.section.positions, from, direction, () => true);
      if (inside.distance < found.distance) {
        return { element: this.section.elements[inside.triangle], part: 0, facet: [] };
      }
    }
    if (found.triangle < 0) return null;
    const drawn = this.drawn[found.triangle];
    if (!this.topology) {
      const { part, facet } = this.nearestSegment(this.toMesh(from));
      return { element: drawn, part, facet };
    }
    const corners = this.cornersOf(drawn >> 2);
    const part = this.topology.partOf[drawn];
    return { element: drawn >> 2, part, facet: FACES[drawn & 3].map((k) => corners[k]) };
  }

  /** In the plane, the facet that is shown nearest to a point, with 1 + the index of its part; part 0: none is near. */
  private nearestSegment([x, y]: readonly number[]): { part: number; facet: number[] } {
    const { points: p, facets, boundary } = this.mesh;
    let nearest = { part: 0, facet: [] as number[] };
    let least = NEAR_SEGMENT * this.pixel;
    let facet = 0;
    boundary.forEach((part, i) => {
      for (const end = facet + part.facets; facet < end; ++facet) {
        const a = facets[2 * facet];
        const b = facets[2 * facet + 1];
        const dx = p[2 * b] - p[2 * a];
        const dy = p[2 * b + 1] - p[2 * a + 1];
        const along = ((x - p[2 * a]) * dx + (y - p[2 * a + 1]) * dy) / (dx * dx + dy * dy);
        const t = Math.min(1, Math.max(0, along));
        const distance = Math.hypot(x - p[2 * a] - t * dx, y - p[2 * a + 1] - t * dy);
        if (distance < least && !this.hiddenParts[i + 1]) {
          least = distance;
          nearest = { part: i + 1, facet: [a, b] };
        }
      }
    });
    return nearest;
  }
}
