// Runs: force over depth from touch to lift. The last ones stay, to compare with.

import type { Moment } from './history';

/** Force from which the tool touches, N: without contact it is zero. */
export const TOUCH = 1e-6;
/** Times without a force after which the tool has been lifted, s: above the skin at rest, and in the dent that the
 * tool leaves. A late contact patch may let the force go for a moment. */
const LIFTED = 0.15;
const LEFT = 1;

/** Whether the tool is lifted at a moment without a force; `felt` is the time of the last force, s. */
export function isLifted({ time, depth }: Moment, felt: number): boolean {
  return time > felt + (depth < 0 ? LIFTED : LEFT);
}
/** Runs before the newest one. */
const GHOSTS = 3;
/** Shorter runs are none, s. */
const SHORTEST = 0.1;
/** Most moments of a run; beyond it, every other one is dropped. */
const MOST = 4000;
/** Changes that are stored: of depth, m, and of force, as a share of the largest in the run. */
const DEPTH_STEP = 1e-5;
const FORCE_STEP = 2e-3;

export interface Run {
  /** The body that was pressed. */
  body: string;
  /** m; NaN where moments are missing. */
  depths: number[];
  /** N. */
  forces: number[];
  most: { force: number; depth: number };
}

export class Runs {
  /** Newest last; only the newest can be under way. */
  readonly all: Run[] = [];
  /** Key of the body that is pressed now. */
  body = '';
  private now: Run | null = null;
  private began = 0;
  private felt = 0;
  private before: Moment | null = null;

  /** Takes a moment. Returns whether a run has changed. */
  push(moment: Moment): boolean {
    if (moment.isReduced) {
      this.break();
      this.felt = moment.time;
      return false;
    }
    const touches = moment.force > TOUCH;
    if (this.now === null) {
      const before = this.before;
      this.before = moment;
      if (!touches) return false;
      this.begin(moment);
      // From the skin on: the line begins at no force.
      if (before !== null && before.force <= TOUCH && before.depth > -1e-3) this.add(before);
    }
    this.before = moment;
    if (touches) this.felt = moment.time;
    else if (isLifted(moment, this.felt)) {
      this.end();
      return true;
    }
    return this.add(moment);
  }

  /** The run is over. */
  end(): void {
    if (this.now !== null && this.felt - this.began < SHORTEST) this.all.splice(this.all.indexOf(this.now), 1);
    else this.all.splice(0, this.all.length - 1 - GHOSTS);
    this.now = null;
    this.before = null;
  }

  /** Moments are missing. */
  break(): void {
    this.before = null;
    if (this.now === null || Number.isNaN(this.now.depths.at(-1))) return;
    this.now.depths.push(NaN);
    this.now.forces.push(NaN);
  }

  clear(): void {
    this.all.length = 0;
    this.now = null;
    this.before = null;
  }

  get isUnderWay(): boolean {
    return this.now !== null;
  }

  private begin(moment: Moment): void {
    this.now = { body: this.body, depths: [], forces: [], most: { force: 0, depth: 0 } };
    this.began = this.felt = moment.time;
    this.all.push(this.now);
    if (this.all.length > 1 + GHOSTS) this.all.shift();
  }

  private add({ depth, force }: Moment): boolean {
    const { depths, forces, most } = this.now!;
    const isSeen =
      !(Math.abs(depth - (depths.at(-1) ?? NaN)) < DEPTH_STEP) || Math.abs(force - forces.at(-1)!) > FORCE_STEP * most.force;
    if (!isSeen) return false;
    depths.push(depth);
    forces.push(force);
    most.force = Math.max(most.force, force);
    most.depth = Math.max(most.depth, depth);
    if (depths.length > MOST) {
      for (const list of [depths, forces]) list.splice(0, list.length, ...list.filter((_, i) => i % 2 === 0));
    }
    return true;
  }
}
