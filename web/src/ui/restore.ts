// The scene of this page after the engine was started again.
//
// A new run of the program begins with a scene of its own. The page compares it with the one that it had and, if they differ, offers
// to bring that back: by its key, or as it was edited, with the user's files that it was made of.

import { effect, signal } from '@preact/signals';
import type { State } from '../generated/api';
import type { SceneTable } from '../generated/scene';
import { t } from '../i18n';
import { ask, hello, state } from '../store';
import { expectSources, forgetSources, sourcesOf } from '../own/draft';
import { Refused, upload } from '../own/upload';

/** A scene that the page had. */
interface Had {
  key: string | null;
  isChanged: boolean;
  scene: SceneTable;
  /** Names of its files. */
  files: string[];
  origin: number;
  /** The files that it was made of, if this page sent them; known once it is lost. */
  sources?: File[];
}

/** The scene that can be brought back; null if there is none. */
export const lost = signal<Had | null>(null);
/** Whether it is being brought back. */
export const isRestoring = signal(false);

let run: string | null = null;
let had: Had | null = null;
/** Whether the scene of the present run is known. */
let isKnown = false;

const asHad = (now: State): Had => ({
  key: now.gallery_key ?? null,
  isChanged: now.is_changed,
  scene: now.scene as SceneTable,
  files: now.files,
  origin: now.origin,
});

export function beginRestoring(): void {
  effect(() => {
    const now = state.value;
    const current = hello.value?.run ?? null;
    if (current === null || now?.scene == null) return;
    if (run !== current) {
      const isFirst = run === null;
      run = current;
      isKnown = isFirst;
      if (!isFirst) {
        // The state of the run before is still shown.
        state.value = null;
        return;
      }
    }
    if (!isKnown) {
      isKnown = true;
      if (had !== null) had = { ...had, sources: sourcesOf(had.origin) };
      forgetSources();
      const isSame = had !== null && JSON.stringify(had.scene) === JSON.stringify(now.scene);
      lost.value = isSame ? null : had;
      if (!isSame) return;
    }
    if (lost.value === null) had = asHad(now);
  });
}

/** Keeps the scene of the new run. */
export function keepNew(): void {
  lost.value = null;
  if (state.peek()?.scene != null) had = asHad(state.peek()!);
}

/** Brings the scene back; resolves to why it cannot, or null. */
export async function restore(): Promise<string | null> {
  const before = lost.peek();
  if (before === null) return null;
  isRestoring.value = true;
  const error = await bringBack(before).catch((error: unknown) => (error instanceof Refused ? error.message : String(error)));
  isRestoring.value = false;
  if (error === null) lost.value = null;
  else if (before.files.length > 0 && before.sources === undefined) return t('restore.needs_files', { files: before.files.join(', ') });
  return error;
}

async function bringBack({ key, isChanged, scene, sources }: Had): Promise<string | null> {
  if (key !== null && !isChanged) return ask({ type: 'load_scene', key });
  const ids: number[] = [];
  for (const file of sources ?? []) ids.push((await upload(file, new AbortController().signal)).id);
  expectSources(sources ?? null);
  return ask({ type: 'load_table', scene, ...(key === null ? {} : { key }), files: ids });
}
