// A gamepad: the left stick moves the tool, the right trigger presses it.

/** Dead zone of the stick; of its whole way. */
const DEAD = 0.15;
/** The right trigger among the buttons of the standard layout. */
const TRIGGER = 7;

export class Gamepads {
  private request = 0;
  private last = 0;
  private wasUsed = false;
  private readonly stop = new AbortController();

  /** `onUse` gets the stick (right and down, −1 to 1), the trigger (0 to 1), and the time
   * since the last call, s. */
  constructor(private readonly onUse: (dx: number, dy: number, pull: number, dt: number) => void) {
    const { signal } = this.stop;
    // Gamepads must be polled. There is no polling while there is none.
    window.addEventListener('gamepadconnected', () => this.begin(), { signal });
    this.begin();
  }

  private begin(): void {
    if (this.request !== 0 || !this.first()) return;
    this.last = performance.now();
    this.request = requestAnimationFrame((now) => this.poll(now));
  }

  private first(): Gamepad | null {
    return navigator.getGamepads?.().find((pad) => pad !== null) ?? null;
  }

  private poll(now: number): void {
    this.request = 0;
    const pad = this.first();
    if (!pad || this.stop.signal.aborted) return;
    this.request = requestAnimationFrame((next) => this.poll(next));
    const dt = Math.min(0.1, (now - this.last) / 1000);
    this.last = now;
    const live = (x = 0) => (Math.abs(x) < DEAD ? 0 : (x - Math.sign(x) * DEAD) / (1 - DEAD));
    const dx = live(pad.axes[0]), dy = live(pad.axes[1]);
    const trigger = pad.buttons[TRIGGER]?.value ?? 0;
    const pull = trigger < 0.04 ? 0 : trigger;
    const isUsed = dx !== 0 || dy !== 0 || pull > 0;
    // Once more when all is released, so that the tool comes up.
    if (isUsed || this.wasUsed) this.onUse(dx, dy, pull, dt);
    this.wasUsed = isUsed;
  }

  dispose(): void {
    this.stop.abort();
    cancelAnimationFrame(this.request);
  }
}
