// The hand that holds the tool, by mouse, finger, keys or gamepad: says to the engine where it is to be.

import type { Request } from '../connection';
import type { BodyView, Vec3 } from '../scene';
import { Gamepads } from './gamepad';
import { wheelSteps } from '../scene/gestures';

export interface HandSettings {
  /** m. */
  pressDepth: number;
  mode: 'press' | 'orbit' | 'mark';
  /** Whether this page may control. */
  enabled: boolean;
}

export interface Target {
  point: Vec3;
  normal: Vec3;
  depth: number;
}

/** Shortest time between two messages, and longest while the tool is held, ms. */
const LEAST_WAIT = 1000 / 60;
const MOST_WAIT = 150;
const WHEEL_STEP = 0.0005;
const KEY_STEP = 0.002;
const KEY_STEP_FAR = 0.01;
const KEY_DEPTH = 0.0005;
/** Where the tool hovers that is held but does not press, m. */
const HOVER = -0.003;
/** Depths that can be asked for lie between this, m, and so many times the press's, or what the tissue allows. */
const HIGHEST = -0.03;
const DEEPEST_SHARE = 3;
/** Of a click that marks: it moves no farther, px. */
const CLICK_REACH = 6;

export class HandControl {
  onTarget: (target: Target | null) => void = () => {};
  onMark: (point: Vec3) => void = () => {};
  /** What the tissue allows where the tool is, m, as the engine says. */
  deepest = Infinity;
  private settings: HandSettings;
  private target: Target | null = null;
  private pointer: {
    id: number;
    depth: number;
    dragFrom: { x: number; y: number; depth: number } | null;
    /** From the cursor to the place that is pressed, px: what shift-drags have moved it off. */
    off: { x: number; y: number };
  } | null = null;
  private click: { id: number; x: number; y: number } | null = null;
  /** Keys hold the tool until it is let go. */
  private isHeldByKeys = false;
  private lastPlace: { point: Vec3; normal: Vec3 } | null = null;
  private sentAt = 0;
  private isDirty = false;
  private timer = 0;
  private readonly gamepads: Gamepads;
  private readonly stop = new AbortController();

