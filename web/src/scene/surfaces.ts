// The surfaces of a body: where each layer begins and ends, the walls at open rims,
// the core, the bones.

import { BackSide, BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, Group, LineBasicMaterial, LineSegments, Mesh, Sphere, type Plane } from 'three';
import { wallTriangles, type Body } from './body';
import { SurfaceMaterial, type SharedUniforms, type SurfaceLook } from './materials';
import { SKIN, SKIN_IN_LIGHT } from './palette';
import type { Stage } from './stage';

export interface LayerLook {
  colour: string;
  opacity: number;
  visible: boolean;
}

interface SurfacesLook {
  layers: LayerLook[];
  isMapped: boolean;
  /** Whether skin is shaded as skin, not in the plain colour of a legend. */
  isTissue: boolean;
  bones: boolean;
  core: string;
  bone: string;
  wire: { on: boolean; colour: string; opacity: number };
}

/** Materials by the part they belong to. They outlive meshes, because compiling one takes much
 * longer than a new mesh. */
export type Materials = Map<string, SurfaceMaterial>;

export class Surfaces {
  readonly group = new Group();
  private readonly position: BufferAttribute;
  private readonly normal: BufferAttribute;
  private readonly rest: BufferAttribute;
  readonly value: BufferAttribute;
  private readonly geometries: BufferGeometry[] = [];
  private readonly outer: Mesh<BufferGeometry, SurfaceMaterial>[] = [];
  private readonly inner: Mesh<BufferGeometry, SurfaceMaterial>[] = [];
  private readonly walls: Mesh<BufferGeometry, SurfaceMaterial>[] = [];
  private readonly core: Mesh<BufferGeometry, SurfaceMaterial>;
  private readonly bones: Mesh<BufferGeometry, SurfaceMaterial> | null = null;
  private readonly wire: LineSegments<BufferGeometry, LineBasicMaterial>;
  private levels: number[] = [0];

  constructor(
    private readonly body: Body,
    private readonly shared: SharedUniforms,
    private readonly stage: Stage,
    private readonly planes: Plane[],
    private readonly materials: Materials,
  ) {
    const dynamic = (data: Float32Array, size: number) => {
      const attribute = new BufferAttribute(data, size);
      attribute.setUsage(DynamicDrawUsage);
      return attribute;
    };
    this.position = dynamic(body.positions, 3);
    this.normal = dynamic(body.normals, 3);
    this.rest = new BufferAttribute(body.rest, 3);
    this.value = dynamic(new Float32Array(body.nNodes), 1);

    const { layerStart, nLevels, triangles } = body;
    for (let layer = 0; layer < layerStart.length; layer++) {
      const from = layerStart[layer], to = layerStart[layer + 1] ?? nLevels - 1;
      this.outer.push(this.mesh(`outer ${layer}`, triangles.map((v) => v * nLevels + from)));
      this.inner.push(this.mesh(`inner ${layer}`, triangles.map((v) => v * nLevels + to)));
      this.walls.push(this.mesh(`walls ${layer}`, wallTriangles(body, from, to)));
    }
    this.core = this.mesh('core', body.coreTriangles);
    if (body.boneTriangles.length > 0) this.bones = this.boneMesh();

    // Deeper parts are drawn later, so that hidden pixels are not shaded.
    this.walls.forEach((mesh) => (mesh.renderOrder = 0.1));
    this.core.renderOrder = 0.6;
    if (this.bones) this.bones.renderOrder = 0.5;
    // Where bones, core and tissue meet, the outer one is drawn.
    this.core.material.polygonOffsetFactor = 3;
    this.core.material.polygonOffsetUnits = 200;
    if (this.bones) {
      this.bones.material.polygonOffsetFactor = 2;
      this.bones.material.polygonOffsetUnits = 80;
    }

    const geometry = this.geometry(edgeNodes(body));
    this.wire = new LineSegments(geometry, new LineBasicMaterial({ transparent: true, depthWrite: false, clippingPlanes: planes }));
    this.wire.frustumCulled = false;
    this.wire.renderOrder = 6;
    this.group.add(this.wire);
  }

  private geometry(index: Uint32Array): BufferGeometry {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', this.position);
    geometry.setAttribute('normal', this.normal);
    geometry.setAttribute('rest', this.rest);
    geometry.setAttribute('value', this.value);
    geometry.setIndex(new BufferAttribute(index, 1));
    geometry.boundingSphere = new Sphere(this.body.centre, this.body.radius);
    this.geometries.push(geometry);
    return geometry;
  }

  private mesh(name: string, index: Uint32Array): Mesh<BufferGeometry, SurfaceMaterial> {
    return this.add(name, this.geometry(index));
  }

