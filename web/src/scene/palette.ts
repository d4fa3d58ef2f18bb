// Colours of tissues by their names, colour maps, and the two themes.
//
// To add a colour map: one entry in `MAPS` below with its source, its colours evenly spaced from
// the least value to the greatest, and the lines that are seen on it. To use it: name it in
// `MAP_OF` at the quantity that it shows. Nothing else of the page names a map, and none needs
// words: the legend shows the quantity.
// To add a tissue's colour: one line in `TISSUES`.

import { DataTexture, LinearFilter, RGBAFormat, SRGBColorSpace } from 'three';
import type { LayerInfo } from '../generated/api';
import type { Quantity } from './quantities';

/** Skin in sections and legends. */
export const SKIN = '#dba17b';
/** Skin as a surface is paler than its section. */
export const SKIN_IN_LIGHT = '#dcae98';

/** Parts of tissue names, mostly of the catalogue; the first that occurs in a
 * layer's name counts. */
const TISSUES: [string, string][] = [
  ['epidermis', '#e3b08d'],
  ['dermis', '#d9a07c'],
  ['skin', SKIN],
  ['subcut', '#f0d68f'],
  ['fat', '#f0d68f'],
  ['adipose', '#f0d68f'],
  ['fascia', '#e8e2d4'],
  ['tendon', '#e6ddc8'],
  ['muscle', '#b0574c'],
  ['soleus', '#b0574c'],
  ['gastrocnemius', '#bd655a'],
  ['liver', '#8f4a3c'],
  ['gland', '#dfa6a0'],
  ['breast', '#e7b9a6'],
  ['brain', '#d8b4ac'],
  ['cartilage', '#cfdde0'],
  ['bone', '#e9e1cc'],
];
/** For layers with other names; safe for colour-blind eyes (after Okabe and Ito, softened). */
const OTHERS = ['#d9a07c', '#8fb8d6', '#e8c66b', '#7fb8a0', '#c98fb0', '#a7a1d1', '#d3886a', '#9fb37a'];

export const BONE = '#e9e2cf';
/** The rigid core between bones. */
export const CORE = '#c3b7a3';
export const LUMP = '#7d5ba6';

/** A colour for every layer, from the skin down: the same on the body, in its
 * section and in legends. */
export function layerColours(layers: readonly Pick<LayerInfo, 'name'>[]): string[] {
  const taken = new Set<string>();
  return layers.map(({ name }, i) => {
    const wanted = TISSUES.find(([part]) => name.toLowerCase().includes(part))?.[1];
    let colour = wanted && !taken.has(wanted) ? wanted : undefined;
    for (let k = 0; colour === undefined; k++) {
      const other = OTHERS[(i + k) % OTHERS.length];
      if (!taken.has(other) || k >= OTHERS.length) colour = other;
    }
    taken.add(colour);
    return colour;
  });
}

interface ColourMap {
  /** Evenly spaced, from the least value to the greatest. */
  stops: string[];
  /** Lines on the map's colours: white where most of them are dark, else those of the theme. */
  lines: 'white' | 'theme';
}

const MAPS = {
  /** YlGnBu (Brewer, 2002), safe for colour-blind eyes; small values are light, so that a body at
   * rest shows its shape. */
  ylgnbu: {
    stops: ['#fbf8d0', '#edf4b1', '#c7e9b4', '#7fcdbb', '#41b6c4', '#1d91c0', '#225ea8', '#253494', '#081d58'],
    lines: 'white',
  },
  /** Cividis (Nuñez, Anderton and Renslow, 2018). */
  cividis: {
    stops: ['#00224e', '#123570', '#3b496c', '#575d6d', '#707173', '#8a8678', '#a59c74', '#c3b369', '#fee838'],
    lines: 'white',
  },
  /** Vik (Crameri, 2018), for signed values: blue below the middle, brown above. */
  vik: {
    stops: ['#001261', '#033e7d', '#1e6f9d', '#71a8c4', '#c9dde7', '#ece5e0', '#eacebd', '#d39774', '#be6533', '#8b2706', '#590008'],
    lines: 'theme',
  },
  /** Inferno (van der Walt and Smith, 2015), without its darkest end: what stands out glows. */
  inferno: {
    stops: ['#4a0c6b', '#781c6d', '#a52c60', '#cf4446', '#ed6925', '#fb9b06', '#f7d13d', '#fcffa4'],
    lines: 'theme',
  },
} satisfies Record<string, ColourMap>;
type MapName = keyof typeof MAPS;

/** The map of each quantity. */
const MAP_OF: Record<Quantity, MapName> = {
  displacement: 'ylgnbu',
  von_mises: 'ylgnbu',
  pressure: 'vik',
  stretch: 'ylgnbu',
  contact: 'ylgnbu',
  stiffness: 'cividis',
};

export function mapOf(quantity: Quantity): ColourMap {
  return MAPS[MAP_OF[quantity]];
}

/** The colours of the palpation map. */
export const PALPATION_STOPS = MAPS.inferno.stops;

export function palpationTexture(): DataTexture {
  return mapTexture(PALPATION_STOPS);
}

/** The texture of each quantity's map; quantities of one map share it. */
export function mapTextures(): Record<Quantity, DataTexture> {
  const made = Object.fromEntries(Object.entries(MAPS).map(([name, { stops }]) => [name, mapTexture(stops)]));
  return Object.fromEntries(Object.entries(MAP_OF).map(([quantity, name]) => [quantity, made[name]])) as Record<Quantity, DataTexture>;
}

function rgb(hex: string): [number, number, number] {
  const n = parseInt(hex.slice(1), 16);
  return [n >> 16, (n >> 8) & 255, n & 255];
}

/** A texture of one row. */
function mapTexture(colours: string[]): DataTexture {
  const stops = colours.map(rgb);
  const n = 256;
  const data = new Uint8Array(4 * n);
  for (let i = 0; i < n; i++) {
    const at = (i / (n - 1)) * (stops.length - 1);
    const k = Math.min(Math.floor(at), stops.length - 2);
    for (let c = 0; c < 3; c++) data[4 * i + c] = Math.round(stops[k][c] + (at - k) * (stops[k + 1][c] - stops[k][c]));
    data[4 * i + 3] = 255;
  }
  const texture = new DataTexture(data, n, 1, RGBAFormat);
  texture.colorSpace = SRGBColorSpace;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

export interface Theme {
  /** Colours of the background in its middle and at its corners. */
  background: [string, string];
  /** Background of the lens. */
  lens: string;
  shadow: number;
  shadowOpacity: number;
  /** Lines between layers. */
  outline: string;
  wire: string;
  wireOpacity: number;
  plane: string;
  /** Text and scale bar of a saved picture. */
  ink: string;
}

export const THEMES: Record<'light' | 'dark', Theme> = {
  light: {
    background: ['#fbfbfa', '#e3e6e8'],
    lens: '#f4f6f7',
    shadow: 0x1e2a33,
    shadowOpacity: 0.34,
    outline: '#2a1c17',
    wire: '#3a2a22',
    wireOpacity: 0.24,
    plane: '#4c7fa8',
    ink: '#33404a',
  },
  dark: {
    background: ['#2b3036', '#14171a'],
    lens: '#20252a',
    shadow: 0x000000,
    shadowOpacity: 0.6,
    outline: '#1a100d',
    wire: '#2b1b14',
    wireOpacity: 0.28,
    plane: '#7fb2d9',
    ink: '#d5dde3',
  },
};
