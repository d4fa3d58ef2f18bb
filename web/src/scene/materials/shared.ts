// What the shaders of tissue have in common: the colour map, and noise for the grain of tissue.

import type { Texture, Vector2 } from 'three';
import type { MapUniforms } from '../palpation';

/** Uniforms that all materials of the body share, so that a change reaches all of them. */
export interface SharedUniforms extends MapUniforms {
  /** Colours of the palpation map. */
  palpationMap: { value: Texture | null };
  map: { value: Texture | null };
  /** Values at the ends of the colour map, SI; their decimal logarithms when `isLog` is 1. */
  range: { value: Vector2 };
  isLog: { value: number };
  /** 1 with the fine structure of tissue, 0 without, which is drawn faster. */
  grain: { value: number };
}

/** `noise(p)`: smooth, 0 to 1, with a wavelength of 1. */
export const NOISE = /* glsl */ `
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

/** `felt(rest)`: the value of the palpation map at a place at rest, 0 to 1, and how well it is known, 0 to 1. */
export const FELT = /* glsl */ `
uniform sampler3D palpation;
uniform sampler2D palpationMap;
uniform vec3 palpationLow;
uniform vec3 palpationSize;
uniform float palpationOn;
vec2 felt(vec3 rest) {
  vec2 v = texture(palpation, (rest - palpationLow) / palpationSize).rg;
  return vec2(v.r / max(v.g, 1e-3), v.g);
}
`;

/** `mapped(value)`: the colour of a value, SI. */
export const MAP = /* glsl */ `
uniform sampler2D map;
uniform vec2 range;
uniform float isLog;
vec3 mapped(float value) {
  float v = isLog > 0.5 ? log2(max(value, 1e-12)) * 0.30103 : value;
  float t = clamp((v - range.x) / max(range.y - range.x, 1e-20), 0.0, 1.0);
  return texture2D(map, vec2(t * 0.99609375 + 0.001953125, 0.5)).rgb;
}
`;
