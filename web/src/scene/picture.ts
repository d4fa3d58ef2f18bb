// The view as a PNG, with its background and scale bar, which are not on the canvas.

import type { Vector2 } from 'three';
import type { ScaleBar } from './overlay';
import type { Theme } from './palette';

/** From the edges of the picture to the scale bar, px. */
const MARGIN = 20;
/** Height of the bar's ends, px. */
const TICK = 6;

/** A bar of colours with its words, drawn into the picture. */
export interface PictureLegend {
  title: string;
  stops: readonly string[];
  labels: readonly string[];
  note: string;
}

/** `size` is that of the canvas on the page, px; the canvas itself may have more pixels. The lens lies over it while it
 * is open. */
export function pictureOf(canvas: HTMLCanvasElement, size: Vector2, theme: Theme, scaleBar: ScaleBar, lens: HTMLCanvasElement, legend: PictureLegend | null): Promise<Blob> {
  const out = document.createElement('canvas');
  const { width, height } = canvas;
  [out.width, out.height] = [width, height];
  const g = out.getContext('2d')!;
  const [middle, corner] = theme.background;
  const fill = g.createRadialGradient(width / 2, 0.43 * height, 0, width / 2, height / 2, 0.75 * Math.max(width, height));
  fill.addColorStop(0, middle);
  fill.addColorStop(1, corner);
  g.fillStyle = fill;
  g.fillRect(0, 0, width, height);
  g.drawImage(canvas, 0, 0);
  g.scale(width / size.x, width / size.x);
  if (!lens.hidden) g.drawImage(lens, lens.offsetLeft, lens.offsetTop, lens.offsetWidth, lens.offsetHeight);
  drawScaleBar(g, MARGIN, size.y - MARGIN, theme.ink, scaleBar);
  if (legend) drawLegend(g, size, theme.ink, legend);
  return new Promise((resolve, reject) =>
    out.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('the browser could not encode the picture as PNG'))), 'image/png'),
  );
}

function drawScaleBar(g: CanvasRenderingContext2D, x: number, y: number, ink: string, { length, label }: ScaleBar): void {
  g.strokeStyle = g.fillStyle = ink;
  g.lineWidth = 1.5;
  g.beginPath();
  g.moveTo(x, y - TICK);
  g.lineTo(x, y);
  g.lineTo(x + length, y);
  g.lineTo(x + length, y - TICK);
  g.stroke();
  g.font = '500 12px system-ui, sans-serif';
  g.fillText(label, x, y - 11);
}

function drawLegend(g: CanvasRenderingContext2D, size: Vector2, ink: string, { title, stops, labels, note }: PictureLegend): void {
  const width = Math.min(230, size.x - 2 * MARGIN);
  const x = size.x - MARGIN - width, y = size.y - MARGIN - 40;
  const fill = g.createLinearGradient(x, 0, x + width, 0);
  stops.forEach((colour, i) => fill.addColorStop(i / (stops.length - 1), colour));
  g.fillStyle = fill;
  g.fillRect(x, y, width, 10);
  g.fillStyle = ink;
  g.font = '600 12px system-ui, sans-serif';
  g.fillText(title, x, y - 6);
  g.font = '500 12px system-ui, sans-serif';
  labels.forEach((label, i) => {
    g.textAlign = i === 0 ? 'left' : i === labels.length - 1 ? 'right' : 'center';
    g.fillText(label, x + (i / (labels.length - 1)) * width, y + 24);
  });
  g.textAlign = 'left';
  g.fillText(note, x, y + 40);
}
