// The detail of pictures, so that slow GPUs and software WebGL stay usable: less while the body
// moves, all of it when it stands still.

/** A picture that takes longer is slow, one that takes less is fast, ms. */
const SLOW = 38;
const FAST = 14;
/** How long nothing moves before the picture is drawn in full, ms. */
const STILL_MS = 350;
/** The same where a full picture takes long and would delay the next movement. */
const STILL_MS_SLOW = 900;
/** Pixel ratios for still pictures in software WebGL, which has no multisampling. If one takes too
 * long, the next is used. */
const STILL_RATIOS = [2, 1.5, 1];
/** ms. */
const STILL_TOO_LONG = 350;

/** How much of a picture is drawn: pixels of the canvas per CSS pixel, and whether with shadows. */
export interface Detail {
  ratio: number;
  shadows: boolean;
}

/** From the most to the least; `ratio` is a share of the screen's. */
const STEPS: Detail[] = [
  { ratio: 1, shadows: true },
  { ratio: 1, shadows: false },
  { ratio: 0.75, shadows: false },
  { ratio: 0.55, shadows: false },
];

/** Whether the CPU draws WebGL; null without WebGL 2. */
export function isSoftwareWebGL(): boolean | null {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) return null;
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  const name = info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : '';
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

export class Quality {
  private step = 0;
  private stillStep = 0;
  private slow = 0;
  private fast = 0;
  private fence: WebGLSync | null = null;
  private fencedAt = 0;
  private isFull = false;
  private timer = 0;

  constructor(private readonly gl: WebGL2RenderingContext, private readonly isSoftware: boolean, private readonly redraw: () => void) {
    if (isSoftware) this.step = 2;
  }

  /** Whether the GPU is done with the last picture; measures how long it took. */
  isReady(now: number): boolean {
    if (!this.fence) return true;
    const { gl } = this;
    const took = now - this.fencedAt;
    if (gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.SIGNALED && took < 2000 && !gl.isContextLost()) return false;
    gl.deleteSync(this.fence);
    this.fence = null;
    if (!this.isFull) this.judge(took);
    else if (this.isSoftware && took > STILL_TOO_LONG) this.stillStep = Math.min(this.stillStep + 1, STILL_RATIOS.length - 1);
    return true;
  }

  private judge(took: number): void {
    if (took > SLOW) {
      this.fast = 0;
      if (++this.slow >= 4 && this.step < STEPS.length - 1) {
        this.step++;
        this.slow = 0;
      }
    } else if (took < FAST) {
      this.slow = 0;
      if (++this.fast >= 240 && this.step > 0) {
        this.step--;
        this.fast = 0;
      }
    } else {
      this.slow = this.fast = 0;
    }
  }

  /** The detail of the next picture: full when nothing has changed for a while, less while pictures
   * follow each other. */
  begin(isRefinement: boolean): Detail {
    this.isFull = isRefinement || (this.step === 0 && !this.isSoftware);
    const usual = Math.min(window.devicePixelRatio || 1, 2);
    const most = this.isSoftware && this.isFull ? Math.max(usual, STILL_RATIOS[this.stillStep]) : usual;
    const step = STEPS[this.isFull ? 0 : this.step];
    return { ratio: most * step.ratio, shadows: step.shadows };
  }

  /** A picture has been handed to the GPU. */
  end(now: number): void {
    this.fence = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
    this.fencedAt = now;
    if (!this.isFull) this.wait();
  }

  /** Something has changed: the full picture is put off. */
  wait(): void {
    window.clearTimeout(this.timer);
    if (this.step > 0 || this.isSoftware) this.timer = window.setTimeout(this.redraw, this.stillStep > 0 ? STILL_MS_SLOW : STILL_MS);
  }

  forget(): void {
    this.fence = null;
  }

  dispose(): void {
    window.clearTimeout(this.timer);
    if (this.fence) this.gl.deleteSync(this.fence);
    this.fence = null;
  }
}
