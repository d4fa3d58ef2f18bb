// A game on the skin: numbered pins for marks, dots coloured by the force pressed there, and in its result the paths from
// marks to lumps, with a ring round each lump in which a mark counts as found.

import {
  BufferAttribute, BufferGeometry, CanvasTexture, Color, CylinderGeometry, Group, Mesh, MeshBasicMaterial, Points, ShaderMaterial, SphereGeometry, Sprite,
  SpriteMaterial, SRGBColorSpace, Vector3, type Vector2,
} from 'three';
import type { FoundLump, GameInfo } from '../generated/api';
import type { Body } from './body';
import { Lines } from './lines';
import type { Vec3 } from './options';
import { nearestOnSkin } from './picking';

const PIN = '#e08a1e';
const FOUND = '#1b9e4b';
const MISSED = '#d42f2f';
/** Corners of a ring, and by how much lines lie above the skin, m. */
const RING = 48;
const ABOVE = 4e-4;
const UP = new Vector3(0, 1, 0);

const DOTS_VERTEX = /* glsl */ `
attribute float force;
uniform float pixelsPerMetre;
varying float vForce;
void main() {
  vForce = force;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  gl_Position.z -= 3e-3 * gl_Position.w;
  gl_PointSize = max(5.0, 0.0055 * pixelsPerMetre);
}
`;
const DOTS_FRAGMENT = /* glsl */ `
varying float vForce;
void main() {
  float r = length(gl_PointCoord - 0.5) * 2.0;
  float alpha = (1.0 - smoothstep(0.55, 1.0, r)) * 0.75;
  if (alpha < 0.01) discard;
  vec3 c = mix(vec3(0.99, 0.83, 0.30), vec3(0.56, 0.09, 0.28), vForce);
  gl_FragColor = vec4(c * c, alpha);
  #include <colorspace_fragment>
}
`;

interface Anchor {
  object: Group;
  triangle: number;
  shares: Vec3;
}

export class MarksView {
  readonly group = new Group();
  private readonly stemGeometry = new CylinderGeometry(1, 0.4, 1, 12).translate(0, 0.5, 0);
  private readonly headGeometry = new SphereGeometry(1, 24, 16);
  private readonly material = new MeshBasicMaterial({ color: PIN, toneMapped: false });
  private readonly labels: SpriteMaterial[] = [];
  private readonly dots: Points<BufferGeometry, ShaderMaterial>;
  private pins: Anchor[] = [];
  /** Each line twice: on the skin, and faint through the body. */
  private readonly lines = { path: [new Lines(3), new Lines(3)], found: [new Lines(2.2), new Lines(2.2)], missed: [new Lines(2.2), new Lines(2.2)] };
  private key = '';

  constructor() {
    this.dots = new Points(new BufferGeometry(), new ShaderMaterial({
      vertexShader: DOTS_VERTEX, fragmentShader: DOTS_FRAGMENT, uniforms: { pixelsPerMetre: { value: 1000 } }, transparent: true, depthWrite: false,
    }));
    this.dots.frustumCulled = false;
    this.dots.renderOrder = 5;
    this.group.add(this.dots);
    this.dots.visible = false;
    for (const [name, pair] of Object.entries(this.lines)) {
      const colour = name === 'path' ? PIN : name === 'found' ? FOUND : MISSED;
      pair.forEach((lines, i) => {
        lines.style(colour, i === 0 ? 1 : 0.3);
        lines.material.depthTest = i === 0;
        lines.material.uniforms.pull.value = 2e-3;
        lines.renderOrder = 9 - i;
        lines.visible = false;
        this.group.add(lines);
      });
    }
  }

  set(game: GameInfo | null, body: Body, hasCoverage: boolean): void {
    const key = JSON.stringify([game?.marks, game?.result?.lumps, game?.result?.coverage.length, body.id, hasCoverage]);
    if (key === this.key) return;
    this.key = key;
    for (const { object } of this.pins) object.removeFromParent();
    this.pins = (game?.marks ?? []).map((mark, i) => {
      const { triangle, shares, normal } = nearestOnSkin(body, mark as Vec3);
      const object = this.pin(i);
      object.quaternion.setFromUnitVectors(UP, new Vector3(...normal));
      this.group.add(object);
      return { object, triangle, shares };
    });
    this.draw(game?.result?.lumps ?? [], body);
    const coverage = hasCoverage ? (game?.result?.coverage ?? []) : [];
    this.dots.visible = coverage.length > 0;
    if (coverage.length === 0) return;
    const most = coverage.reduce((a, c) => Math.max(a, c[3]), 1e-9);
    this.dots.geometry.dispose();
    this.dots.geometry = new BufferGeometry();
    this.dots.geometry.setAttribute('position', new BufferAttribute(Float32Array.from(coverage.flatMap((c) => c.slice(0, 3))), 3));
    this.dots.geometry.setAttribute('force', new BufferAttribute(Float32Array.from(coverage, (c) => c[3] / most), 1));
  }

