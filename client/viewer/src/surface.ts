// The triangles that are drawn: faces that are seen of the elements that are shown, and the cut through these.

import type { MeshData } from "./data.js";
import { TET_FACES, type Topology } from "./topology.js";

/** Keeps the part at normal·x ≤ offset. */
export interface CutPlane {
  readonly normal: readonly [number, number, number];
  readonly offset: number;
}

/** So many triangles are drawn at most. */
export const MOST_TRIANGLES = 4_000_000;
/** Of shrunk elements all are drawn up to this number, beyond it those near the surface. */
const MOST_SHRUNK = 250_000;

/** A list of numbers that grows. */
class Numbers {
  private array = new Uint32Array(1 << 16);
  length = 0;

  push(value: number): void {
    if (this.length === this.array.length) {
      const larger = new Uint32Array(2 * this.array.length);
      larger.set(this.array);
      this.array = larger;
    }
    this.array[this.length++] = value;
  }

  take(): Uint32Array {
    return this.array.slice(0, this.length);
  }
}

/** normal·x − offset for each vertex. */
export function heightsOver(mesh: MeshData, plane: CutPlane): Float64Array {
  const p = mesh.points;
  const [x, y, z] = plane.normal;
  const heights = new Float64Array(p.length / 3);
  for (let v = 0, i = 0; v < heights.length; ++v, i += 3) {
    heights[v] = x * p[i] + y * p[i + 1] + z * p[i + 2] - plane.offset;
  }
  return heights;
}

/** The elements of `shown` that have their centre on the side of the plane that is kept. */
export function keptBelow(mesh: MeshData, shown: Uint8Array, heights: Float64Array): Uint8Array {
  const s = mesh.simplices;
  const kept = new Uint8Array(shown.length);
  for (let t = 0, i = 0; t < kept.length; ++t, i += 4) {
    if (shown[t] && heights[s[i]] + heights[s[i + 1]] + heights[s[i + 2]] + heights[s[i + 3]] <= 0) kept[t] = 1;
  }
  return kept;
}

/**
 * The faces of a 3-D mesh that are seen: those between what is shown and what is not, and those of inner boundaries.
 * `hidden` has 1 for each part that is hidden; its first entry stands for faces without a part.
 */
export function visibleFaces(topology: Topology, shown: Uint8Array, hidden: Uint8Array): Uint32Array {
  const { neighbours, partOf } = topology;
  const faces = new Numbers();
  for (let t = 0, face = 0; t < shown.length; ++t, face += 4) {
    if (!shown[t]) continue;
    for (let f = face; f < face + 4; ++f) {
      const neighbour = neighbours[f];
      if (neighbour < 0 || !shown[neighbour]) {
        if (neighbour < 0 && hidden[partOf[f]]) continue;
      } else if (partOf[f] === 0 || t > neighbour || hidden[partOf[f]]) {
        continue;
      }
      faces.push(f);
    }
    if (faces.length >= MOST_TRIANGLES) break;
  }
  return faces.take();
}

/** All faces of the elements that are shown, or of those nearest to the faces that are seen, if they are many. */
export function shrunkFaces(topology: Topology, shown: Uint8Array, seen: Uint32Array): Uint32Array {
  const elements = new Numbers();
  const listed = new Uint8Array(shown.length);
  const list = (t: number): void => {
    if (t >= 0 && shown[t] && !listed[t]) {
      listed[t] = 1;
      elements.push(t);
    }
  };
  for (const face of seen) list(face >> 2);
  let front = elements.take();
  while (front.length > 0 && elements.length < MOST_SHRUNK) {
    const before = elements.length;
    for (const t of front) {
      for (let f = 4 * t; f < 4 * t + 4; ++f) list(topology.neighbours[f]);
    }
    front = elements.take().subarray(before);
  }
  const faces = new Uint32Array(4 * elements.length);
  elements.take().forEach((t, i) => {
    for (let f = 0; f < 4; ++f) faces[4 * i + f] = 4 * t + f;
  });
  return faces;
}

/** The origin and the unit of the picture. */
export interface Frame {
  readonly origin: readonly [number, number, number];
  readonly scale: number;
}

