// Force over depth, force and depth over time: the last seconds.

import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import { useEffect, useRef } from 'preact/hooks';
import { language, t } from '../i18n';
import { history, state } from '../store';
import { CURVE_PERIOD } from '../machine';
import { axes, roundUp } from './axes';
import { WINDOW } from './history';
import { theme } from './settings';

const FONT = '11px system-ui, sans-serif';
/** The newest part of the force–depth curve, s. Older parts are paler. */
const FRESH = 2;

type Kind = 'force-depth' | 'force-time' | 'depth-time';

export function Curves() {
  // The plots keep their colours and words, so new ones are made when those change.
  const key = `${theme.value}-${language.value}`;
  const now = state.value;
  const usual = now?.usual_depth ?? 0.004;
  axes.setLeast(1, roundUp(usual));
  return (
    <div class="curves" key={key}>
      <Curve kind="force-depth" />
      <Curve kind="force-time" />
      <Curve kind="depth-time" />
    </div>
  );
}

function Curve({ kind }: { kind: Kind }) {
  const place = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const element = place.current!;
    const plot = new uPlot(options(kind, element), emptyData(kind), element);
    const resize = new ResizeObserver(() => plot.setSize(sizeOf(element)));
    resize.observe(element);
    let frame = 0;
    let drawnVersion = -1;
    let drawnAt = 0;
    const draw = (now: number): void => {
      frame = requestAnimationFrame(draw);
      if (history.version === drawnVersion || now - drawnAt < CURVE_PERIOD) return;
      drawnVersion = history.version;
      drawnAt = now;
      if (kind === 'force-depth') axes.settle(history.forces, history.depths);
      plot.setData(dataOf(kind));
    };
    frame = requestAnimationFrame(draw);
    return () => {
      cancelAnimationFrame(frame);
      resize.disconnect();
      plot.destroy();
    };
  }, []);
  const name = t(`curve.${kind}`);
  return (
    <figure class="curve">
      <figcaption>
        {name}
        {kind === 'force-time' && (
          <span class="key">
            <span class="key-force">|F|</span>
            <span class="key-axial">{t('curve.axial')}</span>
          </span>
        )}
      </figcaption>
      <div ref={place} class="curve-place" role="img" aria-label={name} data-testid={`curve-${kind}`} />
    </figure>
  );
}

// Data

const relative = new Float64Array(1200);
const millimetres = new Float64Array(1200);

/** Seconds before now: the axis stands still while the curve moves. */
function relativeTimes(): Float64Array {
  const times = history.times;
  const now = times.length > 0 ? times[times.length - 1] : 0;
  for (let i = 0; i < times.length; i++) relative[i] = times[i] - now;
  return relative.subarray(0, times.length);
}

function depthsInMillimetres(): Float64Array {
  const depths = history.depths;
  for (let i = 0; i < depths.length; i++) millimetres[i] = depths[i] * 1e3;
  return millimetres.subarray(0, depths.length);
}

function dataOf(kind: Kind): uPlot.AlignedData {
  switch (kind) {
    case 'force-depth':
      // uPlot's type knows aligned data only; facets are documented for mode 2.
      return [null, [depthsInMillimetres(), history.forces]] as unknown as uPlot.AlignedData;
    case 'force-time':
      return [relativeTimes(), history.axials, history.forces];
    case 'depth-time':
      return [relativeTimes(), depthsInMillimetres()];
  }
}

function emptyData(kind: Kind): uPlot.AlignedData {
  const none = new Float64Array(0);
  if (kind === 'force-depth') return [null, [none, none]] as unknown as uPlot.AlignedData;
  return kind === 'force-time' ? [none, none, none] : [none, none];
}

// Looks

function sizeOf(element: HTMLElement): { width: number; height: number } {
  return { width: Math.max(80, element.clientWidth), height: Math.max(60, element.clientHeight) };
}

function options(kind: Kind, element: HTMLElement): uPlot.Options {
  const style = getComputedStyle(element);
  const colour = (name: string): string => style.getPropertyValue(name).trim();
  const axis: uPlot.Axis = {
    stroke: colour('--ink-muted'),
    font: FONT,
    grid: { stroke: colour('--grid'), width: 1 },
    ticks: { stroke: colour('--grid'), width: 1, size: 3 },
    gap: 3,
  };
  const isPhase = kind === 'force-depth';
  const isDepth = kind === 'depth-time';
  // Depths above the skin are negative; a little of them is shown.
  const depthRange = (): [number, number] => [-0.2 * axes.depth * 1e3, axes.depth * 1e3];
  const forceRange = (): [number, number] => [0, axes.force];
  const lines: uPlot.Series[] = isPhase
    ? [{ paths: drawPhase(colour('--force')) as unknown as uPlot.Series.PathBuilder }]
    : isDepth
      ? [{ stroke: colour('--depth'), width: 1.75, points: { show: false } }]
      : [
          { stroke: colour('--ink-muted'), width: 1.25, dash: [4, 3], points: { show: false } },
          { stroke: colour('--force'), width: 1.75, points: { show: false } },
        ];
  return {
    ...sizeOf(element),
    mode: isPhase ? 2 : 1,
    legend: { show: false },
    cursor: { show: false },
    padding: [6, isPhase ? 22 : 14, 0, 0],
    scales: {
      x: { time: false, range: isPhase ? depthRange : () => [-WINDOW, 0] },
      y: { range: isDepth ? depthRange : forceRange },
    },
    axes: [
      { ...axis, size: 20, space: 40, values: isPhase ? labels(' mm') : labels(' s') },
      { ...axis, size: 48, space: 24, values: labels(isDepth ? ' mm' : ' N') },
    ],
    series: [{}, ...lines],
  };
}

/** Labels with the unit at the last number only. */
function labels(unit: string): uPlot.Axis.Values {
  return (_plot, splits) =>
    splits.map((value, index) => {
      const number = String(Number(value.toPrecision(6))).replace('-', '−');
      return index === splits.length - 1 ? `${number}${unit}` : number;
    });
}

/** Draws force over depth, which is no function of the depth: pale where it is old, with a dot
 * at the newest point. */
function drawPhase(colour: string) {
  return (plot: uPlot, _series: number): null => {
    const n = history.length;
    if (n === 0) return null;
    const { ctx, bbox } = plot;
    const times = history.times;
    const depths = history.depths;
    const forces = history.forces;
    const x = (i: number): number => plot.valToPos(depths[i] * 1e3, 'x', true);
    const y = (i: number): number => plot.valToPos(forces[i], 'y', true);
    const fresh = times.findIndex((time) => time > times[n - 1] - FRESH);
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.strokeStyle = colour;
    ctx.lineWidth = 1.75 * devicePixelRatio;
    ctx.lineJoin = 'round';
    for (const [from, to, alpha] of [[0, fresh, 0.35], [Math.max(0, fresh - 1), n - 1, 1]] as const) {
      ctx.globalAlpha = alpha;
      ctx.beginPath();
      for (let i = from; i <= to; i++) ctx.lineTo(x(i), y(i));
      ctx.stroke();
    }
    ctx.globalAlpha = 1;
    ctx.fillStyle = colour;
    ctx.beginPath();
    ctx.arc(x(n - 1), y(n - 1), 3.5 * devicePixelRatio, 0, 2 * Math.PI);
    ctx.fill();
    ctx.restore();
    return null;
  };
}
