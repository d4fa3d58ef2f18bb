// The state of the page: signals that panels read, and the functions that send requests.

import { batch, computed, effect, signal } from '@preact/signals';
import type { EngineFigures, Hello, Message, NoticeLevel, State } from './generated/api';
import type { SceneTable } from './generated/scene';
import { SNAPSHOT_VERSION, type FrameSnapshot, type MapSnapshot, type MeshSnapshot, type Snapshot } from './generated/wire';
import { Connection, type ConnectionStatus, type Request } from './connection';
import { language, t } from './i18n';
import { noticeWords } from './i18n/events';
import { History } from './ui/history';
import { inPageWords } from './ui/words';

export type Vec3 = [number, number, number];

export const status = signal<ConnectionStatus>('connecting');
/** Whether the connection has ever been open. */
export const wasOpen = signal(false);
/** Whether the engine refuses this page's token. */
export const isRefused = signal(false);
export const hello = signal<Hello | null>(null);
export const state = signal<State | null>(null);
export const figures = signal<EngineFigures | null>(null);

export const scene = computed<SceneTable | null>(() => (state.value?.scene as SceneTable | undefined) ?? null);
export const isController = computed(
  () => status.value === 'open' && hello.value !== null && state.value?.controller === hello.value.client,
);
export const isWatching = computed(
  () => status.value === 'open' && state.value !== null && !isController.value,
);
export const isVersionOther = computed(
  () => hello.value !== null && hello.value.snapshot_version !== SNAPSHOT_VERSION,
);
/** Whether a game hides lumps: nothing on the page may show them. */
export const isHiding = computed(() => state.value?.game != null && state.value.game.result == null);
export const isReplaying = computed(() => state.value?.recording.is_replaying ?? false);

/** A notice in the list, newest first. */
export interface NoticeItem {
  key: number;
  level: NoticeLevel;
  text: string;
  at: Date;
  /** How often it came in a row. */
  count: number;
}
const MOST_NOTICES = 100;
export const notices = signal<NoticeItem[]>([]);
/** Keys of the notices shown as toasts. */
export const toasts = signal<number[]>([]);
/** ms. */
const TOAST_TIME: Record<NoticeLevel, number> = { info: 5000, warning: 8000, error: 14_000 };
let nextKey = 1;

export function notify(level: NoticeLevel, text: string): void {
  const newest = notices.value[0];
  const repeats = newest !== undefined && newest.text === text && newest.level === level;
  const item: NoticeItem = repeats
    ? { ...newest, count: newest.count + 1, at: new Date() }
    : { key: nextKey++, level, text, at: new Date(), count: 1 };
  const rest = repeats ? notices.value.slice(1) : notices.value;
  batch(() => {
    notices.value = [item, ...rest].slice(0, MOST_NOTICES);
    if (!toasts.value.includes(item.key)) toasts.value = [...toasts.value, item.key].slice(-4);
  });
  window.setTimeout(() => dismissToast(item.key), TOAST_TIME[level]);
}

export function dismissToast(key: number): void {
  if (toasts.value.includes(key)) toasts.value = toasts.value.filter((other) => other !== key);
}

// Snapshots come up to 60 times a second. They go to the drawing code directly,
// not through signals.

export const history = new History();
let latestMesh: MeshSnapshot | null = null;
export let latestFrame: FrameSnapshot | null = null;
const meshListeners = new Set<(mesh: MeshSnapshot) => void>();
const frameListeners = new Set<(frame: FrameSnapshot) => void>();

export function onMesh(listener: (mesh: MeshSnapshot) => void): () => void {
  meshListeners.add(listener);
  if (latestMesh !== null) listener(latestMesh);
  return () => meshListeners.delete(listener);
}

export function onFrame(listener: (frame: FrameSnapshot) => void): () => void {
  frameListeners.add(listener);
  if (latestFrame !== null) listener(latestFrame);
  return () => frameListeners.delete(listener);
}

