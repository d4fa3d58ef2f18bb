// The dialog of a body of one's own: its surface with the findings of the check, unit, layers and bones.

import { useEffect, useRef, useState } from 'preact/hooks';
import type { FindingInfo, FindingSeverity, LengthUnit, Template } from '../generated/api';
import type { MeshSnapshot } from '../generated/wire';
import { language, named, t } from '../i18n';
import { findingWords } from '../i18n/findings';
import { noteWords } from '../i18n/notes';
import { Button, Select } from '../ui/controls';
import { Icon } from '../ui/icons';
import { formatQuantity } from '../ui/quantity';
import { theme } from '../ui/settings';
import { useSeconds } from '../ui/Building';
import { addBones, chooseTemplate, chooseUnit, closeDraft, draft, grow, removeBone, stopWaiting, takeFiles, type Draft, type Part } from './draft';
import { Preview, SEVERITY_COLOURS, type Mark } from './Preview';
import { boundWords, limits, meshOf } from './upload';

const UNITS: Record<LengthUnit, number> = { m: 1, cm: 0.01, mm: 0.001, in: 0.0254 };
const TEMPLATES: Template[] = ['limb', 'thin', 'fat', 'phantom'];
export const MESH_FILES = '.stl,.ply,.obj,.off,.glb,.gltf';

export function OwnDialog() {
  return draft.value === null ? null : <Dialog now={draft.value} />;
}

function Dialog({ now }: { now: Draft }) {
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => {
    if (!dialog.current!.open) dialog.current!.showModal();
  }, []);
  const { skin } = now;
  return (
    <dialog
      ref={dialog}
      class={`own ${skin === null ? 'small' : ''}`}
      aria-labelledby="own-title"
      onCancel={(event) => {
        event.preventDefault();
        closeDraft();
      }}
      data-testid="own"
    >
      <div class="own-head">
        <h2 id="own-title">{skin === null ? t('own.title') : skin.name}</h2>
        <Button kind="quiet" label={t('help.close')} onClick={closeDraft} testid="own-close"><Icon name="close" /></Button>
      </div>
      {skin === null ? <Waiting now={now} /> : <Body now={now} skin={skin} />}
    </dialog>
  );
}

/** While the first file is read, or when it cannot be used. */
function Waiting({ now }: { now: Draft }) {
  return (
    <div class="own-waiting">
      <Progress now={now} />
      {now.problem !== null && (
        <>
          <p class="own-problem" role="alert" data-testid="own-problem">{now.problem}</p>
          <p class="hint">{boundWords()}</p>
          <div class="buttons">
            <FileButton kind="primary" accept={`${MESH_FILES},.zip,.toml`} onFiles={(files) => void takeFiles(files)} testid="own-another">{t('own.another')}</FileButton>
            <Button onClick={closeDraft}>{t('app.cancel')}</Button>
          </div>
        </>
      )}
    </div>
  );
}

function Progress({ now }: { now: Draft }) {
  if (now.busy === null) return null;
  return (
    <p class="own-busy" role="status" data-testid="own-busy">
      <span class="spinner" aria-hidden="true" />
      <span>{now.busy}</span>
      <Button onClick={stopWaiting}>{t('app.cancel')}</Button>
    </p>
  );
}

function Body({ now, skin }: { now: Draft; skin: Part }) {
  const [chosen, setChosen] = useState<{ finding: number; place: number } | null>(null);
  const isGrowing = now.growingSince !== null;
  const { info } = skin;
  return (
    <div class="own-inside">
      <Picture skin={skin} bones={now.bones} chosen={chosen} />
      <div class="own-side">
        <fieldset disabled={isGrowing || now.busy !== null}>
          <dl class="figures" data-testid="own-figures" data-triangles={info.n_triangles} data-unit={now.unit} data-verdict={info.verdict}>
            <dt>{t('own.format')}</dt>
            <dd>{info.format}</dd>
            <dt>{t('own.triangles')}</dt>
            <dd>{info.n_triangles.toLocaleString('en')}</dd>
            <dt>{t('own.size')}</dt>
            <dd>{sizeWords(info.size.map((x) => x * UNITS[now.unit] * 1e3))}</dd>
          </dl>
          <Select<LengthUnit>
            label={t('own.unit')}
            value={now.unit}
            options={(Object.keys(UNITS) as LengthUnit[]).map((unit) => ({ value: unit, label: unitWords(unit, info.size) }))}
            onChange={(unit) => void chooseUnit(unit)}
            testid="own-unit"
          />
          <p class="hint own-guess">{t(now.unit === info.probable_unit ? 'own.guessed' : 'own.not_guessed', { unit: info.probable_unit })}</p>
          <Findings now={now} skin={skin} chosen={chosen} onChoose={setChosen} />
          <Layers now={now} skin={skin} />
          <Bones now={now} />
        </fieldset>
        <Progress now={now} />
        {now.problem !== null && <p class="own-problem" role="alert" data-testid="own-problem">{t('own.not_grown')} {now.problem}</p>}
        {isGrowing ? <Growing since={now.growingSince!} n={info.n_triangles} /> : (
          <div class="buttons own-end">
            <Button kind="primary" disabled={now.busy !== null} onClick={() => void grow()} testid="own-grow">{t('own.grow')}</Button>
            <Button onClick={closeDraft}>{t('app.cancel')}</Button>
          </div>
        )}
      </div>
    </div>
  );
}

