// Fields, switches and buttons that all panels share.

import type { ComponentChildren } from 'preact';
import { useEffect, useId, useRef, useState } from 'preact/hooks';
import { apiUrl } from '../connection';
import { t } from '../i18n';
import { askAloud, isWatching, notify, state, status } from '../store';
import { defaultUnit, formatQuantity, parseQuantity, tidied, withUnit, type Dimension } from './quantity';

/** Changes something, and says why it could not. */
export type Commit<T> = (value: T) => Promise<string | null>;

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

/** What only who controls may use: disabled, with the reason, for all others. */
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

/** How long an answer may take before what was there is shown again. */
const ANSWER_WAIT = 600;

/** What was chosen, shown while the engine builds what it says, and until that is there. */
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

/** A choice of few, all of them seen. */
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

/** A value of the page's own, chosen by sliding. */
export function Slider(props: {
  label: string;
  value: number;
  min: number;
  max: number;
  step: number;
  shown: string;
  onInput: (value: number) => void;
  disabled?: boolean;
  testid?: string;
}) {
  const id = useId();
  return (
    <div class="row slider">
      <label for={id}>{props.label}</label>
      <output for={id}>{props.shown}</output>
      <input
        id={id}
        type="range"
        min={props.min}
        max={props.max}
        step={props.step}
        value={props.value}
        aria-valuetext={props.shown}
        disabled={props.disabled}
        onInput={(event) => props.onInput(event.currentTarget.valueAsNumber)}
        data-testid={props.testid}
      />
    </div>
  );
}

const SLIDE_PERIOD = 100;
const LONGEST_BUILD = 3000;

/** When the body that was asked for last is there, or takes too long: while one slides, no queue of bodies shall grow. */
async function settled(): Promise<void> {
  const begin = performance.now();
  do {
    await new Promise((resolve) => window.setTimeout(resolve, SLIDE_PERIOD));
  } while (state.peek()?.phase === 'building' && performance.now() - begin < LONGEST_BUILD);
}

/** Sends the newest value only, and the next when the one before is answered. */
function useLatest(commit: Commit<string>, onError: (error: string | null) => void): (text: string) => void {
  const waiting = useRef<string | null>(null);
  const isBusy = useRef(false);
  const current = useRef({ commit, onError });
  current.current = { commit, onError };
  return (text) => {
    waiting.current = text;
    if (isBusy.current) return;
    isBusy.current = true;
    void (async () => {
      while (waiting.current !== null) {
        const next = waiting.current;
        waiting.current = null;
        current.current.onError(await current.current.commit(next));
        await settled();
      }
      isBusy.current = false;
    })();
  };
}

export interface Range {
  min: number;
  max: number;
  isLogarithmic?: boolean;
}

const SLIDER_STEPS = 200;

function toSlider(value: number, range: Range): number {
  const share = range.isLogarithmic
    ? Math.log(value / range.min) / Math.log(range.max / range.min)
    : (value - range.min) / (range.max - range.min);
  return Math.round(SLIDER_STEPS * Math.min(1, Math.max(0, share)));
}

function fromSlider(steps: number, range: Range): number {
  const share = steps / SLIDER_STEPS;
  return range.isLogarithmic
    ? range.min * (range.max / range.min) ** share
    : range.min + share * (range.max - range.min);
}

/** A quantity with its unit, written or slid; taken on Enter and on leaving. What is refused is said at the field. */
export function QuantityField(props: {
  label: string;
  /** As the scene writes it; empty where it does not say. */
  value: string;
  dimension: Dimension;
  onCommit: Commit<string>;
  range?: Range;
  placeholder?: string;
  disabled?: boolean;
  hint?: string;
  testid?: string;
}) {
  const id = useId();
  const [draft, setDraft] = useState<string | null>(null);
  const [error, setError] = useState<string | null>(null);
  const [isSliding, setSliding] = useState(false);
  const committed = useRef<string | null>(null);
  const seen = useRef(props.value);
  // What was committed is shown until the engine says what it has made of it.
  useEffect(() => {
    // The first time there is nothing new, and somebody may have begun to type before this runs.
    if (seen.current === props.value) return;
    seen.current = props.value;
    // What is being typed stays.
    if (!isSliding && draft === committed.current) setDraft(null);
    setError(null);
  }, [props.value]);
  // What could not be built is not there: then the field says again what is.
  const isBuilding = state.value?.phase === 'building';
  useEffect(() => {
    if (!isBuilding && !isSliding && draft !== null && draft === committed.current) setDraft(null);
  }, [isBuilding]);
  const commitLatest = useLatest(props.onCommit, setError);

  const value = tidied(props.value, props.dimension);
  const shown = draft ?? value;
  const commit = async (text: string): Promise<void> => {
    const written = withUnit(text, props.dimension);
    if (written === value || written === '') {
      setDraft(null);
      setError(null);
      return;
    }
    setDraft(written);
    committed.current = written;
    setError(await props.onCommit(written));
  };
  const current = parseQuantity(shown, props.dimension) ?? parseQuantity(props.value, props.dimension);
  return (
    <div class={`row quantity ${error !== null ? 'refused' : ''}`}>
      <label for={id} title={props.hint}>{props.label}</label>
      <input
        id={id}
        type="text"
        inputMode={props.dimension === 'number' ? 'decimal' : 'text'}
        value={shown}
        placeholder={props.placeholder ?? defaultUnit(props.dimension)}
        spellcheck={false}
        autocomplete="off"
        disabled={props.disabled}
        aria-invalid={error !== null}
        aria-describedby={error !== null ? `${id}-error` : undefined}
        onInput={(event) => setDraft(event.currentTarget.value)}
        onKeyDown={(event) => {
          if (event.key === 'Enter') void commit(event.currentTarget.value);
          if (event.key === 'Escape') {
            setDraft(null);
            setError(null);
          }
        }}
        onBlur={() => draft !== null && draft !== committed.current && void commit(draft)}
        data-testid={props.testid}
      />
      {props.range !== undefined && (
        <input
          class="under"
          type="range"
          min={0}
          max={SLIDER_STEPS}
          step={1}
          value={current === null ? 0 : toSlider(current, props.range)}
          aria-label={props.label}
          aria-valuetext={shown}
          disabled={props.disabled}
          onInput={(event) => {
            const text = formatQuantity(fromSlider(event.currentTarget.valueAsNumber, props.range!), props.dimension, 3);
            setSliding(true);
            setDraft(text);
            committed.current = text;
            commitLatest(text);
          }}
          onChange={() => setSliding(false)}
          data-testid={props.testid === undefined ? undefined : `${props.testid}-slider`}
        />
      )}
      {error !== null && <FieldError id={`${id}-error`} text={error} />}
    </div>
  );
}

function FieldError({ id, text }: { id: string; text: string }) {
  const place = useRef<HTMLParagraphElement>(null);
  // It may lie below what of the panel is seen.
  useEffect(() => place.current!.scrollIntoView({ block: 'nearest' }), [text]);
  return <p ref={place} class="field-error" id={id} role="alert">{text}</p>;
}

/** Says what was refused as a notice: for buttons, which have no place of their own for it. */
export function aloud(commit: Promise<string | null>): void {
  void commit.then((error) => error !== null && notify('warning', error));
}

export function Download(props: { path: string; name: string; children: ComponentChildren; disabled?: boolean; testid?: string }) {
  if (props.disabled) {
    return <span class="button" aria-disabled="true" data-testid={props.testid}>{props.children}</span>;
  }
  return (
    <a class="button" href={apiUrl(props.path)} download={props.name} data-testid={props.testid}>{props.children}</a>
  );
}
