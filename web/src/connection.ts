// The connection to the engine: snapshots and messages in, requests out. It reconnects by itself.

import type { Envelope, Message } from './generated/api';
import { readSnapshot, type Snapshot } from './generated/wire';
import { t } from './i18n';

/** A request: an envelope without its number. */
export type Request = DistributiveOmit<Envelope, 'id'>;
type DistributiveOmit<T, K extends PropertyKey> = T extends unknown ? Omit<T, K> : never;

export type ConnectionStatus = 'connecting' | 'open' | 'lost';

interface ConnectionListener {
  onStatus(status: ConnectionStatus): void;
  /** The engine refuses this page: the token is missing or wrong. */
  onRefused(): void;
  onMessage(message: Message): void;
  onSnapshot(snapshot: Snapshot): void;
}

/** Before a new attempt to connect, ms; doubled after each failure. */
const FIRST_WAIT = 500;
const LONGEST_WAIT = 5000;
/** Silence after which a connection counts as lost, ms: the engine sends
 * something twice a second. */
const SILENCE = 6000;
/** Then for messages that wait to be read, ms: after a page has stood still its timers
 * may come before them. */
const GRACE = 1000;
/** ms. */
const REPLY_WAIT = 35_000;

/** An address of the engine, with the token of the page's own address. */
export function apiUrl(path: string): string {
  const token = new URLSearchParams(location.search).get('token');
  return token === null ? path : `${path}?token=${encodeURIComponent(token)}`;
}

export class Connection {
  private socket: WebSocket | null = null;
  private wait = FIRST_WAIT;
  private timer = 0;
  private silence = 0;
  private nextId = 1;
  private readonly waiting = new Map<number, (error: string | null) => void>();
  private closed = false;

  constructor(private readonly listener: ConnectionListener) {
    this.open();
  }

  /** Sends a request; resolves to the reason of a refusal, or null. */
  request(request: Request): Promise<string | null> {
    const id = this.nextId++;
    return new Promise((resolve) => {
      if (!this.send({ id, ...request } as Envelope)) {
        resolve(t('connection.not_connected'));
        return;
      }
      const timer = window.setTimeout(() => this.answer(id, t('connection.no_answer', { seconds: REPLY_WAIT / 1000 })), REPLY_WAIT);
      this.waiting.set(id, (error) => {
        window.clearTimeout(timer);
        resolve(error);
      });
    });
  }

  /** Sends without waiting for the answer, as every move of the hand does; true if it was sent. */
  send(envelope: Envelope | Request): boolean {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(envelope));
    return true;
  }

  close(): void {
    this.closed = true;
    window.clearTimeout(this.timer);
    window.clearTimeout(this.silence);
    this.socket?.close();
  }

  private open(): void {
    this.listener.onStatus('connecting');
    const url = new URL(apiUrl('ws'), location.href);
    url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
    const socket = new WebSocket(url);
    let isOpened = false;
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      isOpened = true;
      this.wait = FIRST_WAIT;
      this.listener.onStatus('open');
      this.hear();
    };
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      this.hear();
      if (typeof event.data === 'string') this.read(JSON.parse(event.data) as Message);
      else this.listener.onSnapshot(readSnapshot(event.data));
    };
    socket.onclose = () => {
      if (!isOpened) void this.askWhy();
      this.lose(socket);
    };
    this.socket = socket;
  }

  /** Finds out why the WebSocket did not open, which it does not say itself. */
  private async askWhy(): Promise<void> {
    const status = await fetch(apiUrl('api/state'), { method: 'HEAD' }).then((response) => response.status, () => 0);
    if (status === 401 && !this.closed) this.listener.onRefused();
  }

  private read(message: Message): void {
    if (message.type === 'reply' && message.id != null) this.answer(message.id, message.error ?? null);
    else this.listener.onMessage(message);
  }

  private answer(id: number, error: string | null): void {
    this.waiting.get(id)?.(error);
    this.waiting.delete(id);
  }

  private hear(): void {
    window.clearTimeout(this.silence);
    this.silence = window.setTimeout(() => {
      this.silence = window.setTimeout(() => this.lose(this.socket), GRACE);
    }, SILENCE);
  }

  private lose(socket: WebSocket | null): void {
    if (this.closed || socket === null || socket !== this.socket) return;
    this.socket = null;
    socket.onclose = null;
    socket.close();
    window.clearTimeout(this.silence);
    for (const id of [...this.waiting.keys()]) this.answer(id, t('connection.cut_off'));
    this.listener.onStatus('lost');
    this.timer = window.setTimeout(() => this.open(), this.wait);
    this.wait = Math.min(2 * this.wait, LONGEST_WAIT);
  }
}
