// The plots of the curves: uPlot draws axes and lines over time; force over depth and over the way, which
// are no functions or have ghosts, are drawn here.

import { signal } from '@preact/signals';
import uPlot from 'uplot';
import type { Spectrum } from '../../generated/api';
import { history } from '../../store';
import { axes, largest, roundUp } from '../axes';
import type { Column, Moment } from '../history';
import { Strokes, onAxisOf, type Stroke } from '../strokes';
import { momentAt } from '../replay';
import type { CurveKind, CurveLines } from '../settings';

const FONT = '11px system-ui, sans-serif';
/** Alphas of ghosts, newest first. */
const GHOSTS = [0.7, 0.5, 0.35];
/** Force over the way: an axis that begins at zero would hide changes smaller than this share of the force. */
const SMALL_CHANGE = 0.6;
/** Room above the strokes for the key, as a share of their change. */
const HEADROOM = 0.35;
/** Frequencies that the Pacinian channel feels, Hz; it is most sensitive near 250 Hz. After Bolanowski et al.
 * (1988), "Four channels mediate the mechanical aspects of touch", J. Acoust. Soc. Am. 84, 1680–1694. */
const FELT: [number, number] = [40, 800];
const MOST_SENSITIVE = 250;
/** Ends of the spectrum, Hz and N. */
const HIGHEST = 500;
const FAINTEST = 1e-5;

/** What the key of a plot has to name. */
export interface Shown {
  /** Runs or strokes, ghosts among them. */
  n: number;
  /** Ghosts of the same body, and of bodies before a change. */
  earlier: number;
  before: number;
  /** Places at which lines are broken. */
  gaps: number;
  /** Where the axis of force begins, if it is not zero, N. */
  from: number | null;
}
const NOTHING: Shown = { n: 0, earlier: 0, before: 0, gaps: 0, from: null };

/** The course of a recording, in place of live data. */
export interface Course {
  moments: readonly Moment[];
  duration: number;
}

export interface PlotSettings {
  kind: CurveKind;
  lines: CurveLines;
  /** Length of the curves over time, s. */
  window: number;
  course: Course | null;
}

/** A curve in its place on the page. */
export class Plot {
  readonly shown = signal<Shown>(NOTHING);
  private readonly plot: uPlot;
  private readonly style: CSSStyleDeclaration;
  private readonly strokes: Strokes | null = null;
  private readonly playhead: HTMLDivElement | null = null;
  /** Ends of the axes of force over the way: mm, N. */
  private wayEnds: [number, number] = [0, 20];
  private strokeEnds: [number, number] = [0, 1];
  private recordedEnds = { force: 1, depth: 5e-3 };
  /** The stroke that is shown of a recording. */
  private at: Stroke | null = null;
  private spectrum: Spectrum | null = null;
  private spectrumEnd = 1;

  constructor(private readonly element: HTMLElement, private readonly settings: PlotSettings) {
    this.style = getComputedStyle(element);
    const { course, kind } = settings;
    if (course !== null) {
      const { moments } = course;
      this.recordedEnds = {
        force: roundUp(Math.max(largest(moments.map(({ force }) => force)), 1e-6)),
        depth: roundUp(Math.max(largest(moments.map(({ depth }) => depth)), 1e-4)),
      };
      if (kind === 'force-distance') {
        this.strokes = new Strokes(Infinity);
        for (const moment of moments) {
          if (Number.isNaN(moment.force)) this.strokes.break();
          else this.strokes.push(moment);
        }
      }
    }
    this.plot = new uPlot(this.options(), this.data(), element);
    if (course !== null) {
      this.playhead = document.createElement('div');
      this.playhead.className = this.isOverTime ? 'playhead line' : 'playhead dot';
      this.playhead.dataset.testid = `playhead-${kind}`;
      this.playhead.hidden = true;
      this.plot.over.append(this.playhead);
    }
    this.draw();
  }

  /** Whether anybody can see it. */
  get isVisible(): boolean {
    return this.element.clientWidth > 0 && this.element.clientHeight > 0;
  }

  get isOverTime(): boolean {
    return this.settings.kind === 'force-time' || this.settings.kind === 'depth-time';
  }

  draw(): void {
    if (this.settings.kind === 'force-distance') this.fitStrokes();
    this.plot.setData(this.data());
    const shown = this.found();
    const now = this.shown.peek();
    if ((Object.keys(shown) as (keyof Shown)[]).some((name) => shown[name] !== now[name])) this.shown.value = shown;
  }

