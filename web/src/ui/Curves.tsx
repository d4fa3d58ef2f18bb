// The curves: force over depth, over time and over the way along the skin, depth over time, and the spectrum
// of the force. They are drawn when their data has changed, at most ten times a second.

import 'uplot/dist/uPlot.min.css';
import { effect, signal } from '@preact/signals';
import { useEffect, useRef, useState } from 'preact/hooks';
import type { Spectrum } from '../generated/api';
import { apiUrl } from '../connection';
import { language, t } from '../i18n';
import { history, isController, isReplaying, state, status } from '../store';
import { CURVE_PERIOD } from '../machine';
import { axes, largest, roundUp } from './axes';
import { Button } from './controls';
import { Plot, type Shown } from './curves/plots';
import { Icon } from './icons';
import { formatNumber } from './quantity';
import { drag, replayCourse, replayTime, seek } from './replay';
import {
  CURVES, CURVE_LINES, CURVE_WINDOWS, chooseCurve, curveKinds, curveLines, curveWindow, theme,
  type CurveKind, type CurveLines,
} from './settings';

/** Between two spectra, ms. */
const SPECTRUM_PERIOD = 500;

/** The plots on the page that show live data. */
const plots = new Set<Plot>();
let timer = 0;
let drawnAt = 0;

/** Draws all plots soon, unless that is under way. */
function drawSoon(): void {
  if (timer !== 0 || plots.size === 0) return;
  const wait = Math.max(0, drawnAt + CURVE_PERIOD - performance.now());
  timer = window.setTimeout(() => requestAnimationFrame(drawAll), wait);
}

function drawAll(): void {
  timer = 0;
  drawnAt = performance.now();
  const most = history.runs.all.map((run) => run.most);
  axes.settle(
    Math.max(largest(history.list('force')), ...most.map(({ force }) => force), 0),
    Math.max(largest(history.list('depth')), ...most.map(({ depth }) => depth), 0),
  );
  for (const plot of plots) if (plot.isVisible) plot.draw();
}

history.onChange(drawSoon);

export function Curves() {
  axes.setLeast(1, roundUp(state.value?.usual_depth ?? 0.004));
  return (
    <div class="curves">
      {curveKinds.value.map((kind, place) => <Curve key={place} place={place} kind={kind} />)}
    </div>
  );
}

function Curve({ place, kind }: { place: number; kind: CurveKind }) {
  const [shown] = useState(() => signal<Shown | null>(null));
  const isOverTime = kind === 'force-time' || kind === 'depth-time';
  // The plots keep their colours and words, so new ones are made when those change.
  const course = isReplaying.value ? replayCourse.value : null;
  const key = [kind, theme.value, language.value, isReplaying.value, course !== null, isOverTime && [curveLines.value, curveWindow.value]].join();
  return (
    <figure class="curve" data-testid={`curve-figure-${kind}`} data-earlier={shown.value?.earlier} data-before={shown.value?.before} data-gaps={shown.value?.gaps} data-from={shown.value?.from}>
      <figcaption>
        <Pick
          label={t('curve.choose')}
          value={kind}
          options={CURVES.map((one) => [one, t(`curve.${one}`)])}
          onChange={(chosen) => chooseCurve(place, chosen)}
          testid={`curve-choose-${place}`}
          isTitle
        />
        <span class="curve-tools">
          {kind === 'force-time' && (
            <Pick
              label={t('curve.lines')}
              value={curveLines.value}
              options={CURVE_LINES.map((one) => [one, t(`curve.lines_${one}`)])}
              onChange={(chosen) => (curveLines.value = chosen)}
              testid="curve-lines"
            />
          )}
          {isOverTime && !isReplaying.value && (
            <Pick
              label={t('curve.window')}
              value={curveWindow.value}
              options={CURVE_WINDOWS.map((one) => [one, `${one} s`])}
              onChange={(chosen) => (curveWindow.value = chosen)}
              testid={`curve-window-${kind}`}
            />
          )}
          {(kind === 'force-depth' || kind === 'force-distance') && !isReplaying.value && (
            <Button kind="quiet" label={t('curve.clear')} onClick={() => history.clearGhosts()} testid={`curve-clear-${kind}`}><Icon name="close" /></Button>
          )}
        </span>
      </figcaption>
      <Place key={key} kind={kind} take={(next) => (shown.value = next)} />
      <CurveKey kind={kind} lines={curveLines.value} shown={shown.value} />
    </figure>
  );
}

/** A menu in the caption of a curve. */
function Pick<T extends string>(props: {
  label: string;
  value: T;
  options: readonly (readonly [value: T, label: string])[];
  onChange: (value: T) => void;
  testid: string;
  isTitle?: boolean;
}) {
  return (
    <select
      class={props.isTitle ? 'curve-pick title' : 'curve-pick'}
      aria-label={props.label}
      title={props.label}
      value={props.value}
      onChange={(event) => props.onChange(event.currentTarget.value as T)}
      data-testid={props.testid}
    >
      {props.options.map(([value, label]) => <option key={value} value={value}>{label}</option>)}
    </select>
  );
}

