// The view of the body for panels that use it, and the values it reports.

import { signal } from '@preact/signals';
import type { BodyView, Legend, LensPicture, MapLegend, Probed } from '../scene';

export const bodyView = signal<BodyView | null>(null);
export const legend = signal<Legend | null>(null);
/** The legend of the palpation map; null while nothing of it is shown. */
export const mapLegend = signal<MapLegend | null>(null);
/** What the frame around the lens says; null while it is closed. */
export const lensPicture = signal<LensPicture | null>(null);
/** What the probe reads; null while there is none. */
export const probed = signal<Probed | null>(null);
/** Whether pictures follow each other more slowly, so that the engine keeps up. */
export const yields = signal(false);
/** Area of the cutaway's section, m². */
export const section = signal<{ total: number; layers: number[]; lumps: number } | null>(null);
/** From the start of the page to its first drawn body, ms. */
export const firstBodyMs = signal<number | null>(null);
