// Links that carry a scene, the seed of the game and the view, in the part after “#”, which browsers do not send.
//
// The scene is a key of the gallery or the whole scene as JSON, compressed. A link is not trusted: the engine checks its scene like
// any other and lets it name no files, and the page checks the rest.

import { effect, signal, untracked } from '@preact/signals';
import type { SceneTable } from '../generated/scene';
import { t } from '../i18n';
import { ask, isController, notify, state } from '../store';
import { bodyView } from './body';
import { applyLook, presentLook, readLook, type Look } from './look';
import { LEVELS, LUMPS, ROUNDS, tab, wantedLevel, wantedLumps, wantedRounds, wantedSeed } from './settings';

const MARK = '#palpa=';
/** Longest link, characters: longer ones are cut by mail programs and chats. */
const LONGEST = 8000;
/** Largest content of a link, bytes. */
const LARGEST = 256 << 10;
/** ms. */
const MESH_WAIT = 3000;

/** The content of a link. */
interface Content {
  v: 1;
  key?: string;
  scene?: SceneTable;
  seed?: string;
  /** The rest of the game, if there is a seed: level, lumps in each round, rounds. */
  game?: [string, string, string];
  look?: Look;
}

/** A link to what is shown; an error in words if there can be none. */
export async function linkOfPresent(): Promise<{ link: string } | { error: string }> {
  const now = state.peek();
  if (now?.scene == null) return { error: t('phase.waiting') };
  const isPlain = now.gallery_key != null && !now.is_changed;
  if (!isPlain && now.files.length > 0) return { error: t('share.has_files') };
  const series = now.game?.series;
  const seed = series === undefined ? wantedSeed.peek().trim() : String(series.seed);
  const game: Content['game'] = series === undefined
    ? [wantedLevel.peek(), wantedLumps.peek(), wantedRounds.peek()]
    : [series.level ?? 'drawn', String(now.game!.n_lumps), String(series.n_rounds)];
  const content: Content = {
    v: 1,
    ...(now.gallery_key == null ? {} : { key: now.gallery_key }),
    ...(isPlain ? {} : { scene: now.scene as SceneTable }),
    ...(seed === '' ? {} : { seed, game }),
    look: rounded(presentLook()),
  };
  const packed = await deflated(JSON.stringify(content));
  // Without the token: it is a key to this viewer, not to the scene.
  const link = `${location.origin}${location.pathname}${MARK}${packed}`;
  return link.length > LONGEST ? { error: t('share.too_long') } : { link };
}

/** Four digits of a camera are enough. */
function rounded(look: Look): Look {
  const round = (x: number): number => Number(x.toPrecision(4));
  const { camera } = look;
  if (camera === null) return look;
  const { azimuth, elevation, distance, target } = camera;
  return { ...look, camera: { azimuth: round(azimuth), elevation: round(elevation), distance: round(distance), target: target.map(round) as [number, number, number] } };
}

async function deflated(text: string): Promise<string> {
  const stream = new Blob([text]).stream().pipeThrough(new CompressionStream('deflate-raw'));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join('')).replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '');
}

async function inflated(packed: string): Promise<string> {
  const bytes = Uint8Array.from(atob(packed.replaceAll('-', '+').replaceAll('_', '/')), (char) => char.charCodeAt(0));
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw')).getReader();
  const parts: Uint8Array<ArrayBuffer>[] = [];
  let size = 0;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    size += value.length;
    // A few bytes can stand for gigabytes.
    if (size > LARGEST) throw new Error('too large');
    parts.push(value as Uint8Array<ArrayBuffer>);
  }
  return new Blob(parts).text();
}

/** The content of a link's end; null if it is none. */
async function read(hash: string): Promise<Content | null> {
  try {
    if (hash.length > LONGEST) return null;
    const from = JSON.parse(await inflated(hash.slice(MARK.length))) as Record<string, unknown> | null;
    if (from === null || typeof from !== 'object' || from.v !== 1) return null;
    const { key, scene, seed, game, look } = from;
    if (typeof key !== 'string' && (typeof scene !== 'object' || scene === null)) return null;
    return {
      v: 1,
      ...(typeof key === 'string' ? { key } : {}),
      ...(typeof scene === 'object' && scene !== null ? { scene: scene as SceneTable } : {}),
      ...(typeof seed === 'string' && /^\d{1,20}$/.test(seed) ? { seed } : {}),
      ...(Array.isArray(game) && game.length === 3 ? { game: game.map(String) as Content['game'] } : {}),
      ...(readLook(look) === null ? {} : { look: readLook(look)! }),
    };
  } catch {
    return null;
  }
}

/** A link that waits for this page to be in control. */
const waiting = signal<Content | null>(null);

/** Opens links from now on: the one that the page was opened with, and those put into its address. */
export function beginLinks(): void {
  const take = async (): Promise<void> => {
    const { hash } = location;
    if (!hash.startsWith(MARK)) return;
    // The address is free again: a reload shall not undo later work.
    window.history.replaceState(null, '', location.pathname + location.search);
    const content = await read(hash);
    if (content === null) notify('error', t('share.unreadable'));
    else waiting.value = content;
  };
  window.addEventListener('hashchange', () => void take());
  void take();
  let hasAsked = false;
  effect(() => {
    const content = waiting.value;
    const now = state.value;
    if (content === null || now?.scene == null) return;
    if (!isController.value) {
      if (!hasAsked) untracked(() => notify('info', t('share.waits_for_control')));
      hasAsked = true;
      return;
    }
    hasAsked = false;
    untracked(() => {
      waiting.value = null;
      void open(content);
    });
  });
}

async function open({ key, scene, seed, game, look }: Content): Promise<void> {
  const now = state.peek()!;
  const isThere = scene === undefined && now.gallery_key === key && !now.is_changed;
  if (!isThere) {
    const error = await ask(scene === undefined ? { type: 'load_scene', key: key! } : { type: 'load_table', scene, key, files: [] });
    if (error !== null) {
      notify('error', t('share.not_opened', { error }));
      return;
    }
    if (!(await nextBody(now.origin))) return;
  }
  if (seed !== undefined) {
    wantedSeed.value = seed;
    const [level, lumps, rounds] = game ?? [];
    wantedLevel.value = LEVELS.find((one) => one === level) ?? 'easy';
    wantedLumps.value = LUMPS.find((one) => one === lumps) ?? '1';
    wantedRounds.value = ROUNDS.find((one) => one === rounds) ?? '1';
    tab.value = 'game';
  }
  if (look !== undefined) {
    applyLook(look);
    // Its mesh may still come.
    if (!isThere && look.camera !== null) bodyView.peek()?.expectCamera(look.camera, MESH_WAIT);
  }
  notify('info', t('share.opened'));
}

/** Until there is a body of another scene than that of `origin`; false if it could not be built. */
function nextBody(origin: number): Promise<boolean> {
  return new Promise((resolve) => {
    let hasBegun = false;
    const end = effect(() => {
      const now = state.value;
      if (now === null) return;
      if (now.phase === 'building') hasBegun = true;
      const isThere = now.origin !== origin;
      if (!isThere && !(hasBegun && now.phase !== 'building')) return;
      queueMicrotask(() => {
        end();
        resolve(isThere);
      });
    });
  });
}
