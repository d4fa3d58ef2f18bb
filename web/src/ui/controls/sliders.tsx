// Sliders, and their steps over a range.

import { useId } from 'preact/hooks';

/** A slider for a value of the page itself. */
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

export interface Range {
  min: number;
  max: number;
  isLogarithmic?: boolean;
}

export const SLIDER_STEPS = 200;

export function toSlider(value: number, range: Range): number {
  const share = range.isLogarithmic
    ? Math.log(value / range.min) / Math.log(range.max / range.min)
    : (value - range.min) / (range.max - range.min);
  return Math.round(SLIDER_STEPS * Math.min(1, Math.max(0, share)));
}

export function fromSlider(steps: number, range: Range): number {
  const share = steps / SLIDER_STEPS;
  return range.isLogarithmic
    ? range.min * (range.max / range.min) ** share
    : range.min + share * (range.max - range.min);
}
