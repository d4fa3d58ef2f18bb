// The game on the page: requests to the engine, the best scores that the browser keeps, and where the camera looks.

import { effect, signal, untracked } from '@preact/signals';
import type { FoundLump, GameInfo, Level, RoundInfo } from '../generated/api';
import { t } from '../i18n';
import { askAloud, galleryKey, state, type Vec3 } from '../store';
import { bodyView } from './body';
import { formatNumber } from './quantity';
import { isPanelOpen, picking, remembered, tab, wantedLevel, wantedLumps, wantedRounds } from './settings';

/** Length of the view around a lump that is revealed, m. */
const AROUND_LUMP = 0.11;
const MOST_PLAYED = 300;

export function startGame(seed: number | null): void {
  picking.value = null;
  const level = wantedLevel.value;
  void askAloud({
    type: 'start_game', seed, n_lumps: Number(wantedLumps.value), level: level === 'drawn' ? null : level, n_rounds: Number(wantedRounds.value),
  });
}

/** The same game again, from its seed. */
export function repeatGame({ series, n_lumps }: GameInfo): void {
  picking.value = null;
  void askAloud({ type: 'start_game', seed: series.seed, n_lumps, level: series.level ?? null, n_rounds: series.n_rounds });
}

/** Another game with the same choices. */
export function newGame({ series, n_lumps }: GameInfo): void {
  picking.value = null;
  void askAloud({ type: 'start_game', seed: null, n_lumps, level: series.level ?? null, n_rounds: series.n_rounds });
}

export function nextRound(): void {
  picking.value = null;
  void askAloud({ type: 'next_round' });
}

export function revealLumps(): void {
  picking.value = null;
  void askAloud({ type: 'reveal' });
}

export function endGame(): void {
  picking.value = null;
  void askAloud({ type: 'end_game' });
}

export function isLastRound({ series }: GameInfo): boolean {
  return series.rounds.length >= series.n_rounds;
}

/** Minutes and seconds. */
export function clock(seconds: number): string {
  const whole = Math.floor(seconds);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}`;
}

/** A length in whole mm, below 10 mm in tenths. */
export function millimetres(metres: number): string {
  const value = 1e3 * metres;
  return `${value.toFixed(value < 9.95 ? 1 : 0)} mm`;
}

/** A lump's result in a sentence. */
export function verdict({ is_found, error, is_other_side }: FoundLump): string {
  if (error == null) return t('game.unmarked');
  const words = t(is_found ? 'game.found' : 'game.missed', { error: millimetres(error) });
  return is_other_side ? `${words} ${t('game.other_side')}` : words;
}

export function rangeOf(from: readonly number[], scale: number): string {
  return from.map((x) => formatNumber(scale * x, 2)).join('–');
}

// The best scores. A round whose answer the browser has seen does not count again.

interface Best {
  score: number;
  seconds: number;
}
type Bests = Partial<Record<Level, Best>>;

const isBests = (value: unknown): boolean =>
  typeof value === 'object' && value !== null && Object.values(value).every((best: unknown) => typeof (best as Best | null)?.score === 'number' && typeof (best as Best).seconds === 'number');
export const bests = remembered<Bests>('best_scores', {}, isBests);
const played = remembered<readonly string[]>('played_rounds', [], (value) => Array.isArray(value) && value.every((key) => typeof key === 'string'));

/** How the round that was revealed last compares with the best: a new best, the same round as before, or neither. */
export const standing = signal<'best' | 'repeat' | null>(null);

function keep(round: RoundInfo, nLumps: number): void {
  const key = [galleryKey.peek(), round.level, nLumps, round.seed].join(' ');
  if (played.peek().includes(key)) {
    standing.value = 'repeat';
    return;
  }
  played.value = [...played.peek(), key].slice(-MOST_PLAYED);
  const { total: score } = round.result.score;
  const best = bests.peek()[round.level];
  const isBest = score > 0 && (best === undefined || score > best.score || (score === best.score && round.seconds < best.seconds));
  standing.value = isBest ? 'best' : null;
  if (isBest) bests.value = { ...bests.peek(), [round.level]: { score, seconds: round.seconds } };
}

/** The lump to look at: one that was missed rather than one that was found. */
function lookAt(lumps: readonly FoundLump[]): void {
  const lump = lumps.find(({ is_found }) => !is_found) ?? lumps[0];
  if (lump !== undefined) bodyView.peek()?.lookAtPoint(lump.over as Vec3, lump.normal as Vec3, AROUND_LUMP);
}

/** Follows the game from now on: at each result that this page sees come, it turns the camera to the lump and keeps the score. */
export function beginGames(): void {
  let hiding: string | null = null;
  effect(() => {
    const game = state.value?.game;
    if (game == null) {
      hiding = null;
      return;
    }
    const round = `${game.series.seed} ${game.seed} ${game.level}`;
    if (game.result == null) {
      hiding = round;
      return;
    }
    if (hiding !== round) return;
    hiding = null;
    const { lumps } = game.result;
    untracked(() => {
      const last = game.series.rounds.at(-1);
      if (last !== undefined) keep(last, game.n_lumps);
      tab.value = 'game';
      isPanelOpen.value = true;
      lookAt(lumps);
    });
  });
}
