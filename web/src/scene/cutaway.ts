// Geometry of the cutaway: its plane, the side that stays, and its frame.

import { Plane, Vector3, type Box3 } from 'three';
import { planeAxes, type CutPlane } from './contour';
import type { ViewOptions } from './options';

export interface Cut {
  /** The normal points to the side that stays. */
  plane: CutPlane;
  /** Way of the plane from position 0 to 1, m. */
  way: Vector3;
  /** Corners of the frame around the body, in the plane, m. */
  corners: Vector3[];
  /** Middles of the frame's sides, m. */
  middles: Vector3[];
}

/** Directions to the side that stays unless flipped: the side towards home is removed. */
const STAYS = { x: new Vector3(1, 0, 0), y: new Vector3(0, 1, 0), z: new Vector3(0, 0, -1) };
/** Share of the way left out at both ends, so that the plane never lies in a face of the body. */
const MARGIN = 0.002;

/** `forward` is the direction in which the camera looks; `tool` is where the tool is, and its axis. */
export function cutOf({ axis, position, flip }: ViewOptions['cutaway'], box: Box3, forward: Vector3, tool: { tip: Vector3; axis: Vector3 } | null): Cut {
  const isAtTool = axis === 'tool' && tool !== null;
  const normal = axis === 'x' || axis === 'y' || axis === 'z' ? STAYS[axis].clone() : isAtTool ? sidewards(forward, tool.axis) : forward.clone();
  const along = axis === 'z' ? normal.clone().negate() : normal.clone();
  const centre = box.getCenter(new Vector3());
  const half = box.getSize(new Vector3()).multiplyScalar(0.5);
  const reach = Math.abs(along.x) * half.x + Math.abs(along.y) * half.y + Math.abs(along.z) * half.z;
  const at = isAtTool ? along.dot(tool.tip) : along.dot(centre) + reach * (2 * (MARGIN + (1 - 2 * MARGIN) * position) - 1);
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

/** The direction away from the camera, at a right angle to the tool: the plane holds the tool's axis. */
function sidewards(forward: Vector3, axis: Vector3): Vector3 {
  const side = forward.clone().addScaledVector(axis, -forward.dot(axis));
  if (side.lengthSq() < 1e-4) side.set(0, 1, 0).addScaledVector(axis, -axis.y);
  return side.normalize();
}

/** The plane for three.js, which keeps the side of the normal. */
export function clippingPlane({ normal, offset }: CutPlane, into: Plane): Plane {
  into.normal.set(...normal);
  into.constant = -offset;
  return into;
}
