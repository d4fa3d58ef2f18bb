// The game: choose and start it, follow a round, and read the results.

import { useId } from 'preact/hooks';
import { t } from '../../i18n';
import { state } from '../../store';
import type { GameInfo, LevelInfo } from '../../generated/api';
import { Button, Controlled, Download, Section, Segmented } from '../controls';
import { bests, clock, rangeOf, startGame } from '../game';
import { LEVELS, LUMPS, ROUNDS, wantedLevel, wantedLumps, wantedRounds, wantedSeed } from '../settings';
import { GameResults } from './GameResults';

export function GamePanel() {
  const game = state.value?.game ?? null;
  return (
    <Controlled>
      {game === null && <Start />}
      {game !== null && game.result == null && (
        <Section title={t('game.going_on')}>
          <p class="hint">{t('game.how')}</p>
          <GameFigures game={game} />
          <LevelWords level={game.level} />
        </Section>
      )}
      {game?.result != null && <GameResults game={game} result={game.result} />}
    </Controlled>
  );
}

function Start() {
  const id = useId();
  const seed = wantedSeed.value.trim();
  const isSeed = seed === '' || /^\d{1,15}$/.test(seed);
  const level = wantedLevel.value;
  return (
    <>
      <Section title={t('game.setup')} hint={t('game.about')}>
        <Segmented
          label={t('game.level')}
          value={level}
          options={LEVELS.map((value) => ({ value, label: t(`game.level_${value}`), testid: `game-level-${value}` }))}
          onChange={(value) => (wantedLevel.value = value)}
        />
        {level === 'drawn' ? <p class="hint">{t('game.drawn')}</p> : <LevelWords level={level} />}
        <Segmented
          label={t('game.rounds')}
          value={wantedRounds.value}
          options={ROUNDS.map((value) => ({ value, label: value, testid: `game-rounds-${value}` }))}
          onChange={(value) => (wantedRounds.value = value)}
        />
        <Segmented
          label={t('game.n_lumps')}
          value={wantedLumps.value}
          options={LUMPS.map((value) => ({ value, label: value, testid: `game-lumps-${value}` }))}
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
          <Button kind="primary" disabled={!isSeed} onClick={() => startGame(seed === '' ? null : Number(seed))} testid="game-start">
            {t('game.start')}
          </Button>
        </div>
      </Section>
      <Bests />
      {(state.value?.n_game_results ?? 0) > 0 && (
        <div class="buttons">
          <Download path="api/game.csv" name="find-the-lump.csv" testid="game-csv">{t('game.save_csv')}</Download>
        </div>
      )}
    </>
  );
}

/** The ranges of a level in words. */
function LevelWords({ level }: { level: LevelInfo['level'] }) {
  const info = state.value?.levels.find((one) => one.level === level);
  if (info === undefined) return null;
  return (
    <ul class="level-words hint" data-testid="level-words" data-level={level}>
      <li>{t('game.range_radius', { range: rangeOf(info.radius, 1e3) })}</li>
      <li>{t('game.range_cover', { range: rangeOf(info.cover, 1e3) })}</li>
      <li>{t('game.range_times', { range: rangeOf(info.times, 1) })}</li>
      <li>{t(info.is_either_side ? 'game.on_either_side' : 'game.on_near_side')}</li>
      <li>{t(`game.map_${info.map}`)}</li>
    </ul>
  );
}

function Bests() {
  const all = (['easy', 'medium', 'hard'] as const).flatMap((level) => {
    const best = bests.value[level];
    return best === undefined ? [] : [{ level, ...best }];
  });
  if (all.length === 0) return null;
  return (
    <Section title={t('game.bests')}>
      <dl class="figures" data-testid="game-bests">
        {all.map(({ level, score, seconds }) => [
          <dt key={level}>{t(`game.level_${level}`)}</dt>,
          <dd key={`${level} score`}>{t('game.best', { score, time: clock(seconds) })}</dd>,
        ])}
      </dl>
    </Section>
  );
}

function GameFigures({ game }: { game: GameInfo }) {
  const { series } = game;
  return (
    <dl class="figures">
      {series.n_rounds > 1 && (
        <>
          <dt>{t('game.rounds')}</dt>
          <dd>{series.rounds.length + 1} / {series.n_rounds}</dd>
        </>
      )}
      <dt>{t('game.level')}</dt>
      <dd>{t(`game.level_${game.level}`)}</dd>
      <dt>{t('game.n_lumps')}</dt>
      <dd>{game.n_lumps}</dd>
      <dt>{t('game.marks')}</dt>
      <dd data-testid="game-marks">{game.marks.length}</dd>
      <dt>{t('game.seed')}</dt>
      <dd data-testid="game-seed-used">{series.seed}</dd>
    </dl>
  );
}
