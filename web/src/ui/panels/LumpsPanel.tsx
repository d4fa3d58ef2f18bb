// Lumps: added, moved, changed in size and hardness.

import { signal } from '@preact/signals';
import type { LumpTable } from '../../generated/scene';
import { named, t } from '../../i18n';
import { edit, isHiding, scene, state } from '../../store';
import { aloud, Button, Controlled, PointFields, QuantityField, Section, Select, Toggle } from '../controls';
import { formatQuantity, withUnit, writtenPoint, writtenQuantity } from '../quantity';
import { DEFAULT_POISSON, stiffnessKey } from '../tissue';
import { lastTouched, picking, show, wanted } from '../settings';

/** Opacity of layers that are seen through. */
const CLEAR = 0.3;

/** The values of the next lump: at first a firm nodule under the skin. */
const next = signal({ depth: '10 mm', radius: '6 mm', young: '150 kPa' });

export function LumpsPanel() {
  const lumps = scene.value?.lump ?? [];
  if (isHiding.value) return <p class="hint" role="note">{t('lumps.hidden_by_game')}</p>;
  return (
    <Controlled>
      <Section title={t('lumps.add')}>
        <NewLump lumps={lumps} />
        <SeeThrough />
      </Section>
      <ul class="plain" data-testid="lump-list" aria-label={t('tab.lumps')}>
        {lumps.map((lump, index) => (
          <li key={index} data-testid={`lump-${index}`}>
            <LumpFields index={index} lump={lump} />
          </li>
        ))}
      </ul>
      {lumps.length === 0 && <p class="empty">{t('lumps.none')}</p>}
    </Controlled>
  );
}

/** Makes all layers transparent, or opaque again. */
function SeeThrough() {
  const layers = state.value?.layers ?? [];
  const isClear = wanted.value.layers.some((layer) => layer.opacity < 1);
  return (
    <Toggle
      label={t('lumps.see_through')}
      on={isClear}
      onChange={(on) => show({ layers: layers.map(() => ({ visible: true, opacity: on ? CLEAR : 1 })) })}
      testid="see-through"
    />
  );
}

/** Keeps a value of the new lump; the engine checks it when the lump is added. */
function keep(key: 'depth' | 'radius' | 'young'): (text: string) => Promise<null> {
  return (text) => {
    next.value = { ...next.value, [key]: withUnit(text, key === 'young' ? 'pressure' : 'length') };
    return Promise.resolve(null);
  };
}

function NewLump({ lumps }: { lumps: LumpTable[] }) {
  const place = lastTouched.value;
  const add = (): void => {
    const below = lastTouched.value ?? state.value?.home.point ?? [0, 0, 0];
    const lump = {
      name: t('lumps.name_of_new', { number: lumps.length + 1 }),
      shape: 'sphere',
      radius: next.value.radius,
      below: writtenPoint(below),
      depth: next.value.depth,
      tissue: { name: t('lumps.tissue_of_new'), young: next.value.young, poisson: DEFAULT_POISSON },
      transition: '0.5 mm',
    };
    aloud(scene.value?.lump === undefined ? edit(['/lump', [lump]]) : edit(['/lump/-', lump]));
  };
  return (
    <>
      <QuantityField label={t('lumps.depth')} value={next.value.depth} dimension="length" onCommit={keep('depth')} testid="lump-new-depth" />
      <QuantityField label={t('lumps.radius')} value={next.value.radius} dimension="length" onCommit={keep('radius')} testid="lump-new-radius" />
      <QuantityField label={t('lumps.young')} value={next.value.young} dimension="pressure" onCommit={keep('young')} testid="lump-new-young" />
      <p class="hint">{t(place === null ? 'lumps.at_home' : 'lumps.at_touched')}</p>
      <div class="buttons">
        <Button kind="primary" onClick={add} testid="lump-add">{t('lumps.add_button')}</Button>
      </div>
    </>
  );
}

