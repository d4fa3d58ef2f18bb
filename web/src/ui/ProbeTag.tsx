// The probe on the body: what the model says at one point.

import { named, t } from '../i18n';
import { state } from '../store';
import { bodyView, legend, probed } from './body';
import { Button } from './controls';
import { Icon } from './icons';
import { formatNumber, formatQuantity, inMillimetres } from './quantity';

export function ProbeTag() {
  const now = probed.value;
  if (now === null) return null;
  const { point, layer, displacement, stiffness, contact, value, at } = now;
  const shown = legend.value;
  const isPascal = shown?.unit === 'Pa';
  const [dx, dy, dz] = displacement;
  return (
    <div class="probe" style={{ transform: `translate(${Math.round(at.x)}px, ${Math.round(at.y)}px)` }}>
      <span class="probe-dot" />
      <div class="probe-card" data-testid="probe" data-displacement={Math.hypot(dx, dy, dz)} data-contact={contact ?? ''}>
        <Button kind="quiet" label={t('probe.remove')} onClick={() => bodyView.value?.setProbe(null)} testid="probe-remove"><Icon name="close" /></Button>
        <strong>{layer === null ? t('probe.skin') : named('tissue', state.value?.layers[layer]?.name ?? '')}</strong>
        <dl>
          <dt>{t('probe.place')}</dt><dd>{point.map((x) => (1e3 * x).toFixed(1)).join(', ')} mm</dd>
          <dt>{t('colour.displacement')}</dt><dd>{inMillimetres(Math.hypot(dx, dy, dz), 2)}</dd>
          {contact !== null && <><dt>{t('colour.contact')}</dt><dd>{formatQuantity(contact, 'pressure')}</dd></>}
          {value !== null && shown !== null && shown.title !== 'displacement' && shown.title !== 'contact' && shown.title !== 'stiffness' && (
            <><dt>{t(`colour.${shown.title}`)}</dt><dd>{isPascal ? formatQuantity(value, 'pressure') : formatNumber(value, 4)}</dd></>
          )}
          {state.value?.method !== 'reference' && <><dt>{t('probe.modulus')}</dt><dd>{formatQuantity(stiffness, 'pressure')}</dd></>}
        </dl>
      </div>
    </div>
  );
}
