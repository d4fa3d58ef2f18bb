// The engine's English words about a scene, with the names that the page shows in place of the keys of a scene file.

import type { SceneTable } from '../generated/scene';
import { named, t } from '../i18n';
import { tissueName } from './tissue';

/** Texts that a user has written are named by line and keep their keys. */
const KEY = /\bscene: (layer|lump)\[(\d+)\]((?:\.\w+(?:\[\d+\])?)*)/g;

/** “scene: layer[2].tissue.young: …” becomes “3. Muscle, Young’s modulus: …”. */
export function inPageWords(text: string, scene: SceneTable | null): string {
  return text.replace(KEY, (all, list: 'layer' | 'lump', number: string, keys: string) => {
    const index = Number(number);
    const name = list === 'layer' ? layerWords(scene, index) : lumpWords(scene, index);
    if (name === null) return all;
    const parts = keys.split('.').filter((key) => key !== '' && key !== 'tissue');
    return [name, ...parts.map((key) => named(list === 'layer' ? 'tissues' : 'lumps', key))].join(', ');
  });
}

/** A layer as its panel names it. */
function layerWords(scene: SceneTable | null, index: number): string | null {
  const layer = scene?.layer?.[index];
  return layer === undefined ? null : `${index + 1}. ${named('tissue', tissueName(layer.tissue, t('tissues.unnamed')))}`;
}

function lumpWords(scene: SceneTable | null, index: number): string | null {
  const lump = scene?.lump?.[index];
  return lump === undefined ? null : named('tissue', lump.name ?? t('lumps.name_of_new', { number: index + 1 }));
}
