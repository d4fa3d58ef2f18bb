// The bar of a game: time, marks and result.

import { signal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { t } from '../i18n';
import { askAloud, isController, state } from '../store';
import { Button } from './controls';
import { clock, endGame } from './panels/GamePanel';
import { picking } from './settings';

const seconds = signal(0);

export function GameBar() {
  const game = state.value?.game;
  useClock(game?.seconds, game != null && game.result == null);
  if (game == null || game.result != null) return null;
  const isMarking = picking.value?.kind === 'mark';
  const isFull = game.marks.length >= game.n_lumps;
  const cannot = !isController.value;
  return (
    <section class="game-bar" aria-label={t('game.title')} data-testid="game-bar">
      <strong class="timer" role="timer">{clock(seconds.value)}</strong>
      <span data-marks={game.marks.length}>{t('game.marked', { n: game.marks.length, of: game.n_lumps })}</span>
      <Button
        kind={isFull ? undefined : 'primary'}
        pressed={isMarking}
        disabled={cannot}
        onClick={() => (picking.value = isMarking ? null : { kind: 'mark' })}
        testid="game-mark-mode"
      >
        {t('game.mark')}
      </Button>
      <Button disabled={cannot || game.marks.length === 0} onClick={() => void askAloud({ type: 'unmark' })} testid="game-unmark">
        {t('game.unmark')}
      </Button>
      <Button
        kind={isFull ? 'primary' : undefined}
        disabled={cannot}
        onClick={() => {
          picking.value = null;
          void askAloud({ type: 'reveal' });
        }}
        testid="game-reveal"
      >
        {t('game.reveal')}
      </Button>
      <Button kind="quiet" disabled={cannot} onClick={endGame}>{t('game.give_up')}</Button>
    </section>
  );
}

/** Keeps the clock running between states, which come only when something changes. */
function useClock(told: number | undefined, isOn: boolean): void {
  useEffect(() => {
    if (!isOn || told === undefined) return;
    const began = performance.now();
    seconds.value = told;
    const timer = window.setInterval(() => (seconds.value = told + (performance.now() - began) / 1e3), 500);
    return () => window.clearInterval(timer);
  }, [told, isOn]);
}
