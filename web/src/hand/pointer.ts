// The hand by mouse and finger: press, stroke, wheel, shift-drag, and clicks that mark.

import { wheelSteps } from '../scene/gestures';
import type { Held } from './target';

/** Depth of a notch of the wheel, m. */
const WHEEL_STEP = 0.0005;
/** A click that marks moves no farther than this, px. */
const CLICK_REACH = 6;
/** The tool comes over the place where the pointer has rested for this time, ms: the mesh is refined there, which
 * takes too long to follow a pointer on its way to elsewhere. */
const DWELL = 60;

interface Drag {
  id: number;
  /** Depth of the press, m. */
  depth: number;
  /** Where a shift-drag began, px and m; null without one. */
  shiftFrom: { x: number; y: number; depth: number } | null;
  /** From the cursor to the pressed place, px: shift-drags move the cursor away from it. */
  off: { x: number; y: number };
}

export class PointerHand {
  private drag: Drag | null = null;
  private dwell = 0;
  private click: { id: number; x: number; y: number } | null = null;

  constructor(private readonly hand: Held, signal: AbortSignal) {
    const { canvas } = hand.view;
    canvas.addEventListener('pointermove', (e) => this.move(e), { signal });
    canvas.addEventListener('pointerleave', () => window.clearTimeout(this.dwell), { signal });
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) canvas.addEventListener(type, (e) => this.up(e), { signal });
  }

  get isHolding(): boolean {
    return this.drag !== null;
  }

  /** A pointer goes down; true if the hand takes it. */
  press(event: PointerEvent): boolean {
    const { view, settings: { mode, enabled, pressDepth } } = this.hand;
    window.clearTimeout(this.dwell);
    if (event.button !== 0 || event.ctrlKey || mode === 'orbit') return false;
    const { pointerId: id, clientX: x, clientY: y } = event;
    const at = view.pickRest(x, y);
    if (!at) return false;
    view.canvas.focus({ preventScroll: true });
    if (mode === 'mark') {
      this.click = { id, x, y };
      return true;
    }
    if (!enabled) return false;
    event.preventDefault();
    view.canvas.setPointerCapture(id);
    const depth = event.shiftKey ? 0 : pressDepth;
    this.drag = { id, depth, shiftFrom: event.shiftKey ? { x, y, depth } : null, off: { x: 0, y: 0 } };
    this.hand.goTo({ ...at, depth });
    return true;
  }

  /** A notch of the wheel while the tool is held. */
  turn(event: WheelEvent): void {
    const { target } = this.hand;
    if (!target) return;
    const depth = this.hand.limited(target.depth + wheelSteps(event) * WHEEL_STEP);
    if (this.drag) this.drag.depth = depth;
    this.hand.goTo({ ...target, depth });
  }

  letGo(): void {
    const { canvas } = this.hand.view;
    const { drag } = this;
    this.click = this.drag = null;
    if (drag && canvas.hasPointerCapture(drag.id)) canvas.releasePointerCapture(drag.id);
  }

  private move(event: PointerEvent): void {
    const { drag } = this;
    const { target, view } = this.hand;
    if (!drag || drag.id !== event.pointerId || !target) {
      this.hover(event);
      return;
    }
    if (event.shiftKey) {
      // Down presses deeper; without Shift the depth returns.
      drag.shiftFrom ??= { x: event.clientX, y: event.clientY, depth: target.depth };
      const depth = drag.shiftFrom.depth + (event.clientY - drag.shiftFrom.y) * view.metresPerPixel();
      this.hand.goTo({ ...target, depth: this.hand.limited(depth) });
      return;
    }
    if (drag.shiftFrom) {
      drag.off.x += drag.shiftFrom.x - event.clientX;
      drag.off.y += drag.shiftFrom.y - event.clientY;
      drag.shiftFrom = null;
    }
    // Beside the body the tool stays at the last place.
    const at = view.pickRest(event.clientX + drag.off.x, event.clientY + drag.off.y);
    this.hand.goTo({ ...(at ?? target), depth: drag.depth });
  }

  private up(event: PointerEvent): void {
    if (this.click?.id === event.pointerId) {
      const { x, y } = this.click;
      this.click = null;
      if (event.type !== 'pointerup' || Math.hypot(event.clientX - x, event.clientY - y) > CLICK_REACH) return;
      const at = this.hand.view.pick(event.clientX, event.clientY);
      if (at?.part === 'skin') this.hand.mark(at.point);
      return;
    }
    if (this.drag?.id === event.pointerId) this.hand.lift();
  }

  /** Shows by the cursor what a button would do. */
  private hover(event: PointerEvent): void {
    window.clearTimeout(this.dwell);
    if (event.buttons !== 0) return;
    const { view, settings: { mode, enabled } } = this.hand;
    const at = mode !== 'orbit' && (enabled || mode === 'mark') ? view.pickRest(event.clientX, event.clientY) : null;
    const isOn = at !== null;
    if (isOn && mode === 'press' && event.pointerType !== 'touch') this.dwell = window.setTimeout(() => this.hand.hover(at), DWELL);
    const cursor = isOn ? 'crosshair' : 'grab';
    if (view.canvas.style.cursor !== cursor) view.canvas.style.cursor = cursor;
  }
}
