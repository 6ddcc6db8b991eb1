// Numbers of the elements: angles, ratios, lengths, and means of what the vertices have.

import type { MeshData } from "./data.js";

export interface Measure {
  readonly id: string;
  readonly label: string;
  /** The unit that follows a number. */
  readonly unit: string;
  /** The bad end of the values. */
  readonly worst: "low" | "high" | null;
  readonly logarithmic: boolean;
  /** One number for each element; NaN where there is none. */
  readonly values: Float64Array;
  /** For data: one number for each vertex. */
  readonly ofVertices?: Float64Array;
}

const DEGREES = 180 / Math.PI;
const clampedAcos = (x: number): number => Math.acos(x > 1 ? 1 : x < -1 ? -1 : x);

function triangles(mesh: MeshData, each: (a: number, b: number, c: number, area2: number) => number): Float64Array {
  const { points: p, simplices: s } = mesh;
  const values = new Float64Array(s.length / 3);
  for (let t = 0, i = 0; t < values.length; ++t, i += 3) {
    const u = 2 * s[i];
    const v = 2 * s[i + 1];
    const w = 2 * s[i + 2];
    const area2 = (p[v] - p[u]) * (p[w + 1] - p[u + 1]) - (p[w] - p[u]) * (p[v + 1] - p[u + 1]);
    const a = Math.hypot(p[v] - p[w], p[v + 1] - p[w + 1]);
    const b = Math.hypot(p[w] - p[u], p[w + 1] - p[u + 1]);
    const c = Math.hypot(p[u] - p[v], p[u + 1] - p[v + 1]);
    values[t] = each(a, b, c, Math.abs(area2));
  }
  return values;
}

function smallestAngle(a: number, b: number, c: number, area2: number): number {
  // Between the two longer edges, opposite the shortest one.
  const longest = Math.max(a, b, c);
  const shortest = Math.min(a, b, c);
  const middle = a + b + c - longest - shortest;
  return Math.asin(Math.min(1, area2 / (longest * middle))) * DEGREES;
}

function edgesSquared(p: Float64Array, a: number, b: number): number {
  const x = p[a] - p[b];
  const y = p[a + 1] - p[b + 1];
  const z = p[a + 2] - p[b + 2];
  return x * x + y * y + z * z;
}

function tetrahedra(mesh: MeshData, each: (a: number, b: number, c: number, d: number) => number): Float64Array {
  const s = mesh.simplices;
  const values = new Float64Array(s.length / 4);
  for (let t = 0, i = 0; t < values.length; ++t, i += 4) {
    values[t] = each(3 * s[i], 3 * s[i + 1], 3 * s[i + 2], 3 * s[i + 3]);
  }
  return values;
}

function longestEdge(p: Float64Array, a: number, b: number, c: number, d: number): number {
  const ab = edgesSquared(p, a, b);
  const ac = edgesSquared(p, a, c);
  const ad = edgesSquared(p, a, d);
  const bc = edgesSquared(p, b, c);
  const bd = edgesSquared(p, b, d);
  const cd = edgesSquared(p, c, d);
  return Math.sqrt(Math.max(ab, ac, ad, bc, bd, cd));
}

function smallestDihedral(mesh: MeshData): Float64Array {
  const p = mesh.points;
  const n = new Float64Array(12);
  const lengths = new Float64Array(4);
  return tetrahedra(mesh, (a, b, c, d) => {
    const ux = p[b] - p[a];
    const uy = p[b + 1] - p[a + 1];
    const uz = p[b + 2] - p[a + 2];
    const vx = p[c] - p[a];
    const vy = p[c + 1] - p[a + 1];
    const vz = p[c + 2] - p[a + 2];
    const wx = p[d] - p[a];
    const wy = p[d + 1] - p[a + 1];
    const wz = p[d + 2] - p[a + 2];
    // Normals of the three faces at the first corner, which look inward, and minus their sum.
    n[3] = vy * wz - vz * wy;
    n[4] = vz * wx - vx * wz;
    n[5] = vx * wy - vy * wx;
    n[6] = wy * uz - wz * uy;
    n[7] = wz * ux - wx * uz;
    n[8] = wx * uy - wy * ux;
    n[9] = uy * vz - uz * vy;
    n[10] = uz * vx - ux * vz;
    n[11] = ux * vy - uy * vx;
    for (let k = 0; k < 3; ++k) n[k] = -(n[3 + k] + n[6 + k] + n[9 + k]);
    for (let f = 0; f < 4; ++f) lengths[f] = Math.sqrt(n[3 * f] ** 2 + n[3 * f + 1] ** 2 + n[3 * f + 2] ** 2);
    let most = -1;
    for (let f = 0; f < 4; ++f) {
      for (let g = f + 1; g < 4; ++g) {
        const dot = n[3 * f] * n[3 * g] + n[3 * f + 1] * n[3 * g + 1] + n[3 * f + 2] * n[3 * g + 2];
        const cosine = -dot / (lengths[f] * lengths[g]);
        if (!(cosine <= most)) most = cosine;
      }
    }
    return clampedAcos(most) * DEGREES;
  });
}