  /** Shows a spectrum, unless nothing of it changed that can be seen. */
  drawSpectrum(next: Spectrum): void {
    const most = largest(next.amplitude);
    if (this.spectrum !== null && most < FAINTEST && largest(this.spectrum.amplitude) < FAINTEST) return;
    this.spectrum = next;
    this.spectrumEnd = Math.max(0.1, 10 ** Math.ceil(Math.log10(Math.max(most, 1e-9))));
    this.draw();
  }

  resize(): void {
    if (!this.isVisible) return;
    this.plot.setSize(sizeOf(this.element));
  }

  destroy(): void {
    this.plot.destroy();
  }

  // A recording

  /** Puts the playhead to a time of the recording. */
  showTime(time: number): void {
    const { course, kind } = this.settings;
    if (course === null || this.playhead === null) return;
    if (kind === 'force-distance') {
      const { all } = this.strokes!;
      const at = all.findLast(({ times }) => times[0] <= time) ?? null;
      if (at !== this.at) {
        this.at = at;
        this.draw();
      }
    }
    const point = this.pointAt(course, time);
    const isIn = point !== null && point.every(Number.isFinite);
    this.playhead.hidden = !isIn;
    if (!isIn) return;
    const x = this.plot.valToPos(point[0], 'x');
    const y = this.isOverTime ? 0 : this.plot.valToPos(point[1], 'y');
    this.playhead.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    this.playhead.dataset.time = time.toFixed(3);
  }

  private pointAt({ moments }: Course, time: number): [number, number] | null {
    if (this.isOverTime) return [time, 0];
    if (this.settings.kind === 'force-depth') {
      const moment = momentAt(moments, time);
      return moment === null ? null : [moment.depth * 1e3, moment.force];
    }
    if (this.settings.kind !== 'force-distance' || this.at === null) return null;
    const { times, ways, forces } = this.at;
    const next = times.findIndex((one) => one >= time);
    if (next < 0) return null;
    return [ways[next] * 1e3, forces[next]];
  }

  /** The time of the recording at a point of the plot, px from its left and top. */
  timeAt(left: number, top: number): number | null {
    const { course, kind } = this.settings;
    if (course === null) return null;
    if (this.isOverTime) return this.plot.posToVal(left, 'x');
    let [best, nearest] = [Infinity, null as number | null];
    const take = (time: number, x: number, y: number): void => {
      const off = Math.hypot(this.plot.valToPos(x, 'x') - left, this.plot.valToPos(y, 'y') - top);
      if (off < best) [best, nearest] = [off, time];
    };
    if (kind === 'force-depth') for (const { time, depth, force } of course.moments) take(time, depth * 1e3, force);
    if (kind === 'force-distance' && this.at !== null) this.at.times.forEach((time, i) => take(time, this.at!.ways[i] * 1e3, this.at!.forces[i]));
    return nearest;
  }

  /** The part of the plot that takes the pointer. */
  get over(): HTMLElement {
    return this.plot.over;
  }

  // Data

  private data(): uPlot.AlignedData {
    const { kind, lines } = this.settings;
    switch (kind) {
      case 'force-depth':
      case 'force-distance':
        // Drawn below; uPlot's type knows aligned data only, facets are documented for mode 2.
        return [null, [[0], [0]]] as unknown as uPlot.AlignedData;
      case 'force-time':
        return this.overTime(LINES[lines].map(({ column }) => column));
      case 'depth-time':
        return this.overTime(['depth']);
      case 'spectrum': {
        if (this.spectrum === null) return [[0, HIGHEST], [null, null]];
        const { amplitude, step } = this.spectrum;
        return [amplitude.map((_, k) => k * step), amplitude.map((value) => Math.max(value, FAINTEST / 2))];
      }
    }
  }

  /** Lists over the time; a value that is missing is `null`, which breaks the line. */
  private overTime(columns: readonly Column[]): uPlot.AlignedData {
    const { course } = this.settings;
    const scale = (column: Column): number => (column === 'depth' ? 1e3 : 1);
    const whole = (value: number, factor: number): number | null => (Number.isNaN(value) ? null : value * factor);
    if (course !== null) {
      const { moments } = course;
      return [moments.map(({ time }) => time), ...columns.map((column) => moments.map((moment) => whole(moment[column], scale(column))))];
    }
    const times = history.list('time');
    const now = times.length > 0 ? times[times.length - 1] : 0;
    // One moment before the window, so that the line reaches to its border.
    const after = times.findIndex((time) => time >= now - this.settings.window);
    const from = Math.max(0, after - 1);
    const part = (column: Column): (number | null)[] => Array.from(history.list(column).subarray(from), (value) => whole(value, scale(column)));
    // Seconds before now: the axis stands still while the curve moves.
    return [Array.from(times.subarray(from), (time) => time - now), ...columns.map(part)];
  }

