// Overlays of the picture: scale bar, axes, the number of the force, and the grip of the cutaway plane.

import type { Vector3 } from 'three';
import './overlay.css';

const SVG = 'http://www.w3.org/2000/svg';

function svg<K extends keyof SVGElementTagNameMap>(name: K, attributes: Record<string, string | number>, parent: Element): SVGElementTagNameMap[K] {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  parent.append(element);
  return element;
}

interface ScreenAxes {
  right: Vector3;
  up: Vector3;
  forward: Vector3;
}

const AXES = [
  { name: 'x', colour: '#c8553d' },
  { name: 'y', colour: '#4f9d57' },
  { name: 'z', colour: '#3f78c4' },
] as const;

/** Small axes in the corner. A click on one looks along it. */
export class Gizmo {
  readonly element = document.createElement('div');
  private readonly arms: { group: SVGGElement; line: SVGLineElement; end: SVGGElement; axis: number; sign: number }[] = [];
  private readonly root: SVGSVGElement;
  /** The axes as drawn. */
  private view = '';

  constructor(onAxis: (axis: number, sign: number) => void) {
    this.element.className = 'scene-gizmo';
    this.root = svg('svg', { viewBox: '-44 -44 88 88', width: 88, height: 88, 'aria-hidden': 'true' }, this.element);
    for (let axis = 0; axis < 3; axis++) {
      for (const sign of [1, -1]) {
        const { name, colour } = AXES[axis];
        const group = svg('g', {}, this.root);
        const line = svg('line', { x1: 0, y1: 0, stroke: colour, 'stroke-width': 2.2, 'stroke-linecap': 'round' }, group);
        line.style.display = sign > 0 ? '' : 'none';
        const end = svg('g', { class: 'end' }, group);
        svg('circle', { r: sign > 0 ? 8.5 : 5, fill: colour, 'fill-opacity': sign > 0 ? 1 : 0.28, stroke: colour, 'stroke-width': sign > 0 ? 0 : 1.2 }, end);
        if (sign > 0) svg('text', { 'text-anchor': 'middle', dy: '0.34em' }, end).textContent = name;
        end.addEventListener('click', () => onAxis(axis, sign));
        this.arms.push({ group, line, end, axis, sign });
      }
    }
  }