  constructor(private readonly view: BodyView, private readonly send: (request: Request) => void, settings: HandSettings) {
    this.settings = { ...settings };
    const { signal } = this.stop;
    const { canvas } = view;
    view.claims = {
      press: (event) => this.press(event),
      wheel: (event) => this.wheel(event),
      release: () => this.lift(),
    };
    canvas.addEventListener('pointermove', (e) => this.move(e), { signal });
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) canvas.addEventListener(type, (e) => this.up(e), { signal });
    canvas.addEventListener('keydown', (e) => this.key(e), { signal });
    // What keys hold stays held while something else on the page is looked at or changed; Escape lifts from anywhere.
    canvas.addEventListener('blur', () => this.isHeldByKeys || this.lift(), { signal });
    window.addEventListener('keydown', (e) => e.key === 'Escape' && this.isHeldByKeys && this.lift(), { signal });
    window.addEventListener('blur', () => this.lift(), { signal });
    document.addEventListener('visibilitychange', () => document.hidden && this.lift(), { signal });
    this.gamepads = new Gamepads((dx, dy, pull, dt) => this.gamepad(dx, dy, pull, dt));
  }

  set(settings: Partial<HandSettings>): void {
    const before = this.settings;
    this.settings = { ...before, ...settings };
    if (!this.settings.enabled || this.settings.mode !== before.mode) this.lift();
  }

  /** Whether the tool is held as deep as it goes. */
  get isDeepest(): boolean {
    return this.target !== null && this.target.depth >= this.greatestDepth() - 1e-9;
  }

  /** Another body: keys begin at its home, not where another one was pressed. */
  forget(): void {
    this.lastPlace = null;
  }

  dispose(): void {
    this.lift();
    this.stop.abort();
    this.gamepads.dispose();
    this.view.claims = null;
    window.clearTimeout(this.timer);
  }

  // Mouse and fingers.

  private press(event: PointerEvent): boolean {
    const { mode, enabled, pressDepth } = this.settings;
    if (event.button !== 0 || event.ctrlKey || mode === 'orbit') return false;
    const at = this.view.pickRest(event.clientX, event.clientY);
    if (!at) return false;
    this.view.canvas.focus({ preventScroll: true });
    if (mode === 'mark') {
      this.click = { id: event.pointerId, x: event.clientX, y: event.clientY };
      return true;
    }
    if (!enabled) return false;
    event.preventDefault();
    this.view.canvas.setPointerCapture(event.pointerId);
    this.isHeldByKeys = false;
    const depth = event.shiftKey ? 0 : pressDepth;
    this.pointer = { id: event.pointerId, depth, dragFrom: event.shiftKey ? { x: event.clientX, y: event.clientY, depth } : null, off: { x: 0, y: 0 } };
    this.goTo({ ...at, depth });
    return true;
  }

  private move(event: PointerEvent): void {
    const { pointer, target } = this;
    if (!pointer || pointer.id !== event.pointerId || !target) {
      this.hover(event);
      return;
    }
    if (event.shiftKey) {
      // The spring of shift-drag: down presses deeper, and letting go of shift goes back.
      pointer.dragFrom ??= { x: event.clientX, y: event.clientY, depth: target.depth };
      const depth = pointer.dragFrom.depth + (event.clientY - pointer.dragFrom.y) * this.view.metresPerPixel();
      this.goTo({ ...target, depth: this.limited(depth) });
      return;
    }
    if (pointer.dragFrom) {
      pointer.off.x += pointer.dragFrom.x - event.clientX;
      pointer.off.y += pointer.dragFrom.y - event.clientY;
      pointer.dragFrom = null;
    }
    // Off the body the tool stays at the last place.
    const at = this.view.pickRest(event.clientX + pointer.off.x, event.clientY + pointer.off.y);
    this.goTo({ ...(at ?? target), depth: pointer.depth });
  }

  private up(event: PointerEvent): void {
    if (this.click?.id === event.pointerId) {
      const { x, y } = this.click;
      this.click = null;
      if (event.type !== 'pointerup' || Math.hypot(event.clientX - x, event.clientY - y) > CLICK_REACH) return;
      const at = this.view.pick(event.clientX, event.clientY);
      if (at?.part === 'skin') this.onMark(at.point);
      return;
    }
    if (this.pointer?.id === event.pointerId) this.lift();
  }

  private wheel(event: WheelEvent): boolean {
    const { pointer, target } = this;
    if (!target || (!pointer && !this.isHeldByKeys)) return false;
    const depth = this.limited(target.depth + wheelSteps(event) * WHEEL_STEP);
    if (pointer) pointer.depth = depth;
    this.goTo({ ...target, depth });
    return true;
  }

  /** Shows by the cursor what a button would do. */
  private hover(event: PointerEvent): void {
    if (event.buttons !== 0) return;
    const { mode, enabled } = this.settings;
    const isOn = mode !== 'orbit' && (enabled || mode === 'mark') && this.view.pickRest(event.clientX, event.clientY) !== null;
    const cursor = isOn ? 'crosshair' : 'grab';
    if (this.view.canvas.style.cursor !== cursor) this.view.canvas.style.cursor = cursor;
  }

  // Keys and gamepad.

  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (!this.keyed(event)) return;
    event.preventDefault();
    event.stopPropagation();
  }

  private keyed({ key, shiftKey, repeat }: KeyboardEvent): boolean {
    const { enabled, mode, pressDepth } = this.settings;
    if (key === 'Escape') {
      const held = this.target !== null;
      this.lift();
      return held;
    }
    if (mode === 'mark' && key === 'Enter') {
      const at = this.target ?? this.view.home;
      if (at) this.onMark(at.point);
      return at !== null;
    }
    if (!enabled || this.pointer) return false;
    const arrow = ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] } as Record<string, [number, number]>)[key];
    if (arrow) {
      const from = this.held();
      if (!from) return false;
      const step = shiftKey ? KEY_STEP_FAR : KEY_STEP;
      this.goTo({ ...this.stepped(from, arrow[0] * step, arrow[1] * step), depth: from.depth });
      return true;
    }
    const deeper = key === 'PageDown' || key === '+' || key === '=' ? 1 : key === 'PageUp' || key === '-' ? -1 : 0;
    if (deeper !== 0) {
      const from = this.held();
      if (!from) return false;
      this.goTo({ ...from, depth: this.limited(from.depth + deeper * KEY_DEPTH) });
      return true;
    }
    if (key === ' ') {
      const from = this.held();
      if (from && !repeat) this.goTo({ ...from, depth: from.depth > 0 ? HOVER : pressDepth });
      return true;
    }
    return false;
  }

  /** Where keys hold the tool; they take it up where it was left, or at home. */
  private held(): Target | null {
    if (this.target) {
      this.isHeldByKeys = true;
      return this.target;
    }
    const at = this.lastPlace ?? this.view.home;
    if (!at) return null;
    this.isHeldByKeys = true;
    return { point: at.point, normal: at.normal, depth: HOVER };
  }

  /** A place over the skin, as far to the right and up as seen on the screen. */
  private stepped(from: Target, dx: number, dy: number): { point: Vec3; normal: Vec3 } {
    const { right, up } = this.view.screenAxes();
    const n = from.normal;
    const way = [0, 1, 2].map((c) => right[c] * dx + up[c] * dy);
    const into = way[0] * n[0] + way[1] * n[1] + way[2] * n[2];
    const along = way.map((w, c) => w - into * n[c]);
    // As long on the skin as was asked for, where the skin is seen aslant; but not where it is seen edge-on.
    const length = Math.hypot(...along), wanted = Math.hypot(dx, dy);
    const scale = length > 0.2 * wanted ? wanted / length : 0;
    const point = from.point.map((p, c) => p + along[c] * scale) as Vec3;
    return this.view.nearest(point) ?? from;
  }

  private gamepad(dx: number, dy: number, pull: number, dt: number): void {
    const { enabled, mode, pressDepth } = this.settings;
    if (!enabled || mode === 'orbit' || this.pointer) return;
    const from = this.held();
    if (!from) return;
    const at = dx === 0 && dy === 0 ? from : this.stepped(from, dx * 0.06 * dt, -dy * 0.06 * dt);
    // The trigger is a spring: let go, the tool hovers.
    const depth = pull > 0 ? HOVER + pull * (1.5 * pressDepth - HOVER) : HOVER;
    this.goTo({ point: at.point, normal: at.normal, depth });
  }

  private limited(depth: number): number {
    return Math.min(Math.max(depth, HIGHEST), this.greatestDepth());
  }

  private greatestDepth(): number {
    return Math.min(this.deepest, DEEPEST_SHARE * this.settings.pressDepth);
  }

  // What the engine is told.

  private goTo({ point, normal, depth }: Target): void {
    this.target = { point, normal, depth };
    this.lastPlace = { point, normal };
    this.isDirty = true;
    this.onTarget(this.target);
    this.pump();
  }

  private lift(): void {
    this.click = null;
    const pointer = this.pointer;
    this.pointer = null;
    this.isHeldByKeys = false;
    if (pointer && this.view.canvas.hasPointerCapture(pointer.id)) this.view.canvas.releasePointerCapture(pointer.id);
    if (!this.target) return;
    this.target = null;
    this.isDirty = false;
    window.clearTimeout(this.timer);
    this.timer = 0;
    this.send({ type: 'lift' });
    this.onTarget(null);
  }

  /** Sends the target when it is time: at most 60 times a second, and again while it is held. */
  private pump(): void {
    if (!this.target) return;
    const wait = this.sentAt + (this.isDirty ? LEAST_WAIT : MOST_WAIT) - performance.now();
    if (wait <= 0.5) {
      const { point, normal, depth } = this.target;
      this.sentAt = performance.now();
      this.isDirty = false;
      this.send({ type: 'hand', point: [...point], normal: [...normal], depth });
      this.schedule(MOST_WAIT);
    } else {
      this.schedule(wait);
    }
  }

  private schedule(wait: number): void {
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.pump(), wait);
  }
}
