// How far a press goes: to a depth, or until the tissue pushes back with a force. Both can be typed.

import { t } from '../i18n';
import { state } from '../store';
import { QuantityField, Segmented } from './controls';
import { formatQuantity, inMillimetres, parseQuantity } from './quantity';
import { chosenDepth, chosenForce, greatestForce, PRESS_BY, pressBy, pressDepth } from './settings';

/** The least force that can be asked for, N. */
const LEAST_FORCE = 0.05;

export function PressGoal({ testid }: { testid: string }) {
  const greatest = state.value?.greatest_depth ?? 0.02;
  const mostForce = greatestForce.value;
  const least = Math.min(0.0005, greatest / 20);
  return (
    <div class="press-goal">
      <Segmented
        label={t('press.by')}
        isLabelHidden
        value={pressBy.value}
        options={PRESS_BY.map((value) => ({ value, label: t(`press.by_${value}`), testid: `${testid}-by-${value}` }))}
        onChange={(by) => (pressBy.value = by)}
      />
      {pressBy.value === 'depth' ? (
        <QuantityField
          key="depth"
          label={t('device.press_depth')}
          value={inMillimetres(pressDepth.value, 2).replace(/\.?0+ /, ' ')}
          dimension="length"
          range={{ min: least, max: greatest }}
          onCommit={async (text) => {
            const depth = parseQuantity(text, 'length');
            if (depth === null) return t('press.no_depth');
            if (depth < least - 1e-9 || depth > greatest + 1e-9) return t('press.depth_range', { least: formatQuantity(least, 'length', 2), most: formatQuantity(greatest, 'length', 3) });
            chosenDepth.value = depth;
            return null;
          }}
          testid={`${testid}-depth`}
        />
      ) : (
        <QuantityField
          key="force"
          label={t('press.force')}
          value={formatQuantity(Math.min(chosenForce.value, mostForce), 'force')}
          dimension="force"
          range={{ min: LEAST_FORCE, max: Math.min(mostForce, 10), isLogarithmic: true }}
          hint={t('press.force_hint')}
          onCommit={async (text) => {
            const force = parseQuantity(text, 'force');
            if (force === null) return t('press.no_force');
            if (force < LEAST_FORCE || force > mostForce) return t('press.force_range', { least: formatQuantity(LEAST_FORCE, 'force'), most: formatQuantity(mostForce, 'force') });
            chosenForce.value = force;
            return null;
          }}
          testid={`${testid}-force`}
        />
      )}
    </div>
  );
}
