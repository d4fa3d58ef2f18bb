// The legend of the colours.

import { named, t } from '../i18n';
import type { Legend } from '../scene';
import { legend } from './body';
import { formatNumber } from './quantity';

export function LegendBox() {
  const shown = legend.value;
  if (shown === null) return null;
  return (
    <figure class="legend" aria-label={t('view.legend')} data-testid="legend">
      <figcaption>{t(`colour.${shown.title}`)}</figcaption>
      {shown.categories === undefined ? <Bar shown={shown} /> : (
        <ul>
          {shown.categories.map(({ name, colour }, index) => (
            <li key={index}><span class="swatch" style={{ background: colour }} />{named('tissue', name)}</li>
          ))}
        </ul>
      )}
    </figure>
  );
}

function Bar({ shown }: { shown: Legend }) {
  const middle = shown.isLog ? Math.sqrt(shown.min * shown.max) : (shown.min + shown.max) / 2;
  return (
    <>
      <div class="legend-bar" style={{ background: `linear-gradient(to right, ${shown.stops.join(', ')})` }} />
      <div class="legend-scale" data-min={shown.min} data-max={shown.max}>
        {[shown.min, middle, shown.max].map((value, index) => <span key={index}>{inUnit(value, shown)}</span>)}
      </div>
    </>
  );
}

/** A value of the legend; all values have the unit that suits the largest. */
function inUnit(value: number, { title, unit, max }: Legend): string {
  if (unit === '' || title === 'stretch') return value.toFixed(2);
  const [factor, name] = unit === 'm' ? [1e-3, 'mm'] : unit !== 'Pa' || max < 1e3 ? [1, unit] : max < 1e6 ? [1e3, 'kPa'] : [1e6, 'MPa'];
  return `${formatNumber(value / factor, 2)} ${name}`;
}