  private found(): Shown {
    const { kind, course } = this.settings;
    if (kind === 'force-depth' && course === null) return { ...NOTHING, ...kinds(history.runs.all), gaps: brokenAt(history.runs.all.at(-1)?.depths ?? []) };
    if (kind === 'force-distance') {
      const from = this.strokeEnds[0] > 0 ? this.strokeEnds[0] : null;
      return { ...NOTHING, ...kinds(this.presentStrokes()), from };
    }
    if (this.isOverTime) {
      const list = course === null ? Array.from(history.list('force')) : course.moments.map(({ force }) => force);
      return { ...NOTHING, gaps: brokenAt(list) };
    }
    return NOTHING;
  }

  // Force over the way

  /** The strokes that are shown, newest last. */
  private presentStrokes(): readonly Stroke[] {
    if (this.strokes === null) return history.strokes.all;
    const { all } = this.strokes;
    const at = this.at === null ? -1 : all.indexOf(this.at);
    return all.slice(Math.max(0, at - 2), at + 1);
  }

  /** Chooses the axes of the strokes. */
  private fitStrokes(): void {
    const strokes = this.presentStrokes();
    const newest = strokes.at(-1);
    if (newest === undefined) {
      this.wayEnds = [0, 20];
      this.strokeEnds = [0, axes.force];
      return;
    }
    const length = Math.max(newest.ways.at(-1)! * 1e3, 5);
    this.wayEnds = [0, length];
    let [least, most] = [Infinity, 0];
    for (const stroke of strokes) {
      const [offset, sign] = onAxisOf(newest, stroke);
      stroke.forces.forEach((force, i) => {
        const x = (offset + sign * stroke.ways[i]) * 1e3;
        if (x < 0 || x > length || Number.isNaN(force)) return;
        least = Math.min(least, force);
        most = Math.max(most, force);
      });
    }
    const change = most - least;
    const pad = Math.max(0.08 * change, 0.005 * most);
    const low = change > SMALL_CHANGE * most ? 0 : Math.max(0, least - pad);
    this.strokeEnds = [low, most + pad + HEADROOM * (most - low)];
  }

  // Looks

  private colour(name: string): string {
    return this.style.getPropertyValue(name).trim();
  }

  private options(): uPlot.Options {
    const { kind, lines, window, course } = this.settings;
    const axis: uPlot.Axis = {
      stroke: this.colour('--ink-muted'),
      font: FONT,
      grid: { stroke: this.colour('--grid'), width: 1 },
      ticks: { stroke: this.colour('--grid'), width: 1, size: 3 },
      gap: 3,
    };
    const ends = course === null ? axes : this.recordedEnds;
    // Depths above the skin are negative; a little of them is shown.
    const depths = (): [number, number] => [-0.2 * ends.depth * 1e3, ends.depth * 1e3];
    const forces = (): [number, number] => [0, ends.force];
    const times = (): [number, number] => (course === null ? [-window, 0] : [0, Math.max(course.duration, 0.1)]);
    const ranges: Record<CurveKind, [x: () => [number, number], y: (plot: uPlot, least: number, most: number) => [number, number]]> = {
      'force-depth': [depths, forces],
      'force-time': [times, lines === 'parts' ? (_plot, least, most) => bothSides(least, most) : forces],
      'force-distance': [() => this.wayEnds, () => this.strokeEnds],
      'depth-time': [times, depths],
      spectrum: [() => [0, HIGHEST], () => [FAINTEST, this.spectrumEnd]],
    };
    const [x, y] = ranges[kind];
    const [xUnit, yUnit] = UNITS[kind];
    const isDrawnHere = kind === 'force-depth' || kind === 'force-distance';
    const series: uPlot.Series[] = isDrawnHere
      ? [{ paths: ((plot: uPlot) => this.drawGhosts(plot)) as unknown as uPlot.Series.PathBuilder }]
      : (kind === 'force-time' ? LINES[lines] : kind === 'depth-time' ? DEPTH : AMPLITUDE).map(({ colour, dash }) => ({
          stroke: this.colour(colour),
          width: dash === undefined ? 1.75 : 1.25,
          dash,
          points: { show: false },
          spanGaps: false,
        }));
    return {
      ...sizeOf(this.element),
      mode: isDrawnHere ? 2 : 1,
      legend: { show: false },
      cursor: { show: false },
      // Room for half a label at the right, and above the topmost.
      padding: [10, 24, 0, 0],
      scales: {
        x: { time: false, range: x },
        y: kind === 'spectrum' ? { distr: 3, log: 10, range: y } : { range: y },
      },
      axes: [
        { ...axis, size: 20, space: 40, values: labels(xUnit) },
        kind === 'spectrum'
          ? { ...axis, size: 54, space: 16, values: (_plot, splits) => splits.map(decade), grid: { ...axis.grid, filter: decades }, ticks: { ...axis.ticks, filter: decades } }
          : { ...axis, size: 54, space: 24, values: labels(yUnit) },
      ],
      series: [{}, ...series],
      hooks: kind === 'spectrum' ? { drawClear: [(plot) => this.drawFelt(plot)] } : {},
    };
  }

