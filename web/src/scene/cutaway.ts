// Where the cutaway plane lies, which side of it stays, and its frame.

import { Plane, Vector3, type Box3 } from 'three';
import { planeAxes, type CutPlane } from './contour';
import type { ViewOptions } from './options';

export interface Cut {
  /** Its normal points into what stays. */
  plane: CutPlane;
  /** Growing positions go along this way, m, from 0 to 1. */
  way: Vector3;
  /** Corners of the frame round the body, in the plane. */
  corners: Vector3[];
  /** Where the frame's sides have their middles. */
  middles: Vector3[];
}

/** Unless flipped, what lies towards home is taken away. */
const STAYS = { x: new Vector3(1, 0, 0), y: new Vector3(0, 1, 0), z: new Vector3(0, 0, -1) };
/** Of the way, left at both ends, so that a plane at the end does not lie in a face of the body. */
const MARGIN = 0.002;

export function cutOf({ axis, position, flip }: ViewOptions['cutaway'], box: Box3, forward: Vector3): Cut {
  const normal = axis === 'view' ? forward.clone() : STAYS[axis].clone();
  const along = axis === 'z' ? normal.clone().negate() : normal.clone();
  const centre = box.getCenter(new Vector3());
  const half = box.getSize(new Vector3()).multiplyScalar(0.5);
  const reach = Math.abs(along.x) * half.x + Math.abs(along.y) * half.y + Math.abs(along.z) * half.z;
  const at = along.dot(centre) + reach * (2 * (MARGIN + (1 - 2 * MARGIN) * position) - 1);
  if (flip) normal.negate();
  const offset = normal.dot(along) > 0 ? at : -at;
  const n = normal.toArray() as [number, number, number];
  const [u, v] = planeAxes(n).map((a) => new Vector3(...a));
  const reachOf = (a: Vector3) => 1.08 * (Math.abs(a.x) * half.x + Math.abs(a.y) * half.y + Math.abs(a.z) * half.z) + 0.004;
  const ru = reachOf(u), rv = reachOf(v);
  const middle = centre.clone().addScaledVector(normal, offset - normal.dot(centre));
  const to = (i: number, k: number) => middle.clone().addScaledVector(u, i * ru).addScaledVector(v, k * rv);
  return {
    plane: { normal: n, offset },
    way: along.multiplyScalar(2 * reach),
    corners: [to(-1, -1), to(1, -1), to(1, 1), to(-1, 1)],
    middles: [to(1, 0), to(-1, 0), to(0, 1), to(0, -1)],
  };
}

/** As three clips: keeps what is on the normal's side. */
export function clippingPlane({ normal, offset }: CutPlane, into: Plane): Plane {
  into.normal.set(...normal);
  into.constant = -offset;
  return into;
}
