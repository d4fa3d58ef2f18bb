// The probe: what the model says at one point of the body, at rest and as it moves.

import { Vector3 } from 'three';
import type { FrameSnapshot } from '../generated/wire';
import type { Body } from './body';
import type { Vec3 } from './options';
import { nearestOnSkin } from './picking';

/** What is known at the point, SI. */
export interface Probed {
  /** At rest. */
  point: Vec3;
  /** On the skin, or the layer in which it lies (0 is the skin layer). */
  layer: number | null;
  displacement: Vec3;
  /** Young's modulus at small strain of the tissue there. */
  stiffness: number;
  /** Pressure of the tool; 0 without contact, null below the skin. */
  contact: number | null;
  /** The quantity that colours the body; null for colours by tissue or layer. */
  value: number | null;
  /** In the picture, px. */
  at: { x: number; y: number };
}

export class Probe {
  private point: Vec3 | null = null;
  private isSkin = false;
  private of: Body | null = null;
  /** Nodes around the point and their shares. */
  private nodes: [node: number, share: number][] = [];
  private interval = 0;
  private triangle = 0;

  /** Puts the probe at a point at rest, on the skin or below it; null takes it away. */
  set(point: Vec3 | null, isSkin: boolean): void {
    this.point = point;
    this.isSkin = isSkin;
    this.of = null;
  }

  get isOn(): boolean {
    return this.point !== null;
  }

  /** Reads the point. `values` are those of the nodes by which the body is coloured. */
  read(body: Body, frame: FrameSnapshot | null, values: Float32Array | null, toScreen: (p: Vector3) => { x: number; y: number }): Probed | null {
    if (!this.point) return null;
    if (this.of !== body) this.anchor(body);
    const { nodes } = this;
    const place = new Vector3(), rest = new Vector3();
    let value = 0;
    for (const [node, share] of nodes) {
      place.addScaledVector(new Vector3().fromArray(body.positions, 3 * node), share);
      rest.addScaledVector(new Vector3().fromArray(body.rest, 3 * node), share);
      value += share * (values?.[node] ?? 0);
    }
    return {
      point: rest.toArray() as Vec3,
      layer: this.isSkin ? null : body.intervalLayer[this.interval],
      displacement: place.clone().sub(rest).toArray() as Vec3,
      stiffness: body.stiffness[this.triangle * (body.nLevels - 1) + this.interval],
      contact: this.isSkin ? this.pressure(body, frame) : null,
      value: values ? value : null,
      at: toScreen(place),
    };
  }

  private pressure(body: Body, frame: FrameSnapshot | null): number {
    if (!frame) return 0;
    let sum = 0;
    for (const [node, share] of this.nodes) {
      const k = frame.contacts.indexOf(node / body.nLevels);
      if (k >= 0) sum += share * frame.contact_pressures[k];
    }
    return sum;
  }

  private anchor(body: Body): void {
    const point = this.point!;
    this.of = body;
    const { triangles, nLevels } = body;
    const near = nearestOnSkin(body, point);
    this.triangle = near.triangle / 3;
    const corners = [0, 1, 2].map((k) => triangles[near.triangle + k] * nLevels);
    if (this.isSkin) {
      this.interval = 0;
      this.nodes = corners.map((node, k) => [node, near.shares[k]]);
      return;
    }
    // In the column below the nearest place of the skin: between two levels, by the distance from both.
    const at = (level: number) => {
      const p = new Vector3();
      corners.forEach((node, k) => p.addScaledVector(new Vector3().fromArray(body.rest, 3 * (node + level)), near.shares[k]));
      return p;
    };
    const p = new Vector3(...point);
    let best = Infinity, share = 0;
    for (let i = 0; i < nLevels - 1; i++) {
      const a = at(i), way = at(i + 1).sub(a);
      const s = Math.min(1, Math.max(0, p.clone().sub(a).dot(way) / (way.lengthSq() || 1)));
      const off = a.addScaledVector(way, s).distanceToSquared(p);
      if (off < best) [best, this.interval, share] = [off, i, s];
    }
    this.nodes = corners.flatMap((node, k): [number, number][] => [
      [node + this.interval, near.shares[k] * (1 - share)], [node + this.interval + 1, near.shares[k] * share],
    ]);
  }
}
