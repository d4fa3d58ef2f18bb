// A look at a body: camera, colours and cutaway as plain data, for saved views and for links.

import type { CameraPose, ViewOptions } from '../scene';
import { COLOURINGS, DEFAULT_OPTIONS } from '../scene';
import { bodyView } from './body';
import { show, wanted } from './settings';

const SWITCHES = ['bones', 'lumps', 'wireframe', 'shadows', 'tool', 'force'] as const;
const MOST_LAYERS = 32;

/** The part of the view that can be kept. */
export interface Look extends Pick<ViewOptions, 'colourBy' | 'range' | 'layers' | 'cutaway' | (typeof SWITCHES)[number]> {
  camera: CameraPose | null;
}

/** The present look. */
export function presentLook(): Look {
  const { colourBy, range, layers, cutaway, bones, lumps, wireframe, shadows, tool, force } = wanted.peek();
  const camera = bodyView.peek()?.camera ?? null;
  return { colourBy, range, layers, cutaway, bones, lumps, wireframe, shadows, tool, force, camera };
}

/** Shows the body as in a look. */
export function applyLook({ camera, ...options }: Look): void {
  show(options);
  if (camera !== null && bodyView.peek() !== null) bodyView.peek()!.camera = camera;
}

const isNumber = (x: unknown): x is number => typeof x === 'number' && Number.isFinite(x);
const isRecord = (x: unknown): x is Record<string, unknown> => typeof x === 'object' && x !== null && !Array.isArray(x);
const oneOf = <T extends string>(all: readonly T[], x: unknown, otherwise: T): T => (all.includes(x as T) ? (x as T) : otherwise);
const share = (x: unknown, otherwise: number): number => (isNumber(x) ? Math.min(1, Math.max(0, x)) : otherwise);
const flag = (x: unknown, otherwise: boolean): boolean => (typeof x === 'boolean' ? x : otherwise);

/** A look from a link or from the browser's storage, which may hold anything; null if it is none. */
export function readLook(from: unknown): Look | null {
  if (!isRecord(from)) return null;
  const cut = isRecord(from.cutaway) ? from.cutaway : {};
  const range = Array.isArray(from.range) && from.range.length === 2 && from.range.every(isNumber) && from.range[0] < from.range[1]
    ? (from.range as [number, number])
    : null;
  const layers = Array.isArray(from.layers) ? from.layers.slice(0, MOST_LAYERS).filter(isRecord) : [];
  const switches = Object.fromEntries(SWITCHES.map((name) => [name, flag(from[name], DEFAULT_OPTIONS[name])])) as Pick<Look, (typeof SWITCHES)[number]>;
  return {
    ...switches,
    colourBy: oneOf(COLOURINGS, from.colourBy, 'tissue'),
    range,
    layers: layers.map(({ visible, opacity }) => ({ visible: flag(visible, true), opacity: share(opacity, 1) })),
    cutaway: {
      on: flag(cut.on, false),
      axis: oneOf(['x', 'y', 'z', 'view', 'tool'] as const, cut.axis, 'x'),
      position: share(cut.position, 0.5),
      flip: flag(cut.flip, false),
    },
    camera: readCamera(from.camera),
  };
}

function readCamera(from: unknown): CameraPose | null {
  if (!isRecord(from)) return null;
  const { azimuth, elevation, distance, target } = from;
  if (!isNumber(azimuth) || !isNumber(elevation) || !isNumber(distance) || distance <= 0) return null;
  if (!Array.isArray(target) || target.length !== 3 || !target.every(isNumber)) return null;
  return { azimuth, elevation, distance, target: target as [number, number, number] };
}
