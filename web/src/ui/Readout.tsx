// The force on the hand as a number, a bar and curves.

import { signal } from '@preact/signals';
import { useEffect, useRef, useState } from 'preact/hooks';
import { t } from '../i18n';
import { isReplaying, latestFrame, onFrame, state } from '../store';
import type { FrameSnapshot } from '../generated/wire';
import { axes } from './axes';
import { Button } from './controls';
import { Curves } from './Curves';
import { magnitude } from './history';
import { Icon } from './icons';
import { formatNumber, inMillimetres, withPrefix } from './quantity';
import { PressDepth } from './panels/DevicePanel';
import { isDeepest } from './settings';

/** Share of the force that reaches the hand, %. */
const gain = signal(100);

/** Between two changes of the numbers, ms; faster ones cannot be read. */
const PERIOD = 80;

export function Readout() {
  return (
    <aside class="readout" aria-label={t('readout.title')}>
      <div class="numbers">
        <ForceNumber />
        <PressDepth testid="press-depth" />
      </div>
      <Curves />
    </aside>
  );
}

/** Small forces of the reference method are shown in mN: the thesis has dyn. */
export function written(force: number): string {
  return force > 0 && force < 0.005 && state.peek()?.method === 'reference' ? withPrefix(force, 'N', 2) : `${force.toFixed(2)} N`;
}

function ForceNumber() {
  const number = useRef<HTMLOutputElement>(null);
  const depth = useRef<HTMLSpanElement>(null);
  const gauge = useRef<HTMLDivElement>(null);
  const bar = useRef<HTMLDivElement>(null);
  const scale = useRef<HTMLSpanElement>(null);
  const [spoken, setSpoken] = useState('');

  // Text is set directly, not through signals, so that all of it is of one frame.
  useEffect(() => {
    let newest: FrameSnapshot | null = null;
    let timer = 0;
    const set = (): void => {
      timer = 0;
      if (newest === null) return;
      const force = magnitude(newest.force);
      const element = number.current!;
      element.textContent = written(force);
      element.dataset.newtons = String(force);
      element.dataset.tick = String(newest.tick);
      depth.current!.textContent = inMillimetres(newest.depth);
      depth.current!.dataset.metres = String(newest.depth);
      gauge.current!.setAttribute('aria-valuenow', force.toFixed(2));
      gauge.current!.setAttribute('aria-valuemax', String(axes.force));
      scale.current!.textContent = `${formatNumber(axes.force)} N`;
      // Above the skin a reduced force makes no difference.
      gain.value = newest.depth > 0 ? Math.round(newest.gain * 100) : 100;
      newest = null;
    };
    const stop = onFrame((frame) => {
      newest = frame;
      const force = magnitude(frame.force);
      axes.take(force, frame.depth);
      bar.current!.style.transform = `scaleX(${Math.min(1, force / axes.force)})`;
      if (timer === 0) timer = window.setTimeout(set, PERIOD);
    });
    return () => {
      stop();
      window.clearTimeout(timer);
    };
  }, []);

  const speak = (): void => {
    if (latestFrame === null) return;
    const words = t('readout.spoken', {
      force: written(magnitude(latestFrame.force)),
      depth: inMillimetres(latestFrame.depth),
    });
    // Screen readers speak a text only when it changes.
    setSpoken(words === spoken ? `${words}\u00a0` : words);
  };

  return (
    <section class="force" aria-labelledby="force-title">
      <div class="section-head">
        <h2 id="force-title">{t(isReplaying.value ? 'readout.force_replayed' : 'readout.force')}</h2>
        <Button kind="quiet" label={t('readout.speak')} onClick={speak}><Icon name="speak" /></Button>
      </div>
      <output ref={number} class="force-number" aria-live="off" data-testid="force-number" data-newtons="0" data-tick="0">0.00 N</output>
      <div ref={gauge} class="gauge" role="meter" aria-label={t('readout.force')} aria-valuemin={0} aria-valuemax={1} aria-valuenow={0}>
        <div ref={bar} class="gauge-bar" />
      </div>
      <div class="gauge-scale" aria-hidden="true"><span>0</span><span ref={scale} /></div>
      <p class="depth-line">
        <span>
          {t('readout.depth')}
          <span role="status">{isDeepest.value && <em data-testid="deepest">{t('readout.deepest')}</em>}</span>
        </span>
        <span ref={depth} class="depth-number" data-testid="depth-number">–</span>
      </p>
      {gain.value < 100 && <p class="held-back" role="status">{t('readout.held_back')}</p>}
      <p class="sr-only" role="status" aria-live="polite">{spoken}</p>
    </section>
  );
}
