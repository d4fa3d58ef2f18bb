// How layers and lumps are shown, from the engine's state and the options of the view.

import type { LumpInfo, State } from '../generated/api';
import type { ViewOptions } from './options';
import { layerColours } from './palette';
import type { LayerLook } from './surfaces';

/** Greatest opacity of layers while a game shows its result: the lumps must be seen
 * through all of them. */
const RESULT_OPACITY = 0.38;

/** A layer that lets something through shows more of itself in the section, where
 * nothing lies behind it. */
const SECTION_BONUS = 0.25;

export interface NamedLook extends LayerLook {
  name: string;
}

/** The look of each layer, from the skin down. */
export function layerLooks(nLayers: number, state: State | null, options: ViewOptions): NamedLook[] {
  const names = Array.from({ length: nLayers }, (_, i) => state?.layers[i]?.name ?? `layer ${i + 1}`);
  const colours = layerColours(names.map((name) => ({ name })));
  const most = state?.game?.result ? RESULT_OPACITY : 1;
  return names.map((name, i) => {
    const { visible = true, opacity = 1 } = options.layers[i] ?? {};
    return { name, colour: colours[i], visible: visible && opacity > 0, opacity: Math.min(opacity, most) };
  });
}

export function sectionOpacity({ opacity }: LayerLook): number {
  return opacity < 1 ? Math.min(1, opacity + SECTION_BONUS) : 1;
}

/** The lumps that may be shown: during a game none, and those of the game once
 * it shows its result. */
export function knownLumps(state: State | null): LumpInfo[] {
  const result = state?.game?.result;
  return result ? result.lumps.map(({ lump }) => lump) : (state?.lumps ?? []);
}
