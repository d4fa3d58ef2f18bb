// Ends of the axes of the curves: round numbers that grow at once, and shrink when most
// of an axis is empty.

/** The next of …, 1, 2, 5, 10, … that is not smaller. */
export function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  const lead = value / power;
  const step = [1, 2, 5].find((candidate) => lead <= candidate + 1e-9) ?? 10;
  return step * power;
}

/** An axis shrinks when a smaller share of it is used. */
const LEAST_USED = 0.25;

class AxisEnd {
  private end: number;
  constructor(private least: number) {
    this.end = least;
  }
  get value(): number {
    return this.end;
  }
  setLeast(least: number): void {
    if (least === this.least) return;
    this.least = least;
    this.end = least;
  }
  grow(value: number): void {
    if (value > this.end) this.end = roundUp(value);
  }
  /** `most` is the largest value shown. */
  settle(most: number): void {
    this.grow(most);
    if (most < LEAST_USED * this.end) this.end = Math.max(this.least, roundUp(Math.max(most / 0.8, 1e-9)));
  }
}

/** Curves and the bar share one scale, so that the same length is the same force. */
class Axes {
  private readonly forceEnd = new AxisEnd(1);
  private readonly depthEnd = new AxisEnd(5e-3);

  get force(): number {
    return this.forceEnd.value;
  }
  get depth(): number {
    return this.depthEnd.value;
  }
  setLeast(force: number, depth: number): void {
    this.forceEnd.setLeast(force);
    this.depthEnd.setLeast(depth);
  }
  take(force: number, depth: number): void {
    this.forceEnd.grow(force);
    this.depthEnd.grow(depth);
  }
  /** Takes the largest force and depth shown. */
  settle(force: number, depth: number): void {
    this.forceEnd.settle(force);
    this.depthEnd.settle(depth);
  }
}

export const axes = new Axes();

/** The largest positive value; 0 if there is none. */
export function largest(values: ArrayLike<number>): number {
  let most = 0;
  for (let i = 0; i < values.length; i++) if (values[i] > most) most = values[i];
  return most;
}
