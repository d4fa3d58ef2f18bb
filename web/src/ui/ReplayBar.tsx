// The bar of a replay: time slider and playback.

import { signal } from '@preact/signals';
import { useEffect, useId, useRef } from 'preact/hooks';
import { t } from '../i18n';
import { askAloud, isController, onFrame, send, state } from '../store';
import { Button } from './controls';
import { Icon } from './icons';

/** The time shown, s. */
const time = signal(0);
const SEEK_PERIOD = 50;
/** Step of an arrow key, s: longer than a frame, so that it always reaches another one. */
const KEY_STEP = 0.05;
/** Longest time for which frames from before a seek are not shown, ms. */
const ARRIVAL = 1000;
const ARROWS: Record<string, number> = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 };

export function ReplayBar() {
  const recording = state.value?.recording;
  const id = useId();
  const isDragging = useRef(false);
  const wanted = useRef<number | null>(null);
  // The last time sought, until a frame of it has come: frames on the way show the time before it.
  const sought = useRef<{ time: number; at: number } | null>(null);

  useEffect(() => {
    let shownAt = 0;
    return onFrame((frame) => {
      const now = performance.now();
      if (frame.is_replay === 0 || isDragging.current || now - shownAt < 80) return;
      const last = sought.current;
      const isOnTheWay = last !== null && Math.abs(frame.time - last.time) > KEY_STEP && now - last.at < ARRIVAL;
      if (isOnTheWay) return;
      sought.current = null;
      shownAt = now;
      time.value = frame.time;
    });
  }, []);

  if (recording === undefined || !recording.is_replaying) return null;
  const seek = (to: number): void => {
    time.value = to;
    sought.current = { time: to, at: performance.now() };
    // Only the newest time is sent.
    if (wanted.current === null) {
      window.setTimeout(() => {
        send({ type: 'seek', time: wanted.current ?? to });
        wanted.current = null;
      }, SEEK_PERIOD);
    }
    wanted.current = to;
  };
  const shown = Math.min(time.value, recording.duration);
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
          seek(Math.min(Math.max((sought.current?.time ?? shown) + step * KEY_STEP, 0), recording.duration));
        }}
        onPointerDown={() => (isDragging.current = true)}
        onInput={(event) => seek(event.currentTarget.valueAsNumber)}
        onChange={() => (isDragging.current = false)}
        onPointerUp={() => (isDragging.current = false)}
        onPointerCancel={() => (isDragging.current = false)}
        data-testid="replay-slider"
      />
      <output for={id}>{shown.toFixed(1)} / {recording.duration.toFixed(1)} s</output>
      <Button disabled={cannot} onClick={() => void askAloud({ type: 'close_replay' })} testid="replay-close">{t('replay.close')}</Button>
    </section>
  );
}
