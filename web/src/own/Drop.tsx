// Files that are dragged over the page and dropped on it.

import { useEffect, useState } from 'preact/hooks';
import { t } from '../i18n';
import { draft, takeFiles } from './draft';
import { boundWords } from './upload';

const hasFiles = (event: DragEvent): boolean => event.dataTransfer?.types.includes('Files') ?? false;

export function Drop() {
  const [isOver, setOver] = useState(false);
  useEffect(() => {
    const stop = new AbortController();
    const { signal } = stop;
    window.addEventListener('dragover', (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      event.dataTransfer!.dropEffect = 'copy';
      setOver(true);
    }, { signal });
    window.addEventListener('dragleave', (event) => {
      // Within the page it only changes the element.
      if (event.relatedTarget === null) setOver(false);
    }, { signal });
    window.addEventListener('drop', (event) => {
      setOver(false);
      if (!hasFiles(event)) return;
      event.preventDefault();
      void takeFiles([...event.dataTransfer!.files]);
    }, { signal });
    return () => stop.abort();
  }, []);
  if (!isOver) return null;
  // A modal dialog lies over all else; it gets files too, but shows no overlay.
  return (
    <div class="drop" data-testid="drop">
      <div class="drop-inside">
        <strong>{t(draft.value?.skin != null ? 'own.drop_bones' : 'own.drop')}</strong>
        <span>{t('own.drop_kinds')}</span>
        <span class="hint">{boundWords()}</span>
      </div>
    </div>
  );
}