function radiusEdge(mesh: MeshData): Float64Array {
  const p = mesh.points;
  return tetrahedra(mesh, (a, b, c, d) => {
    const ux = p[b] - p[a];
    const uy = p[b + 1] - p[a + 1];
    const uz = p[b + 2] - p[a + 2];
    const vx = p[c] - p[a];
    const vy = p[c + 1] - p[a + 1];
    const vz = p[c + 2] - p[a + 2];
    const wx = p[d] - p[a];
    const wy = p[d + 1] - p[a + 1];
    const wz = p[d + 2] - p[a + 2];
    const uu = ux * ux + uy * uy + uz * uz;
    const vv = vx * vx + vy * vy + vz * vz;
    const ww = wx * wx + wy * wy + wz * wz;
    const px = vy * wz - vz * wy;
    const py = vz * wx - vx * wz;
    const pz = vx * wy - vy * wx;
    const qx = wy * uz - wz * uy;
    const qy = wz * ux - wx * uz;
    const qz = wx * uy - wy * ux;
    const rx = uy * vz - uz * vy;
    const ry = uz * vx - ux * vz;
    const rz = ux * vy - uy * vx;
    const volume6 = ux * px + uy * py + uz * pz;
    const x = uu * px + vv * qx + ww * rx;
    const y = uu * py + vv * qy + ww * ry;
    const z = uu * pz + vv * qz + ww * rz;
    const radius = Math.sqrt(x * x + y * y + z * z) / Math.abs(2 * volume6);
    const shortest = Math.min(uu, vv, ww, edgesSquared(p, b, c), edgesSquared(p, b, d), edgesSquared(p, c, d));
    return radius / Math.sqrt(shortest);
  });
}

function meansOf(mesh: MeshData, ofVertices: Float64Array): Float64Array {
  const corners = mesh.dimension + 1;
  const s = mesh.simplices;
  const values = new Float64Array(s.length / corners);
  for (let t = 0, i = 0; t < values.length; ++t) {
    let sum = 0;
    for (const end = i + corners; i < end; ++i) sum += ofVertices[s[i]];
    values[t] = sum / corners;
  }
  return values;
}

/** Powers of coordinates are computed: such as leave the range of numbers by that are scaled first. */
function withScale(mesh: MeshData): { scaled: MeshData; unit: number } {
  const range = rangeOf(mesh.points);
  const extent = range ? Math.max(Math.abs(range.low), Math.abs(range.high)) : 1;
  if (extent === 0 || (extent > 1e-40 && extent < 1e40)) return { scaled: mesh, unit: 1 };
  const unit = 2 ** Math.round(Math.log2(extent));
  return { scaled: { ...mesh, points: mesh.points.map((x) => x / unit) }, unit };
}

/** A measure that a mesh has, by name; its numbers are computed when they are asked for. */
export interface NamedMeasure {
  readonly id: string;
  readonly label: string;
  readonly group: "Quality" | "Size" | "Data";
  /** Whether the vertices have the numbers, of which an element has the mean. */
  readonly isOfVertices: boolean;
  readonly make: () => Measure;
}

export function measuresOf(mesh: MeshData): NamedMeasure[] {
  const is3d = mesh.dimension === 3;
  const angle = is3d ? "Smallest dihedral angle" : "Smallest angle";
  const measure = (
    id: string,
    label: string,
    unit: string,
    worst: Measure["worst"],
    logarithmic: boolean,
    values: () => Float64Array,
  ): NamedMeasure => ({
    id,
    label,
    group: id === "size" ? "Size" : "Quality",
    isOfVertices: false,
    make: (): Measure => ({ id, label, unit, worst, logarithmic, values: values() }),
  });
  const { scaled, unit } = withScale(mesh);
  const p = scaled.points;
  const list = [
    measure("angle", angle, "°", "low", false, () =>
      is3d ? smallestDihedral(scaled) : triangles(scaled, smallestAngle),
    ),
    measure("ratio", "Radius-edge ratio", "", "high", false, () =>
      is3d
        ? radiusEdge(scaled)
        : triangles(scaled, (a, b, c, area2) => (a * b * c) / (2 * area2) / Math.min(a, b, c)),
    ),
    measure("size", "Longest edge", "", null, true, () =>
      is3d
        ? tetrahedra(scaled, (a, b, c, d) => unit * longestEdge(p, a, b, c, d))
        : triangles(scaled, (a, b, c) => unit * Math.max(a, b, c)),
    ),
  ];
  const data = (id: string, label: string, numbers: () => Pick<Measure, "values" | "ofVertices">): NamedMeasure => ({
    id,
    label,
    group: "Data",
    isOfVertices: !id.startsWith("simplex"),
    make: () => ({ id, label, unit: "", worst: null, logarithmic: false, ...numbers() }),
  });
  const ofVertices = mesh.fields.map(({ name, values }, i) =>
    data(`field${i}`, name, () => ({ values: meansOf(mesh, values), ofVertices: values })),
  );
  const ofSimplices = mesh.simplexFields.map(({ name, values }, i) =>
    data(`simplex-field${i}`, name, () => ({ values })),
  );
  return [...list, ...ofVertices, ...ofSimplices];
}

/** The range of the numbers that are finite; null where there is none. */
export function rangeOf(values: ArrayLike<number>): { low: number; high: number } | null {
  let low = Infinity;
  let high = -Infinity;
  for (let i = 0; i < values.length; ++i) {
    const value = values[i];
    if (value < low && value > -Infinity) low = value;
    if (value > high && value < Infinity) high = value;
  }
  return low <= high ? { low, high } : null;
}

/** The elements with the worst numbers, the worst first; such without a number are worst of all. */
export function worstElements(measure: Measure, count: number): number[] {
  const badness = (t: number): number => {
    const value = measure.values[t];
    return Number.isNaN(value) ? -Infinity : measure.worst === "high" ? -value : value;
  };
  const worst: number[] = [];
  for (let t = 0; t < measure.values.length; ++t) {
    const bad = badness(t);
    if (worst.length === count && !(bad < badness(worst[count - 1]))) continue;
    let place = Math.min(worst.length, count - 1);
    while (place > 0 && bad < badness(worst[place - 1])) {
      worst[place] = worst[place - 1];
      --place;
    }
    worst[place] = t;
  }
  return worst;
}