/** The plot in its place. */
function Place({ kind, take }: { kind: CurveKind; take: (shown: Shown) => void }) {
  const place = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const element = place.current!;
    const moments = isReplaying.peek() ? (replayCourse.peek() ?? []) : null;
    const course = moments === null ? null : { moments, duration: Math.max(state.peek()?.recording.duration ?? 0, moments.at(-1)?.time ?? 0) };
    const plot = new Plot(element, { kind, lines: curveLines.peek(), window: Number(curveWindow.peek()), course });
    const resize = new ResizeObserver(() => {
      plot.resize();
      if (course !== null) plot.showTime(replayTime.peek());
    });
    resize.observe(element);
    const ends = [effect(() => take(plot.shown.value)), () => resize.disconnect(), () => plot.destroy()];
    if (course !== null) {
      ends.push(effect(() => plot.showTime(replayTime.value)), seekBy(plot));
    } else if (kind === 'spectrum') {
      ends.push(watchSpectrum(plot));
    } else {
      plots.add(plot);
      ends.push(() => plots.delete(plot));
      drawSoon();
    }
    return () => {
      for (const end of ends) end();
    };
  }, []);
  const isSought = isReplaying.value && kind !== 'spectrum' && isController.value;
  return (
    <div
      ref={place}
      class={isSought ? 'curve-place sought' : 'curve-place'}
      role="img"
      aria-label={t(`curve.${kind}`)}
      title={isSought ? t('curve.seek') : undefined}
      data-testid={`curve-${kind}`}
    />
  );
}

/** Clicks and drags on a curve of a recording go to that time. Returns what ends it. */
function seekBy(plot: Plot): () => void {
  const over = plot.over;
  const go = (event: PointerEvent): void => {
    const box = over.getBoundingClientRect();
    const time = plot.timeAt(event.clientX - box.left, event.clientY - box.top);
    if (time !== null) seek(time);
  };
  const down = (event: PointerEvent): void => {
    if (event.button !== 0 || !isController.peek()) return;
    over.setPointerCapture(event.pointerId);
    drag(true);
    go(event);
  };
  const move = (event: PointerEvent): void => {
    if (over.hasPointerCapture(event.pointerId)) go(event);
  };
  const up = (): void => drag(false);
  over.addEventListener('pointerdown', down);
  over.addEventListener('pointermove', move);
  over.addEventListener('pointerup', up);
  over.addEventListener('pointercancel', up);
  // The listeners go with the element.
  return up;
}

/** Asks for spectra while anybody can see them. Returns what ends it. */
function watchSpectrum(plot: Plot): () => void {
  let isAsking = false;
  const ask = async (): Promise<void> => {
    if (isAsking || document.hidden || status.peek() !== 'open' || !plot.isVisible) return;
    isAsking = true;
    try {
      const response = await fetch(apiUrl('api/spectrum'));
      // The engine may just have started, or be busy with files: the next one comes soon.
      if (response.ok) plot.drawSpectrum((await response.json()) as Spectrum);
    } catch {
      // The connection says so by itself.
    } finally {
      isAsking = false;
    }
  };
  const watch = window.setInterval(() => void ask(), SPECTRUM_PERIOD);
  return () => window.clearInterval(watch);
}

/** What the lines are. */
function CurveKey({ kind, lines, shown }: { kind: CurveKind; lines: CurveLines; shown: Shown | null }) {
  const words: [look: string, words: string][] = [];
  if (kind === 'force-time') {
    if (lines === 'parts') words.push(['part-x', 'x'], ['part-y', 'y'], ['part-z', 'z']);
    else if (lines === 'size') words.push(['force', '|F|'], ['axial', t('curve.axial')]);
    else words.push(['force', t('curve.device')], ['tissue', t('curve.tissue')]);
  } else if (kind === 'spectrum') {
    words.push(['felt', t('curve.felt')]);
    if (isReplaying.value) return <p class="curve-none">{t('curve.live_only')}</p>;
  } else if (kind === 'force-distance' && shown?.n === 0) {
    return <p class="curve-none">{t('curve.no_stroke')}</p>;
  } else if (shown !== null) {
    if (shown.earlier > 0) words.push(['earlier', t('curve.earlier')]);
    if (shown.before > 0) words.push(['before', t('curve.before')]);
    if (shown.from !== null) words.push(['', t('curve.from', { force: formatNumber(shown.from) })]);
  }
  if (words.length === 0) return null;
  return (
    <p class="key" title={kind === 'spectrum' ? t('curve.felt_source') : undefined}>
      {words.map(([look, text]) => <span key={text} class={look === '' ? 'key-note' : `key-${look}`}>{text}</span>)}
    </p>
  );
}
