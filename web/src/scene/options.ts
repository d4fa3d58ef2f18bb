// The options of the view, and the types of what it reports.

import type { MapKind } from './palpation';
import type { ColourBy } from './quantities';

export type Vec3 = [number, number, number];

/** Names for screen readers. */
interface ViewWords {
  canvas: string;
  plane: string;
}

export interface ViewOptions {
  words: ViewWords;
  theme: 'light' | 'dark';
  colourBy: ColourBy;
  /** Range of the colour map, SI; null is automatic: it grows at once and shrinks slowly. */
  range: [number, number] | null;
  /** From the skin down; a missing one is visible and opaque. */
  layers: { visible: boolean; opacity: number }[];
  bones: boolean;
  /** In the section, and through transparent layers. */
  lumps: boolean;
  /** Edges of prisms. */
  wireframe: boolean;
  shadows: boolean;
  /** `position` runs from 0 to 1 through the body. */
  cutaway: { on: boolean; axis: 'x' | 'y' | 'z' | 'view' | 'tool'; position: number; flip: boolean };
  tool: boolean;
  force: boolean;
  coverage: boolean;
  /** What the palpation map shows on the skin. */
  palpation: MapKind;
  /** The enlarged section through the tool, while it touches. */
  lens: boolean;
  reducedMotion: boolean;
}

export const DEFAULT_OPTIONS: ViewOptions = {
  words: { canvas: '', plane: '' },
  theme: 'light',
  colourBy: 'tissue',
  range: null,
  layers: [],
  bones: true,
  lumps: true,
  wireframe: false,
  shadows: true,
  cutaway: { on: false, axis: 'x', position: 0.5, flip: false },
  tool: true,
  force: true,
  coverage: true,
  palpation: 'surroundings',
  lens: true,
  reducedMotion: false,
};

/** A colour of a legend; `name` is that of a tissue. */
export interface Category {
  name: string;
  colour: string;
}

export interface Legend {
  title: ColourBy;
  unit: string;
  min: number;
  max: number;
  /** Colours from `min` to `max`, evenly spaced: stops of a CSS gradient. */
  stops: string[];
  /** Whether the stops are evenly spaced in the logarithm. */
  isLog?: boolean;
  categories?: Category[];
}

/** The legend of the palpation map. */
export interface MapLegend {
  kind: 'absolute' | 'surroundings';
  /** Range of the colours: N/m, or shares of the surroundings. */
  range: [number, number];
  stops: string[];
  /** Number of places that were felt, and of those that were forgotten. */
  n: number;
  nForgotten: number;
  /** By how much the place that stands out is stiffer than its surroundings; null if none stands out. */
  finding: number | null;
}

/** Areas of the section, m². */
export interface SectionArea {
  total: number;
  layers: number[];
  lumps: number;
}

export interface Picked {
  /** At rest, m. */
  point: Vec3;
  normal: Vec3;
  part: 'skin' | 'section' | 'bone';
}

/** The browser has no WebGL2. */
export class NoWebGL2 extends Error {
  constructor() {
    super('this browser has no WebGL2');
    this.name = 'NoWebGL2';
  }
}
