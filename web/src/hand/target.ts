// Where the hand is to be, and how the inputs say so.

import type { BodyView, Vec3 } from '../scene';

/** A place of the skin at rest, m, and the outward normal there. */
export interface Place {
  point: Vec3;
  normal: Vec3;
}

export interface Target extends Place {
  /** Depth below the skin at rest, m; negative above it. */
  depth: number;
}

export interface HandSettings {
  /** m. */
  pressDepth: number;
  mode: 'press' | 'orbit' | 'mark';
  /** Whether this page controls. */
  enabled: boolean;
  /** Whether the tool follows the pointer over the skin. */
  hovers: boolean;
}

/** Depth of a tool that is held over the skin without pressing, m. */
export const HOVER = -0.003;

/** The hand as mouse, keys and gamepad see it. */
export interface Held {
  readonly view: BodyView;
  readonly settings: HandSettings;
  /** Null while the hand holds nothing. */
  readonly target: Target | null;
  goTo(target: Target): void;
  hover(place: Place): void;
  lift(): void;
  /** The nearest depth that is allowed, m. */
  limited(depth: number): number;
  mark(point: Vec3): void;
}
