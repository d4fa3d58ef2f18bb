// The bar of a game over the body: time, marks and verdict.

import { signal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { t } from '../i18n';
import type { GameInfo, GameResult } from '../generated/api';
import { askAloud, isController, state } from '../store';
import { bodyView } from './body';
import { Button } from './controls';
import { clock, endGame, isLastRound, newGame, nextRound, revealLumps, verdict } from './game';
import { picking } from './settings';

const seconds = signal(0);

export function GameBar() {
  const game = state.value?.game;
  useClock(game?.seconds, game != null && game.result == null);
  if (game == null) return null;
  return game.result == null ? <Searching game={game} /> : <Verdict game={game} result={game.result} />;
}

function RoundName({ game: { series, level, result } }: { game: GameInfo }) {
  const n = series.rounds.length + (result == null ? 1 : 0);
  const name = t(`game.level_${level}`);
  return <span data-testid="game-round">{series.n_rounds > 1 ? t('game.round', { n, of: series.n_rounds, level: name }) : name}</span>;
}

function Searching({ game }: { game: GameInfo }) {
  const isMarking = picking.value?.kind === 'mark';
  const isFull = game.marks.length >= game.n_lumps;
  const cannot = !isController.value;
  return (
    <section class="game-bar" aria-label={t('game.title')} data-testid="game-bar">
      <strong class="timer" role="timer">{clock(seconds.value)}</strong>
      <RoundName game={game} />
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
      <Button kind={isFull ? 'primary' : undefined} disabled={cannot} onClick={revealLumps} testid="game-reveal">
        {t('game.reveal')}
      </Button>
      <Button kind="quiet" disabled={cannot} onClick={endGame}>{t('game.give_up')}</Button>
      {game.is_either_side && (
        <p class="game-sides" data-testid="game-sides">
          {t('game.either_side')}
          <Button kind="quiet" onClick={() => bodyView.value?.turnRound()} testid="game-turn">{t('game.turn_round')}</Button>
        </p>
      )}
    </section>
  );
}

function Verdict({ game, result }: { game: GameInfo; result: GameResult }) {
  const isAll = result.n_found === result.lumps.length;
  const isLast = isLastRound(game);
  const cannot = !isController.value;
  return (
    <section class="game-bar" aria-label={t('game.title')} data-testid="game-verdict" data-found={result.n_found} role="status">
      <RoundName game={game} />
      <strong class={`verdict ${isAll ? 'good' : 'bad'}`}>
        {result.lumps.length === 1 ? verdict(result.lumps[0]) : t('game.found_of', { n: result.n_found, of: result.lumps.length })}
      </strong>
      <span>{t('game.points', { n: result.score.total })}</span>
      {isLast
        ? <Button kind="primary" disabled={cannot} onClick={() => newGame(game)} testid="game-bar-again">{t(game.series.n_rounds > 1 ? 'game.new_series' : 'game.new_round')}</Button>
        : <Button kind="primary" disabled={cannot} onClick={nextRound} testid="game-next">{t('game.next_round')}</Button>}
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
