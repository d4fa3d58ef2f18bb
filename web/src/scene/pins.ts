// Elements of the page that stay at a place of the body while the picture turns.

import { Vector3, type Vector2 } from 'three';
import type { Vec3 } from './options';
import type { CameraRig } from './rig';

/** A place is seen from the side to which its normal points: cosine of the angle to the view, at least. */
const SEEN = 0.05;

interface Place {
  point: Vec3;
  normal: Vec3;
}

export class Pins {
  private readonly pins = new Map<HTMLElement, () => Place | null>();

  constructor(private readonly rig: CameraRig) {}

  /** Keeps an element at a place, and hides it while the place is not seen. Returns what ends it. */
  add(element: HTMLElement, place: () => Place | null): () => void {
    this.pins.set(element, place);
    return () => this.pins.delete(element);
  }

  /** Moves the elements for a picture of this size, px. */
  update(size: Vector2): void {
    for (const [element, place] of this.pins) {
      const at = place();
      const to = at && this.onScreen(at, size);
      if (element.hidden !== (to === null)) element.hidden = to === null;
      if (to !== null && element.style.transform !== to) element.style.transform = to;
    }
  }

  private onScreen({ point, normal }: Place, size: Vector2): string | null {
    const p = new Vector3(...point);
    const { camera } = this.rig;
    if (camera.position.clone().sub(p).normalize().dot(new Vector3(...normal)) < SEEN) return null;
    p.project(camera);
    if (Math.abs(p.x) > 1 || Math.abs(p.y) > 1) return null;
    return `translate(${((0.5 + 0.5 * p.x) * size.x).toFixed(0)}px, ${((0.5 - 0.5 * p.y) * size.y).toFixed(0)}px)`;
  }
}
