// The help dialog: mouse, keys and gamepad.

import { useEffect, useRef } from 'preact/hooks';
import { t, type Key } from '../i18n';
import { hello } from '../store';
import { boundWords } from '../own/upload';
import { Button } from './controls';

const MOUSE: Key[] = ['press', 'stroke', 'wheel', 'shift', 'orbit', 'zoom', 'touch'].map((name) => `help.mouse_${name}` as Key);
const KEYS: [keys: string, what: Key][] = [
  ['← → ↑ ↓', 'help.key_arrows'],
  ['Shift + ← → ↑ ↓', 'help.key_shift_arrows'],
  ['PgUp / PgDn, + / −', 'help.key_depth'],
  ['Space', 'help.key_space'],
  ['Esc', 'help.key_escape'],
  ['Tab', 'help.key_tab'],
];
const EVERYWHERE: [keys: string, what: Key][] = [
  ['Ctrl + Z', 'help.key_undo'],
  ['Ctrl + Shift + Z, Ctrl + Y', 'help.key_redo'],
  ['Enter', 'help.key_enter'],
  ['↑ ↓ Home End', 'help.key_tabs'],
];
const PAD: Key[] = ['help.pad_stick', 'help.pad_trigger'];

export function Help({ onClose }: { onClose: () => void }) {
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => dialog.current!.showModal(), []);
  return (
    <dialog
      ref={dialog}
      class="help"
      aria-labelledby="help-title"
      onClose={onClose}
      onClick={(event) => event.target === dialog.current && dialog.current?.close()}
      data-testid="help"
    >
      <div class="help-inside">
        <div class="section-head">
          <h2 id="help-title">{t('help.title')}</h2>
          <Button onClick={() => dialog.current?.close()} testid="help-close">{t('help.close')}</Button>
        </div>
        <p>{t('help.about')}</p>
        <h3>{t('help.mouse')}</h3>
        <ul>{MOUSE.map((key) => <li key={key}>{t(key)}</li>)}</ul>
        <h3>{t('help.keys')}</h3>
        <p class="hint">{t('help.keys_hint')}</p>
        <dl class="keys">
          {KEYS.map(([keys, what]) => [<dt key={`t${keys}`}><kbd>{keys}</kbd></dt>, <dd key={`d${keys}`}>{t(what)}</dd>])}
        </dl>
        <p class="hint">{t('help.keys_everywhere')}</p>
        <dl class="keys">
          {EVERYWHERE.map(([keys, what]) => [<dt key={`t${keys}`}><kbd>{keys}</kbd></dt>, <dd key={`d${keys}`}>{t(what)}</dd>])}
        </dl>
        <h3>{t('help.files')}</h3>
        <p>{t('own.drop_kinds')} {boundWords()}</p>
        <h3>{t('help.pad')}</h3>
        <ul>{PAD.map((key) => <li key={key}>{t(key)}</li>)}</ul>
        <p class="hint">{hello.value === null ? 'Palpa' : `Palpa ${hello.value.palpa}`}</p>
      </div>
    </dialog>
  );
}
