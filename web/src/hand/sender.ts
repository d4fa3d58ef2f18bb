// Sends the target to the engine: at most 60 times a second, and again while the tool is held.

import type { Request } from '../connection';
import { HOVER, type Place, type Target } from './target';

/** Shortest time between two messages, and longest while the tool is held, ms. The engine lifts
 * after a second of silence. */
const LEAST_WAIT = 1000 / 60;
const MOST_WAIT = 150;

export class Sender {
  private target: Target | null = null;
  private sentAt = 0;
  private isDirty = false;
  private timer = 0;

  constructor(private readonly send: (request: Request) => void) {}

  goTo(target: Target): void {
    this.target = target;
    this.isDirty = true;
    this.pump();
  }

  /** Sends a place to hover over, once: without another message the engine lifts the tool a little. */
  hover({ point, normal }: Place): void {
    this.send({ type: 'hand', point: [...point], normal: [...normal], depth: HOVER });
  }

  lift(): void {
    this.target = null;
    this.isDirty = false;
    window.clearTimeout(this.timer);
    this.send({ type: 'lift' });
  }

  private pump(): void {
    if (!this.target) return;
    const wait = this.sentAt + (this.isDirty ? LEAST_WAIT : MOST_WAIT) - performance.now();
    if (wait > 0.5) {
      this.schedule(wait);
      return;
    }
    const { point, normal, depth, force } = this.target;
    this.sentAt = performance.now();
    this.isDirty = false;
    this.send({ type: 'hand', point: [...point], normal: [...normal], depth, ...(force !== undefined && { force }) });
    this.schedule(MOST_WAIT);
  }

  private schedule(wait: number): void {
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.pump(), wait);
  }
}
