// Rotating, moving and zooming the view by mouse and fingers. The hand may claim gestures that
// begin on the body.

import type { CameraRig } from './rig';

/** Takes pointers and the wheel before the camera does. */
export interface Claims {
  /** A pointer goes down; true when it is the hand's until it comes up. */
  press(event: PointerEvent): boolean;
  /** The wheel turns; true when it is the hand's. */
  wheel(event: WheelEvent): boolean;
  /** A second finger came down: what the hand holds, it lets go. */
  release(): void;
}

export class Gestures {
  claims: Claims | null = null;
  private readonly pointers = new Map<number, { x: number; y: number }>();
  private readonly claimed = new Map<number, { x: number; y: number }>();
  private kind: 'orbit' | 'pan' = 'orbit';
  private readonly stop = new AbortController();

  constructor(private readonly canvas: HTMLCanvasElement, private readonly rig: CameraRig) {
    const { signal } = this.stop;
    canvas.addEventListener('pointerdown', (e) => this.down(e), { signal });
    canvas.addEventListener('pointermove', (e) => this.move(e), { signal });
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) canvas.addEventListener(type, (e) => this.up(e), { signal });
    canvas.addEventListener('wheel', (e) => this.wheel(e), { signal, passive: false });
    // Focus that came by a pointer needs no ring; by script it would have one.
    canvas.addEventListener('pointerdown', () => (canvas.dataset.focus = 'pointer'), { signal, capture: true });
    canvas.addEventListener('keydown', () => delete canvas.dataset.focus, { signal, capture: true });
    canvas.addEventListener('blur', () => delete canvas.dataset.focus, { signal });
    canvas.addEventListener('contextmenu', (e) => e.preventDefault(), { signal });
  }

  private down(event: PointerEvent): void {
    const place = { x: event.clientX, y: event.clientY };
    if (event.pointerType === 'touch' && this.claimed.size > 0) {
      // The finger that pressed and the new one take the picture together.
      this.claims?.release();
      for (const [id, at] of this.claimed) this.pointers.set(id, at);
      this.claimed.clear();
    } else if (this.pointers.size === 0 && this.claims?.press(event)) {
      this.claimed.set(event.pointerId, place);
      return;
    }
    this.kind = event.button === 1 || (event.button === 2 && event.shiftKey) ? 'pan' : 'orbit';
    this.pointers.set(event.pointerId, place);
    this.canvas.setPointerCapture(event.pointerId);
    if (event.button === 1) event.preventDefault();
  }

  private move(event: PointerEvent): void {
    const held = this.claimed.get(event.pointerId);
    if (held) [held.x, held.y] = [event.clientX, event.clientY];
    const at = this.pointers.get(event.pointerId);
    if (!at) return;
    const dx = event.clientX - at.x, dy = event.clientY - at.y;
    const height = this.canvas.clientHeight || 1;
    if (this.pointers.size === 1) {
      if (this.kind === 'pan') this.rig.pan(dx, dy, height);
      else this.rig.orbit(dx, dy, height);
    } else {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)![1];
      const before = Math.hypot(at.x - other.x, at.y - other.y);
      const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 10 && after > 10) this.rig.zoom(before / after);
      this.rig.orbit(dx / 2, dy / 2, height);
    }
    [at.x, at.y] = [event.clientX, event.clientY];
  }

  private up(event: PointerEvent): void {
    this.pointers.delete(event.pointerId);
    this.claimed.delete(event.pointerId);
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    if (this.claims?.wheel(event)) return;
    this.rig.zoom(Math.exp(wheelSteps(event) * 0.12));
  }

  dispose(): void {
    this.stop.abort();
  }
}

/** Notches of a wheel, or an equal movement on a touchpad. */
export function wheelSteps(event: WheelEvent): number {
  const pixels = event.deltaY * (event.deltaMode === 1 ? 33 : event.deltaMode === 2 ? 400 : 1);
  return Math.max(-3, Math.min(3, pixels / 100));
}
