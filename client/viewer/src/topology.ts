// The topology of tetrahedra: neighbours across faces, and faces that are facets of the boundary.

import type { MeshData } from "./data.js";

/** The corners of each face of a positively oriented tetrahedron, counterclockwise seen from outside. */
export const TET_FACES = [
  [1, 2, 3],
  [0, 3, 2],
  [0, 1, 3],
  [0, 2, 1],
] as const;

/** Face f of tetrahedron t, opposite its corner f, has the number 4·t + f in these arrays. */
export interface Topology {
  /** The tetrahedron on the other side of each face, or −1. */
  readonly neighbours: Int32Array;
  /** 1 + the index of the part that each face is of, or 0. */
  readonly partOf: Uint32Array;
}

/** Buckets above this many faces are searched by a map: a vertex may be in most of a mesh's tetrahedra. */
const SMALL_BUCKET = 96;

/**
 * Faces are sorted into buckets by their lowest vertex; within one, faces with the same other vertices are paired.
 *
 * Complexity: O(faces), by the bound on buckets that are searched one by one.
 */
export function topologyOf(mesh: MeshData): Topology {
  const faces = mesh.simplices.length;
  const n = mesh.points.length / 3;
  const total = faces + mesh.facets.length / 3;
  const starts = new Uint32Array(n + 1);
  forEachFace(mesh, (_, a, b, c) => ++starts[Math.min(a, b, c) + 1]);
  for (let v = 0; v < n; ++v) starts[v + 1] += starts[v];

  // Faces by their buckets, with the two vertices above the lowest.
  const order = new Uint32Array(total);
  const middle = new Uint32Array(total);
  const highest = new Uint32Array(total);
  const ends = starts.slice(0, n);
  forEachFace(mesh, (face, a, b, c) => {
    const low = Math.min(a, b, c);
    const high = Math.max(a, b, c);
    const at = ends[low]++;
    order[at] = face;
    middle[at] = a === low ? Math.min(b, c) : b === low ? Math.min(a, c) : Math.min(a, b);
    highest[at] = high;
  });

  const neighbours = new Int32Array(faces).fill(-1);
  const partOf = new Uint32Array(faces);
  const partOfFacet = new Uint32Array(total - faces);
  let facet = 0;
  mesh.boundary.forEach((part, i) => {
    partOfFacet.fill(i + 1, facet, facet + part.facets);
    facet += part.facets;
  });
  const pair = (x: number, y: number): void => {
    if (x < faces && y < faces) {
      if (neighbours[x] < 0 && neighbours[y] < 0) {
        neighbours[x] = y >> 2;
        neighbours[y] = x >> 2;
      }
    } else if (x < faces) {
      partOf[x] = partOfFacet[y - faces];
    } else if (y < faces) {
      partOf[y] = partOfFacet[x - faces];
    }
  };
  for (let v = 0; v < n; ++v) {
    const from = starts[v];
    const to = starts[v + 1];
    if (to - from <= SMALL_BUCKET) {
      for (let i = from + 1; i < to; ++i) {
        const b = middle[i];
        const c = highest[i];
        for (let j = from; j < i; ++j) {
          if (highest[j] === c && middle[j] === b) pair(order[j], order[i]);
        }
      }
      continue;
    }
    const same = new Map<number, number[]>();
    for (let i = from; i < to; ++i) {
      const x = order[i];
      const key = middle[i] * n + highest[i];
      const others = same.get(key);
      if (others === undefined) {
        same.set(key, [x]);
      } else if (others.length < 4) {
        for (const y of others) pair(y, x);
        others.push(x);
      }
    }
  }
  return { neighbours, partOf };
}

/** Calls `each` for the faces of all tetrahedra, then for the facets. */
function forEachFace(mesh: MeshData, each: (face: number, a: number, b: number, c: number) => void): void {
  const { simplices: s, facets } = mesh;
  for (let i = 0; i < s.length; i += 4) {
    const a = s[i];
    const b = s[i + 1];
    const c = s[i + 2];
    const d = s[i + 3];
    each(i, b, c, d);
    each(i + 1, a, c, d);
    each(i + 2, a, b, d);
    each(i + 3, a, b, c);
  }
  let face = s.length;
  for (let i = 0; i < facets.length; i += 3) each(face++, facets[i], facets[i + 1], facets[i + 2]);
}
