// The engine: rates, deadlines, limits, energy.

import { language, t } from '../../i18n';
import { eventWords, grantedWords } from '../../i18n/events';
import { askAloud, figures, isController, state } from '../../store';
import type { EngineFigures, FaultKind } from '../../generated/api';
import { firstBodyMs } from '../body';
import { Button, Controlled, Section } from '../controls';
import { formatNumber, withPrefix } from '../quantity';

const FAULTS: FaultKind[] = ['tissue_panic', 'spoilt_patch', 'tissue_pause'];

export function EnginePanel() {
  const now = figures.value;
  return (
    <>
      {now === null ? <p class="empty">{t('engine.none')}</p> : <Figures now={now} />}
      <Controlled>
        <Section title={t('engine.control')}>
          <div class="buttons">
            <Button onClick={() => void askAloud({ type: 'restart' })} testid="engine-restart">{t('engine.restart')}</Button>
            {state.value?.allows_faults && isController.value && FAULTS.map((fault) => (
              <Button key={fault} kind="danger" onClick={() => void askAloud({ type: 'inject', fault })} testid={`inject-${fault}`}>
                {t(`fault.${fault}`)}
              </Button>
            ))}
          </div>
        </Section>
      </Controlled>
    </>
  );
}

function Figures({ now }: { now: EngineFigures }) {
  const seconds = (values: readonly number[]): string => values.map((value) => withPrefix(value, 's', 2)).join(' · ');
  const rows: [name: string, value: string, testid?: string][] = [
    [t('engine.tick_rate'), `${formatNumber(now.tick_rate, 4)} Hz`, 'tick-rate'],
    [t('engine.missed'), now.missed.toLocaleString(), 'missed'],
    [t('engine.tissue_rate'), `${formatNumber(now.tissue_rate)} Hz`, 'tissue-rate'],
    [t('engine.latency'), withPrefix(now.latency, 's', 2), 'latency'],
    [t('engine.snapshot_rate'), `${formatNumber(now.snapshot_rate)} Hz`],
    [t('engine.nodes'), now.n_nodes.toLocaleString()],
    [t('engine.meshes'), now.n_meshes.toLocaleString()],
    [t('engine.step'), t(`step_result.${now.step_status}`), 'step-status'],
  ];
  if (firstBodyMs.value !== null) rows.push([t('engine.first_body'), `${formatNumber(firstBodyMs.value / 1e3)} s`]);
  return (
    <>
      <Section title={t('engine.rates')}>
        <dl class="figures">
          {rows.map(([name, value, testid]) => [
            <dt key={`t${name}`}>{name}</dt>,
            <dd key={`d${name}`} data-testid={testid}>{value}</dd>,
          ])}
        </dl>
      </Section>
      <Section title={t('engine.times')} hint={t('engine.times_hint')}>
        <dl class="figures">
          <dt>{t('engine.tick_cpu')}</dt>
          <dd>{seconds(now.tick_cpu)}</dd>
          <dt>{t('engine.lateness')}</dt>
          <dd>{seconds(now.lateness)}</dd>
          <dt>{t('engine.step_cpu')}</dt>
          <dd>{seconds(now.step_cpu)}</dd>
        </dl>
        <Histogram now={now} />
      </Section>
      <Section title={t('engine.energy')} hint={t('engine.energy_hint')}>
        <Energy now={now} />
      </Section>
      <Section title={t('engine.limits_and_faults')}>
        <Words words={now.limits.map((limit) => t(`limit.${limit}`))} none={t('engine.no_limits')} />
        <Words words={now.faults.map((fault) => t(`law_fault.${fault}`))} none={t('engine.no_faults')} />
      </Section>
      <Section title={t('engine.granted')}>
        <Words words={now.granted.map((granted) => grantedWords(granted, language.value))} none="–" />
      </Section>
      <Section title={t('engine.events')}>
        {now.events.length === 0 && <p class="empty">{t('engine.no_events')}</p>}
        <ol class="events">
          {[...now.events].reverse().map((event, index) => (
            <li key={index} class={event.level}>
              <span class="time">{event.time.toFixed(1)} s</span> {eventWords(event.what, language.value)}
            </li>
          ))}
        </ol>
      </Section>
    </>
  );
}

function Words({ words, none }: { words: readonly string[]; none: string }) {
  if (words.length === 0) return <p class="empty">{none}</p>;
  return <ul class="notes">{words.map((word) => <li key={word}>{word}</li>)}</ul>;
}

const WIDTH = 248;
const HEIGHT = 84;
const FOOT = 16;

const BARS = 40;

