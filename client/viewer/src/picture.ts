// Drawables of three.js: triangles coloured by one number a corner, with their edges; and lines of some pixels' width.

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  DoubleSide,
  GLSL3,
  LinearFilter,
  LinearSRGBColorSpace,
  Mesh,
  NearestFilter,
  RawShaderMaterial,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import type { Camera } from "./camera.js";
import { COLOURS, PLAIN, textureOf } from "./colours.js";

const SURFACE_VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec4 clip;
in vec3 position;
in float value;
in float inner;
out vec3 viewed;
out vec3 sides;
out float number;
out float over;
void main() {
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  viewed = place.xyz;
  number = value;
  over = dot(position, clip.xyz) - clip.w;
  int corner = gl_VertexID % 3;
  int mask = int(inner + 0.5);
  sides = vec3(corner == 0, corner == 1, corner == 2);
  // An edge that is none of the mesh is never near.
  if ((mask & 1) != 0) sides.x = 1.0;
  if ((mask & 2) != 0) sides.y = 1.0;
  if ((mask & 4) != 0) sides.z = 1.0;
  gl_Position = projectionMatrix * place;
}`;

const SURFACE_FRAGMENT = `
precision highp float;
uniform sampler2D colours;
uniform vec3 plain, edgeColour;
uniform float edges, lit, behind;
in vec3 viewed;
in vec3 sides;
in float number;
in float over;
out vec4 colour;
void main() {
  if (over > 0.0) discard;
  vec3 base = number < 0.0 || isnan(number) ? plain : texture(colours, vec2(number, 0.5)).rgb;
  vec3 normal = normalize(cross(dFdx(viewed), dFdy(viewed)));
  // A lamp on either side of the eye: sides to the right are darker than sides to the left, and none is black.
  float light = 0.56;
  light += 0.34 * max(0.0, dot(normal, vec3(-0.35, 0.58, 0.735)));
  light += 0.2 * max(0.0, dot(normal, vec3(0.7, 0.1, 0.707)));
  if (!gl_FrontFacing) light *= behind;
  base *= mix(1.0, light, lit);
  vec3 width = fwidth(sides);
  vec3 near = smoothstep(width * 0.35, width * 1.25, sides);
  float edge = 1.0 - min(near.x, min(near.y, near.z));
  // Where triangles are a few pixels large, their edges would be all that is seen.
  edge *= edges * (1.0 - smoothstep(0.12, 0.5, max(width.x, max(width.y, width.z))));
  colour = vec4(mix(base, edgeColour, edge), 1.0);
}`;

const LINE_VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec2 halfSize;
uniform float pixels;
in vec3 position, other;
in float side, value;
out float number;
void main() {
  vec4 here = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  vec4 there = projectionMatrix * modelViewMatrix * vec4(other, 1.0);
  vec2 along = (there.xy / there.w - here.xy / here.w) * halfSize;
  float length2 = max(dot(along, along), 1e-20);
  along *= inversesqrt(length2);
  vec2 across = vec2(-along.y, along.x) * side - along * abs(side) * 0.6;
  here.xy += across * pixels * 0.5 / halfSize * here.w;
  number = value;
  gl_Position = here;
}`;

const LINE_FRAGMENT = `
precision highp float;
uniform sampler2D colours;
uniform vec3 plain;
in float number;
out vec4 colour;
void main() { colour = vec4(number < 0.0 ? plain : texture(colours, vec2(number, 0.5)).rgb, 1.0); }`;

/** Colours of the theme, as CSS has them. */
export interface Theme {
  readonly background: string;
  readonly edge: string;
  readonly accent: string;
}

export type Colours = "ramp" | "categories";

interface Uniforms {
  [name: string]: { value: unknown };
}

function texture(kind: Colours): DataTexture {
  const made = new DataTexture(textureOf(kind), COLOURS, 1);
  made.minFilter = made.magFilter = kind === "ramp" ? LinearFilter : NearestFilter;
  made.needsUpdate = true;
  return made;
}

