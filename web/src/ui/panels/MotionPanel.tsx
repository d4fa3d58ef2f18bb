// Motions of the simulated hand: a press, a stroke, a palpation.

import { CHOICES, type MotionKind } from '../../generated/scene';
import { t } from '../../i18n';
import { askAloud, edit, scene, state } from '../../store';
import { aloud, Button, Controlled, PointFields, QuantityField, Section, Segmented, Select } from '../controls';
import { formatQuantity, parseQuantity, writtenQuantity, type Dimension } from '../quantity';
import { picking } from '../settings';

const ACROSS: MotionKind[] = ['stroke', 'drag', 'palpate'];
const REPEATED: MotionKind[] = ['drag', 'tap', 'palpate'];

export function MotionPanel() {
  const motion = scene.value?.motion ?? {};
  const press = scene.value?.press ?? {};
  const kind = motion.kind ?? 'press';
  const isRunning = state.value?.is_motion_running ?? false;
  const isPicking = picking.value?.kind === 'place';
  const field = (key: 'depth' | 'speed' | 'hold' | 'length' | 'tremor' | 'above', dimension: Dimension, range?: [number, number]) => (
    <QuantityField
      label={t(`motion.${key}`)}
      value={motion[key] ?? (key === 'depth' ? formatQuantity(state.value?.usual_depth ?? 0, 'length') : '')}
      dimension={dimension}
      range={range && { min: range[0], max: range[1] }}
      onCommit={(value) => edit([`/motion/${key}`, value])}
      testid={`motion-${key}`}
    />
  );
  return (
    <Controlled>
      <Section title={t('motion.title')} hint={t('motion.hint')}>
        <div class="buttons">
          {isRunning ? (
            <Button kind="primary" onClick={() => void askAloud({ type: 'stop_motion' })} testid="motion-stop">{t('motion.stop')}</Button>
          ) : (
            <Button kind="primary" onClick={() => void askAloud({ type: 'run_motion' })} testid="motion-run">{t('motion.run')}</Button>
          )}
        </div>
        <Select
          label={t('motion.kind')}
          value={kind}
          options={CHOICES.MotionKind.map((value) => ({ value, label: t(`motion_kind.${value}`) }))}
          onChange={(value) => aloud(edit(['/motion/kind', value]))}
          testid="motion-kind"
        />
        <p class="hint">{t(`motion_about.${kind}`)}</p>
      </Section>
      <Section title={t('motion.how')}>
        {field('depth', 'length', [0.5e-3, state.value?.greatest_depth ?? 20e-3])}
        {field('speed', 'speed', [5e-3, 200e-3])}
        {(kind === 'press' || kind === 'palpate') && field('hold', 'time')}
        {ACROSS.includes(kind) && field('length', 'length', [5e-3, 100e-3])}
        {ACROSS.includes(kind) && (
          <Segmented
            label={t('motion.along')}
            value={typeof motion.along === 'string' ? motion.along : ''}
            options={(['x', 'y', 'z'] as const).map((value) => ({ value: value as string, label: value }))}
            onChange={(along) => aloud(edit(['/motion/along', along]))}
          />
        )}
        {REPEATED.includes(kind) && (
          <QuantityField
            label={t('motion.times')}
            value={writtenQuantity(motion.times ?? 3)}
            dimension="number"
            onCommit={(value) => edit(['/motion/times', parseQuantity(value, 'number') ?? value])}
            testid="motion-times"
          />
        )}
        {field('tremor', 'length')}
        {field('above', 'length')}
      </Section>
      <Section title={t('motion.where')}>
        {press.at !== undefined && <PointFields label={t('motion.at')} value={press.at} path="/press/at" />}
        <div class="buttons">
          <Button pressed={isPicking} onClick={() => (picking.value = isPicking ? null : { kind: 'place' })} testid="motion-place">
            {t(isPicking ? 'lumps.picking' : 'motion.pick')}
          </Button>
        </div>
      </Section>
    </Controlled>
  );
}
