// The game: start a round, follow it, and read its result.

import { signal } from '@preact/signals';
import { useId } from 'preact/hooks';
import { t } from '../../i18n';
import { askAloud, state } from '../../store';
import type { GameInfo, GameResult } from '../../generated/api';
import { Button, Controlled, Section, Segmented, Toggle } from '../controls';
import { formatNumber } from '../quantity';
import { picking, show, view, wantedSeed } from '../settings';

const wantedLumps = signal<'1' | '2' | '3'>('1');

function startGame(n_lumps: number, seed: number | null): void {
  picking.value = null;
  void askAloud({ type: 'start_game', n_lumps, seed });
}

export function endGame(): void {
  picking.value = null;
  void askAloud({ type: 'end_game' });
}

export function GamePanel() {
  const game = state.value?.game ?? null;
  return (
    <Controlled>
      {game === null && <Start />}
      {game !== null && game.result == null && (
        <Section title={t('game.going_on')}>
          <p class="hint">{t('game.how')}</p>
          <GameFigures game={game} />
        </Section>
      )}
      {game?.result != null && <Result game={game} result={game.result} />}
    </Controlled>
  );
}

function Start() {
  const id = useId();
  const seed = wantedSeed.value.trim();
  const isSeed = seed === '' || /^\d{1,15}$/.test(seed);
  return (
    <Section title={t('game.setup')} hint={t('game.about')}>
      <Segmented
        label={t('game.n_lumps')}
        value={wantedLumps.value}
        options={(['1', '2', '3'] as const).map((value) => ({ value, label: value, testid: `game-lumps-${value}` }))}
        onChange={(value) => (wantedLumps.value = value)}
      />
      <div class={`row quantity ${isSeed ? '' : 'refused'}`}>
        <label for={id}>{t('game.seed')}</label>
        <input
          id={id}
          type="text"
          inputMode="numeric"
          autocomplete="off"
          placeholder={t('game.seed_random')}
          value={wantedSeed.value}
          aria-invalid={!isSeed}
          aria-describedby={isSeed ? undefined : `${id}-error`}
          onInput={(event) => (wantedSeed.value = event.currentTarget.value)}
          data-testid="game-seed"
        />
        {!isSeed && <p class="field-error" id={`${id}-error`} role="alert">{t('game.seed_error')}</p>}
      </div>
      <div class="buttons">
        <Button
          kind="primary"
          disabled={!isSeed}
          onClick={() => startGame(Number(wantedLumps.value), seed === '' ? null : Number(seed))}
          testid="game-start"
        >
          {t('game.start')}
        </Button>
      </div>
    </Section>
  );
}

function GameFigures({ game }: { game: GameInfo }) {
  return (
    <dl class="figures">
      <dt>{t('game.n_lumps')}</dt>
      <dd>{game.n_lumps}</dd>
      <dt>{t('game.marks')}</dt>
      <dd data-testid="game-marks">{game.marks.length}</dd>
      <dt>{t('game.seed')}</dt>
      <dd data-testid="game-seed-used">{game.seed}</dd>
    </dl>
  );
}

export function clock(seconds: number): string {
  const whole = Math.floor(seconds);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}`;
}

function Result({ game, result }: { game: GameInfo; result: GameResult }) {
  const newtons = (value: number): string => `${formatNumber(value)} N`;
  return (
    <>
      <div class="section" role="group" data-testid="game-result" aria-label={t('game.result')}>
        <div class="section-head"><h3>{t('game.result')}</h3></div>
        <table class="result">
          <thead>
            <tr>
              <th scope="col">{t('game.lump')}</th>
              <th scope="col">{t('game.error')}</th>
            </tr>
          </thead>
          <tbody>
            {result.lumps.map((found, index) => (
              <tr key={index}>
                <th scope="row">{index + 1}</th>
                <td data-error={found.error ?? ''}>
                  {found.error == null ? t('game.not_found') : `${(found.error * 1e3).toFixed(1)} mm`}
                </td>
              </tr>
            ))}
          </tbody>
        </table>
        <dl class="figures">
          <dt>{t('game.stray')}</dt>
          <dd>{result.n_stray_marks}</dd>
          <dt>{t('game.time')}</dt>
          <dd>{clock(game.seconds)}</dd>
          <dt>{t('game.contact_time')}</dt>
          <dd>{clock(result.contact_seconds)}</dd>
          <dt>{t('game.max_force')}</dt>
          <dd>{newtons(result.max_force)}</dd>
          <dt>{t('game.mean_force')}</dt>
          <dd>{newtons(result.mean_force)}</dd>
          <dt>{t('game.covered')}</dt>
          <dd data-testid="game-covered">{Math.round(result.covered * 100)} %</dd>
          <dt>{t('game.seed')}</dt>
          <dd>{game.seed}</dd>
        </dl>
        <Toggle label={t('game.coverage')} on={view.value.coverage} onChange={(coverage) => show({ coverage })} testid="show-coverage" />
      </div>
      <div class="buttons">
        <Button kind="primary" onClick={() => startGame(game.n_lumps, null)} testid="game-again">{t('game.new_round')}</Button>
        <Button onClick={() => startGame(game.n_lumps, game.seed)} testid="game-same-seed">{t('game.same_seed')}</Button>
        <Button onClick={endGame} testid="game-end">{t('game.end')}</Button>
      </div>
    </>
  );
}
