// What the colours mean.

import { named, t } from '../i18n';
import type { Legend } from '../scene';
import { legend } from './body';
import { formatNumber, formatQuantity } from './quantity';

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

function inUnit(value: number, { title, unit }: Legend): string {
  if (unit === '' || title === 'stretch') return value.toFixed(2);
  if (unit === 'Pa') return formatQuantity(value, 'pressure', 2);
  if (unit === 'm') return `${formatNumber(value * 1e3, 2)} mm`;
  return `${formatNumber(value, 2)} ${unit}`;
}
