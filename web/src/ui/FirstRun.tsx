// The first minute: where to press, and a hand that shows it.

import { useEffect, useRef } from 'preact/hooks';
import { t } from '../i18n';
import { isController, isReplaying, state } from '../store';
import { bodyView } from './body';
import { Button } from './controls';
import { canShow, ghost, hasPressed, showMe, stopGhost } from './ghost';
import { picking } from './settings';

/** What the ghost does, with the way to stop it. */
export function GhostChip() {
  const now = ghost.value;
  if (now !== 'opening' && now !== 'stroking') return null;
  return (
    <p class="chip" role="status" data-testid="ghost" data-ghost={now}>
      {t(now === 'opening' ? 'first.opening' : 'first.watch')}
      <Button kind="quiet" onClick={stopGhost} testid="ghost-stop">{t('first.stop')}</Button>
    </p>
  );
}

/** Points to the place to press, until the first press and after the ghost. */
export function FirstHint() {
  const isTurn = ghost.value === 'done';
  const isWanted = isTurn || (ghost.value === 'off' && !hasPressed.value);
  const isPossible = isController.value && !isReplaying.value && picking.value === null && state.value?.phase === 'running' && !state.value.is_motion_running && state.value.game == null;
  return isWanted && isPossible ? <Hint isTurn={isTurn} /> : null;
}

function Hint({ isTurn }: { isTurn: boolean }) {
  const element = useRef<HTMLElement>(null);
  const view = bodyView.value;
  useEffect(() => view?.pin(element.current!, () => view.home), [view]);
  return (
    <aside ref={element} class="first-hint" hidden aria-label={t('first.title')}>
      <svg class="first-mark" viewBox="-80 -80 110 110" width="110" height="110" aria-hidden="true">
        <path class="first-lead" d="M-48 -62C-44 -34 -34 -18 -22 -8" />
        <path class="first-lead" d="M-31.500 -9.500L-22 -8L-23 -17.500" />
        <ellipse class="first-pulse" rx="17" ry="8.500" />
        <ellipse class="first-ring" rx="17" ry="8.500" />
      </svg>
      <p class="chip first-label" data-testid="first-hint" data-turn={isTurn}>
        <strong>{t(isTurn ? 'first.turn' : 'first.press')}</strong>
        {!isTurn && canShow() && <Button kind="quiet" onClick={() => void showMe()} testid="show-me">{t('first.show')}</Button>}
      </p>
    </aside>
  );
}
