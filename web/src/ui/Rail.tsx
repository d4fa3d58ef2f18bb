// Tabs, and the panel of the chosen one.

import type { FunctionComponent } from 'preact';
import { useRef } from 'preact/hooks';
import { t } from '../i18n';
import { isHiding, state } from '../store';
import { Icon } from './icons';
import { DevicePanel } from './panels/DevicePanel';
import { EnginePanel } from './panels/EnginePanel';
import { GamePanel } from './panels/GamePanel';
import { LumpsPanel } from './panels/LumpsPanel';
import { MotionPanel } from './panels/MotionPanel';
import { RecordPanel } from './panels/RecordPanel';
import { ScenePanel } from './panels/ScenePanel';
import { TissuesPanel } from './panels/TissuesPanel';
import { ToolPanel } from './panels/ToolPanel';
import { ViewPanel } from './panels/ViewPanel';
import { isPanelOpen, isPortrait, tab, TABS, type Tab } from './settings';

const PANELS: Record<Tab, FunctionComponent> = {
  scene: ScenePanel,
  view: ViewPanel,
  tissues: TissuesPanel,
  lumps: LumpsPanel,
  tool: ToolPanel,
  device: DevicePanel,
  motion: MotionPanel,
  record: RecordPanel,
  game: GamePanel,
  engine: EnginePanel,
};

export function Rail() {
  const list = useRef<HTMLDivElement>(null);
  const focus = (to: number): void => {
    const next = TABS[(to + TABS.length) % TABS.length];
    tab.value = next;
    list.current?.querySelector<HTMLButtonElement>(`#tab-${next}`)?.focus();
  };
  const onKey = (event: KeyboardEvent): void => {
    const at = TABS.indexOf(tab.value);
    const steps: Record<string, number> = {
      ArrowDown: at + 1, ArrowRight: at + 1, ArrowUp: at - 1, ArrowLeft: at - 1, Home: 0, End: TABS.length - 1,
    };
    if (!(event.key in steps)) return;
    event.preventDefault();
    focus(steps[event.key]);
  };
  const Panel = PANELS[tab.value];
  return (
    <nav class={`rail ${isPanelOpen.value ? 'open' : ''}`} aria-label={t('app.panels')}>
      <div
        ref={list}
        class="tabs"
        role="tablist"
        aria-label={t('app.panels')}
        aria-orientation={isPortrait.value ? 'horizontal' : 'vertical'}
        onKeyDown={onKey}
      >
        {TABS.map((name) => {
          const isChosen = tab.value === name;
          return (
            <button
              key={name}
              id={`tab-${name}`}
              type="button"
              role="tab"
              aria-selected={isChosen}
              aria-controls={isChosen && isPanelOpen.value ? 'panel' : undefined}
              tabIndex={isChosen ? 0 : -1}
              class={hasNews(name) ? 'news' : ''}
              onClick={() => {
                // A click on the chosen tab folds the panel away.
                isPanelOpen.value = isChosen ? !isPanelOpen.value : true;
                tab.value = name;
              }}
              data-testid={`tab-${name}`}
            >
              <Icon name={name} />
              <span>{t(`tab.${name}`)}</span>
            </button>
          );
        })}
      </div>
      {isPanelOpen.value && (
        <div class="panel" id="panel" role="tabpanel" aria-labelledby={`tab-${tab.value}`} tabIndex={0}>
          <h2>{t(`panel.${tab.value}`)}</h2>
          <div class="panel-inside">
            <Panel key={tab.value} />
          </div>
        </div>
      )}
    </nav>
  );
}

/** Whether something is under way in a panel. */
function hasNews(name: Tab): boolean {
  const now = state.value;
  if (now === null) return false;
  if (name === 'record') return now.recording.is_recording;
  if (name === 'motion') return now.is_motion_running;
  return name === 'game' && isHiding.value;
}
