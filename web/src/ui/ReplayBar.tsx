// The bar of a replay: time slider and playback.

import { useId } from 'preact/hooks';
import { t } from '../i18n';
import { askAloud, isController, state } from '../store';
import { Button } from './controls';
import { Icon } from './icons';
import { KEY_STEP, drag, lastSought, replayTime, seek } from './replay';

const ARROWS: Record<string, number> = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 };

export function ReplayBar() {
  const recording = state.value?.recording;
  const id = useId();
  if (recording === undefined || !recording.is_replaying) return null;
  const shown = Math.min(replayTime.value, recording.duration);
  const cannot = !isController.value;
  return (
    <section class="replay-bar" aria-label={t('record.replay')} data-testid="replay-bar">
      <Button
        label={t(recording.is_playing ? 'replay.pause' : 'replay.play')}
        disabled={cannot}
        onClick={() => void askAloud({ type: 'play', on: !recording.is_playing })}
        testid="replay-play"
      >
        <Icon name={recording.is_playing ? 'pause' : 'play'} />
      </Button>
      <label class="sr-only" for={id}>{t('replay.time')}</label>
      <input
        id={id}
        type="range"
        min={0}
        max={recording.duration}
        step={0.001}
        value={shown}
        disabled={cannot}
        aria-valuetext={`${shown.toFixed(1)} s`}
        onKeyDown={(event) => {
          const step = ARROWS[event.key];
          if (step === undefined) return;
          event.preventDefault();
          seek(lastSought() + step * KEY_STEP);
        }}
        onPointerDown={() => drag(true)}
        onInput={(event) => seek(event.currentTarget.valueAsNumber)}
        onChange={() => drag(false)}
        onPointerUp={() => drag(false)}
        onPointerCancel={() => drag(false)}
        data-testid="replay-slider"
      />
      <output for={id}>{shown.toFixed(1)} / {recording.duration.toFixed(1)} s</output>
      <Button disabled={cannot} onClick={() => void askAloud({ type: 'close_replay' })} testid="replay-close">{t('replay.close')}</Button>
    </section>
  );
}
