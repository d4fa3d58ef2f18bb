// The bar that offers the scene of this page to an engine that was started again.

import { useState } from 'preact/hooks';
import { named, t } from '../i18n';
import { isController, notify } from '../store';
import { Button } from './controls';
import { isRestoring, keepNew, lost, restore } from './restore';

export function RestoreBar() {
  const [problem, setProblem] = useState<string | null>(null);
  const before = lost.value;
  if (before === null) return null;
  const name = before.key === null ? (before.scene.body.surface ?? t('scene.own_picked')) : named('gallery', before.key);
  return (
    <div class="banner restore" data-testid="restore">
      <span>
        {t('restore.other', { name: before.isChanged ? t('restore.changed', { name }) : name })}
        {problem !== null && <strong> {problem}</strong>}
      </span>
      <span class="banner-buttons">
        <Button
          kind="primary"
          disabled={!isController.value || isRestoring.value}
          onClick={() => void restore().then((error) => {
            setProblem(error);
            if (error === null) notify('info', t('restore.done'));
          })}
          testid="restore-scene"
        >
          {t('restore.do')}
        </Button>
        <Button
          onClick={() => {
            setProblem(null);
            keepNew();
          }}
          testid="restore-keep"
        >
          {t('restore.keep')}
        </Button>
      </span>
    </div>
  );
}
