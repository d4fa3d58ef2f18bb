// A body of the user's own, from the drop of its files to the touch.
//
//   files ─► sorted ─┬─ a scene (TOML, with its files or alone; ZIP) ─► loaded
//                    └─ surfaces ─► draft: checked, shown with findings ─► unit, layers, bones ─► grown

import { batch, effect, signal } from '@preact/signals';
import type { LengthUnit, Template } from '../generated/api';
import { language, t } from '../i18n';
import { problemWords } from '../i18n/events';
import { ask, isController, notify, scene, state } from '../store';
import { inPageWords } from '../ui/words';
import { recheck, Refused, sizeWords, upload, uploadSurface, type Surface } from './upload';

/** A surface with the file that it came from. */
export interface Part extends Surface {
  file: File;
}

/** A body that is not grown yet. */
export interface Draft {
  skin: Part | null;
  bones: Part[];
  unit: LengthUnit;
  template: Template;
  /** What is being done; null if nothing. */
  busy: string | null;
  /** Why the last thing could not be done. */
  problem: string | null;
  /** Since when the body grows, ms of `performance.now()`. */
  growingSince: number | null;
}

export const draft = signal<Draft | null>(null);

const EMPTY: Draft = { skin: null, bones: [], unit: 'm', template: 'limb', busy: null, problem: null, growingSince: null };

function change(changes: Partial<Draft>): void {
  if (draft.value !== null) draft.value = { ...draft.value, ...changes };
}

let abort = new AbortController();

/** Closes the draft; what is under way is left. */
export function closeDraft(): void {
  abort.abort();
  if (draft.value?.growingSince != null) void ask({ type: 'cancel_build' });
  draft.value = null;
}

/** Stops to wait for a file or for the body, and keeps the draft. */
export function stopWaiting(): void {
  abort.abort();
  if (draft.value?.growingSince != null) void ask({ type: 'cancel_build' });
  change({ busy: null, growingSince: null });
  if (draft.value?.skin === null) draft.value = null;
}

// Files that were used, for an engine that is started again.

const MOST_SOURCES = 20;
const sources = new Map<number, File[]>();
let sourcesOfNext: { files: File[]; after: number | undefined } | null = null;
/** Files of a scene by its origin, as they were chosen. */
export const sourcesOf = (origin: number): File[] | undefined => sources.get(origin);
/** A new engine counts its scenes from one. */
export function forgetSources(): void {
  sources.clear();
}
/** The next scene that is loaded is made of these files. */
export function expectSources(files: File[] | null): void {
  sourcesOfNext = files === null ? null : { files, after: state.peek()?.origin };
}
effect(() => {
  const now = state.value;
  if (now === null || sourcesOfNext === null || now.files.length === 0 || now.origin === sourcesOfNext.after) return;
  sources.set(now.origin, sourcesOfNext.files);
  sourcesOfNext = null;
  for (const origin of sources.keys()) if (sources.size > MOST_SOURCES) sources.delete(origin);
});

// Files from the user.

const ending = (file: File): string => (/\.([^.]+)$/.exec(file.name)?.[1] ?? '').toLowerCase();
const LARGEST_SCENE = 1 << 20;

/** Takes files that were dropped or chosen. */
export async function takeFiles(files: readonly File[]): Promise<void> {
  if (files.length === 0) return;
  if (!isController.value) {
    notify('warning', t('own.not_in_control'));
    return;
  }
  const archives = files.filter((file) => ending(file) === 'zip');
  const scenes = files.filter((file) => ending(file) === 'toml');
  const rest = files.filter((file) => !['zip', 'toml'].includes(ending(file)));
  if (archives.length + scenes.length > 1) {
    notify('warning', t('own.one_scene'));
  } else if (archives.length === 1) {
    await openArchive(archives[0]);
  } else if (scenes.length === 1) {
    await openScene(scenes[0], rest);
  } else if (draft.value?.skin != null) {
    await addBones(rest);
  } else {
    await begin(rest);
  }
}

/** Opens a scene file, with the files that it refers to. */
export async function openScene(file: File, rest: readonly File[]): Promise<void> {
  if (file.size > LARGEST_SCENE) {
    notify('warning', t('scene.too_large', { name: file.name }));
    return;
  }
  await opened(file, rest.length > 0, async (signal) => {
    const ids: number[] = [];
    for (const one of rest) ids.push((await upload(one, signal)).id);
    expectSources(rest.length > 0 ? [...rest] : null);
    const error = await ask({ type: 'load_text', text: await file.text(), files: ids });
    return error !== null && rest.length === 0 && /surface|cannot read/.test(error) ? `${error} ${t('own.with_its_files')}` : error;
  });
}

