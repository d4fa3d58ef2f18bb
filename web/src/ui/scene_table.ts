// The keys of a scene file that panels show and change.

export type Quantity = string;
export type Point = [Quantity, Quantity, Quantity];

export const LAWS = [
  'linear', 'st-venant-kirchhoff', 'neo-hookean', 'mooney-rivlin', 'yeoh', 'ogden', 'fung',
] as const;
export type LawName = (typeof LAWS)[number];

export interface TissueTable {
  name?: string;
  law?: LawName;
  young?: Quantity;
  shear?: Quantity;
  c10?: Quantity;
  c01?: Quantity;
  c20?: Quantity;
  c30?: Quantity;
  alpha?: number;
  b?: number;
  terms?: unknown[];
  poisson?: number;
  bulk?: Quantity;
  spring?: Quantity;
  [key: string]: unknown;
}

export interface LayerTable {
  tissue: string | TissueTable;
  thickness?: Quantity | Record<string, unknown>;
  levels?: number;
  prestress?: Quantity;
  [key: string]: unknown;
}

export interface LumpTable {
  name?: string;
  shape?: 'sphere' | 'ellipsoid' | 'capsule' | 'mesh';
  radius?: Quantity;
  radii?: Point;
  length?: Quantity;
  at?: Point;
  below?: Point;
  below_vertex?: number;
  depth?: Quantity;
  tissue?: string | TissueTable;
  transition?: Quantity;
  [key: string]: unknown;
}

export const TOOL_SHAPES = ['sphere', 'flat-punch', 'capsule', 'box', 'fingertip', 'disc', 'node'] as const;
export type ToolShape = (typeof TOOL_SHAPES)[number];

export interface ToolTable {
  shape?: ToolShape;
  radius?: Quantity;
  edge_radius?: Quantity;
  length?: Quantity;
  size?: Point;
  radii?: Point;
  axis?: unknown;
  friction?: number;
}

export const MOTIONS = ['press', 'stroke', 'drag', 'tap', 'palpate'] as const;
export type MotionKind = (typeof MOTIONS)[number];

export interface MotionTable {
  kind?: MotionKind;
  depth?: Quantity;
  speed?: Quantity;
  hold?: Quantity;
  length?: Quantity;
  along?: 'x' | 'y' | 'z' | number[];
  times?: number;
  tremor?: Quantity;
  above?: Quantity;
}

export const PRESETS = ['falcon', 'touch', 'inverse3', 'ideal'] as const;
export const GRIPS = ['soft', 'medium', 'stiff'] as const;

export interface SceneTable {
  layer?: LayerTable[];
  lump?: LumpTable[];
  tool?: ToolTable;
  press?: { at?: Point; vertex?: number; depth?: Quantity; [key: string]: unknown };
  device?: { preset?: (typeof PRESETS)[number]; grip?: (typeof GRIPS)[number] };
  motion?: MotionTable;
  [key: string]: unknown;
}

/** What a tissue's stiffness is given by; Young's modulus unless the scene says otherwise. */
export const STIFFNESS_KEYS = ['young', 'shear', 'c10', 'spring'] as const;
export type StiffnessKey = (typeof STIFFNESS_KEYS)[number];

export function stiffnessKey(tissue: string | TissueTable | undefined): StiffnessKey {
  if (tissue === undefined || typeof tissue === 'string') return 'young';
  return STIFFNESS_KEYS.find((key) => tissue[key] !== undefined) ?? 'young';
}

export function tissueName(tissue: string | TissueTable | undefined, unnamed: string): string {
  return (typeof tissue === 'string' ? tissue : tissue?.name) ?? unnamed;
}
