// The page: bar, rail with panels, body, readout.

import { useEffect } from 'preact/hooks';
import { t } from '../i18n';
import { hello, isVersionOther } from '../store';
import { SNAPSHOT_VERSION } from '../generated/wire';
import { Drop } from '../own/Drop';
import { OwnDialog } from '../own/OwnDialog';
import { Banner } from './Banner';
import { Button } from './controls';
import { Notices } from './Notices';
import { Rail } from './Rail';
import { Readout } from './Readout';
import { Stage } from './Stage';
import { TopBar } from './TopBar';
import { picking } from './settings';

export function App() {
  useEffect(() => {
    const onKey = (event: KeyboardEvent): void => {
      if (event.key === 'Escape') picking.value = null;
    };
    window.addEventListener('keydown', onKey);
    return () => window.removeEventListener('keydown', onKey);
  }, []);
  if (isVersionOther.value) return <OtherVersion />;
  return (
    <div class="app">
      <a class="skip" href="#body-canvas">{t('app.skip')}</a>
      <TopBar />
      <Banner />
      <Rail />
      <Stage />
      <Readout />
      <Notices />
      <OwnDialog />
      <Drop />
    </div>
  );
}

/** Shown after an update of the engine: this page can no longer read its snapshots. */
function OtherVersion() {
  return (
    <main class="whole-page">
      <h1>{t('version.title')}</h1>
      <p>{t('version.text', { engine: hello.value!.snapshot_version, page: SNAPSHOT_VERSION })}</p>
      <Button kind="primary" onClick={() => location.reload()} testid="reload">{t('version.reload')}</Button>
    </main>
  );
}
