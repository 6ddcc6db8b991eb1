// The mesh that a page holds.
//
// A page has one element <script type="application/json" id="mesh">, the header, and for each array an element
// <script type="application/octet-stream" id="…"> with its bytes in base64, little-endian. Browsers execute neither.
// docs/view.md is the definition; client/viewer/page.cc and client/python/src/wellspace/_view.py write it.

export interface Part {
  readonly tag: number;
  readonly name: string;
  readonly facets: number;
}

export interface Region {
  readonly id: number;
  readonly name: string;
}

/** Numbers of the vertices, or of the simplices. */
export interface Field {
  readonly name: string;
  readonly values: Float64Array;
}

export interface MeshData {
  readonly name: string;
  readonly dimension: 2 | 3;
  /** The axis that points upwards: 0, 1 or 2. */
  readonly up: number;
  readonly points: Float64Array;
  readonly simplices: Uint32Array;
  readonly facets: Uint32Array;
  readonly boundary: readonly Part[];
  readonly regions: readonly Region[];
  /** For each simplex the index of its region; empty: all are of the first. */
  readonly regionOf: Uint32Array;
  /** Of the vertices. */
  readonly fields: readonly Field[];
  readonly simplexFields: readonly Field[];
}

interface Header {
  format: number;
  name: string;
  dimension: number;
  up: number;
  vertices: number;
  simplices: number;
  boundary: Part[];
  regions: Region[];
  has_simplex_regions: boolean;
  fields: string[];
  simplex_fields: string[];
}

export class DataError extends Error {}

function elementText(id: string): string {
  const element = document.getElementById(id);
  if (!element) throw new DataError(`The page has no ${id}.`);
  const text = element.textContent ?? "";
  element.remove(); // Its memory is that of the mesh once more.
  return text;
}

type WithBase64 = { fromBase64?: (text: string) => Uint8Array<ArrayBuffer> };

function decodeBase64(text: string): Uint8Array<ArrayBuffer> {
  const native = (Uint8Array as unknown as WithBase64).fromBase64;
  if (native) return native.call(Uint8Array, text);
  const code = new Uint8Array(128);
  const alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (let i = 0; i < 64; ++i) code[alphabet.charCodeAt(i)] = i;
  let length = text.length;
  while (length > 0 && text.charCodeAt(length - 1) === 61) --length;
  const bytes = new Uint8Array(Math.floor((length * 3) / 4));
  for (let from = 0, to = 0; from < length; from += 4, to += 3) {
    const word =
      (code[text.charCodeAt(from)] << 18) |
      (code[text.charCodeAt(from + 1)] << 12) |
      (from + 2 < length ? code[text.charCodeAt(from + 2)] << 6 : 0) |
      (from + 3 < length ? code[text.charCodeAt(from + 3)] : 0);
    bytes[to] = word >> 16;
    bytes[to + 1] = (word >> 8) & 255;
    bytes[to + 2] = word & 255;
  }
  return bytes;
}

function bytesOf(id: string, length: number): ArrayBuffer {
  const bytes = decodeBase64(elementText(id).trim());
  if (bytes.length !== length) {
    throw new DataError(`The page has ${bytes.length} bytes of ${id}; expected ${length}.`);
  }
  return bytes.buffer;
}

function checkIndices(what: string, indices: Uint32Array, vertices: number): void {
  for (let i = 0; i < indices.length; ++i) {
    if (indices[i] >= vertices) {
      throw new DataError(`${what} has the vertex ${indices[i]} at ${i}; expected less than ${vertices}.`);
    }
  }
}

/** Swaps two corners of each tetrahedron that is negatively oriented, as files may have them. */
function orient(p: Float64Array, s: Uint32Array): void {
  for (let i = 0; i < s.length; i += 4) {
    const a = 3 * s[i];
    const b = 3 * s[i + 1];
    const c = 3 * s[i + 2];
    const d = 3 * s[i + 3];
    const vx = p[c] - p[a];
    const vy = p[c + 1] - p[a + 1];
    const vz = p[c + 2] - p[a + 2];
    const wx = p[d] - p[a];
    const wy = p[d + 1] - p[a + 1];
    const wz = p[d + 2] - p[a + 2];
    const volume6 =
      (p[b] - p[a]) * (vy * wz - vz * wy) +
      (p[b + 1] - p[a + 1]) * (vz * wx - vx * wz) +
      (p[b + 2] - p[a + 2]) * (vx * wy - vy * wx);
    if (volume6 < 0) {
      const last = s[i + 3];
      s[i + 3] = s[i + 2];
      s[i + 2] = last;
    }
  }
}

/** Reads the mesh of this page. Throws a DataError that names the fault. */
export function readMesh(): MeshData {
  const header = JSON.parse(elementText("mesh")) as Header;
  if (header.format !== 1) throw new DataError(`The mesh has format ${header.format}; this page reads format 1.`);
  const d = header.dimension;
  if (d !== 2 && d !== 3) throw new DataError(`The mesh has dimension ${d}; this page shows 2 and 3.`);
  const n = header.vertices;
  const m = header.simplices;
  const facets = header.boundary.reduce((sum, part) => sum + part.facets, 0);
  const mesh: MeshData = {
    name: header.name,
    dimension: d,
    up: header.up,
    points: new Float64Array(bytesOf("mesh-points", n * d * 8)),
    simplices: new Uint32Array(bytesOf("mesh-simplices", m * (d + 1) * 4)),
    facets: new Uint32Array(bytesOf("mesh-facets", facets * d * 4)),
    boundary: header.boundary,
    regions: header.regions,
    regionOf: header.has_simplex_regions ? new Uint32Array(bytesOf("mesh-regions", m * 4)) : new Uint32Array(0),
    fields: header.fields.map((name, i) => ({ name, values: new Float64Array(bytesOf(`mesh-field${i}`, n * 8)) })),
    simplexFields: header.simplex_fields.map((name, i) => ({
      name,
      values: new Float64Array(bytesOf(`mesh-simplex-field${i}`, m * 8)),
    })),
  };
  checkIndices("simplices", mesh.simplices, n);
  checkIndices("facets", mesh.facets, n);
  mesh.regionOf.forEach((region, i) => {
    if (region >= header.regions.length) throw new DataError(`The simplex ${i} is of the region ${region}.`);
  });
  if (d === 3) orient(mesh.points, mesh.simplices);
  return mesh;
}
