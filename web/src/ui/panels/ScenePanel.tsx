// Scenes: the gallery, files, and what is known about the loaded one.

import { useState } from 'preact/hooks';
import { language, named, t } from '../../i18n';
import { noteWords } from '../../i18n/notes';
import { takeFiles } from '../../own/draft';
import { FileButton, MESH_FILES } from '../../own/OwnDialog';
import { boundWords } from '../../own/upload';
import { ask, askAloud, isController, notify, scene, state } from '../../store';
import { aloud, Button, Controlled, Download, Section } from '../controls';
import { formatNumber } from '../quantity';
import { linkOfPresent } from '../share';

const FILES = `.toml,.zip,.csv,text/plain,${MESH_FILES}`;

export function ScenePanel() {
  const now = state.value;
  return (
    <>
      {now?.scene != null && <PresentScene />}
      <Controlled>
        <Section title={t('scene.own')} hint={t('scene.own_hint')}>
          <p class="hint">{boundWords()}</p>
          <div class="buttons">
            <FileButton accept={FILES} multiple onFiles={(files) => void takeFiles(files)} testid="scene">{t('scene.open')}</FileButton>
          </div>
        </Section>
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
      </Controlled>
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

/** The loaded scene: whether it was changed, and what can be kept of it. */
function PresentScene() {
  const now = state.value!;
  const name = now.gallery_key == null ? (scene.value?.body.surface ?? t('scene.own_picked')) : named('gallery', now.gallery_key);
  return (
    <Section
      title={name}
      action={
        <span class={`tag ${now.is_changed ? 'changed' : ''}`} data-testid="scene-changed" data-changed={now.is_changed}>
          {t(now.is_changed ? 'scene.changed' : 'scene.as_loaded')}
        </span>
      }
    >
      <div class="buttons">
        <Button
          disabled={!now.is_changed || !isController.value}
          onClick={() => aloud(ask({ type: 'reset_scene' }))}
          testid="scene-reset"
        >
          {t('scene.reset')}
        </Button>
        <CopyLink />
      </div>
      <div class="buttons">
        {now.files.length > 0
          ? <Download path="api/scene.zip" name="scene.zip" testid="scene-save-zip">{t('scene.save_zip')}</Download>
          : <Download path="api/scene.toml" name="scene.toml" testid="scene-save">{t('scene.save_toml')}</Download>}
        <Download path="api/body.vtu" name="body.vtu" testid="save-vtu">{t('scene.save_vtu')}</Download>
      </div>
    </Section>
  );
}

/** Copies a link; where the browser allows no copy, shows it. */
function CopyLink() {
  const [shown, setShown] = useState<string | null>(null);
  const copy = async (): Promise<void> => {
    const made = await linkOfPresent();
    if ('error' in made) {
      notify('warning', made.error);
      return;
    }
    try {
      await navigator.clipboard.writeText(made.link);
      notify('info', t('share.copied'));
      setShown(null);
    } catch {
      setShown(made.link);
    }
  };
  return (
    <>
      <Button onClick={() => void copy()} testid="share">{t('share.copy')}</Button>
      {shown !== null && (
        <input
          type="text"
          readOnly
          class="share-link"
          value={shown}
          aria-label={t('share.link')}
          onFocus={(event) => event.currentTarget.select()}
          data-testid="share-link"
        />
      )}
    </>
  );
}
