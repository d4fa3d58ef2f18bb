// Values at nodes and prisms by which a body is coloured, and the range and legend of their map.

import type { LayerInfo } from '../generated/api';
import type { FrameSnapshot } from '../generated/wire';
import type { Body } from './body';
import type { ColourBy, Legend } from './options';
import { layerColours, mapStops, type MapName } from './palette';

const FIELD_NUMBER: Partial<Record<ColourBy, number>> = { von_mises: 1, pressure: 2, stretch: 3 };
/** In which an automatic range comes down to a half, s. */
const HALF_LIFE = 3;
/** Ranges are not automatically smaller: below lie noise and the quantum of the wire. */
const LEAST_SPAN: Record<string, number> = { displacement: 5e-4, von_mises: 50, pressure: 50, stretch: 0.01 };
/** Above lie single nodes at edges of the contact, which would darken all else. */
const SHARE = 0.995;

/** How a quantity is mapped. */
export function mapFor(by: ColourBy): MapName {
  return by === 'pressure' ? 'vik' : by === 'stiffness' ? 'cividis' : 'ylgnbu';
}

export class Colouring {
  /** Of the legend, SI. */
  min = 0;
  max = 1;
  isLog = false;
  readonly prisms: Float32Array | null = null;
  private stiffnessNodes: Float32Array | null = null;
  private stiffnessOf: Body | null = null;
  private high = 0;
  private low = 0;
  private by: ColourBy = 'tissue';
  private since = 0;

  /** Whether surfaces are coloured by a map. */
  static isMap(by: ColourBy): boolean {
    return by !== 'tissue' && by !== 'layer';
  }

  /** Writes the nodes' values; false when there is nothing to show yet. */
  nodes(body: Body, by: ColourBy, frame: FrameSnapshot | null, out: Float32Array): boolean {
    if (by === 'stiffness') {
      out.set(this.nodalStiffness(body));
      return true;
    }
    if (by === 'displacement') {
      if (!frame) {
        out.fill(0);
        return true;
      }
      const { displacements: d, displacement_unit: unit } = frame;
      for (let i = 0; i < out.length; i++) out[i] = unit * Math.sqrt(d[3 * i] * d[3 * i] + d[3 * i + 1] * d[3 * i + 1] + d[3 * i + 2] * d[3 * i + 2]);
      return true;
    }
    if (!frame || frame.field !== FIELD_NUMBER[by] || frame.field_values.length !== out.length) {
      out.fill(by === 'stretch' ? 1 : 0);
      return false;
    }
    const scale = (frame.field_max - frame.field_min) / 65535;
    const values = frame.field_values;
    for (let i = 0; i < out.length; i++) out[i] = frame.field_min + scale * values[i];
    return true;
  }

  /** The range for these values; `time` in s. */
  updateRange(body: Body, by: ColourBy, fixed: [number, number] | null, values: Float32Array, time: number): void {
    if (by !== this.by) {
      this.by = by;
      this.high = this.low = 0;
    }
    const fade = 0.5 ** (Math.max(0, time - this.since) / HALF_LIFE);
    this.since = time;
    this.isLog = false;
    if (by === 'stiffness') {
      const [low, high] = extremes(body.stiffness);
      this.isLog = low > 0 && high > 10 * low;
      [this.min, this.max] = fixed ?? (high > low ? [low, high] : [0.9 * low, 1.1 * high + 1e-9]);
    } else if (fixed) {
      [this.min, this.max] = fixed;
    } else if (by === 'displacement') {
      this.high = Math.max(extremes(values)[1], this.high * fade, LEAST_SPAN[by]);
      [this.min, this.max] = [0, niceUp(this.high)];
    } else {
      const base = by === 'stretch' ? 1 : 0;
      const [low, high] = quantiles(values, SHARE);
      this.high = Math.max(high - base, this.high * fade, LEAST_SPAN[by]);
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

  /** For the shader: in decades when logarithmic. */
  get range(): [number, number] {
    return this.isLog ? [Math.log10(this.min), Math.log10(this.max)] : [this.min, this.max];
  }

  legend(by: ColourBy, layers: LayerInfo[], isCut: boolean, isReference: boolean): Legend | null {
    if (!Colouring.isMap(by)) {
      if (by === 'tissue' && !isCut) return null;
      const colours = layerColours(layers);
      return { title: by, unit: '', min: 0, max: 1, stops: colours, categories: layers.map(({ name }, i) => ({ name, colour: colours[i] })) };
    }
    const unit = by === 'displacement' ? 'm' : by === 'stretch' ? '' : by === 'stiffness' && isReference ? 'N/m' : 'Pa';
    return { title: by, unit, min: this.min, max: this.max, isLog: this.isLog, stops: mapStops(mapFor(by)) };
  }

  /** Stiffness of nodes: the mean of the prisms round them. */
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

/** Between which all but the rest of `share` lies on each side, by a histogram. */
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

/** The next number that reads well, so that legends stand still. */
function niceUp(x: number): number {
  const decade = 10 ** Math.floor(Math.log10(x));
  const step = [1, 1.5, 2, 3, 4, 5, 6, 8, 10].find((s) => s * decade >= x * 0.9999) ?? 10;
  return step * decade;
}
