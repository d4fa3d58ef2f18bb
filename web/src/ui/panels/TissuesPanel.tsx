// The tissue of each layer, which can be changed under a press.

import type { LayerTable, TissueTable } from '../../generated/scene';
import { named, t } from '../../i18n';
import { edit, original, scene, state } from '../../store';
import type { LayerInfo } from '../../generated/api';
import { aloud, Button, Controlled, QuantityField, Section, Select, type Range } from '../controls';
import { formatQuantity, parseQuantity, writtenQuantity } from '../quantity';
import {
  DEFAULT_LAW, DEFAULT_POISSON, LAWS, LAW_NAMES, stiffnessKey, tissueName, underLaw, writtenOut, type StiffnessKey,
} from '../tissue';

const STIFFNESS_RANGE: Range = { min: 1e3, max: 1e6, isLogarithmic: true };
const SPRING_RANGE: Range = { min: 1, max: 1e5, isLogarithmic: true };
const POISSON_RANGE: Range = { min: 0.3, max: 0.499 };
const THICKNESS_RANGE: Range = { min: 0.5e-3, max: 30e-3, isLogarithmic: true };

export function TissuesPanel() {
  const layers = scene.value?.layer ?? [];
  const infos = state.value?.layers ?? [];
  return (
    <Controlled>
      <p class="hint">{t('tissues.hint')}</p>
      {layers.map((layer, index) => <LayerFields key={index} index={index} layer={layer} info={infos[index]} />)}
    </Controlled>
  );
}

function LayerFields({ index, layer, info }: { index: number; layer: LayerTable; info: LayerInfo | undefined }) {
  const path = `/layer/${index}`;
  const isNamed = typeof layer.tissue === 'string';
  const table = typeof layer.tissue === 'string' ? writtenOut(layer.tissue, info?.law, info?.stiffness) : layer.tissue;
  const key = stiffnessKey(table);
  const law = table.law ?? DEFAULT_LAW;
  const before = original.value?.layer?.[index];
  const isChanged = before !== undefined && JSON.stringify(before) !== JSON.stringify(layer);

  // A tissue of the catalogue becomes a table in the scene with the first value that is changed.
  const change = (name: string, value: unknown): Promise<string | null> =>
    isNamed ? edit([`${path}/tissue`, { ...table, [name]: value }]) : edit([`${path}/tissue/${name}`, value]);
  const name = named('tissue', tissueName(layer.tissue, t('tissues.unnamed')));
  return (
    <Section
      title={`${index + 1}. ${name}`}
      action={isChanged && (
        <Button kind="quiet" onClick={() => aloud(edit([path, before]))} testid={`layer-${index}-reset`}>{t('tissues.reset')}</Button>
      )}
    >
      {key !== 'spring' && (
        <Select
          label={t('tissues.law')}
          value={law}
          options={LAW_NAMES.map((value) => ({ value, label: t(`law.${value}`) }))}
          onChange={(next) => aloud(edit([`${path}/tissue`, underLaw(table, next, info?.stiffness)]))}
          testid={`layer-${index}-law`}
        />
      )}
      <QuantityField
        label={t(`tissues.${key}`)}
        value={writtenQuantity(table[key]) || (info === undefined ? '' : formatQuantity(info.stiffness, 'pressure', 4))}
        dimension={key === 'spring' ? 'spring' : 'pressure'}
        range={rangeOf(key, table)}
        hint={isNamed ? t('tissues.catalogue_hint') : undefined}
        onCommit={(value) => change(key, value)}
        testid={`layer-${index}-young`}
      />
      {key !== 'spring' && <CompressibilityField index={index} table={table} change={change} />}
      {(table.terms === undefined ? LAWS[law] : []).map((parameter) => (
        <QuantityField
          key={parameter.key}
          label={t(`tissues.${parameter.key}`)}
          value={writtenQuantity(table[parameter.key])}
          dimension={parameter.dimension}
          onCommit={(value) => change(parameter.key, parameter.dimension === 'number' ? parseQuantity(value, 'number') ?? value : value)}
          testid={`layer-${index}-${parameter.key}`}
        />
      ))}
      <ThicknessField index={index} layer={layer} info={info} />
    </Section>
  );
}

function rangeOf(key: StiffnessKey, table: TissueTable): Range {
  const usual = key === 'spring' ? SPRING_RANGE : STIFFNESS_RANGE;
  const value = parseQuantity(writtenQuantity(table[key]), key === 'spring' ? 'spring' : 'pressure');
  if (value === null || value <= 0) return usual;
  return { ...usual, min: Math.min(usual.min, value / 10), max: Math.max(usual.max, value * 10) };
}

function CompressibilityField(props: {
  index: number;
  table: TissueTable;
  change: (name: string, value: unknown) => Promise<string | null>;
}) {
  const { index, table, change } = props;
  if (table.bulk !== undefined) {
    return (
      <QuantityField
        label={t('tissues.bulk')}
        value={table.bulk}
        dimension="pressure"
        onCommit={(value) => change('bulk', value)}
        testid={`layer-${index}-bulk`}
      />
    );
  }
  return (
    <QuantityField
      label={t('tissues.poisson')}
      value={writtenQuantity(table.poisson ?? DEFAULT_POISSON)}
      dimension="number"
      range={POISSON_RANGE}
      onCommit={(value) => change('poisson', parseQuantity(value, 'number') ?? value)}
      testid={`layer-${index}-poisson`}
    />
  );
}

function ThicknessField({ index, layer, info }: { index: number; layer: LayerTable; info: LayerInfo | undefined }) {
  if (typeof layer.thickness !== 'string') {
    const mean = info === undefined ? '–' : formatQuantity(info.thickness, 'length');
    return (
      <div class="row">
        <span class="label">{t('tissues.thickness')}</span>
        <span class="value">{layer.thickness === undefined ? t('tissues.to_the_bone', { mean }) : t('tissues.varying', { mean })}</span>
      </div>
    );
  }
  return (
    <QuantityField
      label={t('tissues.thickness')}
      value={layer.thickness}
      dimension="length"
      range={THICKNESS_RANGE}
      onCommit={(value) => edit([`/layer/${index}/thickness`, value])}
      testid={`layer-${index}-thickness`}
    />
  );
}
