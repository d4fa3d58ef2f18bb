// A hand that strokes over the lump once, to show what can be felt: the page moves the tool as a user would, and the
// forces are the engine's.

import { effect, signal, untracked } from '@preact/signals';
import type { HandControl } from '../hand';
import type { BodyView, Vec3 } from '../scene';
import { ask, isController, isReplaying, latestFrame, notify, state, status } from '../store';
import { distance } from './history';
import { picking, pressDepth, reducedMotion, remembered, show } from './settings';

/** The scene of the gallery in which it strokes. */
const LUMP_SCENE = 'forearm_lump';

/** Ends of the parts of the stroke, s: it presses, strokes, lifts. */
const DOWN = 0.8;
const ACROSS = 4.4;
const UP = 5.2;
/** It presses when the tool is within this distance of the place, m, and strokes when it is at this depth, m, or after
 * this time, s. */
const NEAR = 0.004;
const DEEP = 0.001;
const LONGEST_WAIT = 8;
/** From the lump to either end of the stroke, m. */
const REACH = 0.028;
/** Height over the skin, as a depth, m. */
const ABOVE = -0.003;
/** Between two moves, ms, and longest step of the stroke, s: a slow machine strokes slowly. */
const PERIOD = 25;
const LONGEST_STEP = 0.06;

/** `opening`: its scene is not there yet. `done`: the next press is the user's first one after it. */
export type Ghost = 'off' | 'opening' | 'stroking' | 'done';
export const ghost = signal<Ghost>('off');

const isBoolean = (value: unknown): boolean => typeof value === 'boolean';
/** Whether the user has pressed a body, now or on an earlier visit. */
export const hasPressed = remembered('has_pressed', false, isBoolean);
/** Whether the ghost has stroked, or was stopped by the user. */
const hasShown = remembered('has_shown', false, isBoolean);

const isFree = (): boolean => {
  const now = state.value;
  return isController.value && !isReplaying.value && picking.value === null && now?.phase === 'running' && now.game == null && !now.is_motion_running;
};

/** Whether “Show me” would replace nothing that the user has made. */
export const canShow = (): boolean => isFree() && (state.value?.gallery_key === LUMP_SCENE || (state.value?.gallery_key != null && !state.value.is_changed));

/** Opens the scene with the lump, and strokes over it. */
export async function showMe(): Promise<void> {
  if (!canShow()) return;
  ghost.value = 'opening';
  if (state.peek()?.gallery_key === LUMP_SCENE) return;
  const error = await ask({ type: 'load_scene', key: LUMP_SCENE });
  if (error === null) return;
  ghost.value = 'off';
  notify('warning', error);
}

export function stopGhost(): void {
  ghost.value = 'off';
}

/** The user's hand has gone somewhere. */
export function notePress(depth: number): void {
  if (ghost.peek() === 'stroking' || depth <= 0) return;
  hasPressed.value = true;
  if (ghost.peek() === 'done') ghost.value = 'off';
}

/** Map and lens show what the ghost feels. */
function showWhatIsFelt(): void {
  show({ palpation: 'surroundings', lens: true });
}

/** Lets the ghost move the hand. Returns what ends it. */
export function beginGhost(hand: HandControl, body: BodyView): () => void {
  let keyBefore: string | null | undefined;
  const ends = [
    // When a user opens the scene for the first time. A page that begins in it has a hint instead.
    effect(() => {
      if (state.value === null) return;
      const key = state.value.gallery_key ?? null;
      const isOpened = keyBefore !== undefined && keyBefore !== key && key === LUMP_SCENE;
      keyBefore = key;
      if (key !== LUMP_SCENE && ghost.peek() === 'done') ghost.value = 'off';
      if (isOpened && ghost.peek() === 'off' && isController.peek() && !hasShown.peek() && !reducedMotion.peek()) ghost.value = 'opening';
    }),
    effect(() => {
      if (ghost.value === 'opening' && state.value?.gallery_key === LUMP_SCENE && isFree()) ghost.value = 'stroking';
    }),
    effect(() => {
      if (ghost.value === 'opening') return untilInput();
      if (ghost.value !== 'stroking') return;
      return untracked(() => {
        hasShown.value = true;
        showWhatIsFelt();
        const ends = [untilInput(), stroke(hand, body)];
        return () => ends.forEach((end) => end());
      });
    }),
  ];
  return () => {
    for (const end of ends) end();
    ghost.value = 'off';
  };
}

/** Any input of the user stops the ghost. Returns what ends that. */
function untilInput(): () => void {
  const listening = new AbortController();
  const { signal } = listening;
  for (const type of ['pointerdown', 'wheel', 'keydown'] as const) window.addEventListener(type, stopGhost, { signal, capture: true });
  window.addEventListener('blur', stopGhost, { signal });
  document.addEventListener('visibilitychange', stopGhost, { signal });
  return () => listening.abort();
}

/** Strokes over the lump. Returns what lifts the tool, wherever it is. */
function stroke(hand: HandControl, body: BodyView): () => void {
  const lump = state.peek()?.lumps[0];
  const middle = lump === undefined ? body.home : body.nearest(lump.centre as Vec3);
  if (middle === null) {
    // Not from within the effect that has called this.
    queueMicrotask(stopGhost);
    return () => {};
  }
  const { point, normal } = middle;
  /** Whether the tool has come as far as the next part of the stroke needs. */
  const isReady = (time: number): boolean => {
    if (latestFrame === null || hand.target === null) return false;
    if (time === 0) return distance(latestFrame.place, hand.target.point) < NEAR;
    return time < DOWN || time > DOWN + LONGEST_STEP || latestFrame.depth > DEEP;
  };
  const { right } = body.screenAxes();
  const into = right[0] * normal[0] + right[1] * normal[1] + right[2] * normal[2];
  const along = right.map((x, c) => x - into * normal[c]);
  const length = Math.hypot(...along) || 1;
  let time = 0;
  let waited = 0;
  let before = performance.now();
  const timer = window.setInterval(() => {
    // A busy engine is waited for.
    if (status.peek() !== 'open') return;
    const now = performance.now();
    const step = Math.min((now - before) / 1000, LONGEST_STEP);
    before = now;
    if (isReady(time) || waited > LONGEST_WAIT) {
      // The next wait begins anew.
      if (time < DOWN && time + step >= DOWN) waited = 0;
      time += step;
    } else {
      waited += step;
    }
    if (!isFree() || time > UP) {
      ghost.value = time > UP ? 'done' : 'off';
      return;
    }
    const way = REACH * (2 * smooth((time - DOWN) / (ACROSS - DOWN)) - 1);
    const at = body.nearest(point.map((x, c) => x + (along[c] / length) * way) as Vec3);
    if (at === null) return;
    const pressed = smooth(time / DOWN) - smooth((time - ACROSS) / (UP - ACROSS));
    hand.goTo({ point: at.point, normal: at.normal, depth: ABOVE + pressed * (pressDepth.peek() - ABOVE) });
  }, PERIOD);
  return () => {
    window.clearInterval(timer);
    hand.lift();
  };
}

/** From 0 to 1, at rest at both ends. */
function smooth(share: number): number {
  const t = Math.min(1, Math.max(0, share));
  return t * t * (3 - 2 * t);
}