function shaded(vertexShader: string, fragmentShader: string, uniforms: Uniforms): RawShaderMaterial {
  return new RawShaderMaterial({ vertexShader, fragmentShader, uniforms, glslVersion: GLSL3, side: DoubleSide });
}

function geometryOf(arrays: { [name: string]: [ArrayLike<number> & ArrayBufferView, number] }): BufferGeometry {
  const geometry = new BufferGeometry();
  for (const [name, [array, size]] of Object.entries(arrays)) {
    geometry.setAttribute(name, new BufferAttribute(array as Float32Array, size));
  }
  return geometry;
}

/** Two triangles for each line. `ends` has 6 numbers a line, `values` one. */
function lineGeometry(ends: Float32Array, values: Float32Array): BufferGeometry {
  const position = new Float32Array(18 * values.length);
  const other = new Float32Array(18 * values.length);
  const side = new Float32Array(6 * values.length);
  const value = new Float32Array(6 * values.length);
  const corners = [
    [0, 1],
    [0, -1],
    [1, 1],
    [1, 1],
    [0, -1],
    [1, -1],
  ];
  for (let i = 0; i < values.length; ++i) {
    corners.forEach(([end, sign], k) => {
      const at = 6 * i + k;
      for (let axis = 0; axis < 3; ++axis) {
        position[3 * at + axis] = ends[6 * i + 3 * end + axis];
        other[3 * at + axis] = ends[6 * i + 3 * (1 - end) + axis];
      }
      // Seen from the other end, left is right.
      side[at] = end === 0 ? sign : -sign;
      value[at] = values[i];
    });
  }
  return geometryOf({ position: [position, 3], other: [other, 3], side: [side, 1], value: [value, 1] });
}

/** The picture on a canvas. */
export class Picture {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly ramp = texture("ramp");
  private readonly categories = texture("categories");
  private readonly shared: Uniforms = {
    colours: { value: this.ramp },
    plain: { value: new Color(PLAIN[0] / 255, PLAIN[1] / 255, PLAIN[2] / 255) },
    edgeColour: { value: new Color() },
    edges: { value: 0.6 },
    lit: { value: 1 },
  };
  private readonly clip = { value: [0, 0, 0, 0] };
  private readonly halfSize = { value: new Vector2() };
  private readonly accent = new Color();
  private readonly surface: Mesh<BufferGeometry, RawShaderMaterial>;
  private readonly section: Mesh<BufferGeometry, RawShaderMaterial>;
  private readonly lines: Mesh<BufferGeometry, RawShaderMaterial>;
  private readonly marks: Mesh<BufferGeometry, RawShaderMaterial>;

  /** Throws if the browser has no WebGL 2. */
  constructor(
    readonly canvas: HTMLCanvasElement,
    isMap: boolean,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    this.renderer.outputColorSpace = LinearSRGBColorSpace; // Colours go through as they are.
    this.shared.lit.value = isMap ? 0 : 1;
    const line = (pixels: number, plain: unknown): Uniforms => ({
      colours: { value: this.categories },
      plain: { value: plain },
      halfSize: this.halfSize,
      pixels: { value: pixels },
    });
    const surface = shaded(SURFACE_VERTEX, SURFACE_FRAGMENT, {
      ...this.shared,
      clip: this.clip,
      behind: { value: 0.75 },
    });
    const section = shaded(SURFACE_VERTEX, SURFACE_FRAGMENT, {
      ...this.shared,
      clip: { value: [0, 0, 0, 1] },
      behind: { value: 1 },
    });
    this.surface = new Mesh(new BufferGeometry(), surface);
    this.section = new Mesh(new BufferGeometry(), section);
    this.lines = new Mesh(new BufferGeometry(), shaded(LINE_VERTEX, LINE_FRAGMENT, line(2, this.shared.plain.value)));
    this.marks = new Mesh(new BufferGeometry(), shaded(LINE_VERTEX, LINE_FRAGMENT, line(3, this.accent)));
    this.lines.material.depthTest = this.marks.material.depthTest = false;
    for (const [i, mesh] of [this.surface, this.section, this.lines, this.marks].entries()) {
      mesh.frustumCulled = false;
      mesh.renderOrder = i;
      mesh.visible = false;
      this.scene.add(mesh);
    }
  }