function openArchive(file: File): Promise<void> {
  return opened(file, true, async (signal) => {
    const { id, content } = await upload(file, signal);
    if (content.kind !== 'scene') throw new Refused(t('own.no_scene', { name: file.name }));
    expectSources([file]);
    return ask({ type: 'load_uploaded', file: id });
  });
}

async function opened(file: File, isLong: boolean, open: (signal: AbortSignal) => Promise<string | null>): Promise<void> {
  abort = new AbortController();
  const { signal } = abort;
  draft.value = isLong ? { ...EMPTY, busy: t('own.reading', { name: file.name, size: sizeWords(file) }) } : null;
  const error = await open(signal).catch(words);
  if (signal.aborted) return;
  draft.value = null;
  if (error === null) {
    notify('info', t('scene.opened', { name: file.name }));
  } else {
    expectSources(null);
    notify('error', t('scene.not_opened', { name: file.name, error }));
  }
}

const words = (error: unknown): string => (error instanceof Refused ? error.message : String(error));

const extent = ({ info }: Surface): number => Math.hypot(...info.size);

/** Begins a draft with surfaces: the largest is the skin. */
async function begin(files: readonly File[]): Promise<void> {
  abort = new AbortController();
  const { signal } = abort;
  draft.value = { ...EMPTY };
  const parts: Part[] = [];
  for (const file of files) {
    change({ busy: t('own.reading', { name: file.name, size: sizeWords(file) }) });
    try {
      parts.push({ ...(await uploadSurface(file, signal)), file });
    } catch (error) {
      if (signal.aborted) return;
      change({ busy: null, problem: words(error) });
      return;
    }
  }
  parts.sort((a, b) => extent(b) - extent(a));
  const [skin, ...bones] = parts;
  change({ skin, bones, unit: skin.info.unit, busy: null });
}

/** Adds bones to the draft. */
export async function addBones(files: readonly File[]): Promise<void> {
  abort = new AbortController();
  const { signal } = abort;
  for (const file of files) {
    change({ busy: t('own.reading', { name: file.name, size: sizeWords(file) }), problem: null });
    try {
      const part = { ...(await uploadSurface(file, signal)), file };
      if (draft.value !== null) change({ bones: [...draft.value.bones, part] });
    } catch (error) {
      if (signal.aborted) return;
      change({ problem: words(error) });
      break;
    }
  }
  change({ busy: null });
}

export function removeBone(id: number): void {
  change({ bones: draft.value?.bones.filter((bone) => bone.id !== id) ?? [] });
}

export function chooseTemplate(template: Template): void {
  change({ template });
}

/** Chooses the unit, and checks the skin in it. */
export async function chooseUnit(unit: LengthUnit): Promise<void> {
  const before = draft.value;
  if (before?.skin == null || before.unit === unit) return;
  abort = new AbortController();
  const { signal } = abort;
  change({ unit, problem: null, busy: t('own.checking', { name: before.skin.name }) });
  try {
    const again = await recheck(before.skin.id, unit, signal);
    change({ skin: { ...before.skin, info: again.info }, busy: null });
  } catch (error) {
    if (!signal.aborted) change({ busy: null, problem: words(error) });
  }
}

/** Grows the body, and closes the draft when it can be touched. */
export async function grow(): Promise<void> {
  const now = draft.value;
  if (now?.skin == null) return;
  const before = { origin: state.peek()?.origin, problem: JSON.stringify(state.peek()?.problem ?? null) };
  abort = new AbortController();
  const { signal } = abort;
  change({ problem: null, growingSince: performance.now() });
  const parts = [now.skin, ...now.bones];
  expectSources(parts.map(({ file }) => file));
  const error = await ask({
    type: 'grow', skin: now.skin.id, bones: now.bones.map(({ id }) => id), unit: now.unit, template: now.template,
  });
  if (signal.aborted) return;
  if (error !== null) {
    change({ problem: error, growingSince: null });
    return;
  }
  let hasBegun = false;
  const end = effect(() => {
    const then = state.value;
    if (then === null) return;
    if (then.phase === 'building') hasBegun = true;
    const isGrown = then.origin !== before.origin;
    const isRefused = then.phase !== 'building' && (hasBegun || JSON.stringify(then.problem ?? null) !== before.problem);
    if (!isGrown && !isRefused && !signal.aborted) return;
    queueMicrotask(() => {
      end();
      if (signal.aborted) return;
      if (isGrown) {
        draft.value = null;
        notify('info', t('own.grown', { name: now.skin!.name }));
      } else {
        const why = then.problem == null ? '' : inPageWords(problemWords(then.problem, language.peek()), scene.peek());
        batch(() => change({ problem: why, growingSince: null }));
      }
    });
  });
}
