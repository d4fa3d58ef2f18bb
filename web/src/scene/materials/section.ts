// The material of the section: layers with their grain, and lumps with their outline,
// finer than the mesh.

import { Color, DoubleSide, Matrix3, ShaderMaterial, Vector3, Vector4 } from 'three';
import type { LumpInfo } from '../../generated/api';
import { MAP, NOISE, type SharedUniforms } from './shared';

/** Layers and lumps that a section can tell apart; more are not drawn in it. */
const MAX_LAYERS = 12;
const MAX_LUMPS = 6;

const SECTION_VERTEX = /* glsl */ `
attribute vec3 rest;
attribute float value;
attribute float layer;
varying vec3 vRest;
varying float vValue;
varying float vLayer;
void main() {
  vRest = rest;
  vValue = value;
  vLayer = layer;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}
`;

const SECTION_FRAGMENT = /* glsl */ `
uniform vec3 layerColours[${MAX_LAYERS}];
uniform float layerOpacity[${MAX_LAYERS}];
uniform float layerGrain[${MAX_LAYERS}];
uniform float isMapped;
uniform float isPlain;
uniform float grain;
uniform int nLumps;
uniform vec3 lumpCentre[${MAX_LUMPS}];
uniform mat3 lumpAxes[${MAX_LUMPS}];
uniform vec4 lumpSize[${MAX_LUMPS}];
uniform vec3 lumpColour;
varying vec3 vRest;
varying float vValue;
varying float vLayer;
${NOISE}
${MAP}
// Signed distance to a lump's surface, exact near it; m.
float lumpDistance(int i) {
  vec3 p = (vRest - lumpCentre[i]) * lumpAxes[i];
  vec4 size = lumpSize[i];
  if (size.w < 0.0) {
    p.x -= clamp(p.x, -size.y, size.y);
    return length(p) - size.x;
  }
  float k = length(p / size.xyz);
  return k < 1e-6 ? -min(size.x, min(size.y, size.z)) : k * (k - 1.0) / length(p / (size.xyz * size.xyz));
}
void main() {
  int k = int(vLayer + 0.5);
  vec3 c = layerColours[k];
  if (isMapped > 0.5) {
    c = mapped(vValue);
  } else if (isPlain < 0.5 && grain > 0.5) {
    // The grain of tissue: fat in lobules, muscle in fibres along the limb.
    float kind = layerGrain[k];
    if (kind > 1.5) c *= 1.0 + 0.16 * (noise(vRest * vec3(220.0, 900.0, 900.0)) - 0.5) + 0.10 * (noise(vRest * vec3(60.0, 260.0, 260.0)) - 0.5);
    else if (kind > 0.5) c *= 1.0 + 0.09 * (noise(vRest * 420.0) - 0.5) + 0.05 * (noise(vRest * 1200.0) - 0.5);
    else c *= 1.0 + 0.05 * (noise(vRest * 1100.0) - 0.5);
  }
  float alpha = layerOpacity[k];
  for (int i = 0; i < ${MAX_LUMPS}; i++) {
    if (i >= nLumps) break;
    float d = lumpDistance(i);
    float pixel = max(fwidth(d), 1e-7);
    float inside = clamp(0.5 - d / pixel, 0.0, 1.0);
    vec3 fill = isMapped > 0.5 ? c : lumpColour * (1.0 + 0.10 * (noise(vRest * 700.0) - 0.5));
    float edge = clamp(1.5 - abs(d) / pixel, 0.0, 1.0);
    c = mix(c, fill, inside);
    c = mix(c, isMapped > 0.5 ? vec3(1.0) : lumpColour * 0.35, edge * 0.85);
    alpha = max(alpha, inside);
  }
  gl_FragColor = vec4(c, alpha);
  #include <colorspace_fragment>
}
`;

export class SectionMaterial extends ShaderMaterial {
  constructor(shared: SharedUniforms) {
    const list = <T>(n: number, make: () => T) => ({ value: Array.from({ length: n }, make) });
    super({
      vertexShader: SECTION_VERTEX,
      fragmentShader: SECTION_FRAGMENT,
      uniforms: {
        layerColours: list(MAX_LAYERS, () => new Color('#c9a08a')),
        layerOpacity: list(MAX_LAYERS, () => 1),
        layerGrain: list(MAX_LAYERS, () => 0),
        isMapped: { value: 0 },
        isPlain: { value: 0 },
        nLumps: { value: 0 },
        lumpCentre: list(MAX_LUMPS, () => new Vector3()),
        lumpAxes: list(MAX_LUMPS, () => new Matrix3()),
        lumpSize: list(MAX_LUMPS, () => new Vector4()),
        lumpColour: { value: new Color() },
        ...shared,
      },
      side: DoubleSide,
    });
  }

  layers(colours: string[], opacity: number[], names: string[]): void {
    const u = this.uniforms;
    colours.slice(0, MAX_LAYERS).forEach((colour, i) => {
      (u.layerColours.value as Color[])[i].set(colour);
      u.layerOpacity.value[i] = opacity[i];
      u.layerGrain.value[i] = /fat|adipose|subcut/i.test(names[i]) ? 1 : /muscle|soleus|gastro/i.test(names[i]) ? 2 : 0;
    });
    this.transparent = opacity.some((o) => o < 1);
  }

  lumps(lumps: LumpInfo[], colour: string): void {
    const u = this.uniforms;
    (u.lumpColour.value as Color).set(colour);
    const shown = lumps.slice(0, MAX_LUMPS);
    u.nLumps.value = shown.length;
    shown.forEach(({ shape, centre, axes }, i) => {
      (u.lumpCentre.value as Vector3[])[i].fromArray(centre);
      // The columns are the axes: v * m gives the components along them.
      const [a, b, c] = axes;
      (u.lumpAxes.value as Matrix3[])[i].set(a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2]);
      const size = (u.lumpSize.value as Vector4[])[i];
      if (shape.kind === 'ellipsoid') size.set(shape.radii[0], shape.radii[1], shape.radii[2], 1);
      else if (shape.kind === 'capsule') size.set(shape.radius, shape.length / 2, 0, -1);
      else size.set(shape.radius, shape.radius, shape.radius, 1);
    });
  }
}