function LumpFields({ index, lump }: { index: number; lump: LumpTable }) {
  const path = `/lump/${index}`;
  const shape = lump.shape ?? 'sphere';
  const name = named('tissue', lump.name ?? t('lumps.name_of_new', { number: index + 1 }));
  const isPicking = picking.value?.kind === 'lump' && picking.value.index === index;
  return (
    <Section
      title={name}
      action={
        <Button
          kind="quiet"
          onClick={() => aloud(edit([path, null]))}
          label={t('lumps.remove_named', { name })}
          testid={`lump-${index}-remove`}
        >
          {t('lumps.remove')}
        </Button>
      }
    >
      {shape !== 'mesh' && (
        <Select
          label={t('lumps.shape')}
          value={shape}
          options={(['sphere', 'ellipsoid', 'capsule'] as const).map((value) => ({ value, label: t(`lump_shape.${value}`) }))}
          onChange={(chosen) => aloud(edit([path, reshaped(lump, chosen)]))}
          testid={`lump-${index}-shape`}
        />
      )}
      {lump.radius !== undefined && (
        <QuantityField
          label={t('lumps.radius')}
          value={lump.radius}
          dimension="length"
          range={{ min: 2e-3, max: 20e-3 }}
          onCommit={(value) => edit([`${path}/radius`, value])}
          testid={`lump-${index}-radius`}
        />
      )}
      {lump.radii !== undefined && <PointFields label={t('lumps.radii')} value={lump.radii} path={`${path}/radii`} names={['1', '2', '3']} />}
      {lump.length !== undefined && (
        <QuantityField label={t('lumps.length')} value={lump.length} dimension="length" onCommit={(value) => edit([`${path}/length`, value])} />
      )}
      <Hardness index={index} lump={lump} />
      {lump.depth !== undefined && (
        <QuantityField
          label={t('lumps.depth')}
          value={lump.depth}
          dimension="length"
          range={{ min: 2e-3, max: 30e-3 }}
          onCommit={(value) => edit([`${path}/depth`, value])}
          testid={`lump-${index}-depth`}
        />
      )}
      <PlaceFields path={path} lump={lump} />
      {shape !== 'mesh' && (
        <div class="buttons">
          <Button
            pressed={isPicking}
            onClick={() => (picking.value = isPicking ? null : { kind: 'lump', index })}
            testid={`lump-${index}-move`}
          >
            {t(isPicking ? 'lumps.picking' : 'lumps.move')}
          </Button>
        </div>
      )}
    </Section>
  );
}

/** The lump in another shape of about the same size. The engine refuses keys of other shapes. */
function reshaped(lump: LumpTable, shape: 'sphere' | 'ellipsoid' | 'capsule'): LumpTable {
  const size = lump.radius ?? lump.radii?.[0] ?? '6 mm';
  const { radius: _, radii: __, length: ___, axis: ____, ...rest } = lump;
  if (shape === 'sphere') return { ...rest, shape, radius: size };
  if (shape === 'ellipsoid') return { ...rest, shape, radii: [size, size, size] };
  return { ...rest, shape, radius: size, length: size };
}

function Hardness({ index, lump }: { index: number; lump: LumpTable }) {
  const path = `/lump/${index}/tissue`;
  const stiffness = state.value?.lumps[index]?.stiffness;
  const table = typeof lump.tissue === 'object' ? lump.tissue : null;
  const key = stiffnessKey(table ?? undefined);
  const shown = table === null ? '' : writtenQuantity(table[key]);
  return (
    <QuantityField
      label={t(key === 'young' ? 'lumps.young' : `tissues.${key}`)}
      value={shown || (stiffness === undefined ? '' : formatQuantity(stiffness, 'pressure'))}
      dimension={key === 'spring' ? 'spring' : 'pressure'}
      range={key === 'spring' ? undefined : { min: 2e3, max: 2e6, isLogarithmic: true }}
      onCommit={(value) =>
        table === null
          ? edit([path, { name: lump.tissue ?? t('lumps.tissue_of_new'), young: value, poisson: DEFAULT_POISSON }])
          : edit([`${path}/${key}`, value])
      }
      testid={`lump-${index}-young`}
    />
  );
}

function PlaceFields({ path, lump }: { path: string; lump: LumpTable }) {
  if (lump.at !== undefined) return <PointFields label={t('lumps.at')} value={lump.at} path={`${path}/at`} />;
  if (lump.below !== undefined) return <PointFields label={t('lumps.below')} value={lump.below} path={`${path}/below`} />;
  return null;
}
