// Materials of tissue: surfaces in soft light, and the section.
//
// Written by hand and not taken from three's physical materials because software WebGL must stay usable: one key light
// with a shadow, a sky, a rim; the light wraps round the terminator and reddens there, as it does under skin.

import {
  BackSide, Color, DoubleSide, FrontSide, Matrix3, Plane, ShaderMaterial, type Side, Texture, UniformsLib, UniformsUtils, Vector2, Vector3, Vector4,
} from 'three';
import type { LumpInfo } from '../generated/api';

export const MAX_LAYERS = 12;
export const MAX_LUMPS = 6;

/** What all materials of the body have in common; one object each, so that a change is seen by all. */
export interface SharedUniforms {
  map: { value: Texture | null };
  /** Values at the ends of the map; in decades when `isLog`. */
  range: { value: Vector2 };
  isLog: { value: number };
}

const NOISE = /* glsl */ `
float hash(vec3 p) {
  p = fract(p * 0.3183099 + 0.1);
  p *= 17.0;
  return fract(p.x * p.y * p.z * (p.x + p.y + p.z));
}
float noise(vec3 p) {
  vec3 i = floor(p), f = fract(p);
  f = f * f * (3.0 - 2.0 * f);
  return mix(
    mix(mix(hash(i), hash(i + vec3(1, 0, 0)), f.x), mix(hash(i + vec3(0, 1, 0)), hash(i + vec3(1, 1, 0)), f.x), f.y),
    mix(mix(hash(i + vec3(0, 0, 1)), hash(i + vec3(1, 0, 1)), f.x), mix(hash(i + vec3(0, 1, 1)), hash(i + vec3(1, 1, 1)), f.x), f.y), f.z);
}
`;

const MAP = /* glsl */ `
uniform sampler2D map;
uniform vec2 range;
uniform float isLog;
vec3 mapped(float value) {
  float v = isLog > 0.5 ? log2(max(value, 1e-12)) * 0.30103 : value;
  float t = clamp((v - range.x) / max(range.y - range.x, 1e-20), 0.0, 1.0);
  return texture2D(map, vec2(t * 0.99609375 + 0.001953125, 0.5)).rgb;
}
`;

const SURFACE_VERTEX = /* glsl */ `
attribute vec3 rest;
attribute float value;
varying vec3 vRest;
varying vec3 vNormal;
varying vec3 vView;
varying float vValue;
#include <common>
#include <shadowmap_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
  #include <beginnormal_vertex>
  #include <defaultnormal_vertex>
  #include <begin_vertex>
  #include <project_vertex>
  #include <worldpos_vertex>
  #include <shadowmap_vertex>
  #include <clipping_planes_vertex>
  vRest = rest;
  vNormal = transformedNormal;
  vView = -mvPosition.xyz;
  vValue = value;
}
`;

