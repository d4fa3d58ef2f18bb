// A user's files on their way to the engine, which reads and checks them.

import { apiUrl } from '../connection';
import type { LengthUnit, SurfaceInfo, Uploaded, UploadLimits } from '../generated/api';
import { readSnapshot, type MeshSnapshot } from '../generated/wire';
import { t } from '../i18n';
import { hello } from '../store';

/** Used until the engine has said its own. */
const LIMITS: UploadLimits = { bytes: 64 << 20, triangles: 500_000, files: 66 };

export const limits = (): UploadLimits => hello.value?.upload_limits ?? LIMITS;

/** A surface that the engine has. */
export interface Surface {
  id: number;
  name: string;
  info: SurfaceInfo;
}

/** A file that cannot be used, with the reason in the user's words or the engine's. */
export class Refused extends Error {}

const megabytes = (bytes: number): string => (bytes / (1 << 20)).toFixed(bytes < 10 << 20 ? 1 : 0);

/** The size of a file in words. */
export const sizeWords = (file: File): string => `${megabytes(file.size)} MB`;

/** The bounds of a file in words. */
export function boundWords(): string {
  const { bytes, triangles } = limits();
  return t('own.bounds', { bytes: megabytes(bytes), triangles: triangles.toLocaleString('en') });
}

function withToken(): HeadersInit {
  const token = new URLSearchParams(location.search).get('token');
  return token === null ? {} : { Authorization: `Bearer ${token}` };
}

/** The answer of the engine; its refusal as an error. */
async function asked(path: string, init: RequestInit = {}): Promise<Response> {
  let response: Response;
  try {
    response = await fetch(path, { ...init, headers: { ...withToken(), ...init.headers } });
  } catch (error) {
    if (init.signal?.aborted) throw error;
    throw new Refused(t(error instanceof TypeError ? 'own.not_sent' : 'own.unreadable'));
  }
  if (!response.ok) throw new Refused((await response.text()).trim());
  return response;
}

/** Files are checked one after the other. */
let last: Promise<unknown> = Promise.resolve();
function inTurn<T>(work: () => Promise<T>): Promise<T> {
  const next = last.then(work, work);
  last = next.catch(() => undefined);
  return next;
}

/** Sends a file. Throws `Refused` if it cannot be used. */
export function upload(file: File, signal: AbortSignal): Promise<Uploaded> {
  return inTurn(async () => {
    signal.throwIfAborted();
    if (file.size > limits().bytes) {
      throw new Refused(t('own.too_large', { name: file.name, size: megabytes(file.size), most: megabytes(limits().bytes) }));
    }
    const query = new URLSearchParams({ name: file.name, client: String(hello.value?.client ?? '') });
    const headers = { 'Content-Type': 'application/octet-stream' };
    // Read first: a file that has changed on the disk fails here, with a reason of its own.
    const body = await file.arrayBuffer().catch(() => {
      throw new Refused(t('own.unreadable'));
    });
    const response = await asked(`api/upload?${query}`, { method: 'POST', headers, body, signal });
    return (await response.json()) as Uploaded;
  });
}

/** Sends a file that must be a surface. */
export async function uploadSurface(file: File, signal: AbortSignal): Promise<Surface> {
  const uploaded = await upload(file, signal);
  return asSurface(uploaded);
}

function asSurface({ id, name, content }: Uploaded): Surface {
  if (content.kind !== 'surface') throw new Refused(t('own.no_surface', { name }));
  return { id, name, info: content };
}

/** Checks a surface again, in another unit. */
export function recheck(id: number, unit: LengthUnit, signal: AbortSignal): Promise<Surface> {
  return inTurn(async () => {
    signal.throwIfAborted();
    const response = await asked(`api/upload/check?${new URLSearchParams({ id: String(id), unit })}`, { signal });
    return asSurface((await response.json()) as Uploaded);
  });
}

/** The mesh of a surface for a picture, in the unit of its file, with its middle at the origin. */
export async function meshOf(id: number): Promise<MeshSnapshot> {
  const response = await asked(`api/upload/mesh?${new URLSearchParams({ id: String(id) })}`);
  const snapshot = readSnapshot(await response.arrayBuffer());
  if (snapshot.kind !== 1) throw new Error('not a mesh');
  return snapshot;
}

/** Address of a download. */
export const archiveUrl = (): string => apiUrl('api/scene.zip');
