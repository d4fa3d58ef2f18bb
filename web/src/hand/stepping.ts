// The hand by keys and gamepad, which move the tool in steps over the skin.

import type { Vec3 } from '../scene';
import { HOVER, type Held, type Place, type Target } from './target';

/** Steps of the arrow keys, without and with Shift, m. */
const STEP = 0.002;
const STEP_FAR = 0.01;
/** Speed of a gamepad's stick pushed all the way, m/s. */
const STICK_SPEED = 0.06;
/** Depth of a trigger pulled all the way, in press depths. */
const TRIGGER_DEPTH = 1.5;

const ARROWS: Record<string, [right: number, up: number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const DEEPER: Record<string, number> = { PageDown: 1, '+': 1, '=': 1, PageUp: -1, '-': -1 };

export class SteppingHand {
  /** Keys hold the tool until it is lifted. */
  isHolding = false;
  /** The last place of the hand; there keys take the tool up again. */
  lastPlace: Place | null = null;

  /** `isTaken` says whether a pointer holds the tool. */
  constructor(private readonly hand: Held, private readonly isTaken: () => boolean, signal: AbortSignal) {
    hand.view.canvas.addEventListener('keydown', (event) => this.key(event), { signal });
  }

  /** Moves by the stick (right and down, −1 to 1) and presses by the trigger
   * (0 to 1); `dt` in s. */
  gamepad(dx: number, dy: number, pull: number, dt: number): void {
    const { enabled, mode, pressDepth } = this.hand.settings;
    if (!enabled || mode === 'orbit' || this.isTaken()) return;
    const from = this.hold();
    if (!from) return;
    const at = dx === 0 && dy === 0 ? from : this.stepped(from, dx * STICK_SPEED * dt, -dy * STICK_SPEED * dt);
    // The trigger is a spring: released, the tool hovers.
    const depth = pull > 0 ? HOVER + pull * (TRIGGER_DEPTH * pressDepth - HOVER) : HOVER;
    this.hand.goTo({ point: at.point, normal: at.normal, depth });
  }

  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (!this.isUsed(event)) return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** Does what a key says; false if it says nothing to the hand. */
  private isUsed({ key, shiftKey, repeat }: KeyboardEvent): boolean {
    const { hand } = this;
    const { enabled, mode } = hand.settings;
    if (key === 'Escape') {
      const wasHeld = hand.target !== null;
      hand.lift();
      return wasHeld;
    }
    if (mode === 'mark' && key === 'Enter') {
      const at = hand.target ?? hand.view.home;
      if (at) hand.mark({ point: at.point, normal: at.normal, part: 'skin' });
      return at !== null;
    }
    if (!enabled || this.isTaken()) return false;
    const arrow = ARROWS[key];
    const deeper = DEEPER[key];
    if (!arrow && !deeper && key !== ' ') return false;
    const from = this.hold();
    if (!from) return key === ' ';
    if (arrow) {
      const step = shiftKey ? STEP_FAR : STEP;
      const { point, normal } = this.stepped(from, arrow[0] * step, arrow[1] * step);
      hand.goTo({ ...from, point, normal });
    } else if (deeper) {
      hand.goTo(hand.deepened(from, deeper));
    } else if (!repeat) {
      const { point, normal } = from;
      hand.goTo(from.depth > 0 ? { point, normal, depth: HOVER } : hand.pressed(from));
    }
    return true;
  }

  /** Takes hold of the tool where it is, where it was left, or at home. */
  private hold(): Target | null {
    const { target, view } = this.hand;
    const at = target ?? this.lastPlace ?? view.home;
    if (!at) return null;
    this.isHolding = true;
    return target ?? { point: at.point, normal: at.normal, depth: HOVER };
  }

  /** A place over the skin, `dx` to the right and `dy` up as seen on the screen, m. */
  private stepped(from: Target, dx: number, dy: number): Place {
    const { view } = this.hand;
    const { right, up } = view.screenAxes();
    const n = from.normal;
    const way = [0, 1, 2].map((c) => right[c] * dx + up[c] * dy);
    const into = way[0] * n[0] + way[1] * n[1] + way[2] * n[2];
    const along = way.map((w, c) => w - into * n[c]);
    // Full length on skin that is seen aslant; none where it is seen edge-on.
    const length = Math.hypot(...along), wanted = Math.hypot(dx, dy);
    const scale = length > 0.2 * wanted ? wanted / length : 0;
    const point = from.point.map((p, c) => p + along[c] * scale) as Vec3;
    return view.nearest(point) ?? from;
  }
}
