// The view of the body with its overlays: legend, progress, problems, replay and game.

import { computed, effect, signal } from '@preact/signals';
import { useEffect, useRef, useState } from 'preact/hooks';
import { language, t } from '../i18n';
import { problemWords } from '../i18n/events';
import { HandControl } from '../hand';
import { BodyView, NoWebGL2, type Picked, type Vec3 } from '../scene';
import {
  ask, askAloud, edit, homeKey, isController, isReplaying, isWatching, notify, onFrame, onMap, onMesh, scene, send, state,
} from '../store';
import { bodyView, firstBodyMs, legend, lensPicture, mapLegend, probed, section, yields } from './body';
import { Building } from './Building';
import { Button, Segmented } from './controls';
import { FirstHint, GhostChip } from './FirstRun';
import { GameBar } from './GameBar';
import { beginGhost, notePress } from './ghost';
import { Icon } from './icons';
import { LegendBox } from './LegendBox';
import { LensBox } from './LensBox';
import { MapBox } from './MapBox';
import { Missed, watchMisses } from './Missed';
import { ProbeTag } from './ProbeTag';
import { ReplayBar } from './ReplayBar';
import { saveImage } from './save';
import { writtenPoint } from './quantity';
import { inPageWords } from './words';
import { handMode, greatestForce, isDeepest, lastTouched, picking, pressDepth, pressForce, show, view, wanted } from './settings';

/** Whether nothing else moves the hand, so that it may follow the pointer. */
const isFree = computed(() => state.value?.phase === 'running' && !state.value.is_motion_running);

export function Stage() {
  const container = useRef<HTMLDivElement>(null);
  const [problem, setProblem] = useState<'none' | 'webgl' | 'other'>('none');

  useEffect(() => {
    let body: BodyView;
    try {
      body = new BodyView(container.current!, view.peek());
    } catch (error) {
      console.error(error);
      setProblem(error instanceof NoWebGL2 ? 'webgl' : 'other');
      return;
    }
    body.onLegend = (next) => (legend.value = next);
    body.onLens = (next) => (lensPicture.value = next);
    body.onProbe = (next) => (probed.value = next);
    body.onMapLegend = (next) => (mapLegend.value = next);
    body.onYield = (next) => (yields.value = next);
    body.onSection = (next) => (section.value = next);
    body.onCutaway = (position) => show({ cutaway: { ...wanted.peek().cutaway, position } });
    body.onFirstBody = () => {
      firstBodyMs.value = performance.mark('palpa-first-body').startTime;
    };
    const hand = new HandControl(body, send, { pressDepth: pressDepth.peek(), pressForce: pressForce.peek(), greatestForce: greatestForce.peek(), mode: handMode.peek(), enabled: false, hovers: false });
    hand.onTarget = (target) => {
      if (target !== null && target.depth > 0) lastTouched.value = target.point;
      isDeepest.value = hand.isDeepest;
      if (target !== null) notePress(target.depth);
    };
    hand.onMark = (picked) => takePicked(picked, body);
    bodyView.value = body;
    const ends = [
      effect(() => body.setOptions(view.value)),
      effect(() => {
        if (state.value !== null) body.setState(state.value);
      }),
      effect(() =>
        hand.set({
          pressDepth: pressDepth.value,
          pressForce: pressForce.value,
          greatestForce: greatestForce.value,
          mode: picking.value === null ? handMode.value : 'mark',
          enabled: isController.value && !isReplaying.value,
          hovers: isFree.value,
        }),
      ),
      effect(() => {
        void homeKey.value;
        hand.forget();
      }),
      watchMisses(body),
      beginGhost(hand, body),
      onMesh((mesh) => body.setMesh(mesh)),
      onMap((map) => body.setMap(map)),
      onFrame((frame) => {
        body.setFrame(frame);
        if (frame.is_replay === 0) hand.deepest = frame.deepest;
        isDeepest.value = hand.isDeepest;
      }),
    ];
    return () => {
      for (const end of ends) end();
      hand.dispose();
      body.dispose();
      bodyView.value = null;
    };
  }, []);

  return (
    <main class={`stage ${picking.value === null ? '' : 'picking'}`} aria-label={t('app.body')}>
      <div class="canvas-place" ref={container} />
      <span hidden data-testid="first-body-ms" data-ms={firstBodyMs.value ?? ''}>{firstBodyMs.value?.toFixed(0)}</span>
      <LensBox />
      <ProbeTag />
      {problem === 'none' ? <StageTools /> : <NoBody isWebGL={problem === 'webgl'} />}
      <div class="stage-top">
        <GameBar />
        <PickingHint />
        <GhostChip />
        <Yields />
        {isWatching.value && <p class="chip">{t(state.value?.controller == null ? 'control.nobody_chip' : 'control.watching_chip')}</p>}
      </div>
      <div class="stage-bottom">
        {problem === 'none' && <div class="stage-legends"><MapBox /><LegendBox /></div>}
        <ReplayBar />
      </div>
      {problem === 'none' && <FirstHint />}
      <Missed />
      <Phase />
    </main>
  );
}

