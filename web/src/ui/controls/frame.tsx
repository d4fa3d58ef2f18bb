// The frame of a panel: sections, buttons, and the lock for pages that only watch.

import type { ComponentChildren } from 'preact';
import { useId } from 'preact/hooks';
import { apiUrl } from '../../connection';
import { t } from '../../i18n';
import { askAloud, isWatching, status } from '../../store';

export function Section(props: { title: string; hint?: string; action?: ComponentChildren; children: ComponentChildren }) {
  const id = useId();
  return (
    <div class="section" role="group" aria-labelledby={id}>
      <div class="section-head">
        <h3 id={id}>{props.title}</h3>
        {props.action}
      </div>
      {props.hint !== undefined && <p class="hint">{props.hint}</p>}
      {props.children}
    </div>
  );
}

export function Button(props: {
  children: ComponentChildren;
  onClick: () => void;
  kind?: 'primary' | 'danger' | 'quiet';
  disabled?: boolean;
  label?: string;
  pressed?: boolean;
  testid?: string;
}) {
  return (
    <button
      type="button"
      class={`button ${props.kind ?? ''}`}
      onClick={props.onClick}
      disabled={props.disabled}
      aria-label={props.label}
      title={props.label}
      aria-pressed={props.pressed}
      data-testid={props.testid}
    >
      {props.children}
    </button>
  );
}

/** Controls for the controlling page: on all others they are disabled, with the reason. */
export function Controlled(props: { children: ComponentChildren }) {
  const isLost = status.value !== 'open';
  return (
    <>
      {isWatching.value && (
        <div class="watching" role="note">
          <p>{t('control.watching_hint')}</p>
          <Button kind="primary" onClick={() => void askAloud({ type: 'take_control' })}>
            {t('control.take')}
          </Button>
        </div>
      )}
      <fieldset class="controlled" disabled={isWatching.value || isLost}>
        {props.children}
      </fieldset>
    </>
  );
}

export function Download(props: { path: string; name: string; children: ComponentChildren; disabled?: boolean; testid?: string }) {
  if (props.disabled) {
    return <span class="button" aria-disabled="true" data-testid={props.testid}>{props.children}</span>;
  }
  return (
    <a class="button" href={apiUrl(props.path)} download={props.name} data-testid={props.testid}>{props.children}</a>
  );
}
