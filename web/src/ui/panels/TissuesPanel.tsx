// What each layer is made of, changed while it is pressed.

import { named, t, type Key } from '../../i18n';
import { edit, original, scene, state } from '../../store';
import type { LayerInfo } from '../../generated/api';
import { aloud, Button, Controlled, QuantityField, Section, Select, type Range } from '../controls';
import { formatQuantity, parseQuantity, writtenQuantity, type Dimension } from '../quantity';
import {
  LAWS, stiffnessKey, tissueName, type LawName, type LayerTable, type StiffnessKey, type TissueTable,
} from '../scene_table';

const STIFFNESS_RANGE: Range = { min: 1e3, max: 1e6, isLogarithmic: true };
const SPRING_RANGE: Range = { min: 1, max: 1e5, isLogarithmic: true };
const POISSON_RANGE: Range = { min: 0.3, max: 0.499 };
const THICKNESS_RANGE: Range = { min: 0.5e-3, max: 30e-3, isLogarithmic: true };

/** A parameter of a law beside stiffness and Poisson's ratio, with what it begins at when the law is chosen. */
interface Parameter {
  key: 'c01' | 'c20' | 'c30' | 'alpha' | 'b';
  dimension: Dimension;
  start: (young: number) => string | number;
}
const quarterShear = (young: number): string => formatQuantity(young / 24, 'pressure');
const PARAMETERS: Partial<Record<LawName, Parameter[]>> = {
  'mooney-rivlin': [{ key: 'c01', dimension: 'pressure', start: quarterShear }],
  yeoh: [
    { key: 'c20', dimension: 'pressure', start: quarterShear },
    { key: 'c30', dimension: 'pressure', start: quarterShear },
  ],
  ogden: [{ key: 'alpha', dimension: 'number', start: () => 8 }],
  fung: [{ key: 'b', dimension: 'number', start: () => 10 }],
};

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

/** The tissue as a table of its own, which a name of the catalogue is not. */
function asTable(layer: LayerTable, info: LayerInfo | undefined): TissueTable {
  if (typeof layer.tissue !== 'string') return layer.tissue;
  const law = LAWS.find((name) => name === info?.law) ?? 'neo-hookean';
  const young = info?.stiffness ?? 2e4;
  return { name: layer.tissue, law, young: formatQuantity(young, 'pressure', 4), poisson: 0.45, ...starts(law, young) };
}

function starts(law: LawName, young: number): Partial<TissueTable> {
  return Object.fromEntries((PARAMETERS[law] ?? []).map(({ key, start }) => [key, start(young)]));
}

function LayerFields({ index, layer, info }: { index: number; layer: LayerTable; info: LayerInfo | undefined }) {
  const path = `/layer/${index}`;
  const isNamed = typeof layer.tissue === 'string';
  const table = asTable(layer, info);
  const key = stiffnessKey(table);
  const law = table.law ?? 'neo-hookean';
  const before = original.value?.layer?.[index];
  const isChanged = before !== undefined && JSON.stringify(before) !== JSON.stringify(layer);

  // A tissue of the catalogue becomes one of the scene's own with the first value that is changed.
  const change = (name: string, value: unknown): Promise<string | null> =>
    isNamed ? edit([`${path}/tissue`, { ...table, [name]: value }]) : edit([`${path}/tissue/${name}`, value]);
  const changeLaw = (next: LawName): void => {
    const kept: TissueTable = { ...table, law: next, young: formatQuantity(info?.stiffness ?? 2e4, 'pressure', 4) };
    for (const other of ['shear', 'c10', 'c01', 'c20', 'c30', 'alpha', 'b', 'terms', 'volume']) delete kept[other];
    aloud(edit([`${path}/tissue`, { ...kept, ...starts(next, info?.stiffness ?? 2e4) }]));
  };

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
          options={LAWS.map((value) => ({ value, label: t(`law.${value}` as Key) }))}
          onChange={changeLaw}
          testid={`layer-${index}-law`}
        />
      )}
      <QuantityField
        label={t(`tissues.${key}` as Key)}
        value={writtenQuantity(table[key]) || (info === undefined ? '' : formatQuantity(info.stiffness, 'pressure', 4))}
        dimension={key === 'spring' ? 'spring' : 'pressure'}
        range={rangeOf(key, table)}
        hint={isNamed ? t('tissues.catalogue_hint') : undefined}
        onCommit={(value) => change(key, value)}
        testid={`layer-${index}-young`}
      />
      {key !== 'spring' && <CompressibilityField index={index} table={table} change={change} />}
      {(PARAMETERS[law] ?? []).filter(() => table.terms === undefined).map((parameter) => (
        <QuantityField
          key={parameter.key}
          label={t(`tissues.${parameter.key}` as Key)}
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
      value={writtenQuantity(table.poisson ?? 0.45)}
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
