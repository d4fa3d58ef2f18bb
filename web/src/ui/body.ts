// The view of the body for panels that use it, and the values it reports.

import { signal } from '@preact/signals';
import type { BodyView, Legend, MapLegend } from '../scene';

export const bodyView = signal<BodyView | null>(null);
export const legend = signal<Legend | null>(null);
/** The legend of the palpation map; null while nothing of it is shown. */
export const mapLegend = signal<MapLegend | null>(null);
/** Whether pictures follow each other more slowly, so that the engine keeps up. */
export const yields = signal(false);
/** Area of the cutaway's section, m². */
export const section = signal<{ total: number; layers: number[]; lumps: number } | null>(null);
/** From the start of the page to its first drawn body, ms. */
export const firstBodyMs = signal<number | null>(null);
