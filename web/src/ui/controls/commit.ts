// The way of a changed value to the engine.

import { useRef } from 'preact/hooks';
import { notify, state } from '../../store';

/** Sends a value to the engine; resolves to why it was refused, or null. */
export type Commit<T> = (value: T) => Promise<string | null>;

/** Shows a refusal as a notice: for buttons, which have no place of their own for it. */
export function aloud(commit: Promise<string | null>): void {
  void commit.then((error) => error !== null && notify('warning', error));
}

/** How often the state is looked at, ms. */
const SLIDE_PERIOD = 100;
/** ms. */
const LONGEST_BUILD = 3000;

/** Waits until the last body asked for is built, or takes too long: while a slider moves, no queue
 * of bodies may grow. */
async function settled(): Promise<void> {
  const begin = performance.now();
  do {
    await new Promise((resolve) => window.setTimeout(resolve, SLIDE_PERIOD));
  } while (state.peek()?.phase === 'building' && performance.now() - begin < LONGEST_BUILD);
}

/** Sends the newest value only, and the next one when that is answered. */
export function useLatest(commit: Commit<string>, onError: (error: string | null) => void): (text: string) => void {
  const waiting = useRef<string | null>(null);
  const isBusy = useRef(false);
  const current = useRef({ commit, onError });
  current.current = { commit, onError };
  return (text) => {
    waiting.current = text;
    if (isBusy.current) return;
    isBusy.current = true;
    void (async () => {
      while (waiting.current !== null) {
        const next = waiting.current;
        waiting.current = null;
        current.current.onError(await current.current.commit(next));
        await settled();
      }
      isBusy.current = false;
    })();
  };
}