/** The corners of each triangle in the picture's frame: 9 numbers a face. Elements are `size` of theirs, 1 or less. */
export function facePositions(mesh: MeshData, faces: Uint32Array, frame: Frame, size: number): Float32Array {
  const { points: p, simplices: s } = mesh;
  const { origin, scale } = frame;
  const positions = new Float32Array(9 * faces.length);
  for (let i = 0, to = 0; i < faces.length; ++i, to += 9) {
    const first = faces[i] & ~3;
    const a = 3 * s[first];
    const b = 3 * s[first + 1];
    const c = 3 * s[first + 2];
    const d = 3 * s[first + 3];
    const corners = TET_FACES[faces[i] & 3];
    for (let k = 0; k < 3; ++k) {
      const from = 3 * s[first + corners[k]];
      for (let axis = 0; axis < 3; ++axis) {
        let x = p[from + axis];
        if (size < 1) {
          const centre = (p[a + axis] + p[b + axis] + p[c + axis] + p[d + axis]) / 4;
          x = centre + (x - centre) * size;
        }
        positions[to + 3 * k + axis] = (x - origin[axis]) * scale;
      }
    }
  }
  return positions;
}

/** The triangles of a 2-D mesh that are shown. */
export function shownTriangles(shown: Uint8Array): Uint32Array {
  const list = new Numbers();
  for (let t = 0; t < shown.length && list.length < MOST_TRIANGLES; ++t) {
    if (shown[t]) list.push(t);
  }
  return list.take();
}

/** As facePositions, of triangles in the plane. */
export function trianglePositions(mesh: MeshData, list: Uint32Array, frame: Frame, size: number): Float32Array {
  const { points: p, simplices: s } = mesh;
  const { origin, scale } = frame;
  const positions = new Float32Array(9 * list.length);
  for (let i = 0, to = 0; i < list.length; ++i, to += 9) {
    const first = 3 * list[i];
    for (let axis = 0; axis < 2; ++axis) {
      const centre = (p[2 * s[first] + axis] + p[2 * s[first + 1] + axis] + p[2 * s[first + 2] + axis]) / 3;
      for (let k = 0; k < 3; ++k) {
        const x = centre + (p[2 * s[first + k] + axis] - centre) * size;
        positions[to + 3 * k + axis] = (x - origin[axis]) * scale;
      }
    }
  }
  return positions;
}

/** A cut through elements: triangles with the element of each, and their corners on edges of the mesh. */
export interface Section {
  readonly elements: Uint32Array;
  readonly positions: Float32Array;
  /** Two vertices of the mesh and the weight of the second, for each corner. */
  readonly ends: Uint32Array;
  readonly weights: Float32Array;
  /** For each corner, bit k is set if the edge opposite the k-th corner of its triangle is not one of the cut. */
  readonly inner: Uint8Array;
}

export function sectionOf(mesh: MeshData, shown: Uint8Array, heights: Float64Array, frame: Frame): Section {
  const { points: p, simplices: s } = mesh;
  const { origin, scale } = frame;
  const elements = new Numbers();
  const ends = new Numbers();
  const inner: number[] = [];
  const above: number[] = [];
  const below: number[] = [];
  const corner = (from: number, to: number): void => {
    ends.push(from);
    ends.push(to);
  };
  for (let t = 0, i = 0; t < shown.length; ++t, i += 4) {
    if (!shown[t]) continue;
    let count = 0;
    for (let k = 0; k < 4; ++k) count += heights[s[i + k]] > 0 ? 1 : 0;
    if (count === 0 || count === 4) continue;
    above.length = below.length = 0;
    for (let k = 0; k < 4; ++k) (heights[s[i + k]] > 0 ? above : below).push(s[i + k]);
    if (count !== 2) {
      const [tip, base] = count === 1 ? [above[0], below] : [below[0], above];
      elements.push(t);
      for (const other of base) corner(tip, other);
      inner.push(0, 0, 0);
    } else {
      // A quadrangle, in the order of its sides.
      const quad = [above[0], below[0], above[0], below[1], above[1], below[1], above[1], below[0]];
      for (const [k, l, m, mask] of [[0, 1, 2, 2], [0, 2, 3, 4]]) {
        elements.push(t);
        for (const at of [k, l, m]) corner(quad[2 * at], quad[2 * at + 1]);
        inner.push(mask, mask, mask);
      }
    }
  }
  const list = ends.take();
  const corners = list.length / 2;
  const positions = new Float32Array(3 * corners);
  const weights = new Float32Array(corners);
  for (let c = 0; c < corners; ++c) {
    const a = list[2 * c];
    const b = list[2 * c + 1];
    const weight = heights[a] / (heights[a] - heights[b]);
    weights[c] = weight;
    for (let axis = 0; axis < 3; ++axis) {
      const x = p[3 * a + axis] + weight * (p[3 * b + axis] - p[3 * a + axis]);
      positions[3 * c + axis] = (x - origin[axis]) * scale;
    }
  }
  return { elements: elements.take(), positions, ends: list, weights, inner: Uint8Array.from(inner) };
}
