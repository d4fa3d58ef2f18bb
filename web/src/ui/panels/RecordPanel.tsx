// Recordings: record, replay, download.

import { useEffect, useState } from 'preact/hooks';
import { t } from '../../i18n';
import { askAloud, state } from '../../store';
import { Button, Controlled, Download, Section } from '../controls';

export function RecordPanel() {
  const recording = state.value?.recording;
  const seconds = useElapsed(recording?.is_recording ?? false);
  const hasOne = recording !== undefined && recording.duration > 0 && !recording.is_recording;
  return (
    <>
      <Controlled>
        <Section title={t('record.record')} hint={t('record.hint')}>
          <div class="buttons">
            {recording?.is_recording ? (
              <Button kind="danger" onClick={() => void askAloud({ type: 'stop_recording' })} testid="record-stop">{t('record.stop')}</Button>
            ) : (
              <Button
                kind="primary"
                onClick={() => void askAloud({ type: 'start_recording' })}
                disabled={recording?.is_replaying}
                testid="record-start"
              >
                {t('record.start')}
              </Button>
            )}
          </div>
          <p class="value" data-testid="record-duration" data-seconds={recording?.duration ?? 0}>
            {recording?.is_recording && <span class="recording-dot" aria-hidden="true" />}
            {recording === undefined || (recording.duration === 0 && !recording.is_recording)
              ? t('record.none')
              : t(recording.is_recording ? 'record.running' : 'record.kept', {
                  seconds: (recording.is_recording ? Math.max(seconds, recording.duration) : recording.duration).toFixed(1),
                })}
          </p>
        </Section>
        <Section title={t('record.replay')}>
          <div class="buttons">
            {recording?.is_replaying ? (
              <Button onClick={() => void askAloud({ type: 'close_replay' })}>{t('replay.close')}</Button>
            ) : (
              <Button onClick={() => void askAloud({ type: 'open_replay' })} disabled={!hasOne} testid="replay-open">{t('replay.open')}</Button>
            )}
          </div>
          <p class="hint">{t('replay.hint')}</p>
        </Section>
      </Controlled>
      <Section title={t('record.save')}>
        <div class="buttons">
          <Download path="api/recording.csv" name="recording.csv" disabled={!hasOne} testid="save-csv">{t('record.save_csv')}</Download>
          <Download path="api/recording.mcap" name="recording.mcap" disabled={!hasOne} testid="save-mcap">{t('record.save_mcap')}</Download>
          <Download path="api/body.vtu" name="body.vtu">{t('scene.save_vtu')}</Download>
        </div>
      </Section>
    </>
  );
}

/** Seconds since `isOn` became true; states come only when something changes. */
function useElapsed(isOn: boolean): number {
  const [seconds, setSeconds] = useState(0);
  useEffect(() => {
    setSeconds(0);
    if (!isOn) return;
    const began = performance.now();
    const timer = window.setInterval(() => setSeconds((performance.now() - began) / 1e3), 200);
    return () => window.clearInterval(timer);
  }, [isOn]);
  return seconds;
}
