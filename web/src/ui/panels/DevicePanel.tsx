// The haptic device, the hand that holds it, and the force as sound and vibration.

import { CHOICES } from '../../generated/scene';
import { t } from '../../i18n';
import { edit, scene, state } from '../../store';
import { aloud, Controlled, Section, Segmented, Select, Toggle } from '../controls';
import { canVibrate } from '../feedback';
import { Goals } from '../Goals';
import { PressGoal } from '../PressGoal';
import { formatNumber } from '../quantity';
import { handMode, hasSound, hasVibration } from '../settings';

export function DevicePanel() {
  const device = scene.value?.device ?? {};
  const now = state.value;
  return (
    <>
      <Controlled>
        <Section title={t('device.device')} hint={now === null ? undefined : t('device.max_force', { force: formatNumber(now.max_force) })}>
          <Select
            label={t('device.preset')}
            value={device.preset ?? 'falcon'}
            options={CHOICES.DevicePreset.map((value) => ({ value, label: t(`preset.${value}`) }))}
            onChange={(preset) => aloud(edit(['/device/preset', preset]))}
            testid="device-preset"
          />
          <Segmented
            label={t('device.grip')}
            value={device.grip ?? 'medium'}
            options={CHOICES.Grip.map((value) => ({ value, label: t(`grip.${value}`) }))}
            onChange={(grip) => aloud(edit(['/device/grip', grip]))}
          />
          {device.preset !== 'ideal' && <p class="hint">{t('device.friction_hint')}</p>}
        </Section>
      </Controlled>
      <Section title={t('device.hand')}>
        <Segmented
          label={t('device.mouse')}
          value={handMode.value}
          options={(['press', 'orbit'] as const).map((value) => ({ value, label: t(`hand.${value}`) }))}
          onChange={(mode) => (handMode.value = mode)}
        />
        <PressGoal testid="panel-press" />
      </Section>
      <Goals />
      <Section title={t('feedback.title')} hint={t('feedback.hint')}>
        <Toggle label={t('feedback.sound')} on={hasSound.value} onChange={(on) => (hasSound.value = on)} testid="sound" />
        <Toggle
          label={t('feedback.vibration')}
          on={hasVibration.value}
          onChange={(on) => (hasVibration.value = on)}
          testid="vibration"
        />
        {!canVibrate() && <p class="hint">{t('feedback.no_vibration')}</p>}
      </Section>
    </>
  );
}
