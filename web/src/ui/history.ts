// The last seconds of force and depth, for the curves.

import type { FrameSnapshot } from '../generated/wire';

/** Length of the curves, s. */
export const WINDOW = 15;
/** Changes too small to be seen, N and m. */
const UNSEEN_FORCE = 0.004;
const UNSEEN_DEPTH = 5e-6;
/** Frames come at 60 Hz at most. */
const CAPACITY = 1200;

/** Lists that slide along buffers of twice their size, so that frames allocate nothing. */
export class History {
  private readonly buffers = Array.from({ length: 4 }, () => new Float64Array(2 * CAPACITY));
  private begin = 0;
  private end = 0;
  private replay = 0;
  /** Grows with every change. */
  version = 0;

  push(frame: FrameSnapshot): void {
    const [times, depths, forces, axials] = this.buffers;
    const last = this.end > this.begin ? times[this.end - 1] : -Infinity;
    // After a seek or a restart of the engine, earlier values belong to another time.
    if (frame.time < last || frame.is_replay !== this.replay || frame.time > last + WINDOW) this.clear();
    else if (frame.time === last || this.isAtRest(frame)) return;
    this.replay = frame.is_replay;
    if (this.end === 2 * CAPACITY) this.moveDown();
    times[this.end] = frame.time;
    depths[this.end] = frame.depth;
    forces[this.end] = magnitude(frame.force);
    axials[this.end] = along(frame);
    this.end++;
    while (this.end - this.begin > CAPACITY || times[this.begin] < frame.time - WINDOW) this.begin++;
    this.version++;
  }

  /** Whether nobody presses and nothing has moved since the last point: no curve needs another. */
  private isAtRest(frame: FrameSnapshot): boolean {
    if (this.end === this.begin || frame.is_replay === 1) return false;
    const at = this.end - 1;
    const [, depths, forces] = this.buffers;
    return forces[at] < UNSEEN_FORCE && magnitude(frame.force) < UNSEEN_FORCE && Math.abs(depths[at] - frame.depth) < UNSEEN_DEPTH;
  }

  clear(): void {
    this.begin = 0;
    this.end = 0;
    this.version++;
  }

  get length(): number {
    return this.end - this.begin;
  }
  get times(): Float64Array {
    return this.buffers[0].subarray(this.begin, this.end);
  }
  get depths(): Float64Array {
    return this.buffers[1].subarray(this.begin, this.end);
  }
  get forces(): Float64Array {
    return this.buffers[2].subarray(this.begin, this.end);
  }
  get axials(): Float64Array {
    return this.buffers[3].subarray(this.begin, this.end);
  }

  private moveDown(): void {
    for (const buffer of this.buffers) buffer.copyWithin(0, this.begin, this.end);
    this.end -= this.begin;
    this.begin = 0;
  }
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
