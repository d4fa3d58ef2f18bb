// The detail of pictures and the time between them, so that slow GPUs and software WebGL stay usable and the
// engine keeps the processor: less while the body moves, all of it when it stands still.

/** A picture that takes longer is slow, one that takes less is fast, ms. */
const SLOW = 38;
const FAST = 14;
/** The same in software WebGL, which is to leave the engine half of the time. */
const SLOW_SOFTWARE = 30;
const FAST_SOFTWARE = 10;
/** How long nothing moves before the picture is drawn in full, ms. */
const STILL_MS = 350;
/** The same where a full picture takes long and would delay the next movement. */
const STILL_MS_SLOW = 900;
/** Pixel ratios for still pictures in software WebGL, which has no multisampling. If one takes too
 * long, the next is used. */
const STILL_RATIOS = [2, 1.5, 1];
/** ms. */
const STILL_TOO_LONG = 350;
/** Between two looks at whether the GPU is done, and when it counts as done anyway, ms. */
const POLL_MS = 5;
const GIVEN_UP = 2000;
/** A picture that took longer, ms, was held up by something else. */
const LONGEST = 150;
/** In software WebGL, the pause after a picture, in times that it took. */
const PAUSE = 0.5;
/** Pictures that follow each other more slowly, because the engine was late: their pauses are so many times longer, for at
 * least this time after it was late last, ms. */
const YIELD = 1.5;
const YIELD_MS = 6000;
/** While pictures yield, the least pause between two, ms; it grows with them. */
const YIELD_PAUSE = 20;
/** Between two answers to an engine that is late, ms. */
const YIELD_WAIT = 400;

/** How much of a picture is drawn: pixels of the canvas per CSS pixel, whether with shadows and with the fine
 * structure of tissue. */
export interface Detail {
  ratio: number;
  shadows: boolean;
  grain: boolean;
}

/** From the most to the least; `ratio` is a share of the screen's. */
const STEPS: Detail[] = [
  { ratio: 1, shadows: true, grain: true },
  { ratio: 1, shadows: false, grain: true },
  { ratio: 0.75, shadows: false, grain: true },
  { ratio: 0.6, shadows: false, grain: false },
  { ratio: 0.45, shadows: false, grain: false },
  { ratio: 0.35, shadows: false, grain: false },
];
const SOFTWARE_STEP = 3;

export class Quality {
  /** Pictures yield to the engine, or no longer. */
  onYield: (yields: boolean) => void = () => {};
  /** Whether pictures may yield. */
  private mayYield = true;
  private step = 0;
  private stillStep = 0;
  private slow = 0;
  private fast = 0;
  private fence: WebGLSync | null = null;
  private fencedAt = 0;
  private isFull = false;
  private isHeld = false;
  private timer = 0;
  private poller = 0;
  private yielded = 1;
  private yieldedAt = -Infinity;
  private dueAt = 0;

  constructor(private readonly gl: WebGL2RenderingContext, private readonly isSoftware: boolean, private readonly redraw: () => void) {
    if (isSoftware) this.step = SOFTWARE_STEP;
  }

  /** Whether the GPU is done with the last picture. */
  get isReady(): boolean {
    return this.fence === null;
  }

  /** Looks whether the GPU is done, until it is. */
  private poll(): void {
    const { gl, fence } = this;
    if (!fence) return;
    const now = performance.now();
    const took = now - this.fencedAt;
    if (gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED && took < GIVEN_UP && !gl.isContextLost()) {
      this.poller = window.setTimeout(() => this.poll(), POLL_MS);
      return;
    }
    gl.deleteSync(fence);
    this.fence = null;
    if (!this.isFull) this.judge(took);
    else if (this.isSoftware && took > STILL_TOO_LONG) this.stillStep = Math.min(this.stillStep + 1, STILL_RATIOS.length - 1);
    const pause = (this.isSoftware ? PAUSE * Math.min(took, LONGEST) : 0) * this.yielded;
    this.dueAt = now + (this.yielded > 1 ? Math.max(pause, YIELD_PAUSE * this.yielded) : pause);
  }

  /** Time until the next picture may be drawn, ms. */
  wait(now: number): number {
    return Math.max(0, this.dueAt - now);
  }

  /** The engine was late while the tool pressed: pictures leave it more time. */
  yield(now: number): void {
    if (!this.mayYield || now - this.yieldedAt < YIELD_WAIT) return;
    this.yieldedAt = now;
    this.setYield(YIELD);
  }

  /** Pictures as before, whether the engine is late or not. */
  neverYield(): void {
    this.mayYield = false;
    this.setYield(1);
  }

  private setYield(to: number): void {
    const [before, after] = [this.yielded > 1, to > 1];
    this.yielded = to;
    if (before !== after) this.onYield(after);
  }

  private judge(took: number): void {
    const [slow, fast] = this.isSoftware ? [SLOW_SOFTWARE, FAST_SOFTWARE] : [SLOW, FAST];
    if (took > slow) {
      this.fast = 0;
      if (++this.slow >= 4 && this.step < STEPS.length - 1) {
        this.step++;
        this.slow = 0;
      }
    } else if (took < fast) {
      this.slow = 0;
      if (++this.fast >= 240 && this.step > (this.isSoftware ? 2 : 0)) {
        this.step--;
        this.fast = 0;
      }
    } else {
      this.slow = this.fast = 0;
    }
  }

  /** The detail of the next picture: full when nothing has changed for a while, less while pictures
   * follow each other. `isHeld`: the tool presses, and the engine needs the processor that draws. */
  begin(isRefinement: boolean, isHeld: boolean, now: number): Detail {
    if (this.yielded > 1 && now - this.yieldedAt > YIELD_MS) {
      this.setYield(1);
    }
    this.isHeld = isHeld && this.isSoftware;
    this.isFull = isRefinement || (this.step === 0 && !this.isSoftware);
    const usual = Math.min(window.devicePixelRatio || 1, 2);
    if (isRefinement && this.isHeld) return { ratio: Math.min(usual, 1), shadows: false, grain: true };
    const most = this.isSoftware && this.isFull ? Math.max(usual, STILL_RATIOS[this.stillStep]) : usual;
    const step = STEPS[this.isFull ? 0 : this.step];
    return { ...step, ratio: most * step.ratio };
  }

  /** A picture has been handed to the GPU. */
  end(now: number): void {
    this.fence = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
    this.fencedAt = now;
    window.clearTimeout(this.poller);
    this.poller = window.setTimeout(() => this.poll(), POLL_MS);
    if (!this.isFull) this.putOff();
  }

  /** Something has changed: the full picture is put off. */
  putOff(): void {
    window.clearTimeout(this.timer);
    if (this.step > 0 || this.isSoftware) this.timer = window.setTimeout(this.redraw, this.stillStep > 0 || this.isHeld ? STILL_MS_SLOW : STILL_MS);
  }

  forget(): void {
    this.fence = null;
  }

  dispose(): void {
    window.clearTimeout(this.timer);
    window.clearTimeout(this.poller);
    if (this.fence) this.gl.deleteSync(this.fence);
    this.fence = null;
  }
}