  private draw(lumps: readonly FoundLump[], body: Body): void {
    const paths: number[] = [], rings = { found: [] as number[], missed: [] as number[] };
    for (const lump of lumps) {
      join(lump.path.map((p) => lifted(body, p as Vec3)), paths);
      join(ring(body, lump), lump.is_found ? rings.found : rings.missed);
    }
    const show = (pair: Lines[], segments: number[]) => pair.forEach((lines) => lines.show(Float32Array.from(segments), segments.length));
    show(this.lines.path, paths);
    show(this.lines.found, rings.found);
    show(this.lines.missed, rings.missed);
  }

  private pin(i: number): Group {
    const pin = new Group();
    const stem = new Mesh(this.stemGeometry, this.material);
    const head = new Mesh(this.headGeometry, this.material);
    head.position.y = 1;
    const label = new Sprite(this.label(i));
    label.position.y = 1;
    label.renderOrder = 13;
    pin.add(stem, head, label);
    return pin;
  }

  private label(i: number): SpriteMaterial {
    if (this.labels[i]) return this.labels[i];
    const canvas = document.createElement('canvas');
    canvas.width = canvas.height = 64;
    const g = canvas.getContext('2d')!;
    g.fillStyle = PIN;
    g.beginPath();
    g.arc(32, 32, 30, 0, 2 * Math.PI);
    g.fill();
    g.lineWidth = 4;
    g.strokeStyle = '#fff';
    g.stroke();
    g.fillStyle = new Color('#fff').getStyle();
    g.font = '700 36px system-ui, sans-serif';
    g.textAlign = 'center';
    g.textBaseline = 'middle';
    g.fillText(String(i + 1), 32, 34);
    const map = new CanvasTexture(canvas);
    map.colorSpace = SRGBColorSpace;
    return (this.labels[i] = new SpriteMaterial({ map, depthTest: false, depthWrite: false, toneMapped: false }));
  }

  /** The skin has moved. */
  update(body: Body): void {
    for (const { object, triangle, shares } of this.pins) {
      object.position.set(0, 0, 0);
      for (let k = 0; k < 3; k++) {
        const at = 3 * body.triangles[triangle + k] * body.nLevels;
        object.position.x += shares[k] * body.positions[at];
        object.position.y += shares[k] * body.positions[at + 1];
        object.position.z += shares[k] * body.positions[at + 2];
      }
    }
  }

  /** Keeps the size on the screen at any distance; `pixel` is a pixel's size, m, and `size` that of the picture in pixels. */
  scale(pixel: number, size: Vector2): void {
    for (const lines of Object.values(this.lines).flat()) (lines.material.uniforms.size.value as Vector2).copy(size);
    for (const { object } of this.pins) {
      const [stem, head, label] = object.children;
      const height = 26 * pixel;
      stem.scale.set(1.6 * pixel, height, 1.6 * pixel);
      head.position.y = label.position.y = height;
      head.scale.setScalar(7 * pixel);
      label.scale.setScalar(21 * pixel);
    }
    this.dots.material.uniforms.pixelsPerMetre.value = 1 / pixel;
  }

  dispose(): void {
    this.stemGeometry.dispose();
    this.headGeometry.dispose();
    this.material.dispose();
    for (const label of this.labels) {
      label.map?.dispose();
      label.dispose();
    }
    for (const lines of Object.values(this.lines).flat()) lines.dispose();
    this.dots.geometry.dispose();
    this.dots.material.dispose();
  }
}

/** A point of the skin at rest, a little above it. */
function lifted(body: Body, p: Vec3): Vec3 {
  const { point, normal } = nearestOnSkin(body, p);
  return [0, 1, 2].map((c) => point[c] + ABOVE * normal[c]) as Vec3;
}

/** The ring on the skin within which a mark finds a lump. */
function ring(body: Body, { over, normal, tolerance }: FoundLump): Vec3[] {
  const n = new Vector3(...(normal as Vec3));
  const u = new Vector3(Math.abs(n.x) < 0.8 ? 1 : 0, Math.abs(n.x) < 0.8 ? 0 : 1, 0).cross(n).normalize();
  const v = n.clone().cross(u);
  return Array.from({ length: RING + 1 }, (_, i) => {
    const angle = (2 * Math.PI * i) / RING;
    const at = new Vector3(...(over as Vec3)).addScaledVector(u, tolerance * Math.cos(angle)).addScaledVector(v, tolerance * Math.sin(angle));
    return lifted(body, at.toArray() as Vec3);
  });
}

/** Appends the segments of a line. */
function join(points: Vec3[], out: number[]): void {
  for (let i = 0; i + 1 < points.length; i++) out.push(...points[i], ...points[i + 1]);
}
