// The shapes of tools: how each is drawn, and which fields the tool panel has for it.
//
// To add a shape: once palpa-scene has it, `npm run generate` puts it into `ToolShape`, and the
// compiler asks for its entry in `TOOL_SHAPES` below and for its name, `tool_shape.…`, in
// i18n/en.ts and i18n/ja.ts. A size that no other shape has needs a field below and its label there
// too, `tool.…`. Nothing else of the page names a shape.

import {
  BufferGeometry, CapsuleGeometry, CylinderGeometry, LatheGeometry, SphereGeometry, Vector2,
} from 'three';
import { RoundedBoxGeometry } from 'three/examples/jsm/geometries/RoundedBoxGeometry.js';
import { mergeGeometries } from 'three/examples/jsm/utils/BufferGeometryUtils.js';
import type { ContactShape } from '../generated/api';
import type { ToolShape, ToolTable } from '../generated/scene';

/** A size of a tool, as a key of the scene: one length or angle with the range of its slider, m
 * or rad, or three lengths. */
export type ToolField =
  | { key: 'radius' | 'length' | 'edge_radius' | 'tip_radius' | 'opening_angle'; dimension: 'length' | 'angle'; min: number; max: number }
  | { key: 'size' | 'radii'; names: [string, string, string] };

const RADIUS: ToolField = { key: 'radius', dimension: 'length', min: 2e-3, max: 25e-3 };
const LENGTH: ToolField = { key: 'length', dimension: 'length', min: 2e-3, max: 60e-3 };
const EDGE_RADIUS: ToolField = { key: 'edge_radius', dimension: 'length', min: 0.1e-3, max: 5e-3 };
const TIP_RADIUS: ToolField = { key: 'tip_radius', dimension: 'length', min: 0.2e-3, max: 5e-3 };
const OPENING_ANGLE: ToolField = { key: 'opening_angle', dimension: 'angle', min: 0.35, max: 2.79 };
const SIZE: ToolField = { key: 'size', names: ['x', 'y', 'z'] };
const RADII: ToolField = { key: 'radii', names: ['1', '2', '3'] };

type FormOf<S extends ToolShape> = Extract<ContactShape, { kind: S }>;

/** The tip lies at the origin and z points out of the tissue; a rod is `length` long, m. */
type Draw<F> = (form: F, length: number) => BufferGeometry;

interface Entry<S extends ToolShape> {
  /** Null where the engine sends another form in its place. */
  draw: [FormOf<S>] extends [never] ? null : Draw<FormOf<S>>;
  fields: ToolField[];
  /** The sizes with which it begins when it is chosen; `radius` is that of the tool
   * before, if it had one. */
  begin: (radius: string) => Omit<ToolTable, 'shape' | 'friction'>;
  /** Whether it presses by contact. The others hold the skin and need a scene of their own:
   * they are not offered. */
  isContact: boolean;
}

/** In the order of the menu. */
export const TOOL_SHAPES: { [S in ToolShape]: Entry<S> } = {
  sphere: {
    draw: ({ radius }, length) =>
      withStem(new SphereGeometry(radius, 48, 32).translate(0, 0, radius), radius, 2 * radius, length),
    fields: [RADIUS],
    begin: (radius) => ({ radius }),
    isContact: true,
  },
  'flat-punch': {
    draw: flatPunch,
    fields: [RADIUS, EDGE_RADIUS],
    begin: (radius) => ({ radius, edge_radius: '1.5 mm' }),
    isContact: true,
  },
  capsule: {
    draw: ({ radius, length: straight }, length) =>
      withStem(new CapsuleGeometry(radius, straight, 16, 40).rotateZ(Math.PI / 2).translate(0, 0, radius), radius, 2 * radius, length),
    fields: [RADIUS, LENGTH],
    begin: (radius) => ({ radius, length: '20 mm' }),
    isContact: true,
  },
  box: {
    draw: ({ size: [x, y, z], edge_radius }, length) => {
      const least = Math.min(x, y, z);
      const edge = Math.min(Math.max(edge_radius, 0.02 * least), 0.499 * least);
      return withStem(new RoundedBoxGeometry(x, y, z, 4, edge).translate(0, 0, z / 2), Math.min(x, y) / 2, z, length);
    },
    fields: [SIZE, EDGE_RADIUS],
    begin: () => ({ size: ['16 mm', '16 mm', '16 mm'], edge_radius: '2 mm' }),
    isContact: true,
  },
  fingertip: {
    draw: ({ radii: [x, y, z] }) => new SphereGeometry(1, 48, 32).scale(x, y, z).translate(0, 0, z),
    fields: [RADII],
    begin: () => ({ radii: ['8 mm', '7 mm', '7 mm'] }),
    isContact: true,
  },
  cone: {
    draw: cone,
    fields: [RADIUS, OPENING_ANGLE, TIP_RADIUS],
    begin: (radius) => ({ radius, opening_angle: '120 deg', tip_radius: '3 mm' }),
    isContact: true,
  },
  disc: { draw: null, fields: [RADIUS], begin: (radius) => ({ radius }), isContact: false },
  node: { draw: null, fields: [], begin: () => ({}), isContact: false },
};
export const TOOL_SHAPE_NAMES = Object.keys(TOOL_SHAPES) as ToolShape[];

