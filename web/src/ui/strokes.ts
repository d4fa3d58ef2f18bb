// Strokes: force over the way along the skin, while the tool touches. A stroke ends when the tool is
// lifted, rests, or turns back.

import { distance, type Moment } from './history';
import { TOUCH, isLifted } from './runs';

type Vec3 = readonly [number, number, number];

/** A way of this length, from its start as the crow flies, is a stroke, m. */
const LEAST = 5e-3;
/** A tool that stays within this distance rests, m. */
const RESTING = 0.5e-3;
/** Time of rest after which a stroke is over, s. */
const REST = 1;
/** The way back after which the tool has turned, m. */
const TURNED = 1.5e-3;
/** Way between two points, m. */
const STEP = 0.1e-3;
/** Strokes before the newest one. */
const GHOSTS = 2;
/** Most points of a stroke. */
const MOST = 4000;

export interface Stroke {
  /** The body that was stroked. */
  body: string;
  /** s. */
  times: number[];
  /** Points of the skin at rest, m. */
  places: Vec3[];
  /** Way from the start, m. */
  ways: number[];
  /** N; NaN where moments are missing. */
  forces: number[];
}

export class Strokes {
  /** Newest last. */
  readonly all: Stroke[] = [];
  /** Key of the body that is stroked now. */
  body = '';
  /** The way since touch, rest or turn; a stroke once it is long enough. */
  private now: Stroke | null = null;
  private isStroke = false;
  /** Depth at the last moment, m. */
  private depth = 0;
  /** The place at which the tool rests, until it moves. */
  private anchor: Moment | null = null;
  private felt = 0;
  /** Index of the point farthest from the start, and its distance, m. */
  private farthest = 0;
  private reach = 0;

  /** `most` is the number of strokes that are kept. */
  constructor(private readonly most = 1 + GHOSTS) {}

  /** Takes a moment. Returns whether a stroke has changed. */
  push(moment: Moment): boolean {
    if (moment.isReduced) {
      this.break();
      this.felt = moment.time;
      return false;
    }
    if (moment.force <= TOUCH || !Number.isFinite(moment.place[0])) {
      if (isLifted(moment, this.felt)) this.end();
      else this.break();
      return false;
    }
    this.felt = moment.time;
    if (this.now === null) {
      this.anchor ??= moment;
      const { place } = this.anchor;
      if (distance(moment.place, place) < RESTING) {
        // The force just before it moves, not that of the first touch.
        this.anchor = { ...moment, place };
        return false;
      }
      this.begin(this.anchor);
    }
    const { places, times } = this.now!;
    const sunk = Math.abs(moment.depth - this.depth);
    this.depth = moment.depth;
    const way = distance(moment.place, places.at(-1)!);
    if (way < STEP) {
      if (way < RESTING && moment.time > times.at(-1)! + REST) {
        this.end();
        this.anchor = moment;
      }
      return false;
    }
    // A tool that is pressed in or lifted moves a little along the skin too: that is no stroke.
    if (sunk > way) return false;
    this.add(moment, way);
    return this.isStroke;
  }

  /** The stroke is over. */
  end(): void {
    this.now = null;
    this.anchor = null;
    this.isStroke = false;
  }

  /** Moments are missing: the line is broken, and the way goes on. */
  break(): void {
    if (this.now === null || Number.isNaN(this.now.forces.at(-1))) return;
    this.now.times.push(this.now.times.at(-1)!);
    this.now.places.push(this.now.places.at(-1)!);
    this.now.ways.push(this.now.ways.at(-1)!);
    this.now.forces.push(NaN);
  }

  clear(): void {
    this.all.length = 0;
    this.end();
  }

  private begin({ time, place, force, depth }: Moment): void {
    this.depth = depth;
    this.now = { body: this.body, times: [time], places: [place], ways: [0], forces: [force] };
    this.isStroke = false;
    this.farthest = 0;
    this.reach = 0;
  }

  private add(moment: Moment, way: number): void {
    const now = this.now!;
    now.times.push(moment.time);
    now.places.push(moment.place);
    now.ways.push(now.ways.at(-1)! + way);
    now.forces.push(moment.force);
    const off = distance(moment.place, now.places[0]);
    if (off >= this.reach) {
      this.reach = off;
      this.farthest = now.places.length - 1;
    } else if (off < this.reach - TURNED) {
      this.turn(now);
      return;
    }
    if (!this.isStroke && this.reach >= LEAST) {
      this.isStroke = true;
      this.all.push(now);
      if (this.all.length > this.most) this.all.shift();
    }
    if (now.places.length > MOST) {
      thin(now);
      this.farthest >>= 1;
    }
  }

  /** The way back is a way of its own. */
  private turn(now: Stroke): void {
    const at = this.farthest;
    const back: Stroke = {
      body: this.body,
      times: now.times.splice(at),
      places: now.places.splice(at),
      ways: now.ways.splice(at),
      forces: now.forces.splice(at),
    };
    // The turning point belongs to both.
    for (const name of ['times', 'places', 'ways', 'forces'] as const) (now[name] as unknown[]).push(back[name][0]);
    const start = back.ways[0];
    back.ways = back.ways.map((way) => way - start);
    this.now = back;
    this.isStroke = false;
    this.farthest = back.places.length - 1;
    this.reach = distance(back.places[0], back.places[this.farthest]);
  }
}

function thin(stroke: Stroke): void {
  for (const name of ['times', 'places', 'ways', 'forces'] as const) {
    const list = stroke[name] as unknown[];
    list.splice(0, list.length, ...list.filter((_, i) => i % 2 === 0));
  }
}

/** Direction from the start of a stroke to its end. */
function heading({ places }: Stroke): Vec3 {
  const [a, b] = [places[0], places.at(-1)!];
  const length = Math.max(distance(a, b), 1e-9);
  return [(b[0] - a[0]) / length, (b[1] - a[1]) / length, (b[2] - a[2]) / length];
}

const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Strokes whose directions differ by more than the angle of this cosine lie on other lines. */
const PARALLEL = 0.7;

/** Where the ways of another stroke lie on the axis of `stroke`: the same place is at the same value, also
 * where the other one went the other way. `[offset, sign]`: the value is `offset + sign * way`. */
export function onAxisOf(stroke: Stroke, other: Stroke): [offset: number, sign: 1 | -1] {
  const axis = heading(stroke);
  const cosine = dot(axis, heading(other));
  if (Math.abs(cosine) < PARALLEL) return [0, 1];
  const [a, b] = [stroke.places[0], other.places[0]];
  return [dot(axis, [b[0] - a[0], b[1] - a[1], b[2] - a[2]]), cosine > 0 ? 1 : -1];
}