/** Uses a picked point for its purpose. */
function takePicked(picked: Picked, body: BodyView): void {
  const purpose = picking.peek();
  if (purpose === null) return;
  const { point } = picked;
  if (purpose.kind === 'probe') {
    picking.value = null;
    body.setProbe(picked);
    return;
  }
  // The others lie on the skin.
  if (picked.part !== 'skin') return;
  if (purpose.kind === 'mark') {
    void markLump(point);
    return;
  }
  picking.value = null;
  const refusal = purpose.kind === 'place' ? movePress(point) : moveLump(purpose.index, point);
  void refusal.then((error) => error !== null && notify('warning', error));
}

async function markLump(point: Vec3): Promise<void> {
  // The new state may come after the answer.
  const game = state.peek()?.game;
  const error = await ask({ type: 'mark', point });
  if (error !== null) notify('warning', error);
  else if (game != null && game.marks.length + 1 >= game.n_lumps) picking.value = null;
}

function movePress(point: Vec3): Promise<string | null> {
  const changed = { ...scene.peek()?.press, at: writtenPoint(point) };
  delete changed.vertex;
  return edit(['/press', changed]);
}

/** Moves a lump under another point, at the same depth. */
function moveLump(index: number, point: Vec3): Promise<string | null> {
  const lump = scene.peek()?.lump?.[index];
  const path = `/lump/${index}`;
  const changed = { ...lump, below: writtenPoint(point), depth: lump?.depth ?? '10 mm' };
  delete changed.at;
  delete changed.below_vertex;
  return edit([path, changed]);
}

/** Says that pictures are slower so that the force keeps up. */
function Yields() {
  if (!yields.value) return null;
  return (
    <p class="chip" role="status" data-testid="yields">
      {t('view.yields')}
      <Button kind="quiet" onClick={() => bodyView.value?.neverYield()} testid="never-yield">{t('view.never_yield')}</Button>
    </p>
  );
}

function PickingHint() {
  const purpose = picking.value;
  if (purpose === null) return null;
  return (
    <p class="chip accent" role="status">
      {t(purpose.kind === 'mark' ? 'game.mark_hint' : purpose.kind === 'probe' ? 'probe.hint' : purpose.kind === 'lump' ? 'lumps.pick_hint' : 'motion.pick_hint')}
      <Button kind="quiet" label={t('app.cancel')} onClick={() => (picking.value = null)}><Icon name="close" /></Button>
    </p>
  );
}

function StageTools() {
  return (
    <div class="stage-tools">
      <Segmented
        label={t('device.mouse')}
        isLabelHidden
        value={handMode.value}
        options={(['press', 'orbit'] as const).map((value) => ({ value, label: t(`hand.${value}`), testid: `hand-${value}` }))}
        onChange={(mode) => (handMode.value = mode)}
      />
      <div class="tool-buttons" role="group" aria-label={t('view.views')}>
        {(['home', 'top', 'front', 'side'] as const).map((side) => (
          <Button key={side} kind="quiet" onClick={() => bodyView.value?.viewFrom(side)}>{t(`view.from_${side}`)}</Button>
        ))}
        <Button
          kind="quiet"
          label={t('view.save_png')}
          onClick={() => saveImage().catch((error: unknown) => notify('error', String(error)))}
        >
          <Icon name="camera" />
        </Button>
      </div>
    </div>
  );
}

function NoBody({ isWebGL }: { isWebGL: boolean }) {
  return (
    <div class="no-body" role="alert" data-testid="no-webgl">
      <h2>{t(isWebGL ? 'webgl.title' : 'webgl.other_title')}</h2>
      <p>{t(isWebGL ? 'webgl.text' : 'webgl.other_text')}</p>
      {isWebGL && (
        <ul>
          <li>{t('webgl.do_update')}</li>
          <li>{t('webgl.do_acceleration')}</li>
          <li>{t('webgl.do_other')}</li>
        </ul>
      )}
      <Button kind="primary" onClick={() => location.reload()}>{t('version.reload')}</Button>
    </div>
  );
}

/** The last problem that the user dismissed, as JSON: each state has an object of its own. */
const dismissed = signal<string | null>(null);

function Phase() {
  const now = state.value;
  if (now === null) return <p class="chip building" role="status">{t('phase.waiting')}</p>;
  if (now.phase === 'building') {
    return <Building />;
  }
  if (now.phase !== 'stopped' && (now.problem == null || JSON.stringify(now.problem) === dismissed.value)) return null;
  return (
    <div class={`problem ${now.phase}`} role="alert" data-testid="problem">
      <strong>{t(now.phase === 'stopped' ? 'phase.stopped_long' : 'phase.not_built')}</strong>
      {now.problem != null && <p>{inPageWords(problemWords(now.problem, language.value), scene.value)}</p>}
      {now.phase === 'running' && (
        <Button onClick={() => (dismissed.value = JSON.stringify(now.problem))}>{t('notices.dismiss')}</Button>
      )}
      {now.phase === 'stopped' && (
        <Button kind="primary" disabled={!isController.value} onClick={() => void askAloud({ type: 'restart' })} testid="restart">
          {t('engine.restart')}
        </Button>
      )}
    </div>
  );
}
