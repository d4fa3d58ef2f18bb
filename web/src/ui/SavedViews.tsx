// Views that the user has saved: camera, colours and cutaway under a name. The browser keeps them.

import { useState } from 'preact/hooks';
import { t } from '../i18n';
import { Button } from './controls';
import { Icon } from './icons';
import { applyLook, presentLook, readLook, type Look } from './look';
import { remembered } from './settings';

const MOST_VIEWS = 20;
const LONGEST_NAME = 40;

interface SavedView {
  name: string;
  look: Look;
}

const isList = (value: unknown): boolean => Array.isArray(value);
const kept = remembered<unknown[]>('views', [], isList);

/** Those that can be read: the storage may hold anything. */
function saved(): SavedView[] {
  return kept.value.slice(0, MOST_VIEWS).flatMap((one) => {
    const { name, look } = (one ?? {}) as { name?: unknown; look?: unknown };
    const read = readLook(look);
    return typeof name === 'string' && name !== '' && read !== null ? [{ name: name.slice(0, LONGEST_NAME), look: read }] : [];
  });
}

export function SavedViews() {
  const [draft, setDraft] = useState('');
  const views = saved();
  const isFull = views.length >= MOST_VIEWS;
  const name = draft.trim() || t('views.name_of_new', { number: views.length + 1 });
  const save = (): void => {
    const others = views.filter((view) => view.name !== name);
    if (others.length >= MOST_VIEWS) return;
    kept.value = [...others, { name, look: presentLook() }];
    setDraft('');
  };
  return (
    <>
      <ul class="views" data-testid="saved-views">
        {views.map((view) => (
          <li key={view.name}>
            <Button onClick={() => applyLook(view.look)} testid={`saved-view-${view.name}`}>{view.name}</Button>
            <Button
              kind="quiet"
              label={t('lumps.remove_named', { name: view.name })}
              onClick={() => (kept.value = views.filter((other) => other.name !== view.name))}
            >
              <Icon name="close" />
            </Button>
          </li>
        ))}
      </ul>
      <form
        class="row save-view"
        onSubmit={(event) => {
          event.preventDefault();
          save();
        }}
      >
        <input
          type="text"
          maxLength={LONGEST_NAME}
          placeholder={t('views.name')}
          aria-label={t('views.name')}
          value={draft}
          onInput={(event) => setDraft(event.currentTarget.value)}
          data-testid="view-name"
        />
        <button type="submit" class="button" disabled={isFull} data-testid="view-save">{t('views.save')}</button>
      </form>
      {isFull && <p class="hint">{t('views.full', { n: MOST_VIEWS })}</p>}
    </>
  );
}
