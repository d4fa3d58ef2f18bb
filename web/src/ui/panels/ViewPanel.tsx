// The view: colours, layers, the cutaway.

import { named, t } from '../../i18n';
import { isHiding, isWatching, notify, state } from '../../store';
import { COLOURINGS, quantityOf, type ViewOptions } from '../../scene';
import { Button, Section, Segmented, Select, Slider, Toggle } from '../controls';
import { bodyView, legend, section } from '../body';
import { parseQuantity, formatNumber } from '../quantity';
import { neededField, picking, show, showsLumps, view, wanted } from '../settings';
import { saveImage } from '../save';
import { SavedViews } from '../SavedViews';
import { useId, useState } from 'preact/hooks';

export function ViewPanel() {
  const options = view.value;
  const hiding = isHiding.value;
  return (
    <>
      {hiding && <p class="hint" role="note">{t('view.hidden_by_game')}</p>}
      <Section title={t('view.colours')}>
        <Select
          label={t('view.colour_by')}
          value={options.colourBy}
          options={COLOURINGS.map((value) => ({
            value,
            label: t(`colour.${value}`),
            disabled: hiding && showsLumps(value),
          }))}
          onChange={(colourBy) => show({ colourBy, range: null })}
          testid="colour-by"
        />
        {isWatching.value && neededField.value !== 'none' && neededField.value !== state.value?.field && (
          <p class="hint" role="note">{t('view.field_of_controller')}</p>
        )}
        <RangeFields options={options} />
      </Section>
      <Section title={t('view.cutaway')}>
        <Cutaway options={options} hiding={hiding} />
      </Section>
      <Section title={t('probe.title')} hint={t('probe.about')}>
        <div class="buttons">
          <Button pressed={picking.value?.kind === 'probe'} disabled={hiding} onClick={() => (picking.value = picking.value?.kind === 'probe' ? null : { kind: 'probe' })} testid="probe-place">
            {t('probe.place_it')}
          </Button>
        </div>
      </Section>
      <Section title={t('view.layers')}>
        <Layers options={options} />
        <Toggle label={t('view.bones')} on={options.bones} onChange={(bones) => show({ bones })} testid="show-bones" />
        <Toggle
          label={t('view.lumps')}
          on={options.lumps}
          disabled={hiding}
          onChange={(lumps) => show({ lumps })}
          testid="show-lumps"
        />
      </Section>
      <Section title={t('view.drawing')}>
        <Toggle
          label={t('view.wireframe')}
          on={options.wireframe}
          disabled={hiding}
          onChange={(wireframe) => show({ wireframe })}
          testid="show-wireframe"
        />
        <Toggle label={t('view.shadows')} on={options.shadows} onChange={(shadows) => show({ shadows })} />
        <Toggle label={t('view.tool')} on={options.tool} onChange={(tool) => show({ tool })} />
        <Toggle label={t('view.lens')} on={options.lens} disabled={hiding} onChange={(lens) => show({ lens })} testid="show-lens" />
        <Toggle label={t('view.force')} on={options.force} onChange={(force) => show({ force })} />
      </Section>
      <Section title={t('view.views')}>
        <div class="buttons">
          {(['home', 'top', 'front', 'side'] as const).map((side) => (
            <Button key={side} onClick={() => bodyView.value?.viewFrom(side)} testid={`view-${side}`}>
              {t(`view.from_${side}`)}
            </Button>
          ))}
          <Button onClick={() => saveImage().catch((error: unknown) => notify('error', String(error)))} testid="save-png">
            {t('view.save_png')}
          </Button>
        </div>
        <SavedViews />
      </Section>
    </>
  );
}

function RangeFields({ options }: { options: ViewOptions }) {
  const quantity = quantityOf(options.colourBy);
  if (quantity === null) return null;
  const [name, factor] = quantity.typed;
  const isFixed = options.range !== null;
  const shown = options.range ?? (legend.value === null ? null : [legend.value.min, legend.value.max]);
  return (
    <>
      <Segmented
        label={t('view.range')}
        value={isFixed ? 'fixed' : 'auto'}
        options={[
          { value: 'auto', label: t('view.range_auto') },
          { value: 'fixed', label: t('view.range_fixed'), testid: 'range-fixed' },
        ]}
        onChange={(choice) => show({ range: choice === 'auto' ? null : startRange(shown, factor) })}
      />
      {isFixed && (
        <div class="pair">
          {([0, 1] as const).map((end) => (
            <RangeEnd
              key={end}
              label={`${t(end === 0 ? 'view.range_from' : 'view.range_to')}${name === '' ? '' : ` (${name})`}`}
              value={options.range![end] / factor}
              onChange={(value) => {
                const range: [number, number] = [...options.range!];
                range[end] = value * factor;
                if (range[0] < range[1]) show({ range });
              }}
            />
          ))}
        </div>
      )}
    </>
  );
}

