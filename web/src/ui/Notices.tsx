// Notices: as toasts for some seconds, and in a list.

import { useEffect, useRef } from 'preact/hooks';
import { signal } from '@preact/signals';
import { t } from '../i18n';
import { dismissToast, notices, toasts, type NoticeItem } from '../store';
import { Button } from './controls';
import { Icon } from './icons';

const isListOpen = signal(false);
const seen = signal(0);

export function NoticeButton() {
  const newest = notices.value[0]?.key ?? 0;
  const unseen = notices.value.filter((item) => item.key > seen.value && item.level !== 'info').length;
  return (
    <div class="notice-button">
      <button
        type="button"
        class="button quiet"
        aria-expanded={isListOpen.value}
        aria-label={unseen > 0 ? t('notices.open_unseen', { n: unseen }) : t('notices.open')}
        title={t('notices.open')}
        onClick={() => {
          isListOpen.value = !isListOpen.value;
          seen.value = newest;
        }}
        data-testid="notices-open"
      >
        <Icon name="bell" />
        {unseen > 0 && <span class="badge" aria-hidden="true">{unseen}</span>}
      </button>
      {isListOpen.value && <NoticeList />}
    </div>
  );
}

function NoticeList() {
  const place = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const close = (event: Event): void => {
      const isInside = event.target instanceof Element && event.target.closest('.notice-button') !== null;
      if (event instanceof KeyboardEvent ? event.key === 'Escape' : !isInside) isListOpen.value = false;
    };
    window.addEventListener('pointerdown', close);
    window.addEventListener('keydown', close);
    return () => {
      window.removeEventListener('pointerdown', close);
      window.removeEventListener('keydown', close);
    };
  }, []);
  return (
    <div class="notice-list" ref={place} role="region" aria-label={t('notices.title')} tabIndex={0}>
      <h2>{t('notices.title')}</h2>
      {notices.value.length === 0 && <p class="empty">{t('notices.none')}</p>}
      <ol data-testid="notice-list">
        {notices.value.map((item) => (
          <li key={item.key} class={item.level}>
            <time dateTime={item.at.toISOString()}>{item.at.toLocaleTimeString()}</time>
            <span class="sr-only">{t(`level.${item.level}`)}: </span>
            {item.text}
            {item.count > 1 && <span class="count">× {item.count}</span>}
          </li>
        ))}
      </ol>
    </div>
  );
}

/** Screen readers read errors at once and other notices at the next pause. */
export function Notices() {
  const shown = toasts.value
    .map((key) => notices.value.find((item) => item.key === key))
    .filter((item): item is NoticeItem => item !== undefined);
  return (
    <div class="toasts">
      <div aria-live="assertive" data-testid="toasts-error">
        {shown.filter((item) => item.level === 'error').map((item) => <Toast key={item.key} item={item} />)}
      </div>
      <div aria-live="polite" data-testid="toasts">
        {shown.filter((item) => item.level !== 'error').map((item) => <Toast key={item.key} item={item} />)}
      </div>
    </div>
  );
}

function Toast({ item }: { item: NoticeItem }) {
  return (
    <div class={`toast ${item.level}`} data-testid="toast">
      <p>
        <strong>{t(`level.${item.level}`)}</strong>
        {item.text}
        {item.count > 1 && ` (× ${item.count})`}
      </p>
      <Button kind="quiet" label={t('notices.dismiss')} onClick={() => dismissToast(item.key)}><Icon name="close" /></Button>
    </div>
  );
}