  /** Force over depth or over the way, with its ghosts. */
  private drawGhosts(plot: uPlot): null {
    const { kind, course } = this.settings;
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.lineJoin = 'round';
    if (kind === 'force-distance') this.drawStrokes(plot);
    else if (course === null) this.drawRuns(plot);
    else {
      const { moments } = course;
      this.stroke(plot, moments.length, (i) => moments[i].depth * 1e3, (i) => moments[i].force, this.colour('--force'), 0.55, 1.5);
    }
    ctx.restore();
    return null;
  }

  private drawRuns(plot: uPlot): void {
    const { all } = history.runs;
    all.forEach(({ body, depths, forces }, i) => {
      const age = all.length - 1 - i;
      const [colour, alpha, width] = this.ghost(age, body !== history.runs.body);
      this.stroke(plot, depths.length, (k) => depths[k] * 1e3, (k) => forces[k], colour, alpha, width);
    });
    const newest = all.at(-1);
    if (newest !== undefined && history.runs.isUnderWay) this.dot(plot, newest.depths.at(-1)! * 1e3, newest.forces.at(-1)!);
  }

  private drawStrokes(plot: uPlot): void {
    const strokes = this.presentStrokes();
    const newest = strokes.at(-1);
    if (newest === undefined) return;
    const body = this.strokes === null ? history.strokes.body : newest.body;
    strokes.forEach((stroke, i) => {
      const { ways, forces } = stroke;
      const [offset, sign] = onAxisOf(newest, stroke);
      const [colour, alpha, width] = this.ghost(strokes.length - 1 - i, stroke.body !== body);
      this.stroke(plot, ways.length, (k) => (offset + sign * ways[k]) * 1e3, (k) => forces[k], colour, alpha, width);
    });
  }

  /** Looks of a line by its age, and by whether the body has changed since. */
  private ghost(age: number, isBefore: boolean): [colour: string, alpha: number, width: number] {
    if (isBefore) return [this.colour('--before'), age === 0 ? 1 : GHOSTS[Math.min(age - 1, 2)] + 0.2, 1.5];
    if (age === 0) return [this.colour('--force'), 1, 1.75];
    return [this.colour('--ink-muted'), GHOSTS[Math.min(age - 1, 2)], 1.25];
  }

  /** Draws a line, broken where a value is missing. */
  private stroke(plot: uPlot, n: number, x: (i: number) => number, y: (i: number) => number, colour: string, alpha: number, width: number): void {
    const { ctx } = plot;
    ctx.strokeStyle = colour;
    ctx.globalAlpha = alpha;
    ctx.lineWidth = width * devicePixelRatio;
    ctx.beginPath();
    let isBroken = true;
    for (let i = 0; i < n; i++) {
      const [a, b] = [x(i), y(i)];
      if (Number.isNaN(a) || Number.isNaN(b)) {
        isBroken = true;
        continue;
      }
      const [left, top] = [plot.valToPos(a, 'x', true), plot.valToPos(b, 'y', true)];
      if (isBroken) ctx.moveTo(left, top);
      else ctx.lineTo(left, top);
      isBroken = false;
    }
    ctx.stroke();
    ctx.globalAlpha = 1;
  }

