// The view of the body, for panels that ask it for something, and what it says of itself.

import { signal } from '@preact/signals';
import type { BodyView, Legend } from '../scene';

export const bodyView = signal<BodyView | null>(null);
export const legend = signal<Legend | null>(null);
/** Area of the cutaway's section, m². */
export const section = signal<{ total: number; layers: number[]; lumps: number } | null>(null);
/** From the page's begin to its first body, ms. */
export const firstBodyMs = signal<number | null>(null);
