// The quantities that a body can be coloured by, beside its tissues and layers.
//
// To add one: an entry in `QUANTITIES` below, its colour map in palette.ts (the compiler asks for
// it), and its name, `colour.…`, in i18n/en.ts and i18n/ja.ts. One that the engine computes needs a
// name in `Field` and a number in the snapshots as well; one that the page computes needs its
// values in colouring.ts.

import type { Field } from '../generated/api';

interface QuantityInfo {
  /** The engine's field and its number in snapshots; null where the page computes
   * the values itself. */
  field: { name: Exclude<Field, 'none'>; number: number } | null;
  /** The value of a body that nothing presses, SI. */
  rest: number;
  /** Least span of an automatic range, SI: below lie noise and the steps of 16-bit values. */
  leastSpan: number;
  /** SI unit, for the legend. */
  unit: string;
  /** The unit in which a fixed range is typed, and its size in SI. */
  typed: [unit: string, factor: number];
  /** Whether it shows a hidden lump. Such maps are off during a game. */
  showsLumps: boolean;
}

export const QUANTITIES = {
  displacement: { field: null, rest: 0, leastSpan: 5e-4, unit: 'm', typed: ['mm', 1e-3], showsLumps: false },
  von_mises: { field: { name: 'von_mises', number: 1 }, rest: 0, leastSpan: 50, unit: 'Pa', typed: ['kPa', 1e3], showsLumps: true },
  pressure: { field: { name: 'pressure', number: 2 }, rest: 0, leastSpan: 50, unit: 'Pa', typed: ['kPa', 1e3], showsLumps: true },
  stretch: { field: { name: 'stretch', number: 3 }, rest: 1, leastSpan: 0.01, unit: '', typed: ['', 1], showsLumps: true },
  contact: { field: null, rest: 0, leastSpan: 200, unit: 'Pa', typed: ['kPa', 1e3], showsLumps: false },
  stiffness: { field: null, rest: 0, leastSpan: 0, unit: 'Pa', typed: ['kPa', 1e3], showsLumps: true },
} satisfies Record<string, QuantityInfo>;

export type Quantity = keyof typeof QUANTITIES;
export type ColourBy = 'tissue' | 'layer' | Quantity;

/** In the order of the menu. */
export const COLOURINGS: ColourBy[] = ['tissue', 'layer', ...(Object.keys(QUANTITIES) as Quantity[])];

/** What is known of a quantity; null for colours by tissue or layer, which need no map. */
export function quantityOf(by: ColourBy): QuantityInfo | null {
  return by === 'tissue' || by === 'layer' ? null : QUANTITIES[by];
}
