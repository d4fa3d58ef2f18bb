// The recording that is replayed: its course, the time shown, and seeking.

import { effect, signal } from '@preact/signals';
import type { RecordingCurve } from '../generated/api';
import { apiUrl } from '../connection';
import { t } from '../i18n';
import { isReplaying, notify, onFrame, send, state } from '../store';
import { missing, type Moment } from './history';

/** Between two requests of a seek, ms. */
const SEEK_PERIOD = 50;
/** Between two changes of the time shown, ms. */
const SHOW_PERIOD = 80;
/** Step of an arrow key, s: longer than a frame, so that it always reaches another one. */
export const KEY_STEP = 0.05;
/** Longest time for which frames from before a seek are not shown, ms. */
const ARRIVAL = 1000;
/** Between two attempts to get the course while the engine is busy with other files, ms. */
const AGAIN = 1000;

/** The time shown, s. */
export const replayTime = signal(0);
/** The course of the recording that is replayed, once it has come. Breaks have no values. */
export const replayCourse = signal<readonly Moment[] | null>(null);

// Seeking

let wanted: number | null = null;
// The last time sought, until a frame of it has come: frames on the way show the time before it.
let sought: { time: number; at: number } | null = null;
let isDragged = false;

/** The time to which a key steps on. */
export const lastSought = (): number => sought?.time ?? replayTime.peek();

/** While something is dragged, frames do not change the time shown. */
export function drag(on: boolean): void {
  isDragged = on;
}

export function seek(to: number): void {
  const time = Math.min(Math.max(to, 0), state.peek()?.recording.duration ?? 0);
  replayTime.value = time;
  sought = { time, at: performance.now() };
  // Only the newest time is sent.
  if (wanted === null) {
    window.setTimeout(() => {
      send({ type: 'seek', time: wanted ?? time });
      wanted = null;
    }, SEEK_PERIOD);
  }
  wanted = time;
}

let shownAt = 0;
onFrame((frame) => {
  const now = performance.now();
  if (frame.is_replay === 0 || isDragged || now - shownAt < SHOW_PERIOD) return;
  const isOnTheWay = sought !== null && Math.abs(frame.time - sought.time) > KEY_STEP && now - sought.at < ARRIVAL;
  if (isOnTheWay) return;
  sought = null;
  shownAt = now;
  replayTime.value = frame.time;
});

// The course

let loading: AbortController | null = null;
effect(() => {
  loading?.abort();
  replayCourse.value = null;
  if (!isReplaying.value) return;
  loading = new AbortController();
  load(loading.signal).catch((error: unknown) => {
    if (!(error instanceof DOMException && error.name === 'AbortError')) notify('warning', t('replay.no_curve', { why: String(error) }));
  });
});

async function load(stop: AbortSignal): Promise<void> {
  for (;;) {
    const response = await fetch(apiUrl('api/recording/curve'), { signal: stop });
    if (response.ok) {
      const course = momentsOf((await response.json()) as RecordingCurve);
      if (!stop.aborted) replayCourse.value = course;
      return;
    }
    if (response.status !== 503) throw new Error((await response.text()).trim());
    await new Promise((resolve) => window.setTimeout(resolve, AGAIN));
  }
}

function momentsOf(curve: RecordingCurve): Moment[] {
  const gaps = new Set(curve.gaps);
  const moments: Moment[] = [];
  curve.time.forEach((time, i) => {
    if (gaps.has(i)) moments.push(missing(curve.time[i - 1]));
    const [x, y, z] = curve.force[i];
    const place = curve.place[i] as [number, number, number];
    moments.push({ time, depth: curve.depth[i], force: Math.hypot(x, y, z), axial: curve.axial[i], x, y, z, tissue: curve.tissue_force[i], place, isReduced: false });
  });
  return moments;
}

/** Force and depth at a time, between the moments of the course. */
export function momentAt(course: readonly Moment[], time: number): Moment | null {
  if (course.length === 0) return null;
  let [low, high] = [0, course.length - 1];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (course[middle].time < time) low = middle + 1;
    else high = middle;
  }
  const [a, b] = [course[Math.max(0, low - 1)], course[low]];
  if (Number.isNaN(a.force)) return b;
  if (Number.isNaN(b.force)) return a;
  const share = b.time > a.time ? Math.min(1, Math.max(0, (time - a.time) / (b.time - a.time))) : 1;
  return { ...b, time, depth: a.depth + share * (b.depth - a.depth), force: a.force + share * (b.force - a.force) };
}
