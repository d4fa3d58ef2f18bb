// The palpation map: what its colours mean, what stands out, and what can be done with it.

import { apiUrl } from '../connection';
import { t } from '../i18n';
import type { MapLegend } from '../scene';
import { askAloud, isController } from '../store';
import { mapLegend } from './body';
import { Button, Segmented } from './controls';
import { formatNumber } from './quantity';
import { mapSight, show, view } from './settings';

export function MapBox() {
  const kind = view.value.palpation;
  const shown = mapLegend.value;
  const sight = mapSight.value;
  if (sight === 'nothing') return null;
  const kinds = sight === 'everything' ? (['off', 'absolute', 'surroundings'] as const) : (['off', 'absolute'] as const);
  return (
    <figure class="legend map-box" aria-label={t('map.title')} data-testid="map-box" data-n={shown?.n ?? 0} data-finding={shown?.finding ?? ''}>
      <figcaption>{t('map.title')}</figcaption>
      <Segmented
        label={t('map.title')}
        isLabelHidden
        value={kind}
        options={kinds.map((value) => ({ value, label: t(`map.${value}`), testid: `map-${value}` }))}
        onChange={(palpation) => show({ palpation })}
      />
      {kind !== 'off' && (shown === null ? <p class="map-hint">{t('map.empty')}</p> : <Felt shown={shown} />)}
    </figure>
  );
}

function Felt({ shown }: { shown: MapLegend }) {
  return (
    <>
      <div class="legend-bar" style={{ background: `linear-gradient(to right, ${shown.stops.join(', ')})` }} />
      <div class="legend-scale" data-testid="map-scale">
        {[shown.range[0], (shown.range[0] + shown.range[1]) / 2, shown.range[1]].map((value, index) => <span key={index}>{inUnit(value, shown)}</span>)}
      </div>
      {shown.kind === 'surroundings' && (
        <p class="map-finding" data-testid="map-finding">
          {shown.finding === null ? t('map.nothing') : t('map.stands_out', { share: formatNumber(100 * shown.finding, 2) })}
        </p>
      )}
      {shown.nForgotten > 0 && <p class="map-hint">{t('map.forgotten', { n: shown.nForgotten })}</p>}
      <div class="map-tools">
        <Button kind="quiet" disabled={!isController.value} onClick={() => void askAloud({ type: 'clear_map' })} testid="map-clear">{t('map.clear')}</Button>
        {mapSight.value === 'everything' && <a class="button quiet" href={apiUrl('api/map.csv')} download="palpation-map.csv" data-testid="map-csv">CSV</a>}
        {mapSight.value === 'everything' && <a class="button quiet" href={apiUrl('api/map.vtu')} download="palpation-map.vtu" data-testid="map-vtu">VTU</a>}
      </div>
    </>
  );
}

/** A value of the legend. */
function inUnit(value: number, { kind }: MapLegend): string {
  return kind === 'surroundings' ? `+${formatNumber(100 * value, 2)} %` : `${formatNumber(value / 1e3, 2)} N/mm`;
}
