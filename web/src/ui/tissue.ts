// The tissue of a layer or a lump as the scene writes it: by its name in the catalogue, or as
// a table of values.
//
// To add a law: once the scene's schema has it, `npm run generate` puts it into `LawName`, and the
// compiler asks for its entry in `LAWS` below and for its name, `law.…`, in i18n/en.ts and
// i18n/ja.ts. A parameter that no other law has needs its label there too, `tissues.…`. Nothing
// else of the page names a law.

import type { LawName, LayerTable, TissueTable } from '../generated/scene';
import { formatQuantity, type Dimension } from './quantity';

/** A tissue's table, or its name in the catalogue. */
export type Tissue = LayerTable['tissue'];

/** Parameters beside stiffness and Poisson's ratio. */
type ParameterKey = 'c01' | 'c20' | 'c30' | 'alpha' | 'b' | 'jm';

interface Parameter {
  key: ParameterKey;
  dimension: Dimension;
  /** The value with which the law begins when it is chosen; `young` is Young's modulus, Pa. */
  start: (young: number) => string | number;
}

/** A quarter of the C10 of an incompressible tissue, which is a sixth of Young's modulus. */
const quarterShear = (young: number): string => formatQuantity(young / 24, 'pressure');

/** The parameters of each law, in the order of the menu. */
export const LAWS: Record<LawName, Parameter[]> = {
  linear: [],
  'st-venant-kirchhoff': [],
  'neo-hookean': [],
  'mooney-rivlin': [{ key: 'c01', dimension: 'pressure', start: quarterShear }],
  yeoh: [
    { key: 'c20', dimension: 'pressure', start: quarterShear },
    { key: 'c30', dimension: 'pressure', start: quarterShear },
  ],
  ogden: [{ key: 'alpha', dimension: 'number', start: () => 8 }],
  fung: [{ key: 'b', dimension: 'number', start: () => 10 }],
  gent: [{ key: 'jm', dimension: 'number', start: () => 1 }],
};
export const LAW_NAMES = Object.keys(LAWS) as LawName[];

/** The law where a table names none. */
export const DEFAULT_LAW: LawName = 'neo-hookean';
/** Poisson's ratio where a table says nothing about compressibility. */
export const DEFAULT_POISSON = 0.45;
/** Young's modulus where the engine has not yet reported one, Pa. */
const UNKNOWN_YOUNG = 2e4;

/** The keys by one of which a tissue's stiffness is given. */
const STIFFNESS_KEYS = ['young', 'shear', 'c10', 'spring'] as const;
export type StiffnessKey = (typeof STIFFNESS_KEYS)[number];

/** The key that gives this tissue's stiffness; Young's modulus where there is none. */
export function stiffnessKey(tissue: Tissue | undefined): StiffnessKey {
  if (tissue === undefined || typeof tissue === 'string') return 'young';
  return STIFFNESS_KEYS.find((key) => tissue[key] !== undefined) ?? 'young';
}

export function tissueName(tissue: Tissue, unnamed: string): string {
  return (typeof tissue === 'string' ? tissue : tissue.name) ?? unnamed;
}

/** A tissue of the catalogue written out as a table, from what the engine
 * reports about its layer. */
export function writtenOut(name: string, law: string | undefined, young = UNKNOWN_YOUNG): TissueTable {
  const known = LAW_NAMES.find((one) => one === law) ?? DEFAULT_LAW;
  return { name, law: known, young: formatQuantity(young, 'pressure', 4), poisson: DEFAULT_POISSON, ...starts(known, young) };
}

/** The same tissue under another law, as stiff as before at small strain. */
export function underLaw(table: TissueTable, law: LawName, young = UNKNOWN_YOUNG): TissueTable {
  const kept: TissueTable = { ...table, law, young: formatQuantity(young, 'pressure', 4) };
  // The new law refuses the keys of another one.
  const others = Object.values(LAWS).flatMap((parameters) => parameters.map(({ key }) => key));
  for (const key of ['shear', 'c10', 'terms', 'volume', ...others] as const) delete kept[key];
  return { ...kept, ...starts(law, young) };
}

function starts(law: LawName, young: number): Partial<TissueTable> {
  return Object.fromEntries(LAWS[law].map(({ key, start }) => [key, start(young)]));
}
