// The result of a round, and the summary of a series.

import { language, t } from '../../i18n';
import type { FoundLump, GameInfo, GameResult, RoundInfo } from '../../generated/api';
import { Button, Download, Toggle } from '../controls';
import { bests, clock, endGame, isLastRound, millimetres, newGame, nextRound, repeatGame, standing, verdict } from '../game';
import { formatNumber } from '../quantity';
import { show, view } from '../settings';

const percent = (share: number): string => `${Math.round(100 * share)} %`;

export function GameResults({ game, result }: { game: GameInfo; result: GameResult }) {
  const { series } = game;
  const isSeries = series.n_rounds > 1;
  const isLast = isLastRound(game);
  return (
    <>
      {isSeries && isLast && <Summary rounds={series.rounds} />}
      <div class="section" role="group" data-testid="game-result" aria-label={t('game.result')}>
        <div class="section-head">
          <h3>{isSeries ? t('game.round', { n: series.rounds.length, of: series.n_rounds, level: t(`game.level_${game.level}`) }) : t('game.result')}</h3>
        </div>
        {result.lumps.map((found, index) => <Lump key={index} found={found} name={result.lumps.length > 1 ? t('game.lump_n', { n: index + 1 }) : null} />)}
        <dl class="figures">
          <dt>{t('game.time')}</dt>
          <dd>{clock(game.seconds)}</dd>
          <dt>{t('game.presses')}</dt>
          <dd data-testid="game-presses">{result.n_presses}</dd>
          <dt>{t('game.contact_time')}</dt>
          <dd>{clock(result.contact_seconds)}</dd>
          <dt>{t('game.max_force')}</dt>
          <dd>{formatNumber(result.max_force)} N</dd>
          <dt>{t('game.mean_force')}</dt>
          <dd>{formatNumber(result.mean_force)} N</dd>
          <dt>{t('game.covered')}</dt>
          <dd data-testid="game-covered">{percent(result.covered)}</dd>
          {result.n_stray_marks > 0 && [<dt key="stray">{t('game.stray')}</dt>, <dd key="n">{result.n_stray_marks}</dd>]}
          <dt>{t('game.seed')}</dt>
          <dd>{game.seed}</dd>
        </dl>
        <Toggle label={t('game.coverage')} on={view.value.coverage} onChange={(coverage) => show({ coverage })} testid="show-coverage" />
      </div>
      <ScoreTable result={result} game={game} />
      <div class="buttons">
        {isLast ? (
          <>
            <Button kind="primary" onClick={() => newGame(game)} testid="game-again">{t(isSeries ? 'game.new_series' : 'game.new_round')}</Button>
            <Button onClick={() => repeatGame(game)} testid="game-same-seed">{t('game.same_seed')}</Button>
          </>
        ) : (
          <Button kind="primary" onClick={nextRound} testid="game-panel-next">{t('game.next_round')}</Button>
        )}
        <Download path="api/game.csv" name="find-the-lump.csv" testid="game-csv">{t('game.save_csv')}</Download>
        <Button onClick={endGame} testid="game-end">{t('game.end')}</Button>
      </div>
      <details class="people">
        <summary>{t('game.people')}</summary>
        <p class="hint">{t('game.people_lumps')}</p>
        <p class="hint">{t('game.people_stiffness')}</p>
      </details>
    </>
  );
}

/** What there was to find, and what became of it. */
function Lump({ found, name }: { found: FoundLump; name: string | null }) {
  return (
    <div class={`found-lump ${found.is_found ? 'is-found' : ''}`} data-testid="game-lump" data-error={found.error ?? ''} data-found={found.is_found}>
      <p>
        {name !== null && <span>{name} </span>}
        <strong>{verdict(found)}</strong>
      </p>
      <p class="hint">
        {t('game.lump_was', {
          radius: millimetres(found.radius), depth: millimetres(found.depth), times: formatNumber(found.times, 2), young: `${formatNumber(found.lump.stiffness / 1e3, 2)} kPa`,
        })}{' '}
        {t('game.tolerance', { tolerance: millimetres(found.tolerance) })}
      </p>
      <p class="hint">
        {!found.is_explored ? t('game.not_pressed') : found.felt == null ? t('game.little_felt') : t('game.felt', { share: signed(100 * found.felt) })}
      </p>
    </div>
  );
}

function signed(value: number): string {
  return `${value < 0 ? '−' : '+'}${formatNumber(Math.abs(value), 2)}`;
}

function ScoreTable({ result: { score, lumps, n_found }, game }: { result: GameResult; game: GameInfo }) {
  const best = bests.value[game.level];
  return (
    <div class="section" role="group" aria-label={t('game.score')} data-testid="game-score" data-total={score.total}>
      <div class="section-head">
        <h3>{t('game.score')}</h3>
        <strong>{score.total} / 100</strong>
      </div>
      <dl class="figures">
        {(['time', 'force', 'presses', 'area'] as const).map((part) => [
          <dt key={part}>{t(`game.score_${part}`)}</dt>,
          <dd key={`${part} n`}>{score[part]} / 25</dd>,
        ])}
        <dt>{t('game.score_found')}</dt>
        <dd>× {n_found} / {Math.max(lumps.length, game.marks.length)}</dd>
      </dl>
      <p class="hint">{t('game.score_rule')}</p>
      {standing.value === 'best' && <p class="new-best" role="status">{t('game.new_best', { level: t(`game.level_${game.level}`) })}</p>}
      {standing.value === 'repeat' && <p class="hint">{t('game.repeat')}</p>}
      {standing.value !== 'best' && best !== undefined && (
        <p class="hint">{t('game.best_so_far', { level: t(`game.level_${game.level}`), best: t('game.best', { score: best.score, time: clock(best.seconds) }) })}</p>
      )}
    </div>
  );
}

/** All rounds of a series. */
function Summary({ rounds }: { rounds: readonly RoundInfo[] }) {
  const found = rounds.reduce((sum, { result }) => sum + result.n_found, 0);
  const hidden = rounds.reduce((sum, { result }) => sum + result.lumps.length, 0);
  const points = rounds.reduce((sum, { result }) => sum + result.score.total, 0) / Math.max(rounds.length, 1);
  const time = rounds.reduce((sum, { seconds }) => sum + seconds, 0);
  const mean = new Intl.NumberFormat(language.value, { maximumFractionDigits: 0 }).format(points);
  return (
    <div class="section" role="group" data-testid="game-summary" aria-label={t('game.summary')}>
      <div class="section-head"><h3>{t('game.summary')}</h3></div>
      <p class="summary-line">{t('game.summary_line', { found, hidden, share: percent(found / Math.max(hidden, 1)), points: mean, time: clock(time) })}</p>
      <table class="result rounds">
        <thead>
          <tr>
            <th scope="col">{t('game.level')}</th>
            <th scope="col">{t('game.col_found')}</th>
            <th scope="col">{t('game.col_error')}</th>
            <th scope="col">{t('game.time')}</th>
            <th scope="col">{t('game.score')}</th>
          </tr>
        </thead>
        <tbody>
          {rounds.map(({ level, seconds, result }, index) => (
            <tr key={index}>
              <th scope="row">{index + 1} {t(`game.level_${level}`)}</th>
              <td>{result.n_found} / {result.lumps.length}</td>
              <td>{result.lumps.map(({ error }) => (error == null ? '–' : millimetres(error).replace(' mm', ''))).join(', ')}</td>
              <td>{clock(seconds)}</td>
              <td>{result.score.total}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