function unitWords(unit: LengthUnit, size: readonly number[]): string {
  return `${unit} (${t('own.long', { length: formatQuantity(Math.max(...size) * UNITS[unit], 'length') })})`;
}

/** Three lengths, mm, with the digits that the largest of them needs. */
function sizeWords(size: readonly number[]): string {
  const decimals = Math.max(...size) < 100 ? 1 : 0;
  return `${size.map((x) => x.toFixed(decimals)).join(' × ')} mm`;
}

function Picture(props: { skin: Part; bones: Part[]; chosen: { finding: number; place: number } | null }) {
  const { skin, bones, chosen } = props;
  const canvas = useRef<HTMLCanvasElement>(null);
  const preview = useRef<Preview | null>(null);
  const [isMissing, setMissing] = useState(false);
  const meshes = useRef(new Map<number, Promise<MeshSnapshot>>());
  useEffect(() => {
    try {
      preview.current = new Preview(canvas.current!, theme.peek());
    } catch {
      setMissing(true);
    }
    return () => preview.current?.dispose();
  }, []);
  const parts = [skin, ...bones].map(({ id }) => id).join();
  useEffect(() => {
    let isLate = false;
    const mesh = (id: number): Promise<MeshSnapshot> => {
      const known = meshes.current.get(id) ?? meshOf(id);
      meshes.current.set(id, known);
      return known;
    };
    void Promise.all([skin, ...bones].map(({ id }) => mesh(id))).then(([first, ...others]) => {
      if (isLate) return;
      preview.current?.show(first, others.map((one, i) => ({ mesh: one, offset: offset(bones[i].info.middle, skin.info.middle) })));
      canvas.current?.setAttribute('data-drawn', parts);
    }, () => setMissing(true));
    return () => {
      isLate = true;
    };
  }, [parts, theme.value]);
  useEffect(() => preview.current?.setTheme(theme.value), [theme.value]);
  const marks = skin.info.findings.flatMap(({ places, severity }, finding): Mark[] =>
    places.map((at, place) => ({ at: local(at, skin), severity, isChosen: chosen?.finding === finding && chosen.place === place })));
  useEffect(() => {
    preview.current?.setMarks(marks);
    const mark = marks.find(({ isChosen }) => isChosen);
    if (mark !== undefined) preview.current?.lookAt(mark.at);
  }, [chosen, skin.info]);
  return (
    <div class="own-picture">
      <canvas ref={canvas} role="img" aria-label={t('own.picture', { name: skin.name })} data-testid="own-picture" data-marks={marks.length} />
      {isMissing && <p class="hint">{t('own.no_picture')}</p>}
      <p class="own-legend hint">{t('own.legend')}</p>
    </div>
  );
}

const offset = (a: readonly number[], b: readonly number[]): [number, number, number] => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

/** A place, m, in the frame of the picture: the unit of the file, from the middle. */
function local(at: readonly number[], { info }: Part): [number, number, number] {
  return offset(at.map((x) => x / UNITS[info.unit]), info.middle);
}

function Findings(props: {
  now: Draft;
  skin: Part;
  chosen: { finding: number; place: number } | null;
  onChoose: (chosen: { finding: number; place: number } | null) => void;
}) {
  const { now, skin, chosen, onChoose } = props;
  const { info } = skin;
  const bad = now.bones.filter((bone) => bone.info.verdict === 'bad');
  return (
    <section class="own-findings" aria-labelledby="own-findings">
      <h3 id="own-findings">{t(`own.verdict_${info.verdict}`)}</h3>
      <ul data-testid="own-findings">
        {info.findings.map((finding, index) => (
          <FindingItem
            key={finding.kind}
            finding={finding}
            place={chosen?.finding === index ? chosen.place : null}
            onPlace={(place) => onChoose({ finding: index, place })}
          />
        ))}
        {info.notes.map((note) => <li key={note.text}><p>{noteWords(note, language.value)}</p></li>)}
        {bad.map((bone) => (
          <li key={bone.id}>
            <Severity severity="unrepairable" />
            <p>{t('own.bone_bad', { name: bone.name })} {findingWords(bone.info.findings[0], language.value).found}</p>
          </li>
        ))}
      </ul>
    </section>
  );
}