function startRange(shown: readonly number[] | null, factor: number): [number, number] {
  if (shown === null || !(shown[0] < shown[1])) return [0, factor];
  return [Number(shown[0].toPrecision(2)), Number(shown[1].toPrecision(2))];
}

function RangeEnd(props: { label: string; value: number; onChange: (value: number) => void }) {
  const id = useId();
  const [draft, setDraft] = useState<string | null>(null);
  const take = (text: string): void => {
    const value = parseQuantity(text, 'number');
    if (value !== null) props.onChange(value);
    setDraft(null);
  };
  return (
    <div class="row quantity">
      <label for={id}>{props.label}</label>
      <input
        id={id}
        type="text"
        inputMode="decimal"
        value={draft ?? formatNumber(props.value)}
        onInput={(event) => setDraft(event.currentTarget.value)}
        onBlur={(event) => take(event.currentTarget.value)}
        onKeyDown={(event) => event.key === 'Enter' && take(event.currentTarget.value)}
      />
    </div>
  );
}

function Cutaway({ options, hiding }: { options: ViewOptions; hiding: boolean }) {
  const { cutaway } = options;
  const change = (changes: Partial<ViewOptions['cutaway']>): void =>
    show({ cutaway: { ...wanted.value.cutaway, ...changes } });
  return (
    <>
      <Toggle
        label={t('view.cutaway_on')}
        on={cutaway.on}
        disabled={hiding}
        onChange={(on) => change({ on })}
        testid="cutaway-toggle"
      />
      <Segmented
        label={t('view.cutaway_axis')}
        value={cutaway.axis}
        disabled={!cutaway.on}
        options={(['x', 'y', 'z', 'view', 'tool'] as const).map((value) => ({
          value,
          label: value === 'view' ? t('view.cutaway_view') : value === 'tool' ? t('view.cutaway_tool') : value,
          testid: `cutaway-axis-${value}`,
        }))}
        onChange={(axis) => change({ axis })}
      />
      <Slider
        label={t('view.cutaway_position')}
        value={cutaway.position}
        min={0}
        max={1}
        step={0.005}
        shown={`${Math.round(cutaway.position * 100)} %`}
        disabled={!cutaway.on || cutaway.axis === 'tool'}
        onInput={(position) => change({ position })}
        testid="cutaway-position"
      />
      <Toggle label={t('view.cutaway_flip')} on={cutaway.flip} disabled={!cutaway.on} onChange={(flip) => change({ flip })} />
      {cutaway.on && <SectionArea />}
    </>
  );
}

function SectionArea() {
  const area = section.value;
  const mm2 = (value: number): string => `${(value * 1e6).toFixed(0)} mm²`;
  const layers = state.value?.layers ?? [];
  return (
    <dl class="figures" data-testid="section-area" data-area={area?.total ?? 0} data-lumps={area?.lumps ?? 0}>
      <dt>{t('view.section_area')}</dt>
      <dd>{area === null ? '–' : mm2(area.total)}</dd>
      {area?.layers.map((value, index) => [
        <dt key={`t${index}`} class="inner">{named('tissue', layers[index]?.name ?? String(index + 1))}</dt>,
        <dd key={`d${index}`} data-layer={index} data-area={value}>{mm2(value)}</dd>,
      ])}
      {area !== null && area.lumps > 0 && (
        <>
          <dt class="inner">{t('view.lumps')}</dt>
          <dd>{mm2(area.lumps)}</dd>
        </>
      )}
    </dl>
  );
}

function Layers({ options }: { options: ViewOptions }) {
  const layers = state.value?.layers ?? [];
  const change = (index: number, changes: Partial<ViewOptions['layers'][number]>): void =>
    show({
      layers: layers.map((_, i) => {
        const layer = wanted.value.layers[i] ?? { visible: true, opacity: 1 };
        return i === index ? { ...layer, ...changes } : layer;
      }),
    });
  return (
    <ul class="layers">
      {layers.map((layer, index) => {
        const { visible, opacity } = options.layers[index] ?? { visible: true, opacity: 1 };
        const name = named('tissue', layer.name);
        return (
          <li key={index}>
            <Toggle label={name} on={visible} onChange={(on) => change(index, { visible: on })} testid={`layer-${index}-visible`} />
            <input
              type="range"
              min={0.05}
              max={1}
              step={0.05}
              value={opacity}
              disabled={!visible}
              aria-label={t('view.opacity_of', { name })}
              aria-valuetext={`${Math.round(opacity * 100)} %`}
              onInput={(event) => change(index, { opacity: event.currentTarget.valueAsNumber })}
              data-testid={`layer-${index}-opacity`}
            />
          </li>
        );
      })}
    </ul>
  );
}
