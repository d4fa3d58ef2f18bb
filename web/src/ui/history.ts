// The last minute of force, depth and place, for the curves, and the runs and strokes in it.

import type { FrameSnapshot } from '../generated/wire';
import { axes } from './axes';
import { Runs } from './runs';
import { Strokes } from './strokes';

/** Longest window of the curves, s. */
export const LONGEST = 60;
/** A line is broken where frames are missing for this time, s, which is longer than between two frames of a body at
 * rest, and for so many times the usual one between two frames, which is long where the page draws slowly. */
const GAP = 0.8;
const GAP_PERIODS = 4;
/** Longest time between two frames that counts as usual, s. */
const SLOWEST = 0.5;
/** Frames come at 60 Hz at most. */
const CAPACITY = 4096;
/** Changes smaller than this share of an axis are not seen. */
const UNSEEN = 1 / 400;
/** The same for places, m. */
const UNSEEN_WAY = 5e-5;

/** One moment. */
export interface Moment {
  time: number;
  depth: number;
  /** Size of the force on the hand, N. */
  force: number;
  /** Its component along the tool, N. */
  axial: number;
  x: number;
  y: number;
  z: number;
  /** Size of the tissue's own force, before the limits of the device, N. */
  tissue: number;
  /** The nearest place of the skin at rest, m. */
  place: readonly [number, number, number];
  /** Whether the engine reduces the force, after a fault: then no force does not mean that the tool is lifted. */
  isReduced: boolean;
}

/** A moment without values, which breaks lines. */
export function missing(time: number): Moment {
  return { time, depth: NaN, force: NaN, axial: NaN, x: NaN, y: NaN, z: NaN, tissue: NaN, place: [NaN, NaN, NaN], isReduced: false };
}

export type Column = Exclude<keyof Moment, 'place' | 'isReduced'>;
const COLUMNS: readonly Column[] = ['time', 'depth', 'force', 'axial', 'x', 'y', 'z', 'tissue'];

export function momentOf(frame: FrameSnapshot): Moment {
  const [x, y, z] = frame.force;
  const force = magnitude(frame.force);
  const tissue = magnitude(frame.tissue_force);
  return { time: frame.time, depth: frame.depth, force, axial: along(frame), x, y, z, tissue, place: frame.place, isReduced: frame.gain < 1 };
}

/** Lists that slide along buffers of twice their size, so that frames allocate nothing. Where frames are
 * missing, a moment without values breaks the lines. */
export class History {
  readonly runs = new Runs();
  readonly strokes = new Strokes();
  private readonly buffers = new Map(COLUMNS.map((name) => [name, new Float64Array(2 * CAPACITY)]));
  private begin = 0;
  private end = 0;
  /** The last moment that is seen to differ from those before it. */
  private level: Moment | null = null;
  /** Whether the last moment in the lists is as the level. */
  private isLevel = false;
  /** Usual time between two frames, s. */
  private period = 1 / 60;
  private listeners = new Set<() => void>();
  /** Grows with every change that can be seen. */
  version = 0;

  /** Calls `listener` after every change that can be seen. */
  onChange(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  push(frame: FrameSnapshot): void {
    if (frame.is_replay !== 0) return;
    const moment = momentOf(frame);
    const last = this.length > 0 ? this.lastTime : -Infinity;
    if (moment.time === last) return;
    // Earlier values belong to an engine that was started before. Runs and strokes stay, to compare.
    if (moment.time < last || moment.time > last + LONGEST) this.forgetTimes();
    else {
      const span = moment.time - last;
      if (span > Math.max(GAP, GAP_PERIODS * this.period)) this.breakLines(last);
      this.period += 0.2 * (Math.min(span, SLOWEST) - this.period);
    }
    const wasSeen = this.runs.push(moment);
    const wasFelt = this.strokes.push(moment);
    if (this.level !== null && isAsBefore(moment, this.level)) {
      // A line that stays level needs its two ends only.
      if (this.isLevel) {
        this.set(this.end - 1, moment);
        if (wasSeen || wasFelt) this.change();
        return;
      }
      this.isLevel = true;
    } else {
      this.level = moment;
      this.isLevel = false;
    }
    this.append(moment);
    this.change();
  }

  /** Forgets everything: the curves of one body mean nothing for another. */
  clear(): void {
    this.forgetTimes();
    this.runs.clear();
    this.strokes.clear();
    this.change();
  }

  /** Forgets runs and strokes, and keeps the curves over time. */
  clearGhosts(): void {
    this.runs.clear();
    this.strokes.clear();
    this.change();
  }

  /** Runs and strokes from now on are of this body. */
  setBody(key: string): void {
    this.runs.body = key;
    this.strokes.body = key;
    this.change();
  }

  get length(): number {
    return this.end - this.begin;
  }

  list(name: Column): Float64Array {
    return this.buffers.get(name)!.subarray(this.begin, this.end);
  }

  private get lastTime(): number {
    return this.buffers.get('time')![this.end - 1];
  }

  private change(): void {
    this.version++;
    for (const listener of this.listeners) listener();
  }

  private forgetTimes(): void {
    this.begin = this.end = 0;
    this.level = null;
    this.runs.end();
    this.strokes.end();
  }

  private breakLines(after: number): void {
    this.append(missing(after + 1e-6));
    this.level = null;
    this.runs.break();
    this.strokes.break();
  }

  private append(moment: Moment): void {
    if (this.end === 2 * CAPACITY) this.moveDown();
    this.set(this.end++, moment);
    const times = this.buffers.get('time')!;
    // One moment before the window stays, so that a level line reaches into it.
    while (this.length > CAPACITY || (this.length > 1 && times[this.begin + 1] < moment.time - LONGEST)) this.begin++;
  }

  private set(at: number, moment: Moment): void {
    for (const [name, buffer] of this.buffers) buffer[at] = moment[name];
  }

  private moveDown(): void {
    for (const buffer of this.buffers.values()) buffer.copyWithin(0, this.begin, this.end);
    this.end -= this.begin;
    this.begin = 0;
  }
}

function isAsBefore(a: Moment, b: Moment): boolean {
  const unseen = UNSEEN * axes.force;
  return (
    Math.abs(a.depth - b.depth) < UNSEEN * axes.depth &&
    Math.abs(a.force - b.force) < unseen &&
    Math.abs(a.axial - b.axial) < unseen &&
    Math.abs(a.x - b.x) < unseen &&
    Math.abs(a.y - b.y) < unseen &&
    Math.abs(a.z - b.z) < unseen &&
    Math.abs(a.tissue - b.tissue) < unseen &&
    distance(a.place, b.place) < UNSEEN_WAY
  );
}

export function distance(a: readonly number[], b: readonly number[]): number {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

export function magnitude(force: readonly number[]): number {
  return Math.hypot(force[0], force[1], force[2]);
}

/** Force along the tool's axis, N; the axis points out of the tissue. */
export function along(frame: FrameSnapshot): number {
  const [i, j, k, w] = frame.orientation;
  const [x, y, z] = frame.force;
  return 2 * (i * k + w * j) * x + 2 * (j * k - w * i) * y + (1 - 2 * (i * i + j * j)) * z;
}
