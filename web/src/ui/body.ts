// The view of the body for panels that use it, and the values it reports.

import { signal } from '@preact/signals';
import type { BodyView, Legend } from '../scene';

export const bodyView = signal<BodyView | null>(null);
export const legend = signal<Legend | null>(null);
/** Area of the cutaway's section, m². */
export const section = signal<{ total: number; layers: number[]; lumps: number } | null>(null);
/** From the start of the page to its first drawn body, ms. */
export const firstBodyMs = signal<number | null>(null);
