// The frame around the lens: the names of the layers, the force, the pressure, a scale. The view draws the section
// itself.

import { named, t } from '../i18n';
import { state } from '../store';
import { lensPicture } from './body';
import { Button } from './controls';
import { Icon } from './icons';
import { formatQuantity } from './quantity';
import { show } from './settings';

/** Two names nearer to each other than this would overlap, px. */
const NAME_HEIGHT = 16;

export function LensBox() {
  const shown = lensPicture.value;
  if (shown === null) return null;
  const { place, force, forceAt, pressure, names, tenMillimetres } = shown;
  const layers = state.value?.layers ?? [];
  return (
    <figure
      class="lens"
      aria-label={t('lens.title')}
      style={{ left: `${place.x}px`, top: `${place.y}px`, width: `${place.width}px`, height: `${place.height}px` }}
      data-testid="lens"
      data-pressure={pressure ?? ''}
    >
      <figcaption>{t('lens.title')}</figcaption>
      <Button kind="quiet" label={t('lens.close')} onClick={() => show({ lens: false })} testid="lens-close"><Icon name="close" /></Button>
      {names.filter(({ y }, i) => i === 0 || y - names[i - 1].y >= NAME_HEIGHT).map(({ layer, y }) => (
        <span key={layer} class="lens-name" style={{ top: `${Math.round(y)}px` }}>{named('tissue', layers[layer]?.name ?? '')}</span>
      ))}
      {forceAt !== null && (
        <span class="lens-force" style={{ left: `${Math.round(forceAt.x)}px`, top: `${Math.round(forceAt.y)}px` }}>{`${force.toFixed(2)} N`}</span>
      )}
      <span class="lens-scale" style={{ width: `${Math.round(tenMillimetres)}px` }}>10 mm</span>
      {pressure !== null && <span class="lens-pressure">{t('lens.pressure', { pressure: formatQuantity(pressure, 'pressure', 2) })}</span>}
    </figure>
  );
}
