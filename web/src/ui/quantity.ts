// Quantities: as a scene file writes them ("12 kPa"), and as the page shows them.

export type Dimension = 'length' | 'pressure' | 'time' | 'speed' | 'spring' | 'angle' | 'force' | 'number';

const UNITS: Record<Exclude<Dimension, 'number'>, Record<string, number>> = {
  length: { m: 1, cm: 1e-2, mm: 1e-3, µm: 1e-6, μm: 1e-6, um: 1e-6, in: 0.0254 },
  pressure: { Pa: 1, kPa: 1e3, MPa: 1e6, GPa: 1e9 },
  time: { s: 1, ms: 1e-3, min: 60 },
  speed: { 'm/s': 1, 'cm/s': 1e-2, 'mm/s': 1e-3 },
  angle: { rad: 1, deg: Math.PI / 180, '°': Math.PI / 180 },
  force: { N: 1, mN: 1e-3, kN: 1e3 },
  spring: { 'N/m': 1, 'mN/m': 1e-3, 'N/mm': 1e3, 'dyn/cm': 1e-3 },
};

const PATTERN = /^\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d].*)?$/;

/** The value in SI; null if the text is no such quantity. */
export function parseQuantity(text: string, dimension: Dimension): number | null {
  const match = PATTERN.exec(text);
  if (match === null) return null;
  const value = Number(match[1]);
  const unit = match[2]?.trim();
  if (dimension === 'number') return unit === undefined ? value : null;
  if (unit === undefined) return value === 0 ? 0 : null;
  const factor = UNITS[dimension][unit];
  return factor === undefined ? null : value * factor;
}

/** The unit for values of a size, from large to small. */
const WRITTEN: Record<Exclude<Dimension, 'number'>, [atLeast: number, unit: string][]> = {
  length: [[1, 'm'], [1e-4, 'mm'], [0, 'µm']],
  pressure: [[1e6, 'MPa'], [1e3, 'kPa'], [0, 'Pa']],
  time: [[0.1, 's'], [0, 'ms']],
  speed: [[0, 'mm/s']],
  angle: [[0, 'deg']],
  force: [[0, 'N']],
  spring: [[0.1, 'N/m'], [0, 'dyn/cm']],
};

/** With so many significant digits. */
export function formatNumber(value: number, digits = 3): string {
  if (!Number.isFinite(value)) return '–';
  return String(Number(value.toPrecision(digits)));
}

export function formatQuantity(value: number, dimension: Dimension, digits = 3): string {
  if (dimension === 'number') return formatNumber(value, digits);
  const size = Math.abs(value);
  const written = WRITTEN[dimension];
  const unit = size === 0 ? defaultUnit(dimension) : (written.find(([atLeast]) => size >= atLeast) ?? written[0])[1];
  return `${formatNumber(value / UNITS[dimension][unit], digits)} ${unit}`;
}

const DEFAULT_UNITS: Record<Dimension, string> = {
  length: 'mm', pressure: 'kPa', time: 's', speed: 'mm/s', spring: 'N/m', angle: 'deg', force: 'N', number: '',
};

export function defaultUnit(dimension: Dimension): string {
  return DEFAULT_UNITS[dimension];
}

/** The typed text, with the usual unit if it has none. */
export function withUnit(text: string, dimension: Dimension): string {
  const match = PATTERN.exec(text);
  if (dimension === 'number' || match === null || match[2] !== undefined) return text.trim();
  return `${match[1]} ${defaultUnit(dimension)}`;
}

/** The text as written, unless it is a zero or too long to read, such as
 * 0.00030000000000000003 m. */
export function tidied(text: string, dimension: Dimension): string {
  const value = parseQuantity(text, dimension);
  // A length below a metre is read in millimetres.
  const isInMetres = dimension === 'length' && /[\d\s]m\s*$/.test(text) && Math.abs(value ?? 0) < 1;
  if (value === null || (value !== 0 && text.length <= 9 && !isInMetres)) return text;
  return formatQuantity(value, dimension, 5);
}

/** The text of a scene's value, whatever its type. */
export function writtenQuantity(value: unknown): string {
  if (typeof value === 'string') return value;
  return typeof value === 'number' ? formatNumber(value, 6) : '';
}

/** A length, m, as text in mm. */
export function inMillimetres(value: number, decimals = 1): string {
  const shown = (value * 1e3).toFixed(decimals);
  return `${shown.replace('-', Number(shown) === 0 ? '' : '−')} mm`;
}

/** A point as a scene file writes it. */
export function writtenPoint(point: readonly number[]): string[] {
  return point.map((x) => `${Number((x * 1e3).toFixed(2))} mm`);
}

const PREFIXES: [number, string][] = [[1, ''], [1e-3, 'm'], [1e-6, 'µ'], [1e-9, 'n']];

/** With an SI prefix from nano to none. */
export function withPrefix(value: number, unit: string, digits = 3): string {
  const size = Math.abs(value);
  const [factor, prefix] = size === 0 ? PREFIXES[0] : (PREFIXES.find(([least]) => size >= least) ?? PREFIXES[3]);
  return `${formatNumber(value / factor, digits)} ${prefix}${unit}`;
}