  private dot(plot: uPlot, x: number, y: number): void {
    if (Number.isNaN(x) || Number.isNaN(y)) return;
    const { ctx } = plot;
    ctx.fillStyle = this.colour('--force');
    ctx.beginPath();
    ctx.arc(plot.valToPos(x, 'x', true), plot.valToPos(y, 'y', true), 3.5 * devicePixelRatio, 0, 2 * Math.PI);
    ctx.fill();
  }

  /** The band of frequencies that are felt best. */
  private drawFelt(plot: uPlot): void {
    const { ctx, bbox } = plot;
    const across = (frequency: number): number => Math.min(bbox.left + bbox.width, plot.valToPos(frequency, 'x', true));
    ctx.save();
    ctx.fillStyle = this.colour('--felt');
    ctx.fillRect(across(FELT[0]), bbox.top, across(FELT[1]) - across(FELT[0]), bbox.height);
    ctx.strokeStyle = this.colour('--line-strong');
    ctx.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
    ctx.lineWidth = devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(across(MOST_SENSITIVE), bbox.top);
    ctx.lineTo(across(MOST_SENSITIVE), bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }
}

interface Line {
  column: Column;
  colour: string;
  dash?: number[];
}

/** The lines of force over time; the last is drawn on top. */
const LINES: Record<CurveLines, readonly Line[]> = {
  size: [{ column: 'axial', colour: '--ink-muted', dash: [4, 3] }, { column: 'force', colour: '--force' }],
  parts: [{ column: 'z', colour: '--part-z' }, { column: 'y', colour: '--part-y' }, { column: 'x', colour: '--part-x' }],
  tissue: [{ column: 'tissue', colour: '--depth', dash: [4, 3] }, { column: 'force', colour: '--force' }],
};
const DEPTH: readonly Line[] = [{ column: 'depth', colour: '--depth' }];
const AMPLITUDE: readonly Line[] = [{ column: 'force', colour: '--force' }];

const UNITS: Record<CurveKind, [x: string, y: string]> = {
  'force-depth': [' mm', ' N'],
  'force-time': [' s', ' N'],
  'force-distance': [' mm', ' N'],
  'depth-time': [' s', ' mm'],
  spectrum: [' Hz', ' N'],
};

function sizeOf(element: HTMLElement): { width: number; height: number } {
  return { width: Math.max(80, element.clientWidth), height: Math.max(60, element.clientHeight) };
}

/** Ends of an axis for values of both signs: round numbers. */
function bothSides(least: number, most: number): [number, number] {
  const low = Math.min(least ?? 0, 0);
  const high = Math.max(most ?? 0, 0);
  const up = (value: number): number => (value < 1e-6 ? 0 : roundUp(value));
  if (high < 1e-6 && low > -1e-6) return [-1, 1];
  return [-up(-low), up(high)];
}

/** Labels with the unit at the last number only. */
function labels(unit: string): uPlot.Axis.Values {
  return (_plot, splits) =>
    splits.map((value, index) => {
      const number = String(Number(value.toPrecision(6))).replace('-', '−');
      return index === splits.length - 1 ? `${number}${unit}` : number;
    });
}

/** Labels at powers of ten: "10 mN". */
function decade(value: number | null): string | null {
  if (value === null || value <= 0) return null;
  const power = Math.log10(value);
  if (Math.abs(power - Math.round(power)) > 1e-6) return null;
  return value < 0.9e-3 ? `${Math.round(value * 1e6)} µN` : value < 0.9 ? `${Math.round(value * 1e3)} mN` : `${Math.round(value)} N`;
}

/** Lines at powers of ten only. */
const decades = (_plot: uPlot, splits: readonly number[]): (number | null)[] => splits.map((value) => (decade(value) === null ? null : value));

/** Ghosts before the newest, of its body and of bodies before. */
function kinds(all: readonly { body: string }[]): { n: number; earlier: number; before: number } {
  const body = history.runs.body;
  // A recording is of one body, and its strokes have no key.
  const isBefore = (one: { body: string }): boolean => one.body !== body && one.body !== '';
  const before = all.filter(isBefore).length;
  const newest = all.at(-1);
  return { n: all.length, before, earlier: all.length - before - (newest !== undefined && !isBefore(newest) ? 1 : 0) };
}

function brokenAt(values: readonly number[]): number {
  return values.reduce((n, value) => n + (Number.isNaN(value) ? 1 : 0), 0);
}
