// The banner over everything when the connection is lost.

import { t } from '../i18n';
import { RestoreBar } from './RestoreBar';
import { isRefused, status, wasOpen } from '../store';

export function Banner() {
  const isLost = wasOpen.value && status.value !== 'open';
  const isUnreachable = !wasOpen.value && status.value === 'lost';
  return (
    <div class="banner-place" role="alert">
      {(isLost || isUnreachable) && (
        <div class="banner" data-testid="connection-lost">
          <span class="spinner" aria-hidden="true" />
          {t(isRefused.value ? 'connection.token_banner' : isLost ? 'connection.lost_banner' : 'connection.none_banner')}
        </div>
      )}
      {!isLost && <RestoreBar />}
    </div>
  );
}