/** Collects the engine's bins, which are far finer, into bars: from, to, count. */
function gathered(counted: EngineFigures['tick_histogram'], first: number, last: number): [number, number, number][] {
  const ratio = last / first;
  const bars = Array.from({ length: BARS }, (_, i): [number, number, number] => [
    first * ratio ** (i / BARS), first * ratio ** ((i + 1) / BARS), 0,
  ]);
  for (const [from, to, count] of counted) {
    const at = Math.floor((BARS * Math.log(Math.sqrt(Math.max(from, first) * to) / first)) / Math.log(ratio));
    bars[Math.min(BARS - 1, Math.max(0, at))][2] += count;
  }
  return bars.filter(([, , count]) => count > 0);
}

/** Histogram of tick times. Heights are logarithmic, so that one slow tick in a million is seen. */
function Histogram({ now }: { now: EngineFigures }) {
  const counted = now.tick_histogram.filter(([, , count]) => count > 0);
  if (counted.length === 0) return null;
  const first = Math.max(counted[0][0], 1e-8);
  const last = Math.max(counted[counted.length - 1][1], 2 * first);
  const bars = counted.length <= BARS ? counted : gathered(counted, first, last);
  const across = (seconds: number): number => (WIDTH * Math.log(Math.max(seconds, first) / first)) / Math.log(last / first);
  const most = Math.log10(1 + Math.max(...bars.map(([, , count]) => count)));
  const decades = [1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2].filter((value) => value >= first && value <= last);
  return (
    <svg
      class="histogram"
      viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
      role="img"
      aria-label={t('engine.histogram', {
        half: withPrefix(now.tick_cpu[0], 's', 2),
        rare: withPrefix(now.tick_cpu[1], 's', 2),
        longest: withPrefix(now.tick_cpu[2], 's', 2),
      })}
    >
      <line class="axis" x1={0} x2={WIDTH} y1={HEIGHT - FOOT} y2={HEIGHT - FOOT} />
      {bars.map(([from, to, count]) => {
        const height = ((HEIGHT - FOOT - 4) * Math.log10(1 + count)) / most;
        return (
          <rect
            key={from}
            x={across(from)}
            y={HEIGHT - FOOT - height}
            width={Math.max(1, across(to) - across(from) - 0.5)}
            height={height}
          />
        );
      })}
      {decades.map((value) => (
        <g key={value}>
          <line class="axis" x1={across(value)} x2={across(value)} y1={HEIGHT - FOOT} y2={HEIGHT - FOOT + 3} />
          <text x={across(value)} y={HEIGHT - 3} text-anchor={anchor(across(value))}>{withPrefix(value, 's', 1)}</text>
        </g>
      ))}
    </svg>
  );
}

/** Labels at the ends stay inside the picture. */
function anchor(x: number): 'start' | 'middle' | 'end' {
  return x < 20 ? 'start' : x > WIDTH - 20 ? 'end' : 'middle';
}

/** The energy that the observer bounds, with its bound, and the totals. */
function Energy({ now }: { now: EngineFigures }) {
  const { energy_unpaid: unpaid, energy_budget: bound } = now;
  const isBeyond = unpaid > bound && bound > 0;
  const share = bound > 0 ? Math.min(1, unpaid / bound) : 0;
  const words = t('engine.energy_of', { unpaid: withPrefix(unpaid, 'J', 2), bound: withPrefix(bound, 'J', 2) });
  return (
    <>
      <p class="meter-head">
        <span>{t('engine.energy_unpaid')}</span>
        <span class={isBeyond ? 'bad' : undefined} data-testid="energy-unpaid" data-joules={unpaid}>{words}</span>
      </p>
      <div
        class={isBeyond ? 'meter beyond' : 'meter'}
        role="meter"
        aria-label={t('engine.energy_unpaid')}
        aria-valuemin={0}
        aria-valuemax={100}
        aria-valuenow={Math.round(share * 100)}
        aria-valuetext={words}
        data-testid="energy-meter"
      >
        <div style={{ width: `${share * 100}%` }} />
      </div>
      {isBeyond && <p class="bad" role="status" data-testid="energy-beyond">{t('engine.energy_beyond')}</p>}
      <dl class="figures">
        <dt>{t('engine.damping')}</dt>
        <dd>{now.damping > 0 ? `${formatNumber(now.damping, 2)} N s/m` : t('engine.damping_none')}</dd>
        <dt>{t('engine.energy_in')}</dt>
        <dd>{withPrefix(now.energy_in, 'J')}</dd>
        <dt>{t('engine.energy_out')}</dt>
        <dd>{withPrefix(now.energy_out, 'J')}</dd>
      </dl>
    </>
  );
}
