// The tool: shape, size and friction.

import type { ToolTable } from '../../generated/scene';
import { t } from '../../i18n';
import { DEFAULT_SHAPE, reshaped, TOOL_SHAPES, TOOL_SHAPE_NAMES, type ToolField } from '../../scene/toolshapes';
import { edit, scene } from '../../store';
import { aloud, Controlled, PointFields, QuantityField, Section, Select } from '../controls';
import { parseQuantity, writtenQuantity } from '../quantity';

export function ToolPanel() {
  const tool = scene.value?.tool ?? {};
  const shape = tool.shape ?? DEFAULT_SHAPE;
  const { fields, isContact } = TOOL_SHAPES[shape];
  return (
    <Controlled>
      <Section title={t('tool.shape_and_size')}>
        <Select
          label={t('tool.shape')}
          value={shape}
          options={TOOL_SHAPE_NAMES.filter((value) => TOOL_SHAPES[value].isContact || value === shape).map((value) => ({
            value,
            label: t(`tool_shape.${value}`),
          }))}
          onChange={(chosen) => aloud(edit(['/tool', reshaped(tool, chosen)]))}
          testid="tool-shape"
        />
        {fields.map((field) => <SizeField key={field.key} field={field} tool={tool} />)}
      </Section>
      {isContact && (
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

function SizeField({ field, tool }: { field: ToolField; tool: ToolTable }) {
  const path = `/tool/${field.key}`;
  const label = t(`tool.${field.key}`);
  if ('names' in field) {
    const value = tool[field.key];
    return value === undefined ? null : <PointFields label={label} value={value} path={path} names={field.names} />;
  }
  const value = tool[field.key];
  return value === undefined ? null : (
    <QuantityField
      label={label}
      value={value}
      dimension={field.dimension}
      range={field}
      onCommit={(written) => edit([path, written])}
      testid={`tool-${field.key}`}
    />
  );
}
