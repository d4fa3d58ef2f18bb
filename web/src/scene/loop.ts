// When to draw: once after a change, as fast as the GPU keeps up, and once more in full detail
// when nothing moves.

import type { Detail, Quality } from './quality';

/** The kinds of change since the last picture. */
export type Changes = Record<'frame' | 'style' | 'camera' | 'shadow', boolean>;

export interface Drawing {
  /** Moves what moves by itself, before the detail is chosen; `now` in ms. */
  step(now: number): void;
  /** Whether the tool presses. */
  isHeld(): boolean;
  draw(detail: Detail): void;
  /** The picture has been handed to the GPU. */
  done(): void;
}

export class DrawLoop {
  readonly changed: Changes = { frame: true, style: true, camera: true, shadow: true };
  private isAsked = false;
  private isRefining = false;
  private isStopped = false;

  constructor(private readonly quality: Quality, private readonly drawing: Drawing) {}

  /** Asks for a picture. */
  invalidate(what: keyof Changes): void {
    this.changed[what] = true;
    if (what !== 'shadow') {
      this.isRefining = false;
      this.quality.putOff();
    }
    this.ask();
  }

  /** Asks for a picture in full detail, as nothing has moved for a while. */
  refine(): void {
    this.isRefining = true;
    this.invalidate('shadow');
  }

  /** The changes are in the picture. */
  taken(): void {
    this.changed.frame = this.changed.style = this.changed.camera = this.changed.shadow = false;
  }

  stop(): void {
    this.isStopped = true;
  }

  private ask(): void {
    if (this.isAsked || this.isStopped) return;
    this.isAsked = true;
    const pause = this.quality.wait(performance.now());
    if (pause > 4) window.setTimeout(() => requestAnimationFrame((now) => this.tick(now)), pause - 4);
    else requestAnimationFrame((now) => this.tick(now));
  }

  private tick(now: number): void {
    this.isAsked = false;
    if (this.isStopped || document.hidden) return;
    if (!this.quality.isReady || this.quality.wait(now) > 0) {
      this.ask();
      return;
    }
    this.drawing.step(now);
    this.drawing.draw(this.quality.begin(this.isRefining, this.drawing.isHeld(), now));
    this.quality.end(performance.now());
    this.isRefining = false;
    this.drawing.done();
  }
}
