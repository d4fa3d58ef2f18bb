// The legend of the palpation map in words.

import { t } from '../i18n';
import type { MapLegend, PictureLegend } from '../scene';
import { formatNumber } from './quantity';

export function mapWords(shown: MapLegend): PictureLegend {
  const { kind, range: [low, high], stops, finding } = shown;
  const share = kind === 'surroundings';
  return {
    title: `${t('map.title')}: ${t(`map.${kind}`)}`,
    stops,
    labels: [low, (low + high) / 2, high].map((value) => inUnit(value, shown)),
    note: !share ? '' : finding === null ? t('map.nothing') : t('map.stands_out', { share: formatNumber(100 * finding, 2) }),
  };
}

/** A value of the legend. */
function inUnit(value: number, { kind }: MapLegend): string {
  return kind === 'surroundings' ? `+${formatNumber(100 * value, 2)} %` : `${formatNumber(value / 1e3, 2)} N/mm`;
}