const SURFACE_FRAGMENT = /* glsl */ `
uniform vec3 colour;
uniform float opacity;
uniform float isMapped;
uniform float isFlat;
uniform float skin;
uniform vec3 light;
varying vec3 vRest;
varying vec3 vNormal;
varying vec3 vView;
varying float vValue;
#include <common>
#include <lights_pars_begin>
#include <shadowmap_pars_fragment>
#include <shadowmask_pars_fragment>
#include <clipping_planes_pars_fragment>
${NOISE}
${MAP}
void main() {
  #include <clipping_planes_fragment>
  vec3 V = normalize(vView);
  vec3 N = isFlat > 0.5 ? normalize(cross(dFdx(vView), dFdy(vView))) : normalize(vNormal);
  // By the side that is drawn and not by the angle: at silhouettes the normal may lean away a little, which is no reason to be dark.
  if (isFlat < 0.5 && !gl_FrontFacing) N = -N;
  vec3 L = normalize((viewMatrix * vec4(light, 0.0)).xyz);
  vec3 up = normalize((viewMatrix * vec4(0.0, 0.0, 1.0, 0.0)).xyz);

  vec3 base = colour;
  float shine = 0.18;
  if (isMapped > 0.5) {
    base = mapped(vValue);
    shine = 0.05;
  } else if (skin > 0.0) {
    // Mottling as of blood under skin: broad and faint, then fine. At rest, so that it goes with the tissue.
    float broad = noise(vRest * 55.0) + 0.5 * noise(vRest * 130.0) - 0.75;
    float fine = noise(vRest * 900.0) - 0.5;
    base *= 1.0 + skin * (vec3(0.05, -0.06, -0.06) * broad + 0.045 * fine);
    shine *= 1.0 + 0.5 * fine * skin;
  }

  float ndl = dot(N, L);
  float lit = mix(0.35, 1.0, getShadowMask());
  float sky = 0.5 + 0.5 * dot(N, up);
  float fresnel = pow(1.0 - max(dot(N, V), 0.0), 3.0);
  vec3 shade;
  if (isMapped > 0.5) {
    // A map must be read: form by a little shade only.
    shade = base * (0.62 + 0.2 * sky + 0.24 * clamp(0.3 + 0.7 * ndl, 0.0, 1.0) * lit);
  } else {
    float wrapped = clamp((ndl + 0.4) / 1.4, 0.0, 1.0);
    wrapped *= mix(wrapped, 1.0, 0.5) * lit;
    vec3 scatter = vec3(0.20, 0.05, 0.03) * skin * smoothstep(-0.45, 0.1, ndl) * (1.0 - smoothstep(0.1, 0.75, ndl)) * (0.5 + 0.5 * lit);
    vec3 ambient = mix(vec3(0.27, 0.235, 0.225), vec3(0.45, 0.465, 0.49), sky);
    shade = base * (ambient + vec3(0.76, 0.74, 0.70) * wrapped + scatter);
    shade += vec3(0.9, 0.95, 1.0) * base * fresnel * (0.12 + 0.25 * sky);
  }
  vec3 H = normalize(L + V);
  shade += shine * lit * (0.5 * pow(max(dot(N, H), 0.0), 14.0) + 0.35 * pow(max(dot(N, H), 0.0), 60.0));
  // A transparent layer is densest where it is seen edge-on.
  float alpha = opacity < 1.0 ? mix(opacity, min(1.0, opacity * 1.6 + 0.12), fresnel) : 1.0;
  gl_FragColor = vec4(shade, alpha);
  #include <colorspace_fragment>
}
`;

export interface SurfaceLook {
  colour: string;
  opacity: number;
  isMapped: boolean;
  /** Strength of what makes it skin, 0 to 1. */
  skin: number;
  isFlat?: boolean;
  side?: Side;
}

export class SurfaceMaterial extends ShaderMaterial {
  constructor(shared: SharedUniforms, light: { value: Vector3 }, planes: Plane[]) {
    super({
      vertexShader: SURFACE_VERTEX,
      fragmentShader: SURFACE_FRAGMENT,
      uniforms: {
        ...UniformsUtils.clone(UniformsLib.lights),
        colour: { value: new Color() },
        opacity: { value: 1 },
        isMapped: { value: 0 },
        isFlat: { value: 0 },
        skin: { value: 0 },
        light,
        ...shared,
      },
      lights: true,
      clipping: true,
      clippingPlanes: planes,
      clipShadows: true,
      // Lines and sections that lie on a surface are drawn over it.
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
    });
  }

  look({ colour, opacity, isMapped, skin, isFlat, side }: SurfaceLook): void {
    const u = this.uniforms;
    (u.colour.value as Color).set(colour);
    u.opacity.value = opacity;
    u.isMapped.value = isMapped ? 1 : 0;
    u.skin.value = skin;
    u.isFlat.value = isFlat ? 1 : 0;
    this.side = side ?? FrontSide;
    this.shadowSide = this.side === BackSide ? DoubleSide : null;
    this.transparent = opacity < 1;
  }
}

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
  } else if (isPlain < 0.5) {
    // The grain of tissue: fat in lobules, muscle in fibres along the limb.
    float grain = layerGrain[k];
    if (grain > 1.5) c *= 1.0 + 0.16 * (noise(vRest * vec3(220.0, 900.0, 900.0)) - 0.5) + 0.10 * (noise(vRest * vec3(60.0, 260.0, 260.0)) - 0.5);
    else if (grain > 0.5) c *= 1.0 + 0.09 * (noise(vRest * 420.0) - 0.5) + 0.05 * (noise(vRest * 1200.0) - 0.5);
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
      // Its columns are the axes, so that (v * m) are the components along them.
      const [a, b, c] = axes;
      (u.lumpAxes.value as Matrix3[])[i].set(a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2]);
      const size = (u.lumpSize.value as Vector4[])[i];
      if (shape.kind === 'ellipsoid') size.set(shape.radii[0], shape.radii[1], shape.radii[2], 1);
      else if (shape.kind === 'capsule') size.set(shape.radius, shape.length / 2, 0, -1);
      else size.set(shape.radius, shape.radius, shape.radius, 1);
    });
  }
}
