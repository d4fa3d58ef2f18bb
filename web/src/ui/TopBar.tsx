// The bar at the top: scene, connection, control, theme, language, messages, help.

import { useRef, useState } from 'preact/hooks';
import { language, named, t, type Language } from '../i18n';
import { askAloud, figures, hello, isController, state, status } from '../store';
import { Button, Select } from './controls';
import { Help } from './Help';
import { Icon } from './icons';
import { NoticeButton } from './Notices';
import { formatNumber } from './quantity';
import { themeChoice, type ThemeChoice } from './settings';
import { Undo } from './Undo';

const OWN = '';

export function TopBar() {
  const [isHelpOpen, setHelpOpen] = useState(false);
  return (
    <header class="top-bar">
      <h1 class="name" title={hello.value === null ? undefined : `Palpa ${hello.value.palpa}`}>
        <Logo />
        Palpa
      </h1>
      <ScenePicker />
      <Undo />
      <div class="top-states">
        <ConnectionState />
        <ControllerState />
      </div>
      <div class="top-end">
        <Select<ThemeChoice>
          label={t('theme.title')}
          isLabelHidden
          value={themeChoice.value}
          options={(['auto', 'light', 'dark'] as const).map((value) => ({ value, label: t(`theme.${value}`) }))}
          onChange={(value) => (themeChoice.value = value)}
          testid="theme"
        />
        <Select<Language>
          label={t('language.title')}
          isLabelHidden
          value={language.value}
          options={[{ value: 'en', label: 'English' }, { value: 'ja', label: '日本語' }]}
          onChange={(value) => (language.value = value)}
          testid="language"
        />
        <NoticeButton />
        <Button kind="quiet" label={t('help.open')} onClick={() => setHelpOpen(true)} testid="help-open"><Icon name="help" /></Button>
      </div>
      {isHelpOpen && <Help onClose={() => setHelpOpen(false)} />}
    </header>
  );
}

function Logo() {
  return (
    <svg class="logo" viewBox="0 0 32 32" aria-hidden="true">
      <rect width="32" height="32" rx="7" />
      <path d="M4 14c6 0 6 7 12 7s6-7 12-7" />
      <circle cx="16" cy="11" r="4.4" />
    </svg>
  );
}

function ScenePicker() {
  const now = state.value;
  return (
    <Select
      label={t('scene.pick')}
      isLabelHidden
      value={now?.gallery_key ?? OWN}
      disabled={!isController.value}
      options={[
        ...(now?.gallery_key == null ? [{ value: OWN, label: t('scene.own_picked') }] : []),
        ...(now?.gallery ?? []).map(({ key, name }) => ({
          value: key,
          label: named('gallery', key, name) + (key === now?.gallery_key && now.is_changed ? ` (${t('scene.changed')})` : ''),
        })),
      ]}
      onChange={(key) => key !== OWN && void askAloud({ type: 'load_scene', key })}
      testid="scene-picker"
    />
  );
}

/** The rate to be shown, kHz: the one before, as long as the new one (Hz) is near it. At rest nothing flickers. */
function steady(before: number, rate: number): number {
  return Math.abs(rate / 1e3 - before) < 0.08 ? before : Math.round(rate / 50) / 20;
}

function ConnectionState() {
  const isOpen = status.value === 'open';
  const phase = state.value?.phase;
  const kind = !isOpen ? 'bad' : phase === 'stopped' ? 'bad' : phase === 'building' ? 'busy' : 'good';
  const rate = figures.value;
  const shown = useRef(0);
  shown.current = steady(shown.current, rate?.tick_rate ?? 0);
  return (
    <span class={`state ${kind}`} data-testid="connection-status" data-status={status.value} data-phase={phase} data-revision={state.value?.revision} role="status">
      <span class="dot" aria-hidden="true" />
      {isOpen ? (phase === undefined ? t('connection.open') : t(`phase.${phase}`)) : t(`connection.${status.value}`)}
      {isOpen && phase === 'running' && rate !== null && (
        <span class="rate" aria-hidden="true">{formatNumber(shown.current, 2)} kHz</span>
      )}
    </span>
  );
}

function ControllerState() {
  const now = state.value;
  if (now === null || status.value !== 'open') return <span class="state" data-testid="controller-status" data-controls="unknown" />;
  if (isController.value) {
    return (
      <span class="state" data-testid="controller-status" data-controls="you">
        {t('control.you')}
        {now.n_clients > 1 && <span class="rate">{t('control.others', { n: now.n_clients - 1 })}</span>}
      </span>
    );
  }
  return (
    <span class="state watching-state" data-testid="controller-status" data-controls={now.controller == null ? 'nobody' : 'other'}>
      {t(now.controller == null ? 'control.nobody' : 'control.watching')}
      <Button kind="primary" onClick={() => void askAloud({ type: 'take_control' })} testid="take-control">{t('control.take')}</Button>
    </span>
  );
}
