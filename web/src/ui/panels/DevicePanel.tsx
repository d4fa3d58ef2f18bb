// The haptic device, the hand that holds it, and the force as sound and vibration.

import { CHOICES } from '../../generated/scene';
import { t } from '../../i18n';
import { edit, scene, state } from '../../store';
import { aloud, Controlled, Section, Segmented, Select, Slider, Toggle } from '../controls';
import { canVibrate } from '../feedback';
import { formatNumber, inMillimetres } from '../quantity';
import { chosenDepth, handMode, hasSound, hasVibration, pressDepth } from '../settings';

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
        <PressDepth testid="press-depth-panel" />
      </Section>
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

/** The depth to which a press goes. */
export function PressDepth({ testid }: { testid: string }) {
  const greatest = state.value?.greatest_depth ?? 0.02;
  return (
    <Slider
      label={t('device.press_depth')}
      value={pressDepth.value}
      min={Math.min(0.0005, greatest / 20)}
      max={greatest}
      step={greatest > 0.05 ? 0.001 : 0.00025}
      shown={inMillimetres(pressDepth.value)}
      onInput={(depth) => (chosenDepth.value = depth)}
      testid={testid}
    />
  );
}
