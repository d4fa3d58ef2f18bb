// The goals of a press: a band for the force and a limit at which it would hurt.

import type { Signal } from '@preact/signals';
import { t } from '../i18n';
import { QuantityField, Section, Toggle } from './controls';
import { inBandTenths, reached } from './goals';
import { formatQuantity, parseQuantity } from './quantity';
import { bandHigh, bandLow, goalsSound, hasBand, hasPainLimit, painLimit } from './settings';

export function Goals() {
  return (
    <Section title={t('goals.title')} hint={t('goals.hint')}>
      <Toggle label={t('goals.band')} on={hasBand.value} onChange={(on) => (hasBand.value = on)} testid="band-on" />
      {hasBand.value && (
        <>
          <Force label={t('goals.from')} of={bandLow} isAllowed={(force) => force < bandHigh.value} testid="band-low" />
          <Force label={t('goals.to')} of={bandHigh} isAllowed={(force) => force > bandLow.value} testid="band-high" />
        </>
      )}
      <Toggle label={t('goals.pain')} on={hasPainLimit.value} onChange={(on) => (hasPainLimit.value = on)} testid="pain-on" />
      {hasPainLimit.value && <Force label={t('goals.pain_at')} of={painLimit} isAllowed={() => true} testid="pain-limit" />}
      {(hasBand.value || hasPainLimit.value) && (
        <Toggle label={t('goals.sound')} on={goalsSound.value} onChange={(on) => (goalsSound.value = on)} testid="goals-sound" />
      )}
    </Section>
  );
}

function Force(props: { label: string; of: Signal<number>; isAllowed: (force: number) => boolean; testid: string }) {
  return (
    <QuantityField
      label={props.label}
      value={formatQuantity(props.of.value, 'force')}
      dimension="force"
      onCommit={async (text) => {
        const force = parseQuantity(text, 'force');
        if (force === null || force <= 0 || force > 100) return t('press.no_force');
        if (!props.isAllowed(force)) return t('goals.order');
        props.of.value = force;
        return null;
      }}
      testid={props.testid}
    />
  );
}

/** Where the force is, beside the number. */
export function Reach() {
  if (!hasBand.value && !hasPainLimit.value) return null;
  const now = reached.value;
  return (
    <p class="reach" data-reached={now} role="status" data-testid="reach">
      {now === 'none' ? (hasBand.value ? t('goals.band_is', { low: formatQuantity(bandLow.value, 'force'), high: formatQuantity(bandHigh.value, 'force') }) : '\u00a0') : t(now === 'pain' ? 'goals.pain_now' : `goals.${now}`)}
      {now === 'in' && <span aria-hidden="true">{` ${(inBandTenths.value / 10).toFixed(1)} s`}</span>}
    </p>
  );
}

/** The band and the limit on the bar of the force, whose end is `most` N. */
export function GoalMarks({ most }: { most: number }) {
  const at = (force: number): string => `${(100 * Math.min(1, force / most)).toFixed(2)}%`;
  return (
    <div class="goal-marks" aria-hidden="true">
      {hasBand.value && <span class="band" style={{ left: at(bandLow.value), right: `${(100 - 100 * Math.min(1, bandHigh.value / most)).toFixed(2)}%` }} />}
      {hasPainLimit.value && painLimit.value < most && <span class="pain" style={{ left: at(painLimit.value) }} />}
    </div>
  );
}
