// The camera on a sphere around its target, with z up.

import { Box3, MathUtils, PerspectiveCamera, Vector3 } from 'three';

/** A camera relative to a body, so that it suits other bodies too. */
export interface CameraPose {
  /** rad. */
  azimuth: number;
  elevation: number;
  /** As a share of the distance from which the whole body is seen. */
  distance: number;
  /** The point looked at, from the middle of the body, in its radii. */
  target: [number, number, number];
}

const FIELD_OF_VIEW = 28;
const TURN_MS = 450;

/** Directions from the target to the camera. */
export const SIDES = {
  home: new Vector3(-0.42, -1, 0.72).normalize(),
  top: new Vector3(0, -0.001, 1).normalize(),
  front: new Vector3(-1, -0.001, 0.0).normalize(),
  side: new Vector3(0, -1, 0.02).normalize(),
};

export class CameraRig {
  readonly camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 10);
  readonly target = new Vector3();
  private azimuth = 0;
  private elevation = 0;
  private distance = 1;
  private fitted = 1;
  private radius = 0.1;
  private turn: { from: [number, number, number, Vector3]; to: [number, number, number, Vector3]; since: number | null } | null = null;
  reducedMotion = false;

  constructor(private readonly onChange: () => void) {
    this.camera.up.set(0, 0, 1);
    this.look(SIDES.home);
  }

  private look(direction: Vector3): void {
    this.azimuth = Math.atan2(direction.y, direction.x);
    this.elevation = Math.asin(MathUtils.clamp(direction.z, -1, 1));
  }

  /** Fits the whole box into the picture, seen from a direction. */
  fit(box: Box3, direction: Vector3, animate: boolean): void {
    const centre = box.getCenter(new Vector3());
    const distance = this.distanceFor(box, centre, direction);
    this.fitted = distance;
    this.radius = 0.5 * box.getSize(new Vector3()).length();
    this.turnTo(direction, centre, distance, animate);
  }

  /** Looks at a point from a direction, so that a length around it (m) fits into the picture. */
  lookAt(point: Vector3, direction: Vector3, span: number): void {
    const needed = span / (2 * Math.tan(MathUtils.degToRad(FIELD_OF_VIEW / 2)) * Math.min(1, this.camera.aspect));
    this.turnTo(direction, point, MathUtils.clamp(needed, 0.08 * this.fitted, 1.2 * this.fitted), true);
  }

  /** Turns half round an axis through a point, as one turns an arm over. */
  turnOver(axis: Vector3, middle: Vector3): void {
    const [azimuth, elevation, distance, target] = this.turn?.to ?? [this.azimuth, this.elevation, this.distance, this.target];
    const over = (v: Vector3): Vector3 => axis.clone().multiplyScalar(2 * axis.dot(v)).sub(v);
    const c = Math.cos(elevation);
    const direction = over(new Vector3(c * Math.cos(azimuth), c * Math.sin(azimuth), Math.sin(elevation)));
    this.turnTo(direction, over(target.clone().sub(middle)).add(middle), distance, true);
  }

  private turnTo(direction: Vector3, centre: Vector3, distance: number, animate: boolean): void {
    const azimuth = Math.atan2(direction.y, direction.x);
    const most = Math.PI / 2 - 0.002;
    const elevation = MathUtils.clamp(Math.asin(MathUtils.clamp(direction.z, -1, 1)), -most, most);
    if (animate && !this.reducedMotion) {
      const near = this.azimuth + MathUtils.euclideanModulo(azimuth - this.azimuth + Math.PI, 2 * Math.PI) - Math.PI;
      this.turn = {
        from: [this.azimuth, this.elevation, this.distance, this.target.clone()],
        to: [near, elevation, distance, centre.clone()],
        since: null,
      };
    } else {
      this.turn = null;
      [this.azimuth, this.elevation, this.distance] = [azimuth, elevation, distance];
      this.target.copy(centre);
    }
    this.place();
  }

  private distanceFor(box: Box3, centre: Vector3, direction: Vector3): number {
    // The corners of the box as seen: the nearest distance from which all are in the
    // picture, with a margin.
    const up = new Vector3(0, 0, 1);
    const right = new Vector3().crossVectors(up, direction).normalize();
    up.crossVectors(direction, right);
    const ty = Math.tan(MathUtils.degToRad(FIELD_OF_VIEW / 2)), tx = ty * this.camera.aspect;
    let distance = 0;
    for (let i = 0; i < 8; i++) {
      const p = new Vector3(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y, i & 4 ? box.max.z : box.min.z).sub(centre);
      const near = p.dot(direction);
      distance = Math.max(distance, near + Math.abs(p.dot(right)) / tx, near + Math.abs(p.dot(up)) / ty);
    }
    return 1.12 * distance;
  }

  /** The pose relative to a body with this middle; during a turn, the pose at its end. */
  pose(middle: Vector3): CameraPose {
    const [azimuth, elevation, distance, target] = this.turn?.to ?? [this.azimuth, this.elevation, this.distance, this.target];
    const from = target.clone().sub(middle).divideScalar(this.radius);
    return { azimuth, elevation, distance: distance / this.fitted, target: from.toArray() };
  }

  setPose({ azimuth, elevation, distance, target }: CameraPose, middle: Vector3): void {
    this.turn = null;
    this.azimuth = azimuth;
    this.elevation = MathUtils.clamp(elevation, -Math.PI / 2 + 0.002, Math.PI / 2 - 0.002);
    this.distance = this.fitted * MathUtils.clamp(distance, 0.08, 3);
    this.target.fromArray(target).clampScalar(-3, 3).multiplyScalar(this.radius).add(middle);
    this.place();
  }

  /** Rotates by a drag of so many pixels in a picture `height` pixels high. */
  orbit(dx: number, dy: number, height: number): void {
    this.turn = null;
    this.azimuth -= (dx / height) * Math.PI * 1.1;
    this.elevation = MathUtils.clamp(this.elevation + (dy / height) * Math.PI * 1.1, -Math.PI / 2 + 0.002, Math.PI / 2 - 0.002);
    this.place();
  }

  pan(dx: number, dy: number, height: number): void {
    this.turn = null;
    const scale = this.metresPerPixel(height);
    const { right, up } = this.axes();
    this.target.addScaledVector(right, -dx * scale).addScaledVector(up, dy * scale);
    this.place();
  }

  zoom(factor: number): void {
    this.turn = null;
    this.distance = MathUtils.clamp(this.distance * factor, 0.08 * this.fitted, 3 * this.fitted);
    this.place();
  }

  /** Size of a pixel at the target, m. */
  metresPerPixel(height: number): number {
    return (2 * this.distance * Math.tan(MathUtils.degToRad(FIELD_OF_VIEW / 2))) / height;
  }

  /** Directions to the right, up and into the picture. */
  axes(): { right: Vector3; up: Vector3; forward: Vector3 } {
    const right = new Vector3(), up = new Vector3(), forward = new Vector3();
    this.camera.matrixWorld.extractBasis(right, up, forward);
    return { right, up, forward: forward.negate() };
  }

  resize(aspect: number): void {
    this.camera.aspect = aspect;
    this.place();
  }

  get isTurning(): boolean {
    return this.turn !== null;
  }

  /** Continues an animated turn; `now` in ms. */
  step(now: number): void {
    if (!this.turn) return;
    const { from, to } = this.turn;
    const since = (this.turn.since ??= now);
    const t = Math.min(1, (now - since) / TURN_MS);
    const s = t * t * (3 - 2 * t);
    this.azimuth = MathUtils.lerp(from[0], to[0], s);
    this.elevation = MathUtils.lerp(from[1], to[1], s);
    this.distance = MathUtils.lerp(from[2], to[2], s);
    this.target.lerpVectors(from[3], to[3], s);
    if (t === 1) this.turn = null;
    this.place();
  }

  private place(): void {
    const c = Math.cos(this.elevation);
    const { camera } = this;
    camera.position.set(c * Math.cos(this.azimuth), c * Math.sin(this.azimuth), Math.sin(this.elevation)).multiplyScalar(this.distance).add(this.target);
    camera.near = Math.max(this.distance - 4 * this.radius, 0.02 * this.distance);
    camera.far = this.distance + 6 * this.radius;
    camera.lookAt(this.target);
    camera.updateMatrixWorld();
    camera.updateProjectionMatrix();
    this.onChange();
  }
}
