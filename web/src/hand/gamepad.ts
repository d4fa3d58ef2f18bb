// A gamepad: the left stick moves the tool, the right trigger presses it.

const DEAD = 0.15;
const TRIGGER = 7;

export class Gamepads {
  private asked = 0;
  private last = 0;
  private wasUsed = false;
  private readonly stop = new AbortController();

  /** `onUse` is told of the stick (right and down, −1 to 1), the trigger (0 to 1), and the seconds since it was told last. */
  constructor(private readonly onUse: (dx: number, dy: number, pull: number, dt: number) => void) {
    const { signal } = this.stop;
    // Gamepads have to be asked; nothing is asked while there is none.
    window.addEventListener('gamepadconnected', () => this.begin(), { signal });
    this.begin();
  }

  private begin(): void {
    if (this.asked !== 0 || !this.first()) return;
    this.last = performance.now();
    this.asked = requestAnimationFrame((now) => this.poll(now));
  }

  private first(): Gamepad | null {
    return navigator.getGamepads?.().find((pad) => pad !== null) ?? null;
  }

  private poll(now: number): void {
    this.asked = 0;
    const pad = this.first();
    if (!pad || this.stop.signal.aborted) return;
    this.asked = requestAnimationFrame((next) => this.poll(next));
    const dt = Math.min(0.1, (now - this.last) / 1000);
    this.last = now;
    const live = (x = 0) => (Math.abs(x) < DEAD ? 0 : (x - Math.sign(x) * DEAD) / (1 - DEAD));
    const dx = live(pad.axes[0]), dy = live(pad.axes[1]);
    const trigger = pad.buttons[TRIGGER]?.value ?? 0;
    const pull = trigger < 0.04 ? 0 : trigger;
    const isUsed = dx !== 0 || dy !== 0 || pull > 0;
    // Once more when all is let go, so that the tool is told to come up.
    if (isUsed || this.wasUsed) this.onUse(dx, dy, pull, dt);
    this.wasUsed = isUsed;
  }

  dispose(): void {
    this.stop.abort();
    cancelAnimationFrame(this.asked);
  }
}
