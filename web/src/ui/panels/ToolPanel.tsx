// What presses: shape, size and friction.

import { t } from '../../i18n';
import { edit, scene } from '../../store';
import { aloud, Controlled, QuantityField, Section, Select } from '../controls';
import { parseQuantity, writtenQuantity } from '../quantity';
import { TOOL_SHAPES, type ToolShape, type ToolTable } from '../scene_table';
import { PointFields } from './LumpsPanel';

/** Tools that hold the skin need scenes of their own: they can be kept, not chosen. */
const CHOOSABLE: ToolShape[] = ['sphere', 'flat-punch', 'capsule', 'box', 'fingertip'];

export function ToolPanel() {
  const tool = scene.value?.tool ?? {};
  const shape = tool.shape ?? 'disc';
  const length = (key: 'radius' | 'edge_radius' | 'length', max: number) =>
    tool[key] !== undefined && (
      <QuantityField
        label={t(`tool.${key}`)}
        value={tool[key]}
        dimension="length"
        range={{ min: key === 'edge_radius' ? 0.1e-3 : 2e-3, max }}
        onCommit={(value) => edit([`/tool/${key}`, value])}
        testid={`tool-${key}`}
      />
    );
  return (
    <Controlled>
      <Section title={t('tool.shape_and_size')}>
        <Select
          label={t('tool.shape')}
          value={shape}
          options={TOOL_SHAPES.filter((value) => CHOOSABLE.includes(value) || value === shape).map((value) => ({
            value,
            label: t(`tool_shape.${value}`),
          }))}
          onChange={(chosen) => aloud(edit(['/tool', reshaped(tool, chosen)]))}
          testid="tool-shape"
        />
        {length('radius', 25e-3)}
        {length('length', 60e-3)}
        {tool.size !== undefined && <PointFields label={t('tool.size')} value={tool.size} path="/tool/size" />}
        {tool.radii !== undefined && <PointFields label={t('tool.radii')} value={tool.radii} path="/tool/radii" names={['1', '2', '3']} />}
        {length('edge_radius', 5e-3)}
      </Section>
      {CHOOSABLE.includes(shape) && (
        <Section title={t('tool.friction')} hint={t('tool.friction_hint')}>
          <QuantityField
            label={t('tool.coefficient')}
            value={writtenQuantity(tool.friction ?? 0)}
            dimension="number"
            range={{ min: 0, max: 1.5 }}
            onCommit={(value) => edit(['/tool/friction', parseQuantity(value, 'number') ?? value])}
            testid="tool-friction"
          />
        </Section>
      )}
    </Controlled>
  );
}

/** Each shape has sizes of its own; those of another would be refused. */
function reshaped(tool: ToolTable, shape: ToolShape): ToolTable {
  const radius = tool.radius ?? '10 mm';
  const friction = tool.friction === undefined ? {} : { friction: tool.friction };
  switch (shape) {
    case 'flat-punch':
      return { shape, radius, edge_radius: '1.5 mm', ...friction };
    case 'capsule':
      return { shape, radius, length: '20 mm', ...friction };
    case 'box':
      return { shape, size: ['16 mm', '16 mm', '16 mm'], edge_radius: '2 mm', ...friction };
    case 'fingertip':
      return { shape, radii: ['8 mm', '7 mm', '7 mm'], ...friction };
    case 'node':
      return { shape };
    case 'disc':
      return { shape, radius };
    case 'sphere':
      return { shape, radius, ...friction };
  }
}
