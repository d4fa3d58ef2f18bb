// The cutaway as it is drawn: the clipped body, the section that closes it, the frame of the
// plane and its grip.

import { Plane, Vector3, type Vector2 } from 'three';
import type { LumpInfo } from '../generated/api';
import type { Body } from './body';
import { clippingPlane, cutOf, type Cut } from './cutaway';
import { Lines } from './lines';
import { lumpArea } from './lumps';
import type { SharedUniforms } from './materials';
import type { SectionArea, ViewOptions } from './options';
import { PlaneGrip } from './overlay';
import type { CameraRig } from './rig';
import type { SectionValues } from './section';
import { SectionView } from './sectionview';
import type { Stage } from './stage';

/** Room between the grip and the edges of the picture, px. */
const GRIP_MARGIN = 24;

/** What a section shows. */
interface Slice {
  cutaway: ViewOptions['cutaway'];
  values: SectionValues;
  /** Which layers are visible, from the skin down. */
  layers: boolean[];
  bones: boolean;
  lumps: LumpInfo[];
  /** Where the tool is, and its axis; null before the first frame. */
  tool: { tip: Vector3; axis: Vector3 } | null;
}

export class CutawayView {
  onArea: (area: SectionArea | null) => void = () => {};
  /** For all materials that are cut; empty while nothing is. */
  readonly planes: Plane[] = [];
  readonly section: SectionView;
  readonly grip: PlaneGrip;
  /** Whether a user moves the plane, which otherwise follows the tool. Set at once, not with the next picture: a press may
   * come before it. */
  isMovable = true;
  private readonly clip = new Plane();
  private readonly frame = new Lines(1.2);
  private cut: Cut | null = null;
  private areaKey = '';
  /** Areas of the section; null while nothing is cut. */
  area: SectionArea | null = null;

  constructor(shared: SharedUniforms, stage: Stage, private readonly rig: CameraRig, onMove: (position: number) => void) {
    this.section = new SectionView(shared);
    this.grip = new PlaneGrip(onMove);
    this.frame.renderOrder = 9;
    this.section.group.visible = this.frame.visible = false;
    stage.scene.add(this.section.group, this.frame);
  }

  /** The plane of the section; null when nothing is cut. */
  get plane(): Cut['plane'] | null {
    return this.cut?.plane ?? null;
  }

  /** Whether a point is on the side of the plane that stays. A plane that follows the tool goes to where the tool
   * presses, so nothing counts as cut away. */
  isKept(): (p: Vector3) => boolean {
    const { plane } = this;
    if (!plane || !this.isMovable) return () => true;
    const [x, y, z] = plane.normal;
    return (p) => x * p.x + y * p.y + z * p.z >= plane.offset;
  }

  set frameColour(colour: string) {
    this.frame.style(colour, 0.55);
  }

  /** Cuts the body as it lies now. */
  slice(body: Body, { cutaway, values, layers, bones, lumps, tool }: Slice): void {
    this.section.group.visible = this.frame.visible = cutaway.on;
    if (!cutaway.on) {
      this.cut = null;
      this.planes.length = 0;
      if (this.areaKey !== '') this.onArea(null);
      this.area = null;
      this.areaKey = '';
      return;
    }
    this.cut = cutOf(cutaway, body.box, this.rig.axes().forward, tool);
    const { plane, corners } = this.cut;
    clippingPlane(plane, this.clip);
    if (this.planes.length === 0) this.planes.push(this.clip);
    const { section } = this.section;
    section.cut(body, plane, values, layers);
    this.section.update(body, plane, bones);
    this.frame.show(Float32Array.from(corners.flatMap((c, i) => [...c.toArray(), ...corners[(i + 1) % 4].toArray()])), 24);
    this.report({ total: section.area.reduce((a, b) => a + b, 0), layers: section.area.slice(), lumps: lumpArea(section, lumps) });
  }

  private report(area: SectionArea): void {
    const key = JSON.stringify(area);
    if (key === this.areaKey) return;
    this.areaKey = key;
    this.area = area;
    this.onArea(area);
  }

  /** Size of the picture, px, for the width of lines. */
  set size(size: Vector2) {
    this.section.size = size;
    this.frame.material.uniforms.size.value.copy(size);
  }

  /** Puts the grip at the middle of the frame's side that is farthest up and to the right. */
  placeGrip(size: Vector2, position: number): void {
    const { cut, grip } = this;
    const { element } = grip;
    const isHidden = !cut || !this.isMovable;
    if (element.hidden !== isHidden) element.hidden = isHidden;
    if (!cut || isHidden) return;
    const toScreen = (p: Vector3) => {
      const q = p.clone().project(this.rig.camera);
      return { x: (0.5 + 0.5 * q.x) * size.x, y: (0.5 - 0.5 * q.y) * size.y };
    };
    const places = cut.middles.map((p) => ({ p, at: toScreen(p) }));
    const best = places.reduce((a, b) => (b.at.x * 0.8 - b.at.y > a.at.x * 0.8 - a.at.y ? b : a));
    const ahead = toScreen(best.p.clone().addScaledVector(cut.way, 0.05));
    const inside = (x: number, most: number) => Math.min(Math.max(x, GRIP_MARGIN), most - GRIP_MARGIN);
    grip.update(
      inside(best.at.x, size.x), inside(best.at.y, size.y),
      (ahead.x - best.at.x) / 0.05, (ahead.y - best.at.y) / 0.05,
      position,
    );
  }

  dispose(): void {
    this.section.dispose();
    this.frame.dispose();
  }
}
