// The hand that holds the tool, by mouse, finger, keys or gamepad: tells the engine where
// the tool is to be.

import type { Request } from '../connection';
import type { BodyView, Picked } from '../scene';
import { Gamepads } from './gamepad';
import { PointerHand } from './pointer';
import { Sender } from './sender';
import { SteppingHand } from './stepping';
import { DEPTH_STEP, FORCE_STEP, type HandSettings, type Held, type Place, type Target } from './target';

/** Greatest height above the skin, as a depth, m. */
const HIGHEST = -0.03;
/** Greatest depth, in press depths. */
const DEEPEST_SHARE = 3;

export class HandControl implements Held {
  onTarget: (target: Target | null) => void = () => {};
  onMark: (picked: Picked) => void = () => {};
  /** The greatest depth that the tissue allows at the tool, m, as the engine says. */
  deepest = Infinity;
  settings: HandSettings;
  target: Target | null = null;
  private readonly pointer: PointerHand;
  private readonly stepping: SteppingHand;
  private readonly sender: Sender;
  private readonly gamepads: Gamepads;
  private readonly stop = new AbortController();

  constructor(readonly view: BodyView, send: (request: Request) => void, settings: HandSettings) {
    this.settings = { ...settings };
    const { signal } = this.stop;
    this.sender = new Sender(send);
    this.pointer = new PointerHand(this, signal);
    this.stepping = new SteppingHand(this, () => this.pointer.isHolding, signal);
    this.gamepads = new Gamepads((dx, dy, pull, dt) => this.stepping.gamepad(dx, dy, pull, dt));
    view.claims = {
      press: (event) => this.press(event),
      wheel: (event) => this.wheel(event),
      release: () => this.lift(),
    };
    // A tool that keys hold stays where it is while other parts of the page are used. Escape
    // lifts it from anywhere.
    view.canvas.addEventListener('blur', () => this.stepping.isHolding || this.lift(), { signal });
    window.addEventListener('keydown', (e) => e.key === 'Escape' && this.stepping.isHolding && this.lift(), { signal });
    window.addEventListener('blur', () => this.lift(), { signal });
    document.addEventListener('visibilitychange', () => document.hidden && this.lift(), { signal });
  }

  set(settings: Partial<HandSettings>): void {
    const before = this.settings;
    this.settings = { ...before, ...settings };
    if (!this.settings.enabled || this.settings.mode !== before.mode) this.lift();
  }

  /** Whether the tool is at the greatest depth. */
  get isDeepest(): boolean {
    return this.target !== null && this.target.force === undefined && this.target.depth >= this.greatestDepth() - 1e-9;
  }

  /** Another body: keys begin at its home, not where the last one was pressed. */
  forget(): void {
    this.stepping.lastPlace = null;
  }

  goTo({ point, normal, depth, force }: Target): void {
    this.target = force === undefined ? { point, normal, depth } : { point, normal, depth, force };
    this.stepping.lastPlace = { point, normal };
    this.onTarget(this.target);
    this.sender.goTo(this.target);
  }

  /** Brings the tool over a place, so that a press there begins at once. */
  hover(place: Place): void {
    if (this.target || !this.settings.enabled || !this.settings.hovers) return;
    this.sender.hover(place);
  }

  lift(): void {
    this.pointer.letGo();
    this.stepping.isHolding = false;
    if (!this.target) return;
    this.target = null;
    this.sender.lift();
    this.onTarget(null);
  }

  limited(depth: number): number {
    return Math.min(Math.max(depth, HIGHEST), this.greatestDepth());
  }

  pressed({ point, normal }: Place): Target {
    const { pressDepth, pressForce } = this.settings;
    return pressForce === null ? { point, normal, depth: pressDepth } : { point, normal, depth: this.greatestDepth(), force: pressForce };
  }

  deepened(target: Target, steps: number): Target {
    if (target.force === undefined) return { ...target, depth: this.limited(target.depth + steps * DEPTH_STEP) };
    return { ...target, force: Math.min(Math.max(target.force + steps * FORCE_STEP, 0), this.settings.greatestForce) };
  }

  mark(picked: Picked): void {
    this.onMark(picked);
  }

  dispose(): void {
    this.lift();
    this.stop.abort();
    this.gamepads.dispose();
    this.view.claims = null;
  }

  private press(event: PointerEvent): boolean {
    const isTaken = this.pointer.press(event);
    if (this.pointer.isHolding) this.stepping.isHolding = false;
    return isTaken;
  }

  private wheel(event: WheelEvent): boolean {
    if (!this.target || (!this.pointer.isHolding && !this.stepping.isHolding)) return false;
    this.pointer.turn(event);
    return true;
  }

  private greatestDepth(): number {
    return Math.min(this.deepest, DEEPEST_SHARE * this.settings.pressDepth);
  }
}
