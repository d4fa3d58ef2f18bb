// The force on the hand as a number, a bar and curves.

import { signal } from '@preact/signals';
import { useEffect, useRef, useState } from 'preact/hooks';
import { t } from '../i18n';
import { figures, isReplaying, latestFrame, onFrame, state, status } from '../store';
import type { BarProblem } from '../generated/api';
import type { FrameSnapshot } from '../generated/wire';
import { NUMBER_PERIOD } from '../machine';
import { axes } from './axes';
import { Button } from './controls';
import { Curves } from './Curves';
import { magnitude } from './history';
import { Icon } from './icons';
import { formatNumber, inMillimetres, withPrefix } from './quantity';
import { GoalMarks, Reach } from './Goals';
import { PressGoal } from './PressGoal';
import { isDeepest } from './settings';

/** Share of the force that reaches the hand, %. */
const gain = signal(100);

/** Force at the end of the bar, N. */
const scaleEnd = signal(1);

/** Writes a text or an attribute only when it differs: each write makes the browser draw. */
function write(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}
function writeAttribute(element: HTMLElement, name: string, value: string): void {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

export function Readout() {
  return (
    <aside class="readout" aria-label={t('readout.title')}>
      <div class="numbers">
        <ForceNumber />
        <PressGoal testid="press" />
      </div>
      <Curves />
    </aside>
  );
}

/** Small forces of the reference method are shown in mN: the thesis has dyn. */
export function written(force: number): string {
  return force > 0 && force < 0.005 && state.peek()?.method === 'reference' ? withPrefix(force, 'N', 2) : `${force.toFixed(2)} N`;
}

/** Depth below the skin, or height above it. */
function depthWords(depth: number): string {
  const height = -depth * 1e3;
  return height >= 0.05 ? t('readout.above', { height: `${height < 0.95 ? height.toFixed(1) : Math.round(height)} mm` }) : inMillimetres(depth);
}

/** The error bar of the force shown: none of a recording, or while the engine cannot be heard. */
function presentBar() {
  const bar = figures.value?.error_bar;
  return isReplaying.value || status.value !== 'open' || bar === undefined || bar.kind === 'none' ? null : bar;
}

/** Half the width of the bar, or a change, as text in %. */
const percent = (share: number): string => formatNumber(100 * share, 2);
const signed = (share: number): string => `${share > 0 ? '+' : ''}${percent(share)}`.replace('-', '−');

/** The error bar beside the force, in per cent of it. */
function ErrorBarNumber() {
  const bar = presentBar();
  if (bar === null) return null;
  if (bar.kind !== 'known') return <span class="force-bar" data-testid="force-bar" data-kind={bar.kind} aria-hidden="true">±?</span>;
  return (
    <span class="force-bar" data-testid="force-bar" data-kind="known" data-share={bar.half_width} title={barTitle(bar)}>
      {`± ${percent(bar.half_width)} %`}
    </span>
  );
}

/** Where the error bar was computed, or why there is none. The line keeps its height. */
function ErrorBarWords() {
  const bar = presentBar();
  return (
    <p class="force-bar-words" data-testid="force-bar-words" title={bar === null ? undefined : bar.kind === 'known' ? barTitle(bar) : t('readout.bar_unknown_title')}>
      {bar === null
        ? '\u00a0'
        : bar.kind === 'known'
          ? t('readout.bar_at', { depth: inMillimetres(bar.depth) })
          : bar.kind === 'failed'
            ? t('readout.bar_failed', { depth: inMillimetres(bar.depth), why: reason(bar.why) })
            : t('readout.bar_unknown')}
    </p>
  );
}

function barTitle(bar: { half_width: number; depth: number; near: number; skin_far: number; levels_deep: number; contact: number }): string {
  return t('readout.bar_title', {
    half: percent(bar.half_width),
    depth: inMillimetres(bar.depth),
    near: signed(bar.near),
    skin: signed(bar.skin_far),
    deep: signed(bar.levels_deep),
    contact: percent(bar.contact),
  });
}

function reason(why: BarProblem): string {
  switch (why.kind) {
    case 'too_large':
      return t('readout.bar_too_large', { n: why.n_nodes });
    case 'not_touching':
      return t('readout.bar_not_touching');
    case 'no_equilibrium':
      return t('readout.bar_no_equilibrium');
    case 'other':
      return why.text;
  }
}

function ForceNumber() {
  const number = useRef<HTMLOutputElement>(null);
  const depth = useRef<HTMLSpanElement>(null);
  const gauge = useRef<HTMLDivElement>(null);
  const bar = useRef<HTMLDivElement>(null);
  const scale = useRef<HTMLSpanElement>(null);
  const [spoken, setSpoken] = useState('');

  // Text is set directly, not through signals, so that all of it is of one frame.
  useEffect(() => {
    let newest: FrameSnapshot | null = null;
    let timer = 0;
    const set = (): void => {
      timer = 0;
      if (newest === null) return;
      const force = magnitude(newest.force);
      axes.take(force, newest.depth);
      write(number.current!, written(force));
      // For programs that read the page: not part of the document, so that setting it draws nothing.
      Object.assign(number.current!, { shown: { newtons: force, tick: newest.tick, metres: newest.depth } });
      write(depth.current!, depthWords(newest.depth));
      // A zero without contact is no measurement.
      number.current!.toggleAttribute('data-none', force < 0.005 && newest.depth <= 0);
      depth.current!.toggleAttribute('data-above', newest.depth < 0);
      writeAttribute(gauge.current!, 'aria-valuenow', force.toFixed(2));
      writeAttribute(gauge.current!, 'aria-valuemax', String(axes.force));
      write(scale.current!, `${formatNumber(axes.force)} N`);
      scaleEnd.value = axes.force;
      const width = `scaleX(${Math.min(1, force / axes.force).toFixed(3)})`;
      if (bar.current!.style.transform !== width) bar.current!.style.transform = width;
      // Above the skin a reduced force makes no difference.
      gain.value = newest.depth > 0 ? Math.round(newest.gain * 100) : 100;
      newest = null;
    };
    const stop = onFrame((frame) => {
      newest = frame;
      if (timer === 0) timer = window.setTimeout(set, NUMBER_PERIOD);
    });
    return () => {
      stop();
      window.clearTimeout(timer);
    };
  }, []);

  const speak = (): void => {
    if (latestFrame === null) return;
    const { depth } = latestFrame;
    const words = t(depth < 0 ? 'readout.spoken_above' : 'readout.spoken', {
      force: written(magnitude(latestFrame.force)),
      depth: depthWords(depth),
    });
    // Screen readers speak a text only when it changes.
    setSpoken(words === spoken ? `${words}\u00a0` : words);
  };

  return (
    <section class="force" aria-labelledby="force-title">
      <div class="section-head">
        <h2 id="force-title">{t(isReplaying.value ? 'readout.force_replayed' : 'readout.force')}</h2>
        <Button kind="quiet" label={t('readout.speak')} onClick={speak}><Icon name="speak" /></Button>
      </div>
      <div class="force-line">
        <output ref={number} class="force-number" aria-live="off" data-testid="force-number">0.00 N</output>
        <ErrorBarNumber />
      </div>
      <ErrorBarWords />
      <Reach />
      <div ref={gauge} class="gauge" role="meter" aria-label={t('readout.force')} aria-valuemin={0} aria-valuemax={1} aria-valuenow={0}>
        <div ref={bar} class="gauge-bar" />
      </div>
      <GoalMarks most={scaleEnd.value} />
      <div class="gauge-scale" aria-hidden="true"><span>0</span><span ref={scale} /></div>
      <p class="depth-line">
        <span>
          {t('readout.depth')}
          <span role="status">{isDeepest.value && <em data-testid="deepest">{t('readout.deepest')}</em>}</span>
        </span>
        <span ref={depth} class="depth-number" data-testid="depth-number">–</span>
      </p>
      <p class="held-back" data-on={gain.value < 100 || undefined} role="status" title={gain.value < 100 ? t('readout.held_back_why') : undefined}>{gain.value < 100 ? t('readout.held_back') : '\u00a0'}</p>
      <p class="sr-only" role="status" aria-live="polite">{spoken}</p>
    </section>
  );
}