let latestMap: MapSnapshot | null = null;
const mapListeners = new Set<(map: MapSnapshot) => void>();
export function onMap(listener: (map: MapSnapshot) => void): () => void {
  mapListeners.add(listener);
  if (latestMap !== null) listener(latestMap);
  return () => mapListeners.delete(listener);
}

function takeSnapshot(snapshot: Snapshot): void {
  if (snapshot.kind === 3) {
    latestMap = snapshot;
    for (const listener of mapListeners) listener(snapshot);
  } else if (snapshot.kind === 1) {
    latestMesh = snapshot;
    for (const listener of meshListeners) listener(snapshot);
  } else {
    latestFrame = snapshot;
    history.push(snapshot);
    for (const listener of frameListeners) listener(snapshot);
  }
}

// The scenes as they were loaded, for “Reset” of single layers. The engine numbers the loads.

const MOST_ORIGINALS = 50;
const originals = new Map<number, SceneTable>();
export const original = signal<SceneTable | null>(null);
let runOfOriginals: string | null = null;

function keepOriginal(next: State): void {
  const run = hello.peek()?.run ?? null;
  if (run !== runOfOriginals) originals.clear();
  runOfOriginals = run;
  if (next.scene == null) return;
  if (!next.is_changed) {
    originals.set(next.origin, next.scene as SceneTable);
    for (const origin of originals.keys()) if (originals.size > MOST_ORIGINALS) originals.delete(origin);
  }
  original.value = originals.get(next.origin) ?? null;
}

function takeMessage(message: Message): void {
  switch (message.type) {
    case 'hello':
      hello.value = message;
      break;
    case 'state':
      batch(() => {
        keepOriginal(message);
        state.value = message;
      });
      break;
    case 'engine':
      figures.value = message;
      break;
    case 'notice':
      notify(message.level, inPageWords(noticeWords(message.what, language.value), scene.peek()));
      break;
    case 'reply':
      if (message.error != null) notify('warning', inPageWords(message.error, scene.peek()));
  }
}

let connection: Connection | null = null;

export function connect(): void {
  connection = new Connection({
    onStatus: (next) => {
      batch(() => {
        status.value = next;
        if (next !== 'open') return;
        wasOpen.value = true;
        isRefused.value = false;
      });
    },
    onRefused: () => (isRefused.value = true),
    onMessage: takeMessage,
    onSnapshot: takeSnapshot,
  });
}

/** Sends a request; resolves to the reason of a refusal, or null. Shows nothing: fields show the
 * reason themselves. */
export async function ask(request: Request): Promise<string | null> {
  const error = (await connection?.request(request)) ?? (connection === null ? t('connection.not_connected') : null);
  return error === null ? null : inPageWords(error, scene.peek());
}

/** Sends a request, and shows a refusal as a notice. */
export async function askAloud(request: Request): Promise<boolean> {
  const error = await ask(request);
  if (error !== null) notify('warning', error);
  return error === null;
}

/** Sends a request without waiting for its answer. */
export function send(request: Request): void {
  connection?.send(request);
}

/** Changes keys of the scene; null as a value removes the key. */
export function edit(...edits: [path: string, value: unknown][]): Promise<string | null> {
  return ask({ type: 'edit', edits: edits.map(([path, value]) => ({ path, value })) });
}

/** Changes with the press point of the scene, as when another body is loaded. */
export const homeKey = computed(() => state.value?.home.point.join());

/** Changes when another body is chosen. */
export const galleryKey = computed(() => state.value?.gallery_key ?? state.value?.origin);
/** Changes with the form of the body: curves of one form mean nothing for another. */
const formKey = computed(() => JSON.stringify([galleryKey.value, scene.value?.body]));
/** Changes with everything that is pressed, and what presses it. */
const bodyKey = computed(() => {
  const { press: _, motion: __, ...body } = scene.value ?? {};
  return JSON.stringify(body);
});
effect(() => {
  void formKey.value;
  history.clear();
});
effect(() => history.setBody(bodyKey.value));
