// Scenes: the gallery, files, and what is known about the loaded one.

import { useRef } from 'preact/hooks';
import { language, named, t } from '../../i18n';
import { noteWords } from '../../i18n/notes';
import { ask, askAloud, notify, state } from '../../store';
import { Button, Controlled, Download, Section } from '../controls';
import { formatNumber } from '../quantity';

/** Largest scene file, bytes. */
const LARGEST_FILE = 1_000_000;

export function ScenePanel() {
  const now = state.value;
  const input = useRef<HTMLInputElement>(null);

  const open = async (file: File): Promise<void> => {
    if (file.size > LARGEST_FILE) {
      notify('warning', t('scene.too_large', { name: file.name }));
      return;
    }
    const error = await ask({ type: 'load_text', text: await file.text() });
    if (error === null) notify('info', t('scene.opened', { name: file.name }));
    else notify('error', t('scene.not_opened', { name: file.name, error }));
  };

  return (
    <>
      <Controlled>
        <Section title={t('scene.gallery')}>
          <ul class="gallery">
            {now?.gallery.map((entry) => (
              <li key={entry.key}>
                <button
                  type="button"
                  class="card"
                  aria-current={entry.key === now.gallery_key ? 'true' : undefined}
                  onClick={() => void askAloud({ type: 'load_scene', key: entry.key })}
                  data-testid={`scene-${entry.key}`}
                >
                  <strong>{named('gallery', entry.key, entry.name)}</strong>
                  <span>{named('gallery_about', entry.key, '')}</span>
                </button>
              </li>
            ))}
          </ul>
        </Section>
        <Section title={t('scene.own')} hint={t('scene.own_hint')}>
          <div class="buttons">
            <Button onClick={() => input.current?.click()} testid="scene-open">{t('scene.open')}</Button>
            <Button
              onClick={() => now?.gallery_key != null && void askAloud({ type: 'load_scene', key: now.gallery_key })}
              disabled={now?.gallery_key == null}
              testid="scene-reset"
            >
              {t('scene.reset')}
            </Button>
          </div>
          <input
            ref={input}
            type="file"
            accept=".toml,text/plain"
            hidden
            aria-label={t('scene.open')}
            onChange={(event) => {
              const file = event.currentTarget.files?.[0];
              if (file !== undefined) void open(file);
              event.currentTarget.value = '';
            }}
            data-testid="scene-file"
          />
        </Section>
      </Controlled>
      <Section title={t('scene.save')}>
        <div class="buttons">
          <Download path="api/scene.toml" name="scene.toml" testid="scene-save">{t('scene.save_toml')}</Download>
          <Download path="api/body.vtu" name="body.vtu" testid="save-vtu">{t('scene.save_vtu')}</Download>
        </div>
      </Section>
      {now !== null && (
        <Section title={t('scene.about')}>
          <dl class="figures">
            <dt>{t('scene.method')}</dt>
            <dd>{named('method', now.method)}</dd>
            <dt>{t('scene.nodes')}</dt>
            <dd>{now.n_nodes.toLocaleString()}</dd>
            <dt>{t('scene.greatest_depth')}</dt>
            <dd>{formatNumber(now.greatest_depth * 1e3)} mm</dd>
            <dt>{t('scene.max_force')}</dt>
            <dd>{formatNumber(now.max_force)} N</dd>
          </dl>
          {now.notes.length > 0 && <ul class="notes">{now.notes.map((note) => <li key={note.text}>{noteWords(note, language.value)}</li>)}</ul>}
        </Section>
      )}
    </>
  );
}
