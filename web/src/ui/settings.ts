// Settings: those that the browser remembers between visits, and how the body is shown now.

import { batch, computed, effect, signal, type Signal } from '@preact/signals';
import { DEFAULT_OPTIONS, quantityOf, type ColourBy, type MapKind, type ViewOptions } from '../scene';
import { t } from '../i18n';
import { galleryKey, isHiding, state, type Vec3 } from '../store';
import type { Field, MapSight } from '../generated/api';

const PREFIX = 'palpa.';

/** A signal whose value the browser keeps, unless it forbids storage. */
export function remembered<T>(name: string, initial: T, isValid: (value: unknown) => boolean): Signal<T> {
  let value = initial;
  try {
    const written = localStorage.getItem(PREFIX + name);
    if (written !== null) {
      const read: unknown = JSON.parse(written);
      if (isValid(read)) value = read as T;
    }
  } catch {
    // No storage: the initial value is used.
  }
  const kept = signal(value);
  effect(() => {
    const written = JSON.stringify(kept.value);
    try {
      localStorage.setItem(PREFIX + name, written);
    } catch {
      // No storage: the value lasts as long as the page.
    }
  });
  return kept;
}

const isBoolean = (value: unknown): boolean => typeof value === 'boolean';
const isOneOf = (...allowed: unknown[]) => (value: unknown): boolean => allowed.includes(value);

export type ThemeChoice = 'auto' | 'light' | 'dark';
export const themeChoice = remembered<ThemeChoice>('theme', 'auto', isOneOf('auto', 'light', 'dark'));
export const hasSound = remembered('sound', false, isBoolean);
export const hasVibration = remembered('vibration', false, isBoolean);

function matching(query: string): Signal<boolean> {
  const list = window.matchMedia(query);
  const matches = signal(list.matches);
  list.addEventListener('change', () => (matches.value = list.matches));
  return matches;
}

const prefersDark = matching('(prefers-color-scheme: dark)');
export const reducedMotion = matching('(prefers-reduced-motion: reduce)');
/** Taller than wide, or narrow: panels lie under the body. */
export const isPortrait = matching('(max-width: 900px), (max-aspect-ratio: 1/1)');

export const theme = computed<'light' | 'dark'>(() => {
  if (themeChoice.value !== 'auto') return themeChoice.value;
  return prefersDark.value ? 'dark' : 'light';
});

export const TABS = [
  'scene', 'view', 'tissues', 'lumps', 'tool', 'device', 'motion', 'record', 'game', 'engine',
] as const;
export type Tab = (typeof TABS)[number];
export const tab = remembered<Tab>('tab', 'scene', isOneOf(...TABS));
export const isPanelOpen = remembered('panel', true, isBoolean);

// The curves.

export const CURVES = ['force-depth', 'force-time', 'force-distance', 'depth-time', 'spectrum'] as const;
export type CurveKind = (typeof CURVES)[number];
const USUAL_CURVES: readonly CurveKind[] = ['force-depth', 'force-time', 'force-distance'];
/** What each place for a curve shows, no two the same. */
export const curveKinds = remembered<readonly CurveKind[]>('curves', USUAL_CURVES, (value) =>
  Array.isArray(value) && value.length === USUAL_CURVES.length && new Set(value).size === value.length && value.every((one) => CURVES.includes(one as CurveKind)),
);

/** Shows a curve at a place. If it was at another place, the two change places. */
export function chooseCurve(at: number, kind: CurveKind): void {
  const kinds = [...curveKinds.value];
  const before = kinds.indexOf(kind);
  if (before >= 0) kinds[before] = kinds[at];
  kinds[at] = kind;
  curveKinds.value = kinds;
}

/** Length of the curves over time, s. */
export const CURVE_WINDOWS = ['5', '15', '60'] as const;
export const curveWindow = remembered<(typeof CURVE_WINDOWS)[number]>('curve_window', '15', isOneOf(...CURVE_WINDOWS));
/** The lines of force over time: its size, its components, or that of the device and the tissue's. */
export const CURVE_LINES = ['size', 'parts', 'tissue'] as const;
export type CurveLines = (typeof CURVE_LINES)[number];
export const curveLines = remembered<CurveLines>('curve_lines', 'size', isOneOf(...CURVE_LINES));

// How the hand presses.

type HandMode = 'press' | 'orbit';
export const handMode = signal<HandMode>('press');
/** Depth of a press, m; null until it is chosen: then the scene's own. */
export const chosenDepth = signal<number | null>(null);
export const pressDepth = computed(() => {
  const usual = state.value?.usual_depth ?? 0.004;
  return Math.min(chosenDepth.value ?? usual, state.value?.greatest_depth ?? Infinity);
});

