// The material of surfaces: one key light with a shadow, a sky and a rim. The light wraps round the
// terminator and reddens there, as it does under skin.

import { BackSide, Color, DoubleSide, FrontSide, type Plane, ShaderMaterial, type Side, UniformsLib, UniformsUtils, type Vector3 } from 'three';
import { FELT, MAP, NOISE, type SharedUniforms } from './shared';

const SURFACE_VERTEX = /* glsl */ `
attribute vec3 rest;
attribute float value;
varying vec3 vRest;
varying vec3 vMoved;
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
  vMoved = position - rest;
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
uniform float grain;
uniform float isSkin;
uniform float hasGrid;
uniform vec3 light;
varying vec3 vRest;
varying vec3 vMoved;
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
${FELT}
// Lines of a grid of 5 mm, drawn where the skin has moved.
float gridLine(float x) {
  float cell = x * 200.0;
  float width = max(fwidth(cell), 1e-4);
  return 1.0 - smoothstep(0.6, 1.6, abs(fract(cell - 0.5) - 0.5) / width);
}
void main() {
  #include <clipping_planes_fragment>
  vec3 V = normalize(vView);
  vec3 N = isFlat > 0.5 ? normalize(cross(dFdx(vView), dFdy(vView))) : normalize(vNormal);
  // Turned by the drawn side, not by the angle: at silhouettes the normal may lean away a little
  // without being dark.
  if (isFlat < 0.5 && !gl_FrontFacing) N = -N;
  vec3 L = normalize((viewMatrix * vec4(light, 0.0)).xyz);
  vec3 up = normalize((viewMatrix * vec4(0.0, 0.0, 1.0, 0.0)).xyz);

  vec3 base = colour;
  float shine = 0.18;
  if (isMapped > 0.5) {
    base = mapped(vValue);
    shine = 0.05;
  } else if (skin > 0.0) {
    // Mottling of blood under skin, broad and fine. By the place at rest, so that it
    // moves with the tissue.
    float broad = 0.0, fine = 0.0;
    if (grain > 0.5) {
      broad = noise(vRest * 55.0) + 0.5 * noise(vRest * 130.0) - 0.75;
      fine = noise(vRest * 900.0) - 0.5;
    }
    base *= 1.0 + skin * (vec3(0.05, -0.06, -0.06) * broad + 0.045 * fine);
    shine *= 1.0 + 0.5 * fine * skin;
  }

  if (isSkin > 0.5 && isMapped < 0.5) {
    float moved = length(vMoved);
    // Pressed skin turns pale.
    base = mix(base, vec3(0.95, 0.82, 0.74), 0.55 * smoothstep(0.0008, 0.006, moved));
    if (palpationOn > 0.5) {
      vec2 f = felt(vRest);
      vec3 glow = texture2D(palpationMap, vec2(f.x * 0.99609375 + 0.001953125, 0.5)).rgb;
      float known = smoothstep(0.12, 0.6, f.y);
      base = mix(base, glow, 0.88 * known);
      shine *= 1.0 - 0.7 * known;
    }
    if (hasGrid > 0.5) {
      float near = smoothstep(0.0002, 0.0009, moved);
      if (near > 0.01) base *= 1.0 - 0.30 * near * max(gridLine(vRest.x), max(gridLine(vRest.y), gridLine(vRest.z)));
    }
  }

  float ndl = dot(N, L);
  float lit = mix(0.35, 1.0, getShadowMask());
  float sky = 0.5 + 0.5 * dot(N, up);
  float fresnel = pow(1.0 - max(dot(N, V), 0.0), 3.0);
  vec3 shade;
  if (isMapped > 0.5) {
    // Colours of a map must be readable: little shading.
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
  /** Strength of mottling and of light scattered under the skin, 0 to 1. */
  skin: number;
  isFlat?: boolean;
  /** The outside of the body, which can be felt. */
  isSkin?: boolean;
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
        isSkin: { value: 0 },
        hasGrid: { value: 1 },
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

  look({ colour, opacity, isMapped, skin, isFlat, side, isSkin }: SurfaceLook): void {
    const u = this.uniforms;
    (u.colour.value as Color).set(colour);
    u.opacity.value = opacity;
    u.isMapped.value = isMapped ? 1 : 0;
    u.skin.value = skin;
    u.isFlat.value = isFlat ? 1 : 0;
    u.isSkin.value = isSkin ? 1 : 0;
    this.side = side ?? FrontSide;
    this.shadowSide = this.side === BackSide ? DoubleSide : null;
    this.transparent = opacity < 1;
  }
}
