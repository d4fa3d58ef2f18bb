// The tool, the operated point at its tip, and the arrow of the force beside it.

import {
  BufferGeometry, CanvasTexture, ConeGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, MeshMatcapMaterial,
  SphereGeometry, SRGBColorSpace, Vector3,
} from 'three';
import type { ContactShape } from '../generated/api';
import type { FrameSnapshot } from '../generated/wire';
import { reachOf, toolGeometry } from './toolshapes';

/** Colours of the thesis's program. */
const OPERATED_POINT = 0x00c8d7;
const FORCE = 0xe5252a;
/** Forces below this are noise and have no arrow, N. */
const LEAST_FORCE = 0.01;
const UP = new Vector3(0, 1, 0);
/** How much of the tool is seen: in the air, and in contact, where it would hide the dent. */
const OPACITY = 0.62;
const OPACITY_IN_CONTACT = 0.24;
/** From the tool's axis to the arrow, in reaches of the tool. */
const BESIDE = 1.35;

export class ToolView {
  readonly group = new Group();
  private readonly tool: Mesh<BufferGeometry, MeshMatcapMaterial>;
  private readonly point: Mesh<SphereGeometry, MeshBasicMaterial>;
  private readonly shaft: Mesh<CylinderGeometry, MeshBasicMaterial>;
  private readonly head: Mesh<ConeGeometry, MeshBasicMaterial>;
  private readonly arrow = new Group();
  private form = '';
  /** Length of the arrow at the device's largest force, m. */
  private longest = 0.1;
  private maxForce = 10;
  private readonly force = new Vector3();
  private readonly tip = new Vector3();
  private isNode = false;
  /** From the tool's axis to its side, m. */
  private reach = 0;

  constructor() {
    this.tool = new Mesh(new BufferGeometry(), new MeshMatcapMaterial({ matcap: metal(), transparent: true, opacity: OPACITY }));
    this.tool.renderOrder = 8;
    this.tool.castShadow = true;
    this.tool.frustumCulled = false;
    const over = (color: number) => new MeshBasicMaterial({ color, depthTest: false, depthWrite: false, transparent: true, toneMapped: false });
    this.point = new Mesh(new SphereGeometry(1, 24, 16), over(OPERATED_POINT));
    this.point.renderOrder = 12;
    this.shaft = new Mesh(new CylinderGeometry(1, 1, 1, 16).translate(0, 0.5, 0), over(FORCE));
    this.head = new Mesh(new ConeGeometry(1, 1, 20).translate(0, 0.5, 0), over(FORCE));
    this.shaft.renderOrder = this.head.renderOrder = 11;
    this.arrow.add(this.shaft, this.head);
    this.group.add(this.tool, this.point, this.arrow);
    this.group.visible = false;
  }

  /** Shape of the tool, null for a single node, and scale of the arrow: the device's largest force,
   * N, and the body's radius, m. */
  set(form: ContactShape | null, maxForce: number, bodyRadius: number): void {
    this.maxForce = maxForce > 0 ? maxForce : 10;
    this.longest = 0.85 * bodyRadius;
    this.isNode = form === null;
    this.reach = form === null ? 0 : reachOf(form);
    const key = JSON.stringify([form, bodyRadius.toFixed(3)]);
    if (key === this.form) return;
    this.form = key;
    this.tool.geometry.dispose();
    this.tool.geometry = form === null ? new BufferGeometry() : toolGeometry(form, 0.55 * bodyRadius);
  }

  place(frame: FrameSnapshot): void {
    this.group.visible = true;
    this.tool.position.fromArray(frame.tool);
    this.tool.quaternion.fromArray(frame.orientation);
    this.point.position.fromArray(frame.tool);
    this.tip.fromArray(frame.tool);
    this.force.fromArray(frame.force);
    this.tool.material.opacity = frame.n_active > 0 ? OPACITY_IN_CONTACT : OPACITY;
  }

  options(tool: boolean, force: boolean): void {
    this.tool.visible = tool && !this.isNode;
    this.arrow.visible = force && this.force.length() > LEAST_FORCE;
  }

  /** Gives point and arrow the same size on the screen at any distance; `pixel` is
   * a pixel's size, m, and `right` the direction to the right in the picture. Returns the end of the arrow
   * and the force; null without an arrow. */
  scale(pixel: number, right: Vector3): { at: Vector3; force: number } | null {
    this.point.scale.setScalar(pixel * (this.isNode ? 7 : 5));
    const force = this.force.length();
    if (!this.arrow.visible || force <= LEAST_FORCE) return null;
    // Beside the tool, which would hide it.
    this.arrow.position.copy(this.tip).addScaledVector(right, BESIDE * this.reach + (this.isNode ? 0 : 6 * pixel));
    const head = pixel * 13;
    const length = Math.max((force / this.maxForce) * this.longest, 1.25 * head);
    this.arrow.quaternion.setFromUnitVectors(UP, this.force.clone().divideScalar(force));
    this.shaft.scale.set(pixel * 1.8, length - 0.8 * head, pixel * 1.8);
    this.head.position.y = length - head;
    this.head.scale.set(0.38 * head, head, 0.38 * head);
    return { at: this.arrow.position.clone().addScaledVector(this.force, length / force), force };
  }

  dispose(): void {
    for (const mesh of [this.tool, this.point, this.shaft, this.head]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    this.tool.material.matcap?.dispose();
  }
}

/** Brushed steel, as a matcap: the picture of a lit ball of it. */
function metal(): CanvasTexture {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 128;
  const g = canvas.getContext('2d')!;
  const sky = g.createLinearGradient(0, 0, 0, 128);
  for (const [at, colour] of [[0, '#f7fafc'], [0.3, '#b4bfc8'], [0.48, '#6d7a86'], [0.55, '#4b5864'], [0.75, '#7f8b95'], [1, '#39444e']] as const) sky.addColorStop(at, colour);
  g.fillStyle = sky;
  g.fillRect(0, 0, 128, 128);
  const lamp = g.createRadialGradient(44, 34, 2, 44, 34, 42);
  lamp.addColorStop(0, 'rgba(255,255,255,0.95)');
  lamp.addColorStop(1, 'rgba(255,255,255,0)');
  g.fillStyle = lamp;
  g.fillRect(0, 0, 128, 128);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  return texture;
}