/** Whether a press goes to a depth or to a force. */
export const PRESS_BY = ['depth', 'force'] as const;
export const pressBy = remembered<(typeof PRESS_BY)[number]>('press_by', 'depth', isOneOf(...PRESS_BY));
const isForce = (value: unknown): boolean => typeof value === 'number' && value > 0 && value <= 100;
/** Force that a press holds, N. */
export const chosenForce = remembered('press_force', 1, isForce);
/** The same within what the device can give; null while presses go to a depth. */
export const pressForce = computed(() => (pressBy.value === 'force' ? Math.min(chosenForce.value, greatestForce.value) : null));
/** The largest force that the device gives, N. */
export const greatestForce = computed(() => state.value?.max_force ?? 10);

// Goals: a band in which the force shall stay, and a limit at which it would hurt, N.

export const hasBand = remembered('band_on', false, isBoolean);
export const bandLow = remembered('band_low', 0.8, isForce);
export const bandHigh = remembered('band_high', 1.2, isForce);
export const hasPainLimit = remembered('pain_on', false, isBoolean);
export const painLimit = remembered('pain_limit', 3, isForce);
export const goalsSound = remembered('goals_sound', true, isBoolean);

/** The next game: its seed as it is typed, empty for a random one; its level, or one drawn for each round; its numbers. */
export const wantedSeed = signal('');
export const LEVELS = ['easy', 'medium', 'hard', 'drawn'] as const;
export type WantedLevel = (typeof LEVELS)[number];
export const wantedLevel = signal<WantedLevel>('easy');
export const ROUNDS = ['1', '3', '5', '10'] as const;
export const wantedRounds = signal<(typeof ROUNDS)[number]>('1');
export const LUMPS = ['1', '2', '3'] as const;
export const wantedLumps = signal<(typeof LUMPS)[number]>('1');

/** The purpose of the next click on the body. */
export type Picking = { kind: 'mark' } | { kind: 'lump'; index: number } | { kind: 'place' } | { kind: 'probe' };
export const picking = signal<Picking | null>(null);
/** Whether the tool is at the greatest depth. */
export const isDeepest = signal(false);
/** The last place of the hand on the skin, m. */
export const lastTouched = signal<Vec3 | null>(null);

// How the body is shown.

export const wanted = signal<ViewOptions>({ ...DEFAULT_OPTIONS });

export function show(changes: Partial<ViewOptions>): void {
  wanted.value = { ...wanted.value, ...changes };
}

/** Whether a hidden lump can be seen by this map. */
export function showsLumps(colourBy: ColourBy): boolean {
  return quantityOf(colourBy)?.showsLumps ?? false;
}

/** What the palpation map may show: during a game, as much as its level allows. */
export const mapSight = computed<MapSight>(() => {
  const game = state.value?.game;
  if (game == null || !isHiding.value) return 'everything';
  return state.value?.levels.find(({ level }) => level === game.level)?.map ?? 'nothing';
});

function allowedMap(wantedMap: MapKind, sight: MapSight): MapKind {
  if (sight === 'nothing') return 'off';
  return sight === 'stiffness' && wantedMap === 'surroundings' ? 'absolute' : wantedMap;
}

/** The options in force: during a game, nothing that shows hidden lumps. */
export const view = computed<ViewOptions>(() => {
  const words = { canvas: t('app.canvas'), plane: t('view.cutaway_plane') };
  const options = { ...wanted.value, words, theme: theme.value, reducedMotion: reducedMotion.value };
  if (!isHiding.value) return options;
  return {
    ...options,
    lumps: false,
    palpation: allowedMap(options.palpation, mapSight.value),
    lens: false,
    wireframe: false,
    colourBy: showsLumps(options.colourBy) ? 'tissue' : options.colourBy,
    range: showsLumps(options.colourBy) ? null : options.range,
    cutaway: { ...options.cutaway, on: false },
  };
});

/** The field that the engine must compute for this view. */
export const neededField = computed<Field>(() => quantityOf(view.value.colourBy)?.field?.name ?? 'none');

effect(() => {
  // Layers, depth and places of one body mean nothing for another.
  void galleryKey.value;
  batch(() => {
    chosenDepth.value = null;
    lastTouched.value = null;
    picking.value = null;
    wanted.value = { ...wanted.peek(), layers: [], range: null };
  });
});
