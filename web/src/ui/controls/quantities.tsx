// Fields for quantities with a unit, typed or slid.

import { useEffect, useId, useRef, useState } from 'preact/hooks';
import { edit, state } from '../../store';
import { defaultUnit, formatQuantity, parseQuantity, tidied, withUnit, type Dimension } from '../quantity';
import { useLatest, type Commit } from './commit';
import { fromSlider, SLIDER_STEPS, toSlider, type Range } from './sliders';

/** A quantity with its unit. It is sent on Enter, on leaving the field and while the slider moves;
 * a refusal is shown at the field. */
export function QuantityField(props: {
  label: string;
  /** As the scene writes it; empty where the scene has no such key. */
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
  // The sent text is shown until the engine's state has the new value.
  useEffect(() => {
    // On the first run nothing is new, and the user may already be typing.
    if (seen.current === props.value) return;
    seen.current = props.value;
    // Text that is being typed stays.
    if (!isSliding && draft === committed.current) setDraft(null);
    setError(null);
  }, [props.value]);
  // If the body could not be built, the field shows the old value again.
  const isBuilding = state.value?.phase === 'building';
  useEffect(() => {
    if (isBuilding || isSliding || draft === null || draft !== committed.current) return;
    setDraft(null);
    setError(null);
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
  const current = (error === null ? parseQuantity(shown, props.dimension) : null) ?? parseQuantity(props.value, props.dimension);
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
        data-draft={draft === null || draft === committed.current ? 'no' : 'yes'}
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
  // The message may lie below the visible part of the panel.
  useEffect(() => place.current!.scrollIntoView({ block: 'nearest' }), [text]);
  return <p ref={place} class="field-error" id={id} role="alert">{text}</p>;
}

/** Three lengths of a scene's key, as of a point or a box. */
export function PointFields(props: { label: string; value: [string, string, string]; path: string; names?: [string, string, string] }) {
  const names = props.names ?? ['x', 'y', 'z'];
  return (
    <div class="triple" role="group" aria-label={props.label}>
      <span class="label">{props.label}</span>
      {names.map((name, k) => (
        <QuantityField
          key={name}
          label={name}
          value={props.value[k]}
          dimension="length"
          onCommit={(value) => edit([`${props.path}/${k}`, value])}
        />
      ))}
    </div>
  );
}