  setTheme(theme: Theme): void {
    this.renderer.setClearColor(new Color(theme.background).convertLinearToSRGB());
    (this.shared.edgeColour.value as Color).set(theme.edge).convertLinearToSRGB();
    this.accent.set(theme.accent).convertLinearToSRGB();
  }

  setColours(colours: Colours): void {
    this.surface.material.uniforms.colours.value = this.section.material.uniforms.colours.value =
      colours === "ramp" ? this.ramp : this.categories;
  }

  set edges(strength: number) {
    this.shared.edges.value = strength;
  }

  /** Discards points at normal·x > offset; null: none. */
  setClip(normal: readonly number[] | null, offset: number): void {
    this.clip.value = normal ? [...normal, offset] : [0, 0, 0, 1];
  }

  setSurface(positions: Float32Array, values: Float32Array): void {
    const inner = new Uint8Array(values.length);
    this.replace(this.surface, geometryOf({ position: [positions, 3], value: [values, 1], inner: [inner, 1] }));
  }

  setSurfaceValues(values: Float32Array): void {
    this.surface.geometry.setAttribute("value", new BufferAttribute(values, 1));
  }

  setSection(positions: Float32Array, values: Float32Array, inner: Uint8Array): void {
    this.replace(this.section, geometryOf({ position: [positions, 3], value: [values, 1], inner: [inner, 1] }));
  }

  setLines(ends: Float32Array, values: Float32Array): void {
    this.replace(this.lines, lineGeometry(ends, values));
  }

  /** Lines in the accent's colour, before all else. */
  setMarks(ends: Float32Array): void {
    this.replace(this.marks, lineGeometry(ends, new Float32Array(ends.length / 6).fill(-1)));
  }

  private replace(mesh: Mesh, geometry: BufferGeometry): void {
    mesh.geometry.dispose();
    mesh.geometry = geometry;
    mesh.visible = geometry.getAttribute("position").count > 0;
  }

  resize(width: number, height: number, ratio: number): void {
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.halfSize.value.set(width / 2, height / 2);
  }

  draw(camera: Camera): void {
    this.renderer.render(this.scene, camera.three);
  }
}

/**
 * The first triangle of `positions` that a ray meets where `keeps` says so: its index, or −1.
 *
 * Complexity: O(triangles); a click is rare.
 */
export function pick(
  positions: Float32Array,
  origin: Vector3,
  direction: Vector3,
  keeps: (point: Vector3) => boolean,
): { triangle: number; distance: number } {
  const [ox, oy, oz] = origin.toArray();
  const [dx, dy, dz] = direction.toArray();
  const point = new Vector3();
  let best = { triangle: -1, distance: Infinity };
  for (let i = 0; i < positions.length; i += 9) {
    const ax = positions[i] - ox;
    const ay = positions[i + 1] - oy;
    const az = positions[i + 2] - oz;
    const ux = positions[i + 3] - positions[i];
    const uy = positions[i + 4] - positions[i + 1];
    const uz = positions[i + 5] - positions[i + 2];
    const vx = positions[i + 6] - positions[i];
    const vy = positions[i + 7] - positions[i + 1];
    const vz = positions[i + 8] - positions[i + 2];
    const px = dy * vz - dz * vy;
    const py = dz * vx - dx * vz;
    const pz = dx * vy - dy * vx;
    const determinant = ux * px + uy * py + uz * pz;
    if (determinant === 0) continue;
    const s = -(ax * px + ay * py + az * pz) / determinant;
    if (s < 0 || s > 1) continue;
    const qx = -(ay * uz - az * uy);
    const qy = -(az * ux - ax * uz);
    const qz = -(ax * uy - ay * ux);
    const t = (dx * qx + dy * qy + dz * qz) / determinant;
    if (t < 0 || s + t > 1) continue;
    const distance = (vx * qx + vy * qy + vz * qz) / determinant;
    if (distance <= 0 || distance >= best.distance) continue;
    if (keeps(point.copy(direction).multiplyScalar(distance).add(origin))) best = { triangle: i / 9, distance };
  }
  return best;
}
