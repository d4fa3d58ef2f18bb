// Draws the section: polygons of tissue, lines between layers, filled core and bones.

import { BufferAttribute, BufferGeometry, Color, DoubleSide, DynamicDrawUsage, Group, Mesh, MeshBasicMaterial, Sphere, Vector3, type IUniform, type Vector2 } from 'three';
import type { Body } from './body';
import { contourLoops, fillLoops, type CutPlane } from './contour';
import { Lines } from './lines';
import { SectionMaterial, type SharedUniforms } from './materials';
import { Section } from './section';

/** The core between bones is seen if it is larger than they are by this factor. */
const CORE_SEEN = 1.05;

export class SectionView {
  readonly group = new Group();
  readonly section = new Section();
  readonly material: SectionMaterial;
  private readonly tissue: Mesh<BufferGeometry, SectionMaterial>;
  private readonly core: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly bone: Mesh<BufferGeometry, MeshBasicMaterial>;
  readonly outline = new Lines(1.3);
  readonly wire = new Lines(1);
  private readonly boneLine = new Lines(1.1);
  private capacity = 0;
  private filledFor = '';
  private isCoreSeen = false;
  /** Whether the core between bones is seen in the section. */
  hasCore = false;

  constructor(shared: SharedUniforms) {
    this.material = new SectionMaterial(shared);
    this.tissue = new Mesh(new BufferGeometry(), this.material);
    const flat = (pull: number) =>
      new Mesh(new BufferGeometry(), new MeshBasicMaterial({ side: DoubleSide, toneMapped: false, polygonOffset: true, polygonOffsetFactor: pull, polygonOffsetUnits: pull }));
    this.core = flat(0);
    this.bone = flat(-1);
    this.tissue.renderOrder = 1;
    this.wire.renderOrder = 3;
    this.boneLine.renderOrder = 3.5;
    this.outline.renderOrder = 4;
    for (const mesh of [this.tissue, this.core, this.bone]) mesh.frustumCulled = false;
    this.group.add(this.tissue, this.core, this.bone, this.wire, this.boneLine, this.outline);
  }

  /** Hands the cut in `section` to the GPU. */
  update(body: Body, plane: CutPlane, bones: boolean): void {
    const { section } = this;
    const n = section.layers.length;
    let geometry = this.tissue.geometry;
    if (section.layers.data.length > this.capacity || section.indices.data.length !== geometry.index?.array.length) {
      geometry.dispose();
      geometry = this.tissue.geometry = new BufferGeometry();
      this.capacity = section.layers.data.length;
    }
    const put = (name: string, data: Float32Array, size: number, count: number) => {
      let attribute = geometry.getAttribute(name) as BufferAttribute | undefined;
      if (attribute?.array !== data) {
        if (attribute) geometry = this.renew(geometry);
        attribute = new BufferAttribute(data, size);
        attribute.setUsage(DynamicDrawUsage);
        geometry.setAttribute(name, attribute);
      }
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, count * size);
      attribute.needsUpdate = true;
    };
    put('position', section.positions.data, 3, n);
    put('rest', section.rest.data, 3, n);
    put('value', section.values.data, 1, n);
    put('layer', section.layers.data, 1, n);
    if (geometry.index?.array !== section.indices.data) {
      const index = new BufferAttribute(section.indices.data, 1);
      index.setUsage(DynamicDrawUsage);
      geometry.setIndex(index);
    }
    geometry.index!.clearUpdateRanges();
    geometry.index!.addUpdateRange(0, section.indices.length);
    geometry.index!.needsUpdate = true;
    geometry.setDrawRange(0, section.indices.length);
    geometry.boundingSphere ??= new Sphere(body.centre, body.radius);
    this.outline.show(section.outline.data, section.outline.length);
    this.wire.show(section.wire.data, section.wire.length);

    // Core and bones do not move: they are filled again only after a change of plane or mesh.
    const key = `${body.id} ${plane.normal.join()} ${plane.offset}`;
    if (key !== this.filledFor) {
      this.filledFor = key;
      const core = fillLoops(contourLoops(body.rest, body.coreTriangles, plane), plane);
      fill(this.core, core);
      const loops = contourLoops(body.bonePositions, body.boneTriangles, plane);
      const bone = fillLoops(loops, plane);
      fill(this.bone, bone);
      this.isCoreSeen = areaOf(core) > CORE_SEEN * areaOf(bone);
      const lines = loops.flatMap((loop) => loop.flatMap((_, i) => (i % 3 === 0 ? [...loop.slice(i, i + 3), ...at(loop, i + 3)] : [])));
      this.boneLine.show(Float32Array.from(lines), lines.length);
    }
    this.core.visible = bones;
    this.hasCore = bones && this.isCoreSeen;
    this.bone.visible = this.boneLine.visible = bones && body.boneTriangles.length > 0;
  }

  /** The same attributes in a new geometry; frees the GPU memory of the old one. */
  private renew(geometry: BufferGeometry): BufferGeometry {
    geometry.dispose();
    const next = new BufferGeometry();
    for (const [name, attribute] of Object.entries(geometry.attributes)) next.setAttribute(name, attribute);
    next.setIndex(geometry.index);
    this.tissue.geometry = next;
    return next;
  }

  colours(core: string, bone: string, outline: string, wire: string, wireOpacity: number, isWired: boolean): void {
    (this.core.material.color as Color).set(core);
    (this.bone.material.color as Color).set(bone);
    this.outline.style(outline, outline === '#ffffff' ? 0.6 : 0.8);
    this.boneLine.style(outline, 0.6);
    this.wire.style(wire, isWired ? wireOpacity : 0);
    this.wire.material.visible = isWired;
  }

  /** Size of the picture, px, for the width of lines. */
  set size(size: Vector2) {
    for (const lines of [this.outline, this.wire, this.boneLine]) (lines.material.uniforms.size as IUniform<Vector2>).value.copy(size);
  }

  dispose(): void {
    for (const mesh of [this.tissue, this.core, this.bone]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    for (const lines of [this.outline, this.wire, this.boneLine]) lines.dispose();
    this.group.removeFromParent();
  }
}

function fill(mesh: Mesh<BufferGeometry, MeshBasicMaterial>, positions: number[]): void {
  mesh.geometry.dispose();
  mesh.geometry = new BufferGeometry();
  mesh.geometry.setAttribute('position', new BufferAttribute(Float32Array.from(positions), 3));
}

/** Area of triangles in a plane, m². */
function areaOf(positions: number[]): number {
  let sum = 0;
  const [a, b, c] = [new Vector3(), new Vector3(), new Vector3()];
  for (let i = 0; i + 8 < positions.length; i += 9) {
    a.fromArray(positions, i);
    b.fromArray(positions, i + 3).sub(a);
    c.fromArray(positions, i + 6).sub(a);
    sum += 0.5 * b.cross(c).length();
  }
  return sum;
}

/** A point of a closed loop. */
function at(loop: number[], i: number): number[] {
  const k = i % loop.length;
  return loop.slice(k, k + 3);
}
