// Colours: of tissues by their names, of maps over a range, of the two themes.

import { DataTexture, LinearFilter, RGBAFormat, SRGBColorSpace } from 'three';
import type { LayerInfo } from '../generated/api';

export const SKIN = '#dba17b';
/** Skin as a surface is paler than its section. */
export const SKIN_IN_LIGHT = '#dcae98';

/** Names are those of the tissue catalogue; the first that is part of a layer's name counts. */
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
/** For layers whose names say nothing: told apart by eyes of all kinds (after Okabe and Ito, softened). */
const OTHERS = ['#d9a07c', '#8fb8d6', '#e8c66b', '#7fb8a0', '#c98fb0', '#a7a1d1', '#d3886a', '#9fb37a'];

export const BONE = '#e9e2cf';
/** The rigid core between bones. */
export const CORE = '#c3b7a3';
export const LUMP = '#7d5ba6';

/** The colour of every layer, from the skin down: the same in the body, its section, and legends. */
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

/** YlGnBu (Brewer, 2002), safe for colour-blind eyes. Nothing is light, so that a body of which little moves keeps its shape. */
const YLGNBU = ['#fbf8d0', '#edf4b1', '#c7e9b4', '#7fcdbb', '#41b6c4', '#1d91c0', '#225ea8', '#253494', '#081d58'];
/** Cividis (Nuñez, Anderton and Renslow, 2018). */
const CIVIDIS = ['#00224e', '#123570', '#3b496c', '#575d6d', '#707173', '#8a8678', '#a59c74', '#c3b369', '#fee838'];
/** Vik (Crameri, 2018): blue below the middle, brown above. */
const VIK = ['#001261', '#033e7d', '#1e6f9d', '#71a8c4', '#c9dde7', '#ece5e0', '#eacebd', '#d39774', '#be6533', '#8b2706', '#590008'];

export type MapName = 'ylgnbu' | 'cividis' | 'vik';
const MAPS: Record<MapName, string[]> = { ylgnbu: YLGNBU, cividis: CIVIDIS, vik: VIK };

export function mapStops(name: MapName): string[] {
  return MAPS[name];
}

function rgb(hex: string): [number, number, number] {
  const n = parseInt(hex.slice(1), 16);
  return [n >> 16, (n >> 8) & 255, n & 255];
}

/** A map as a texture of one row. */
export function mapTexture(name: MapName): DataTexture {
  const stops = MAPS[name].map(rgb);
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
  /** In the middle of the background and at its corners. */
  background: [string, string];
  shadow: number;
  shadowOpacity: number;
  /** Lines between layers. */
  outline: string;
  wire: string;
  wireOpacity: number;
  plane: string;
}

export const THEMES: Record<'light' | 'dark', Theme> = {
  light: {
    background: ['#fbfbfa', '#e3e6e8'],
    shadow: 0x1e2a33,
    shadowOpacity: 0.34,
    outline: '#2a1c17',
    wire: '#3a2a22',
    wireOpacity: 0.24,
    plane: '#4c7fa8',
  },
  dark: {
    background: ['#2b3036', '#14171a'],
    shadow: 0x000000,
    shadowOpacity: 0.6,
    outline: '#1a100d',
    wire: '#2b1b14',
    wireOpacity: 0.28,
    plane: '#7fb2d9',
  },
};