function Severity({ severity }: { severity: FindingSeverity }) {
  return <span class={`severity ${severity}`} style={{ background: SEVERITY_COLOURS[severity] }}>{t(`own.${severity}`)}</span>;
}

function FindingItem(props: { finding: FindingInfo; place: number | null; onPlace: (place: number) => void }) {
  const { finding, place, onPlace } = props;
  const { found, advice } = findingWords(finding, language.value);
  const n = finding.places.length;
  const at = finding.places[place ?? 0];
  return (
    <li data-testid={`finding-${finding.kind}`}>
      <Severity severity={finding.severity} />
      <p>{found}</p>
      <p class="hint">{advice}</p>
      {n > 0 && (
        <p class="own-place">
          <button type="button" class="link" onClick={() => onPlace(place === null ? 0 : (place + 1) % n)}>
            {place === null ? t('own.show_place') : t('own.next_place', { i: place + 1, n })}
          </button>
          <span> ({at.map((x) => (x * 1e3).toFixed(1)).join(', ')}) mm</span>
        </p>
      )}
    </li>
  );
}

function Layers({ now, skin }: { now: Draft; skin: Part }) {
  const template = skin.info.templates.find((one) => one.template === now.template);
  const hasBones = now.bones.length > 0;
  const n = template?.layers.length ?? 0;
  return (
    <section>
      <Select<Template>
        label={t('own.layers')}
        value={now.template}
        options={TEMPLATES.map((value) => ({ value, label: t(`own.template_${value}`) }))}
        onChange={chooseTemplate}
        testid="own-template"
      />
      <p class="hint" data-testid="own-layers">
        {template?.layers.map(({ tissue, thickness }, i) =>
          `${named('tissue', tissue)} ${hasBones && i + 1 === n ? t('own.to_the_bone') : formatQuantity(thickness, 'length')}`).join(' · ')}
        {'. '}{t('own.layers_hint')}
      </p>
    </section>
  );
}

function Bones({ now }: { now: Draft }) {
  return (
    <section>
      <div class="row">
        <span class="label">{t('own.bones')}</span>
        <FileButton accept={MESH_FILES} multiple onFiles={(files) => void addBones(files)} disabled={now.bones.length + 1 >= limits().files} testid="own-bone">
          {t('own.add_bone')}
        </FileButton>
      </div>
      {now.bones.length === 0 ? <p class="hint">{t('own.no_bones')}</p> : (
        <ul class="own-bones" data-testid="own-bones">
          {now.bones.map((bone) => (
            <li key={bone.id}>
              <span>{bone.name}</span>
              <Button kind="quiet" label={t('lumps.remove_named', { name: bone.name })} onClick={() => removeBone(bone.id)}><Icon name="close" /></Button>
            </li>
          ))}
        </ul>
      )}
    </section>
  );
}

function Growing({ since, n }: { since: number; n: number }) {
  const seconds = useSeconds(since);
  return (
    <div class="own-growing" role="status" data-testid="own-growing">
      <p><span class="spinner" aria-hidden="true" /> {t('own.growing', { seconds })}</p>
      <p class="hint">{t('own.growing_hint', { n: n.toLocaleString('en') })}</p>
      <Button onClick={stopWaiting} testid="own-stop">{t('building.cancel')}</Button>
    </div>
  );
}

/** A button that opens the system's dialog for files. */
export function FileButton(props: {
  children: string;
  accept: string;
  onFiles: (files: File[]) => void;
  multiple?: boolean;
  kind?: 'primary';
  disabled?: boolean;
  testid: string;
}) {
  const input = useRef<HTMLInputElement>(null);
  return (
    <>
      <Button kind={props.kind} disabled={props.disabled} onClick={() => input.current?.click()} testid={props.testid}>{props.children}</Button>
      <input
        ref={input}
        type="file"
        accept={props.accept}
        multiple={props.multiple}
        hidden
        aria-label={props.children}
        onChange={(event) => {
          const files = [...(event.currentTarget.files ?? [])];
          event.currentTarget.value = '';
          if (files.length > 0) props.onFiles(files);
        }}
        data-testid={`${props.testid}-file`}
      />
    </>
  );
}
