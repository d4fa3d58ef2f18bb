// The palpation map: what its colours mean, what stands out, and what can be done with it.

import { apiUrl } from '../connection';
import { t } from '../i18n';
import type { MapLegend } from '../scene';
import { askAloud, isController, notify } from '../store';
import { mapLegend } from './body';
import { Button, Segmented } from './controls';
import { mapWords } from './mapwords';
import { NOTICED_SHARE, noticedBy } from './people';
import { saveImage } from './save';
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
        {mapWords(shown).labels.map((label, index) => <span key={index}>{label}</span>)}
      </div>
      {shown.kind === 'surroundings' && <p class="map-finding" data-testid="map-finding">{mapWords(shown).note}</p>}
      {shown.kind === 'surroundings' && shown.finding !== null && <Noticed share={shown.finding} />}
      {shown.nForgotten > 0 && <p class="map-hint">{t('map.forgotten', { n: shown.nForgotten })}</p>}
      <div class="map-tools">
        <Button kind="quiet" disabled={!isController.value} onClick={() => void askAloud({ type: 'clear_map' })} testid="map-clear">{t('map.clear')}</Button>
        <Button kind="quiet" onClick={() => saveImage('palpation-map').catch((error: unknown) => notify('error', String(error)))} testid="map-png">PNG</Button>
        {mapSight.value === 'everything' && <a class="button quiet" href={apiUrl('api/map.csv')} download="palpation-map.csv" data-testid="map-csv">CSV</a>}
        {mapSight.value === 'everything' && <a class="button quiet" href={apiUrl('api/map.vtu')} download="palpation-map.vtu" data-testid="map-vtu">VTU</a>}
      </div>
    </>
  );
}

/** Whether a hand would notice what stands out. */
function Noticed({ share }: { share: number }) {
  const { least, most } = NOTICED_SHARE;
  return (
    <p class="map-hint" title={t('map.noticed_source')} data-testid="map-noticed" data-noticed={noticedBy(share)}>
      {t(`map.noticed_${noticedBy(share)}`, { least: Math.round(100 * least), most: Math.round(100 * most) })}
    </p>
  );
}
