// Lines of a given width in pixels.

import { BufferAttribute, Color, DynamicDrawUsage, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, ShaderMaterial, Vector2 } from 'three';

const VERTEX = /* glsl */ `
attribute vec3 a;
attribute vec3 b;
uniform vec2 size;
uniform float width;
uniform float pull;
void main() {
  vec4 p = projectionMatrix * modelViewMatrix * vec4(a, 1.0);
  vec4 q = projectionMatrix * modelViewMatrix * vec4(b, 1.0);
  vec2 along = (q.xy / q.w - p.xy / p.w) * size;
  along = length(along) < 1e-6 ? vec2(1.0, 0.0) : normalize(along);
  vec2 across = vec2(-along.y, along.x);
  vec4 end = position.x < 0.5 ? p : q;
  // Ends reach out by half the width, so that corners close.
  vec2 offset = (across * position.y + along * (position.x * 2.0 - 1.0) * 0.35) * width / size;
  gl_Position = end + vec4(offset * end.w, -pull * end.w, 0.0);
}
`;
const FRAGMENT = /* glsl */ `
uniform vec3 colour;
uniform float opacity;
void main() {
  gl_FragColor = vec4(colour, opacity);
  #include <colorspace_fragment>
}
`;

export class Lines extends Mesh<InstancedBufferGeometry, ShaderMaterial> {
  private capacity = 0;
  private ends: InstancedBufferAttribute[] = [];

  constructor(width: number) {
    super(
      new InstancedBufferGeometry(),
      new ShaderMaterial({
        vertexShader: VERTEX,
        fragmentShader: FRAGMENT,
        uniforms: {
          size: { value: new Vector2(1, 1) },
          width: { value: width },
          pull: { value: 2e-4 },
          colour: { value: new Color() },
          opacity: { value: 1 },
        },
        transparent: true,
        depthWrite: false,
      }),
    );
    this.geometry.setAttribute('position', new BufferAttribute(new Float32Array([0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0]), 3));
    this.geometry.setIndex([0, 1, 2, 0, 2, 3]);
    this.geometry.instanceCount = 0;
    this.frustumCulled = false;
  }

  /** Segments: both ends, x, y, z each. */
  show(segments: Float32Array, length: number): void {
    const n = length / 6;
    if (n > this.capacity) {
      // A new buffer needs a new geometry, and the old one is freed.
      const position = this.geometry.getAttribute('position'), index = this.geometry.index;
      this.geometry.dispose();
      this.geometry = new InstancedBufferGeometry();
      this.geometry.setAttribute('position', position);
      this.geometry.setIndex(index);
      this.capacity = Math.max(512, Math.ceil(1.5 * n));
      this.ends = [new Float32Array(3 * this.capacity), new Float32Array(3 * this.capacity)].map((data) => {
        const attribute = new InstancedBufferAttribute(data, 3);
        attribute.setUsage(DynamicDrawUsage);
        return attribute;
      });
      this.geometry.setAttribute('a', this.ends[0]);
      this.geometry.setAttribute('b', this.ends[1]);
    }
    if (n > 0) {
      const a = this.ends[0].array, b = this.ends[1].array;
      for (let i = 0; i < n; i++) {
        for (let c = 0; c < 3; c++) {
          a[3 * i + c] = segments[6 * i + c];
          b[3 * i + c] = segments[6 * i + 3 + c];
        }
      }
      for (const attribute of this.ends) {
        attribute.clearUpdateRanges();
        attribute.addUpdateRange(0, 3 * n);
        attribute.needsUpdate = true;
      }
    }
    this.geometry.instanceCount = n;
    this.visible = n > 0;
  }

  style(colour: string, opacity: number, width?: number): void {
    (this.material.uniforms.colour.value as Color).set(colour);
    this.material.uniforms.opacity.value = opacity;
    if (width !== undefined) this.material.uniforms.width.value = width;
  }

  override dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
  }
}
