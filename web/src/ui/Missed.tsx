// What a press beside the skin met, said at the pointer.

import { signal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { t } from '../i18n';
import type { BodyView, NoSkin } from '../scene';
import { isController, isReplaying } from '../store';
import { handMode, picking } from './settings';

/** The words go after this time, ms, or when the pointer drags this far, px: that turns the view. */
const STAYS = 3000;
const MOVED = 8;

interface Miss {
  part: NoSkin;
  /** Place in the picture, px. */
  x: number;
  y: number;
}

const missed = signal<Miss | null>(null);

/** What needs skin under the pointer: presses, and clicks for these purposes. */
const NEED_SKIN: readonly string[] = ['press', 'mark', 'lump', 'place'];

/** Says it when a press meets no skin. Returns what ends it. */
export function watchMisses(body: BodyView): () => void {
  const down = ({ button, ctrlKey, clientX, clientY, offsetX: x, offsetY: y }: PointerEvent): void => {
    if (button !== 0 || ctrlKey || !isController.peek() || isReplaying.peek()) return;
    if (!NEED_SKIN.includes(picking.peek()?.kind ?? handMode.peek()) || body.pickRest(clientX, clientY) !== null) return;
    const part = body.pickNoSkin(clientX, clientY);
    if (part !== null) missed.value = { part, x, y };
  };
  body.canvas.addEventListener('pointerdown', down);
  return () => body.canvas.removeEventListener('pointerdown', down);
}

/** The words lie over the picture and take no room. */
export function Missed() {
  const now = missed.value;
  useEffect(() => {
    if (now === null) return;
    const end = (): void => {
      if (missed.peek() === now) missed.value = null;
    };
    let from: { x: number; y: number } | null = null;
    const move = ({ buttons, clientX: x, clientY: y }: PointerEvent): void => {
      if (buttons === 0) return;
      from ??= { x, y };
      if (Math.hypot(x - from.x, y - from.y) > MOVED) end();
    };
    const timer = window.setTimeout(end, STAYS);
    window.addEventListener('pointermove', move);
    window.addEventListener('pointerdown', end);
    return () => {
      window.clearTimeout(timer);
      window.removeEventListener('pointermove', move);
      window.removeEventListener('pointerdown', end);
    };
  }, [now]);
  return (
    <div class="missed-place" role="status">
      {now !== null && (
        <p class="chip missed" style={{ left: `clamp(160px, ${now.x}px, calc(100% - 160px))`, top: `max(48px, ${now.y}px)` }} data-testid="missed" data-part={now.part}>{t(`missed.${now.part}`)}</p>
      )}
    </div>
  );
}