/** The shape where a scene names none. */
export const DEFAULT_SHAPE: ToolShape = 'disc';

/** The tool in another shape. Only its own sizes are kept: the engine refuses
 * those of another shape. */
export function reshaped({ radius = '10 mm', friction }: ToolTable, shape: ToolShape): ToolTable {
  const { begin, isContact } = TOOL_SHAPES[shape];
  return { shape, ...begin(radius), ...(isContact && friction !== undefined && { friction }) };
}

/** From a tool's axis to its side, m. */
export function reachOf(form: ContactShape): number {
  switch (form.kind) {
    case 'capsule':
      return form.radius + form.length / 2;
    case 'box':
      return Math.max(form.size[0], form.size[1]) / 2;
    case 'fingertip':
      return Math.max(form.radii[0], form.radii[1]);
    default:
      return form.radius;
  }
}

/** A tool as it is drawn. */
export function toolGeometry(form: ContactShape, length: number): BufferGeometry {
  const draw = TOOL_SHAPES[form.kind].draw as Draw<ContactShape>;
  return draw(form, length);
}

function flatPunch({ radius: r, edge_radius: e }: FormOf<'flat-punch'>, length: number): BufferGeometry {
  const profile = [new Vector2(0, 0)];
  for (let i = 0; i <= 6; i++) {
    const a = (i / 6) * (Math.PI / 2);
    profile.push(new Vector2(r - e + e * Math.sin(a), e - e * Math.cos(a)));
  }
  const top = Math.max(0.35 * length, 1.2 * r);
  const bevel = 0.08 * r;
  profile.push(new Vector2(r, top - bevel), new Vector2(r - bevel, top), new Vector2(0, top));
  return withStem(new LatheGeometry(profile, 64).rotateX(Math.PI / 2), r, top, length);
}

function cone({ radius: r, opening_angle, tip_radius: t, edge_radius: e }: FormOf<'cone'>, length: number): BufferGeometry {
  const half = opening_angle / 2;
  // The flank touches the roundings of tip and rim, whose middles are `t` and `rim` high.
  const rim = t + (Math.cos(half) * (r - e) - (t - e)) / Math.sin(half);
  const profile: Vector2[] = [];
  for (let i = 0; i <= 8; i++) {
    const a = (i / 8) * (Math.PI / 2 - half);
    profile.push(new Vector2(t * Math.sin(a), t - t * Math.cos(a)));
  }
  for (let i = 0; i <= 6; i++) {
    const a = half * (1 - i / 6);
    profile.push(new Vector2(r - e + e * Math.cos(a), rim - e * Math.sin(a)));
  }
  const top = rim + 0.3 * r;
  profile.push(new Vector2(r, top), new Vector2(0, top));
  return withStem(new LatheGeometry(profile, 64).rotateX(Math.PI / 2), r, top, length);
}

/** A thin stem to hold the tool by, as a second group; `radius` and `from` are the tool's radius and top, m. */
function withStem(geometry: BufferGeometry, radius: number, from: number, length: number): BufferGeometry {
  const r = Math.min(0.35 * radius, 0.035 * length);
  const h = Math.max(length - from, 0.4 * length);
  const stem = new CylinderGeometry(r, r, h, 24).rotateX(Math.PI / 2).translate(0, 0, from + h / 2 - 0.02 * radius);
  const merged = mergeGeometries([geometry, stem].map((g) => (g.index ? g.toNonIndexed() : g)).map(bare), true);
  geometry.dispose();
  stem.dispose();
  return merged;
}

/** Only positions and normals: geometries that are merged must have the same attributes. */
function bare(geometry: BufferGeometry): BufferGeometry {
  for (const name of Object.keys(geometry.attributes)) if (name !== 'position' && name !== 'normal') geometry.deleteAttribute(name);
  return geometry;
}
