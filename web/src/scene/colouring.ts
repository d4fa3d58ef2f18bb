// The values of nodes by which a body is coloured, and the range and legend of their map.

import type { LayerInfo } from '../generated/api';
import type { FrameSnapshot } from '../generated/wire';
import type { Body } from './body';
import type { Category, Legend } from './options';
import { layerColours, mapOf } from './palette';
import { QUANTITIES, type ColourBy, type Quantity } from './quantities';

/** The time in which an automatic range shrinks by a half, s. */
const HALF_LIFE = 3;
/** Share of the nodes that an automatic range covers: single nodes at edges of the contact
 * would darken all else. */
const SHARE = 0.995;

export class Colouring {
  /** The range of the legend, SI. */
  private min = 0;
  private max = 1;
  isLog = false;
  private stiffnessNodes: Float32Array | null = null;
  private stiffnessOf: Body | null = null;
  private high = 0;
  private low = 0;
  private by: ColourBy = 'tissue';
  private since = 0;

  /** Whether surfaces are coloured by a map. */
  static isMap(by: ColourBy): by is Quantity {
    return by !== 'tissue' && by !== 'layer';
  }

  /** Writes the nodes' values, SI: those at rest while there are no others. */
  nodes(body: Body, by: Quantity, frame: FrameSnapshot | null, out: Float32Array): void {
    const { field, rest } = QUANTITIES[by];
    if (by === 'stiffness') {
      out.set(this.nodalStiffness(body));
    } else if (by === 'displacement' && frame) {
      const { displacements: d, displacement_unit: unit } = frame;
      for (let i = 0; i < out.length; i++) out[i] = unit * Math.sqrt(d[3 * i] * d[3 * i] + d[3 * i + 1] * d[3 * i + 1] + d[3 * i + 2] * d[3 * i + 2]);
    } else if (by === 'contact') {
      out.fill(rest);
      frame?.contacts.forEach((vertex, k) => (out[vertex * body.nLevels] = frame.contact_pressures[k]));
    } else if (field && frame && frame.field === field.number && frame.field_values.length === out.length) {
      const scale = (frame.field_max - frame.field_min) / 65535;
      const values = frame.field_values;
      for (let i = 0; i < out.length; i++) out[i] = frame.field_min + scale * values[i];
    } else {
      out.fill(rest);
    }
  }

  /** Sets the range for these values; `time` in s. */
  updateRange(body: Body, by: Quantity, fixed: [number, number] | null, values: Float32Array, time: number): void {
    if (by !== this.by) {
      this.by = by;
      this.high = this.low = 0;
    }
    const fade = 0.5 ** (Math.max(0, time - this.since) / HALF_LIFE);
    this.since = time;
    this.isLog = false;
    const { rest: base, leastSpan } = QUANTITIES[by];
    if (by === 'stiffness') {
      const [low, high] = extremes(body.stiffness);
      this.isLog = low > 0 && high > 10 * low;
      [this.min, this.max] = fixed ?? (high > low ? [low, high] : [0.9 * low, 1.1 * high + 1e-9]);
    } else if (fixed) {
      [this.min, this.max] = fixed;
    } else if (by === 'displacement' || by === 'contact') {
      this.high = Math.max(extremes(values)[1], this.high * fade, leastSpan);
      [this.min, this.max] = [0, niceUp(this.high)];
    } else {
      const [low, high] = quantiles(values, SHARE);
      this.high = Math.max(high - base, this.high * fade, leastSpan);
      this.low = Math.max(base - low, this.low * fade, 0);
      if (by === 'pressure') {
        // Signed: both sides alike, so that the map's middle is zero.
        const span = niceUp(Math.max(this.high, this.low));
        [this.min, this.max] = [-span, span];
      } else {
        [this.min, this.max] = [base, base + niceUp(this.high)];
      }
    }
  }

  /** The range for the shader: decimal logarithms if `isLog`. */
  get range(): [number, number] {
    return this.isLog ? [Math.log10(this.min), Math.log10(this.max)] : [this.min, this.max];
  }

  /** `inside`: what else is seen of the inside, besides the layers. */
  /** The colour of a value, between evenly spaced `stops`. */
  colours(stops: readonly string[]): (value: number) => string {
    const [low, high] = this.range;
    return (value) => {
      const v = this.isLog ? Math.log10(Math.max(value, 1e-12)) : value;
      const share = Math.min(1, Math.max(0, (v - low) / Math.max(high - low, 1e-20)));
      return stops[Math.round(share * (stops.length - 1))];
    };
  }

  legend(by: ColourBy, layers: LayerInfo[], isOpen: boolean, inside: readonly Category[], isReference: boolean): Legend | null {
    if (!Colouring.isMap(by)) {
      if (by === 'tissue' && !isOpen) return null;
      const colours = layerColours(layers);
      return { title: by, unit: '', min: 0, max: 1, stops: colours, categories: [...layers.map(({ name }, i) => ({ name, colour: colours[i] })), ...inside] };
    }
    // The bars of the reference method have a stiffness of their own.
    const unit = by === 'stiffness' && isReference ? 'N/m' : QUANTITIES[by].unit;
    return { title: by, unit, min: this.min, max: this.max, isLog: this.isLog, stops: mapOf(by).stops };
  }

  /** Stiffness of nodes: the mean over the prisms around them. */
  private nodalStiffness(body: Body): Float32Array {
    if (this.stiffnessOf === body && this.stiffnessNodes) return this.stiffnessNodes;
    const { triangles, nLevels, stiffness, nNodes } = body;
    const sum = new Float32Array(nNodes), count = new Float32Array(nNodes);
    for (let t = 0; 3 * t < triangles.length; t++) {
      for (let i = 0; i < nLevels - 1; i++) {
        const value = stiffness[t * (nLevels - 1) + i];
        for (let k = 0; k < 3; k++) {
          const node = triangles[3 * t + k] * nLevels + i;
          sum[node] += value; count[node]++;
          sum[node + 1] += value; count[node + 1]++;
        }
      }
    }
    for (let i = 0; i < nNodes; i++) sum[i] /= count[i] || 1;
    this.stiffnessOf = body;
    this.stiffnessNodes = sum;
    return sum;
  }
}

function extremes(values: Float32Array): [number, number] {
  let low = Infinity, high = -Infinity;
  for (const v of values) {
    if (v < low) low = v;
    if (v > high) high = v;
  }
  return low <= high ? [low, high] : [0, 0];
}

/** Limits within which `share` of the values lie, counted from either side; by a histogram. */
function quantiles(values: Float32Array, share: number): [number, number] {
  const [low, high] = extremes(values);
  if (high <= low) return [low, high];
  const n = 512;
  const bins = new Uint32Array(n);
  const scale = (n - 1) / (high - low);
  for (const v of values) bins[Math.round((v - low) * scale)]++;
  const beyond = (1 - share) * values.length;
  let i = 0, k = n - 1;
  for (let sum = bins[0]; sum <= beyond && i < n - 1; sum += bins[++i]);
  for (let sum = bins[k]; sum <= beyond && k > 0; sum += bins[--k]);
  return [low + i / scale, low + (k + 1) / scale];
}

/** The next round number, so that legends change rarely. */
function niceUp(x: number): number {
  const decade = 10 ** Math.floor(Math.log10(x));
  const step = [1, 1.5, 2, 3, 4, 5, 6, 8, 10].find((s) => s * decade >= x * 0.9999) ?? 10;
  return step * decade;
}
