// Where the hand is to be, and how the inputs say so.

import type { BodyView, Picked, Vec3 } from '../scene';

/** A place of the skin at rest, m, and the outward normal there. */
export interface Place {
  point: Vec3;
  normal: Vec3;
}

export interface Target extends Place {
  /** Depth below the skin at rest, m; negative above it. With a force, the greatest depth. */
  depth: number;
  /** Force to hold, N, in place of the depth. */
  force?: number;
}

export interface HandSettings {
  /** m. */
  pressDepth: number;
  /** Force that a press holds, N; null to press to a depth. */
  pressForce: number | null;
  /** The largest force that the device gives, N. */
  greatestForce: number;
  mode: 'press' | 'orbit' | 'mark';
  /** Whether this page controls. */
  enabled: boolean;
  /** Whether the tool follows the pointer over the skin. */
  hovers: boolean;
}

/** Depth of a tool that is held over the skin without pressing, m. */
export const HOVER = -0.003;

/** A step of the wheel and of keys: of the depth, m, and of the force, N. */
export const DEPTH_STEP = 0.0005;
export const FORCE_STEP = 0.1;

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
  /** A place to be pressed, to the depth or with the force of the settings. */
  pressed(place: Place): Target;
  /** A target that presses more, by `steps` of depth or of force. */
  deepened(target: Target, steps: number): Target;
  mark(picked: Picked): void;
}