  update({ right, up, forward }: ScreenAxes): void {
    const view = [right, up].map((v) => v.toArray().map((x) => x.toFixed(3)).join()).join();
    if (view === this.view) return;
    this.view = view;
    const order: [number, SVGGElement][] = [];
    for (const { group, line, end, axis, sign } of this.arms) {
      const x = 32 * sign * right.getComponent(axis), y = -32 * sign * up.getComponent(axis);
      const depth = sign * forward.getComponent(axis);
      const r = Math.hypot(x, y);
      const inner = Math.max(0, r - 8.5) / (r || 1);
      line.setAttribute('x2', String(x * inner));
      line.setAttribute('y2', String(y * inner));
      end.setAttribute('transform', `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
      group.setAttribute('opacity', depth > 0.3 ? '0.62' : '1');
      order.push([depth, group]);
    }
    for (const [, group] of order.sort((a, b) => b[0] - a[0])) this.root.append(group);
  }
}

/** The size of the force at the end of its arrow. */
export class ForceTag {
  readonly element = document.createElement('div');
  private shown = '';

  constructor() {
    this.element.className = 'scene-force';
    this.element.setAttribute('aria-hidden', 'true');
    this.element.hidden = true;
  }

  /** `at` in px; null hides it. */
  update(at: { x: number; y: number } | null, force: number): void {
    const shown = at === null ? '' : `${force.toFixed(2)} N ${Math.round(at.x)} ${Math.round(at.y)}`;
    if (shown === this.shown) return;
    this.shown = shown;
    this.element.hidden = at === null;
    if (at === null) return;
    this.element.textContent = `${force.toFixed(2)} N`;
    this.element.style.transform = `translate(${Math.round(at.x) + 6}px, ${Math.round(at.y) - 20}px)`;
  }
}

/** A bar of a round length in mm. */
export class ScaleBar {
  readonly element = document.createElement('div');
  private readonly bar = document.createElement('div');
  private readonly text = document.createElement('span');
  length = 0;
  label = '';

  constructor() {
    this.element.className = 'scene-scale';
    this.element.append(this.text, this.bar);
  }

  update(metresPerPixel: number): void {
    const most = 130 * metresPerPixel * 1000;
    const decade = 10 ** Math.floor(Math.log10(most));
    const step = most >= 5 * decade ? 5 : most >= 2 * decade ? 2 : 1;
    const mm = step * decade;
    const length = mm / 1000 / metresPerPixel;
    if (Math.abs(length - this.length) > 0.05) this.bar.style.width = `${length.toFixed(1)}px`;
    this.length = length;
    const label = `${Number(mm.toPrecision(2))} mm`;
    if (label !== this.label) this.text.textContent = this.label = label;
  }
}

/** The grip that drags the plane: a slider that turns with the plane's normal. */
export class PlaneGrip {
  readonly element = document.createElement('div');
  private readonly arrow: SVGGElement;
  private direction = { x: 1, y: 0 };
  /** Length of the way through the whole body, px. */
  private way = 1;
  private position = 0;

  constructor(private readonly onMove: (position: number) => void) {
    const { element } = this;
    element.className = 'scene-grip';
    element.tabIndex = 0;
    element.setAttribute('role', 'slider');
    element.setAttribute('aria-valuemin', '0');
    element.setAttribute('aria-valuemax', '100');
    element.hidden = true;
    const root = svg('svg', { viewBox: '-20 -20 40 40', width: 40, height: 40, 'aria-hidden': 'true' }, element);
    svg('circle', { r: 12, class: 'disc' }, root);
    this.arrow = svg('g', { class: 'arrow' }, root);
    svg('path', { d: 'M-7 0 H7 M-7 0 l3.2 -3.2 M-7 0 l3.2 3.2 M7 0 l-3.2 -3.2 M7 0 l-3.2 3.2', fill: 'none', 'stroke-width': 1.8, 'stroke-linecap': 'round', 'stroke-linejoin': 'round' }, this.arrow);

    element.addEventListener('pointerdown', (down) => {
      if (down.button !== 0) return;
      down.preventDefault();
      down.stopPropagation();
      element.focus({ preventScroll: true });
      element.setPointerCapture(down.pointerId);
      const from = this.position;
      // The direction at the start: perspective turns the plane's own while the grip moves.
      const { x, y } = this.direction, way = this.way;
      const move = (event: PointerEvent) => this.move(from + ((event.clientX - down.clientX) * x + (event.clientY - down.clientY) * y) / way);
      element.addEventListener('pointermove', move);
      element.addEventListener('lostpointercapture', () => element.removeEventListener('pointermove', move), { once: true });
    });
    element.addEventListener('keydown', (event) => {
      const step = event.shiftKey ? 0.05 : 0.01;
      const to = ({ ArrowRight: step, ArrowUp: step, ArrowLeft: -step, ArrowDown: -step, PageUp: 0.1, PageDown: -0.1 } as Record<string, number>)[event.key];
      if (event.key === 'Home') this.move(0);
      else if (event.key === 'End') this.move(1);
      else if (to !== undefined) this.move(this.position + to);
      else return;
      event.preventDefault();
      event.stopPropagation();
    });
  }

  private move(to: number): void {
    this.onMove(Math.min(1, Math.max(0, to)));
  }

  /** Place of the grip and way of the plane from position 0 to 1 in the picture, px. */
  update(x: number, y: number, wayX: number, wayY: number, position: number): void {
    this.position = position;
    const way = Math.hypot(wayX, wayY);
    // A plane seen from the front is dragged to the right.
    const [dx, dy] = way > 30 ? [wayX / way, wayY / way] : [1, 0];
    this.direction = { x: dx, y: dy };
    this.way = Math.max(way, 160);
    this.element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    this.arrow.setAttribute('transform', `rotate(${((Math.atan2(dy, dx) * 180) / Math.PI).toFixed(1)})`);
    this.element.setAttribute('aria-valuenow', String(Math.round(100 * position)));
  }
}
