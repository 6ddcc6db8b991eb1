// Colours of numbers and of names, those of `wellspace render`.

export type Rgb = readonly [number, number, number];

/** Knots of "viridis" by S. van der Walt and N. Smith (CC0), at even distances. */
const RAMP: readonly Rgb[] = [
  [68, 1, 84],
  [72, 36, 117],
  [65, 68, 135],
  [53, 95, 141],
  [42, 120, 142],
  [33, 145, 141],
  [34, 168, 132],
  [68, 191, 112],
  [122, 209, 81],
  [189, 223, 38],
  [253, 231, 37],
];

/** M. Okabe and K. Ito, "Color universal design", 2008: distinct for colour-blind readers too. */
const CATEGORIES: readonly Rgb[] = [
  [86, 180, 233],
  [230, 159, 0],
  [0, 158, 115],
  [240, 228, 66],
  [204, 121, 167],
  [0, 114, 178],
  [213, 94, 0],
  [166, 166, 166],
];
const SHADES = [1, 0.72, 0.5];

/** The colour of elements without a part, a region or a number. */
export const PLAIN: Rgb = [176, 182, 190];

/** The colour of a number in [0, 1]. */
export function rampColour(t: number): Rgb {
  const position = Math.min(1, Math.max(0, t)) * (RAMP.length - 1);
  const knot = Math.min(Math.floor(position), RAMP.length - 2);
  const weight = position - knot;
  const mix = (i: number): number => Math.round(RAMP[knot][i] * (1 - weight) + RAMP[knot + 1][i] * weight);
  return [mix(0), mix(1), mix(2)];
}

export function categoryColour(index: number): Rgb {
  const shade = SHADES[Math.floor(index / CATEGORIES.length) % SHADES.length];
  const [r, g, b] = CATEGORIES[index % CATEGORIES.length];
  return [Math.round(r * shade), Math.round(g * shade), Math.round(b * shade)];
}

export const cssColour = ([r, g, b]: Rgb): string => `rgb(${r} ${g} ${b})`;

/** How many colours a texture has. Categories beyond them begin anew, as their colours do. */
export const COLOURS = 240;

/** The texture of a ramp or of the categories: COLOURS pixels. */
export function textureOf(kind: "ramp" | "categories"): Uint8Array {
  const pixels = new Uint8Array(4 * COLOURS);
  for (let i = 0; i < COLOURS; ++i) {
    const colour = kind === "ramp" ? rampColour(i / (COLOURS - 1)) : categoryColour(i);
    pixels.set([...colour, 255], 4 * i);
  }
  return pixels;
}

/** The place of a category in the texture; −1 stands for PLAIN. */
export const categoryValue = (index: number): number => (index < 0 ? -1 : ((index % COLOURS) + 0.5) / COLOURS);
