// Switches, menus and rows of choices.

import { useEffect, useId, useState } from 'preact/hooks';
import { state } from '../../store';

export function Toggle(props: {
  label: string;
  on: boolean;
  onChange: (on: boolean) => void;
  disabled?: boolean;
  hint?: string;
  testid?: string;
}) {
  const id = useId();
  return (
    <div class="row toggle">
      <label for={id}>{props.label}</label>
      <input
        id={id}
        type="checkbox"
        role="switch"
        checked={props.on}
        disabled={props.disabled}
        title={props.hint}
        onChange={(event) => props.onChange(event.currentTarget.checked)}
        data-testid={props.testid}
      />
    </div>
  );
}

/** How long an answer may take before the old value is shown again, ms. */
const ANSWER_WAIT = 600;

/** A choice that is shown at once, and kept while the engine builds the body that it asks for. */
function usePending<T>(value: T): [shown: T, choose: (chosen: T) => void] {
  const [pending, setPending] = useState<{ value: T } | null>(null);
  const phase = state.value?.phase;
  useEffect(() => setPending(null), [value]);
  useEffect(() => {
    if (pending === null || phase === 'building') return;
    const timer = window.setTimeout(() => setPending(null), ANSWER_WAIT);
    return () => window.clearTimeout(timer);
  }, [pending, phase]);
  return [pending === null ? value : pending.value, (chosen) => setPending({ value: chosen })];
}

export function Select<T extends string>(props: {
  label: string;
  value: T | '';
  options: readonly { value: T; label: string; disabled?: boolean }[];
  onChange: (value: T) => void;
  isLabelHidden?: boolean;
  disabled?: boolean;
  testid?: string;
}) {
  const id = useId();
  const [shown, choose] = usePending<T | ''>(props.value);
  const isKnown = props.options.some((option) => option.value === shown);
  return (
    <div class={props.isLabelHidden ? 'select-alone' : 'row'}>
      <label for={id} class={props.isLabelHidden ? 'sr-only' : ''}>{props.label}</label>
      <select
        id={id}
        value={shown}
        disabled={props.disabled}
        onChange={(event) => {
          const chosen = event.currentTarget.value as T;
          choose(chosen);
          props.onChange(chosen);
        }}
        data-testid={props.testid}
      >
        {!isKnown && <option value={shown}>{shown === '' ? '–' : shown}</option>}
        {props.options.map((option) => (
          <option key={option.value} value={option.value} disabled={option.disabled}>{option.label}</option>
        ))}
      </select>
    </div>
  );
}

/** A choice of few, all in sight. */
export function Segmented<T extends string>(props: {
  label: string;
  value: T;
  options: readonly { value: T; label: string; testid?: string }[];
  onChange: (value: T) => void;
  disabled?: boolean;
  isLabelHidden?: boolean;
}) {
  const name = useId();
  const [shown, choose] = usePending(props.value);
  return (
    <div class={props.isLabelHidden ? 'segmented-alone' : 'row'} role="radiogroup" aria-label={props.label}>
      {!props.isLabelHidden && <span class="label" aria-hidden="true">{props.label}</span>}
      <div class="segmented">
        {props.options.map((option) => (
          <label key={option.value} class={shown === option.value ? 'chosen' : ''}>
            <input
              type="radio"
              name={name}
              value={option.value}
              checked={shown === option.value}
              disabled={props.disabled}
              onChange={() => {
                choose(option.value);
                props.onChange(option.value);
              }}
              data-testid={option.testid}
            />
            <span>{option.label}</span>
          </label>
        ))}
      </div>
    </div>
  );
}
