// The palpation map as a volume of values round the skin: whatever the mesh, each point of the skin finds its value
// at its place at rest.

import { Data3DTexture, LinearFilter, RGFormat, UnsignedByteType, Vector3 } from 'three';
import type { MapSnapshot } from '../generated/wire';
import type { Body } from './body';

/** What the map shows: stiffness, or by how much a place is stiffer than its surroundings. */
export type MapKind = 'off' | 'absolute' | 'surroundings';

/** Edge of a cell, m, and the greatest number of cells; larger bodies have larger cells. */
const CELL = 2e-3;
const MOST_CELLS = 700_000;
/** Spots end at so many of their widths. */
const REACH = 3;
/** Least range of the comparison with surroundings: smaller differences are noise. */
const LEAST_SHARE = 0.08;
/** Share of the spots that the range of the stiffness leaves out at either end. */
const TAIL = 0.02;

export interface MapUniforms {
  palpation: { value: Data3DTexture };
  palpationLow: { value: Vector3 };
  palpationSize: { value: Vector3 };
  palpationOn: { value: number };
}

export class PalpationVolume {
  readonly uniforms: MapUniforms;
  /** Range of the colours, N/m or a share. */
  range: [number, number] = [0, 1];
  private texture = volume(new Uint8Array(2), 1, 1, 1);
  private key = '';

  constructor() {
    this.uniforms = {
      palpation: { value: this.texture },
      palpationLow: { value: new Vector3() },
      palpationSize: { value: new Vector3(1, 1, 1) },
      palpationOn: { value: 0 },
    };
  }

  /** Shows a map on a body. */
  set(map: MapSnapshot | null, kind: MapKind, body: Body): void {
    const n = map?.stiffness.length ?? 0;
    const values = kind === 'surroundings' ? map?.shares : map?.stiffness;
    this.uniforms.palpationOn.value = kind === 'off' || n === 0 ? 0 : 1;
    const key = `${map?.revision} ${kind} ${body.box.min.toArray().join()}`;
    if (key === this.key || map === null || values === undefined || this.uniforms.palpationOn.value === 0) return;
    this.key = key;
    this.range = rangeOf(values, kind);
    const low = body.box.min.clone().addScalar(-CELL), high = body.box.max.clone().addScalar(CELL);
    const size = high.clone().sub(low);
    const cell = Math.max(CELL, Math.cbrt((size.x * size.y * size.z) / MOST_CELLS));
    const [nx, ny, nz] = size.toArray().map((length) => Math.max(2, Math.ceil(length / cell)));
    const data = this.fill(map, values, low, cell, nx, ny, nz);
    this.texture.dispose();
    this.texture = volume(data, nx, ny, nz);
    this.uniforms.palpation.value = this.texture;
    this.uniforms.palpationLow.value.copy(low);
    this.uniforms.palpationSize.value.set(nx * cell, ny * cell, nz * cell);
  }

  /** Values and how well they are known, of each cell. */
  private fill(map: MapSnapshot, values: Float32Array, low: Vector3, cell: number, nx: number, ny: number, nz: number): Uint8Array<ArrayBuffer> {
    const sums = new Float32Array(nx * ny * nz), weights = new Float32Array(nx * ny * nz);
    const limits = [nx, ny, nz];
    for (let i = 0; i < values.length; i++) {
      if (!Number.isFinite(values[i])) continue;
      const width = map.widths[i];
      const at = [0, 1, 2].map((c) => map.points[3 * i + c] - low.getComponent(c));
      const from = at.map((x) => Math.max(0, Math.floor((x - REACH * width) / cell)));
      const to = at.map((x, c) => Math.min(limits[c] - 1, Math.ceil((x + REACH * width) / cell)));
      for (let z = from[2]; z <= to[2]; z++) {
        for (let y = from[1]; y <= to[1]; y++) {
          for (let x = from[0]; x <= to[0]; x++) {
            const dx = (x + 0.5) * cell - at[0], dy = (y + 0.5) * cell - at[1], dz = (z + 0.5) * cell - at[2];
            const off = (dx * dx + dy * dy + dz * dz) / (width * width);
            if (off > REACH * REACH) continue;
            const weight = Math.exp(-0.5 * off);
            const k = (z * ny + y) * nx + x;
            sums[k] += weight * values[i];
            weights[k] += weight;
          }
        }
      }
    }
    const [least, most] = this.range;
    const data = new Uint8Array(2 * weights.length);
    for (let k = 0; k < weights.length; k++) {
      if (weights[k] < 1e-4) continue;
      // The value is stored times its coverage, so that the texture blends both rightly.
      const coverage = Math.min(1, weights[k]);
      const share = Math.min(1, Math.max(0, (sums[k] / weights[k] - least) / (most - least)));
      data[2 * k] = Math.round(255 * share * coverage);
      data[2 * k + 1] = Math.round(255 * coverage);
    }
    return data;
  }

  dispose(): void {
    this.texture.dispose();
  }
}

function rangeOf(values: Float32Array, kind: MapKind): [number, number] {
  const known = Float32Array.from(values).filter((value) => Number.isFinite(value)).sort();
  if (known.length === 0) return [0, LEAST_SHARE];
  if (kind === 'surroundings') {
    const most = known[Math.min(known.length - 1, Math.floor((1 - 0.5 * TAIL) * known.length))];
    return [0, Math.max(LEAST_SHARE, Math.ceil(most * 50) / 50)];
  }
  const [low, high] = [TAIL, 1 - TAIL].map((share) => known[Math.min(known.length - 1, Math.floor(share * known.length))]);
  const span = Math.max(high - low, 0.2 * high, 1e-6);
  const middle = 0.5 * (low + high);
  return [Math.max(0, middle - 0.5 * span), middle + 0.5 * span];
}

function volume(data: Uint8Array<ArrayBuffer>, nx: number, ny: number, nz: number): Data3DTexture {
  const texture = new Data3DTexture(data, nx, ny, nz);
  texture.format = RGFormat;
  texture.type = UnsignedByteType;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}
