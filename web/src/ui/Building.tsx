// The time that a body takes to be built, and the way to keep the present one.

import { useEffect, useState } from 'preact/hooks';
import { t } from '../i18n';
import { askAloud, isController, state } from '../store';
import { Button } from './controls';

/** Shown after so many seconds: most bodies are there sooner. */
const LONG = 3;

/** Whole seconds since a moment of `performance.now()`. */
export function useSeconds(since: number): number {
  const elapsed = (): number => Math.floor((performance.now() - since) / 1000);
  const [seconds, setSeconds] = useState(elapsed);
  useEffect(() => {
    setSeconds(elapsed());
    const timer = window.setInterval(() => setSeconds(elapsed()), 500);
    return () => window.clearInterval(timer);
  }, [since]);
  return seconds;
}

export function Building() {
  const [since] = useState(() => performance.now());
  const seconds = useSeconds(since);
  // The first body cannot be left: there is none before it.
  const hasBody = state.value?.scene != null;
  return (
    <p class="chip building" role="status" data-testid="building">
      <span class="spinner" aria-hidden="true" />
      {t('phase.building_long')}
      {seconds >= LONG && ` ${t('building.seconds', { seconds })}`}
      {seconds >= LONG && hasBody && isController.value && (
        <Button kind="quiet" onClick={() => void askAloud({ type: 'cancel_build' })} testid="cancel-build">{t('building.cancel')}</Button>
      )}
    </p>
  );
}
