// Undo and redo of changes of the scene: two buttons, and the usual keys.

import { useEffect } from 'preact/hooks';
import { t } from '../i18n';
import { askAloud, isController, isHiding, notify, state } from '../store';
import { Button } from './controls';
import { Icon } from './icons';

type Way = 'undo' | 'redo';

/** Why the scene cannot be changed now; null if it can. */
function hindrance(): string | null {
  const now = state.value;
  if (!isController.value) return t('undo.not_in_control');
  if (isHiding.value) return t('undo.in_game');
  if (now?.recording.is_recording) return t('undo.in_recording');
  return null;
}

const count = (way: Way): number => (way === 'undo' ? state.value?.n_undo : state.value?.n_redo) ?? 0;

function go(way: Way): void {
  const why = hindrance() ?? (count(way) === 0 ? t(`undo.no_${way}`) : null);
  if (why === null) void askAloud({ type: way });
  else notify('info', why);
}

/** The way that a key asks for. Text that is being typed has an undo of its own. */
function wayOf(event: KeyboardEvent): Way | null {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return null;
  const at = event.target;
  if (at instanceof HTMLTextAreaElement || (at instanceof HTMLInputElement && at.type === 'text' && at.dataset.draft !== 'no')) return null;
  const key = event.key.toLowerCase();
  if (key === 'z') return event.shiftKey ? 'redo' : 'undo';
  return key === 'y' ? 'redo' : null;
}

export function Undo() {
  useEffect(() => {
    const onKey = (event: KeyboardEvent): void => {
      const way = wayOf(event);
      // A dialog lies over the scene.
      if (way === null || document.querySelector('dialog[open]') !== null) return;
      event.preventDefault();
      go(way);
    };
    window.addEventListener('keydown', onKey);
    return () => window.removeEventListener('keydown', onKey);
  }, []);
  const why = hindrance();
  return (
    <div class="undo" role="group" aria-label={t('undo.title')}>
      {(['undo', 'redo'] as const).map((way) => (
        <Button
          key={way}
          kind="quiet"
          label={why === null ? t(`undo.${way}`) : `${t(`undo.${way}`)}: ${why}`}
          disabled={why !== null || count(way) === 0}
          onClick={() => go(way)}
          testid={way}
        >
          <Icon name={way} />
        </Button>
      ))}
    </div>
  );
}
