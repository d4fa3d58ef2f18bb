// The hand by mouse and finger: press, stroke, wheel, shift-drag, and clicks that mark.

import { wheelSteps } from '../scene/gestures';
import { DEPTH_STEP, type Held, type Target } from './target';

/** A click that marks moves no farther than this, px. */
const CLICK_REACH = 6;
/** The tool comes over the place where the pointer has rested for this time, ms: the mesh is refined there, which
 * takes too long to follow a pointer on its way to elsewhere. */
const DWELL = 60;

interface Drag {
  id: number;
  /** Depth of the press, m, or the force that it holds, N. */
  aim: Pick<Target, 'depth' | 'force'>;
  /** Where a shift-drag began, px, and the target then; null without one. */
  shiftFrom: { x: number; y: number; target: Target } | null;
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
    const { view, settings: { mode, enabled } } = this.hand;
    window.clearTimeout(this.dwell);
    if (event.button !== 0 || event.ctrlKey || mode === 'orbit') return false;
    const { pointerId: id, clientX: x, clientY: y } = event;
    if (mode === 'mark') {
      if (!view.pick(x, y)) return false;
      view.canvas.focus({ preventScroll: true });
      this.click = { id, x, y };
      return true;
    }
    const at = view.pickRest(x, y);
    if (!at) return false;
    view.canvas.focus({ preventScroll: true });
    if (!enabled) return false;
    event.preventDefault();
    view.canvas.setPointerCapture(id);
    const pressed = this.hand.pressed(at);
    const target = !event.shiftKey ? pressed : pressed.force === undefined ? { ...at, depth: 0 } : { ...pressed, force: 0 };
    this.drag = { id, aim: aimOf(target), shiftFrom: event.shiftKey ? { x, y, target } : null, off: { x: 0, y: 0 } };
    this.hand.goTo(target);
    return true;
  }

  /** A notch of the wheel while the tool is held. */
  turn(event: WheelEvent): void {
    const { target } = this.hand;
    if (!target) return;
    const deeper = this.hand.deepened(target, wheelSteps(event));
    if (this.drag) this.drag.aim = aimOf(deeper);
    this.hand.goTo(deeper);
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
      drag.shiftFrom ??= { x: event.clientX, y: event.clientY, target };
      const steps = ((event.clientY - drag.shiftFrom.y) * view.metresPerPixel()) / DEPTH_STEP;
      this.hand.goTo({ ...this.hand.deepened(drag.shiftFrom.target, steps), point: target.point, normal: target.normal });
      return;
    }
    if (drag.shiftFrom) {
      drag.off.x += drag.shiftFrom.x - event.clientX;
      drag.off.y += drag.shiftFrom.y - event.clientY;
      drag.shiftFrom = null;
    }
    // Beside the body the tool stays at the last place.
    const at = view.pickRest(event.clientX + drag.off.x, event.clientY + drag.off.y);
    const { point, normal } = at ?? target;
    this.hand.goTo({ point, normal, ...drag.aim });
  }

  private up(event: PointerEvent): void {
    if (this.click?.id === event.pointerId) {
      const { x, y } = this.click;
      this.click = null;
      if (event.type !== 'pointerup' || Math.hypot(event.clientX - x, event.clientY - y) > CLICK_REACH) return;
      const at = this.hand.view.pick(event.clientX, event.clientY);
      if (at) this.hand.mark(at);
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

function aimOf({ depth, force }: Target): Pick<Target, 'depth' | 'force'> {
  return force === undefined ? { depth } : { depth, force };
}