  private add(name: string, geometry: BufferGeometry): Mesh<BufferGeometry, SurfaceMaterial> {
    const material = this.materials.get(name) ?? new SurfaceMaterial(this.shared, this.stage.light, this.planes);
    this.materials.set(name, material);
    const mesh = new Mesh(geometry, material);
    mesh.frustumCulled = false;
    mesh.castShadow = mesh.receiveShadow = true;
    this.group.add(mesh);
    return mesh;
  }

  private boneMesh(): Mesh<BufferGeometry, SurfaceMaterial> {
    const geometry = new BufferGeometry();
    const position = new BufferAttribute(this.body.bonePositions, 3);
    geometry.setAttribute('position', position);
    geometry.setAttribute('rest', position);
    geometry.setAttribute('value', new BufferAttribute(new Float32Array(this.body.bonePositions.length / 3), 1));
    geometry.setIndex(new BufferAttribute(this.body.boneTriangles, 1));
    geometry.setAttribute('normal', new BufferAttribute(this.body.boneNormals, 3));
    this.geometries.push(geometry);
    return this.add('bones', geometry);
  }

  style({ layers, isMapped, isTissue, bones, core, bone, wire }: SurfacesLook): void {
    const n = this.outer.length;
    const isThrough = (k: number) => k < 0 || k >= n || !layers[k].visible || layers[k].opacity < 1;
    const levels = new Set<number>();
    for (let k = 0; k < n; k++) {
      const { colour, opacity, visible } = layers[k];
      const look: SurfaceLook = { colour: isTissue && colour === SKIN ? SKIN_IN_LIGHT : colour, opacity, isMapped, skin: isTissue ? (k === 0 ? 1 : 0.55) : 0 };
      // A side of a layer is drawn only if the layer next to it is transparent or hidden.
      this.outer[k].visible = visible && isThrough(k - 1);
      this.inner[k].visible = visible && opacity === 1 && k < n - 1 && isThrough(k + 1);
      this.walls[k].visible = visible;
      this.outer[k].material.look({ ...look, isSkin: k === 0 });
      this.inner[k].material.look({ ...look, side: BackSide });
      this.walls[k].material.look({ ...look, skin: look.skin * 0.5, isFlat: true, side: DoubleSide });
      // Transparent layers are drawn after the solid ones, from the inside out.
      this.outer[k].renderOrder = opacity < 1 ? 2 + 0.01 * (n - k) : 0;
      this.walls[k].renderOrder = opacity < 1 ? 2 + 0.01 * (n - k) : 0.1;
      this.outer[k].castShadow = this.walls[k].castShadow = opacity > 0.6;
      if (this.outer[k].visible) levels.add(this.body.layerStart[k]);
      if (this.inner[k].visible) levels.add(this.body.layerStart[k + 1]);
    }
    this.core.material.look({ colour: this.bones ? core : bone, opacity: 1, isMapped: false, skin: 0, isFlat: true, side: DoubleSide });
    this.core.visible = bones;
    // Under solid layers only the open ends of the core are visible.
    const isHidden = layers.every((layer) => layer.visible && layer.opacity === 1);
    this.core.geometry.setDrawRange(isHidden ? 3 * this.body.nCoreSides : 0, Infinity);
    if (this.bones) {
      this.bones.material.look({ colour: bone, opacity: 1, isMapped: false, skin: 0 });
      this.bones.visible = bones;
    }
    levels.add(0);
    this.levels = [...levels];
    this.wire.visible = wire.on && layers[0]?.visible !== false;
    this.wire.material.color.set(wire.colour);
    this.wire.material.opacity = wire.opacity;
    this.update();
  }

  /** The body has moved. */
  update(): void {
    this.body.updateNormals(this.levels);
    this.position.needsUpdate = true;
    this.normal.needsUpdate = true;
  }

  dispose(): void {
    for (const geometry of this.geometries) geometry.dispose();
    this.wire.material.dispose();
    this.group.removeFromParent();
  }
}

/** Outer edges of prisms: those of the skin and of the walls. */
function edgeNodes({ triangles, rimEdges, nLevels }: Body): Uint32Array {
  const out: number[] = [];
  for (let i = 0; i < triangles.length; i++) {
    const a = triangles[i], b = triangles[i % 3 === 2 ? i - 2 : i + 1];
    if (a < b) out.push(a * nLevels, b * nLevels);
  }
  for (let e = 0; e < rimEdges.length; e += 2) {
    const a = rimEdges[e] * nLevels, b = rimEdges[e + 1] * nLevels;
    if (a > b) out.push(a, b);
    for (let l = 1; l < nLevels; l++) out.push(a + l, b + l, a + l - 1, a + l);
  }
  return Uint32Array.from(out);
}
