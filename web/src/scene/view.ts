// The view of a body: keeps what the page gives it, and draws when something has changed.

import { PCFShadowMap, Quaternion, Raycaster, Vector2, Vector3, WebGLRenderer } from 'three';
import type { State } from '../generated/api';
import type { FrameSnapshot, MapSnapshot, MeshSnapshot } from '../generated/wire';
import { isSoftwareWebGL } from '../machine';
import { Body } from './body';
import { Colouring } from './colouring';
import { CutawayView } from './cutawayview';
import { looksSame } from './frames';
import { Gestures, type Claims } from './gestures';
import { knownLumps, layerLooks, sectionOpacity, type NamedLook } from './looks';
import { LensView, type LensPicture } from './lens';
import { DrawLoop } from './loop';
import { LumpsView } from './lumps';
import { MarksView } from './marks';
import type { SharedUniforms } from './materials';
import { DEFAULT_OPTIONS, NoWebGL2, type Category, type Legend, type MapLegend, type Picked, type SectionArea, type Vec3, type ViewOptions } from './options';
import { ForceTag, Gizmo, ScaleBar } from './overlay';
import { BONE, CORE, LUMP, mapOf, mapTextures, PALPATION_STOPS, palpationTexture, type Theme } from './palette';
import { PalpationVolume } from './palpation';
import { nearestOnSkin, pickNearest, pickNoSkin, pickSkin, type NoSkin } from './picking';
import { pictureOf, type PictureLegend } from './picture';
import { Pins } from './pins';
import { Probe, type Probed } from './probe';
import { Quality, type Detail } from './quality';
import { CameraRig, SIDES, type CameraPose } from './rig';
import type { SectionValues } from './section';
import { Stage } from './stage';
import { Surfaces, type Materials } from './surfaces';
import { ToolView } from './tool';

/** How long a new mesh waits for its first frame, ms: shown without it, a pressed body would
 * jump to rest and back. */
const MESH_WAIT = 400;
/** Two meshes whose boxes differ by less than this share of the body's radius
 * are of the same body. */
const SAME_BODY = 0.06;

/** Faults of a tick that come from a busy processor, as bits: a stale patch, a late tick. */
const LATE = (1 << 1) | (1 << 3);

export class BodyView {
  onLegend: (legend: Legend | null) => void = () => {};
  onSection: (area: SectionArea | null) => void = () => {};
  onCutaway: (position: number) => void = () => {};
  onMapLegend: (legend: MapLegend | null) => void = () => {};
  onLens: (lens: LensPicture | null) => void = () => {};
  onProbe: (probed: Probed | null) => void = () => {};
  onFirstBody: () => void = () => {};
  /** Pictures follow each other more slowly, so that the engine keeps up; or no longer. */
  onYield: (yields: boolean) => void = () => {};
  readonly canvas = document.createElement('canvas');

  private readonly root = document.createElement('div');
  private readonly renderer: WebGLRenderer;
  private readonly stage = new Stage();
  private readonly rig = new CameraRig(() => this.loop?.invalidate('camera'));
  private readonly gestures: Gestures;
  private readonly quality: Quality;
  private readonly loop: DrawLoop;
  private readonly scaleBar = new ScaleBar();
  private readonly pins = new Pins(this.rig);
  private readonly gizmo: Gizmo;
  private readonly forceTag = new ForceTag();
  private readonly tool = new ToolView();
  private readonly marks = new MarksView();
  private readonly colouring = new Colouring();
  private readonly maps = mapTextures();
  private readonly volume = new PalpationVolume();
  private readonly shared: SharedUniforms = {
    ...this.volume.uniforms, palpationMap: { value: palpationTexture() },
    map: { value: null }, range: { value: new Vector2(0, 1) }, isLog: { value: 0 }, grain: { value: 1 },
  };
  private readonly cutaway: CutawayView;
  private readonly materials: Materials = new Map();
  private readonly lumps: LumpsView;
  private readonly lens = new LensView();
  private readonly probe = new Probe();
  private readonly resizer: ResizeObserver;
  private readonly stop = new AbortController();
  private readonly raycaster = new Raycaster();

  private options: ViewOptions;
  private theme: Theme;
  private state: State | null = null;
  private body: Body | null = null;
  private surfaces: Surfaces | null = null;
  private waitingMesh: MeshSnapshot | null = null;
  private meshTimer = 0;
  /** Whether the section is that of a plane or body before the present ones. */
  private isCutStale = true;
  private expected: { pose: CameraPose; until: number } | null = null;
  private frame: FrameSnapshot | null = null;
  private map: MapSnapshot | null = null;
  private isFirst = true;
  private isHeld = false;
  private isLensOpen = false;
  private lensTimer = 0;
  private size = new Vector2(1, 1);
  private legendKey = '';
  private mapLegendKey = '';

  constructor(container: HTMLElement, options: ViewOptions) {
    this.options = { ...DEFAULT_OPTIONS, ...options };
    const { canvas, root } = this;
    canvas.id = 'body-canvas';
    canvas.tabIndex = 0;
    canvas.setAttribute('role', 'application');
    const gl = isSoftwareWebGL === null ? null : canvas.getContext('webgl2', { antialias: !isSoftwareWebGL, alpha: true, powerPreference: 'high-performance' });
    if (!gl) throw new NoWebGL2();
    this.renderer = new WebGLRenderer({ canvas, context: gl, alpha: true });
    this.renderer.setClearAlpha(0);
    this.renderer.localClippingEnabled = true;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.renderer.shadowMap.autoUpdate = false;
    this.quality = new Quality(gl, isSoftwareWebGL === true, () => this.loop.refine());
    this.quality.onYield = (yields) => this.onYield(yields);
    this.loop = new DrawLoop(this.quality, {
      step: (now) => this.rig.step(now),
      isHeld: () => this.isHeld,
      draw: (detail) => this.draw(detail),
      done: () => this.done(),
    });
    this.cutaway = new CutawayView(this.shared, this.stage, this.rig, (position) => {
      this.setOptions({ cutaway: { ...this.options.cutaway, position } });
      this.onCutaway(position);
    });
    this.cutaway.onArea = (area) => this.onSection(area);
    this.lumps = new LumpsView(this.shared, this.stage, this.cutaway.planes);

    root.className = 'scene-root';
    this.gizmo = new Gizmo((axis, sign) => this.look(new Vector3().setComponent(axis, sign).add(new Vector3(0, -0.001, 0)).normalize()));
    root.append(canvas, this.lens.canvas, this.scaleBar.element, this.gizmo.element, this.forceTag.element, this.cutaway.grip.element);
    container.append(root);
    this.gestures = new Gestures(canvas, this.rig);
    this.stage.scene.add(this.tool.group, this.marks.group, this.lumps.group);
    this.theme = this.stage.theme(this.options.theme);
    this.paintBackground();
    this.nameParts();

    const { signal } = this.stop;
    canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      this.quality.forget();
    }, { signal });
    canvas.addEventListener('webglcontextrestored', () => {
      this.quality.forget();
      this.loop.invalidate('style');
    }, { signal });
    document.addEventListener('visibilitychange', () => this.loop.invalidate('camera'), { signal });
    this.resizer = new ResizeObserver(() => this.resize());
    this.resizer.observe(root);
    this.resize();
  }

  // Input from the page.

  setMesh(mesh: MeshSnapshot): void {
    window.clearTimeout(this.meshTimer);
    if (!this.body || this.isOther(mesh)) {
      this.waitingMesh = null;
      this.takeMesh(mesh);
    } else {
      this.waitingMesh = mesh;
      this.meshTimer = window.setTimeout(() => {
        if (this.waitingMesh === mesh) this.takeMesh(mesh);
      }, MESH_WAIT);
    }
  }

  setFrame(frame: FrameSnapshot): void {
    if (this.waitingMesh?.mesh === frame.mesh) this.takeMesh(this.waitingMesh);
    if (!this.body || frame.mesh !== this.body.id) return;
    this.isHeld = frame.n_active > 0;
    if (this.isHeld && frame.is_replay === 0 && (frame.faults & LATE) !== 0) this.quality.yield(performance.now());
    // A still picture is drawn in full once, and left alone.
    if (this.frame && looksSame(this.frame, frame)) return;
    this.frame = frame;
    this.loop.invalidate('frame');
  }

  setMap(map: MapSnapshot): void {
    this.map = map;
    this.loop.invalidate('style');
  }

  setState(state: State): void {
    const before = this.state;
    this.state = state;
    if (before && before.revision === state.revision) return;
    this.loop.invalidate('style');
  }

  setOptions(options: Partial<ViewOptions>): void {
    const before = this.options;
    this.options = { ...before, ...options };
    this.rig.reducedMotion = this.options.reducedMotion;
    this.cutaway.isMovable = this.options.cutaway.axis !== 'tool';
    if (before.cutaway !== this.options.cutaway) this.isCutStale = true;
    this.nameParts();
    if (before.theme !== this.options.theme) {
      this.theme = this.stage.theme(this.options.theme);
      this.paintBackground();
    }
    this.loop.invalidate('style');
  }

  viewFrom(side: 'home' | 'top' | 'front' | 'side'): void {
    this.look(side === 'home' ? this.homeSide() : SIDES[side]);
  }

  /** Turns the camera to a place of the skin, so that a length around it (m) is seen. */
  lookAtPoint(point: Vec3, normal: Vec3, span: number): void {
    const direction = new Vector3(...normal);
    const along = this.longest();
    // Across the body, so that it lies as from its usual side; from above or below, aslant.
    const across = direction.clone().addScaledVector(along, -direction.dot(along));
    if (across.length() > 0.3) direction.copy(across.normalize());
    direction.y -= 0.35 * Math.abs(direction.z);
    this.rig.lookAt(new Vector3(...point), direction.normalize(), span);
  }

  /** The axis along which the body is longest. */
  private longest(): Vector3 {
    const size = this.body ? this.body.box.getSize(new Vector3()).toArray() : [1, 0, 0];
    return new Vector3().setComponent(size.indexOf(Math.max(...size)), 1);
  }

  /** Shows the other side of the body: half a turn round its longest axis. */
  turnRound(): void {
    if (!this.body) return;
    this.rig.turnOver(this.longest(), this.body.centre);
  }

  /** The camera relative to the body; null while there is none. */
  get camera(): CameraPose | null {
    return this.body && this.rig.pose(this.body.centre);
  }

  set camera(pose: CameraPose | null) {
    if (this.body && pose) this.rig.setPose(pose, this.body.centre);
  }

  /** Another body that comes within this time, ms, is seen by this camera, and not from its own side. */
  expectCamera(pose: CameraPose, time: number): void {
    this.expected = { pose, until: performance.now() + time };
  }

  /** The view as a PNG, with the scale bar and, if there is one, a legend. */
  image(legend: PictureLegend | null): Promise<Blob> {
    this.draw({ ratio: Math.max(window.devicePixelRatio || 1, 1), shadows: true, grain: true });
    const made = pictureOf(this.canvas, this.size, this.theme, this.scaleBar, this.lens.canvas, legend);
    this.loop.invalidate('camera');
    return made;
  }

  /** The nearest part of the body under a place of the picture, given in pixels of the window. */
  pick(clientX: number, clientY: number): Picked | null {
    return this.body && pickNearest(this.rayAt(clientX, clientY), this.body, this.pickable());
  }

  /** The part under a place of the picture that is not skin; null if it is skin, or beside the body. */
  pickNoSkin(clientX: number, clientY: number): NoSkin | null {
    return this.body && pickNoSkin(this.rayAt(clientX, clientY), this.body, this.pickable());
  }

  /** What a click may meet, as the options say now: a plane that was just set may not be in the picture yet. */
  private pickable() {
    const { cutaway, options, body, surfaces } = this;
    if (this.isCutStale && body && surfaces) this.slice(body, surfaces);
    const section = cutaway.plane && { section: cutaway.section.section, plane: cutaway.plane };
    return { section, bones: options.bones, isKept: cutaway.isKept() };
  }

  /** Puts the probe at a point at rest; null takes it away. */
  setProbe(picked: Pick<Picked, 'point' | 'part'> | null): void {
    this.probe.set(picked?.point ?? null, picked?.part === 'skin');
    if (picked === null) this.onProbe(null);
    this.loop.invalidate('style');
  }

  /** The skin at rest under a place of the picture: it stays where it is while
   * the skin gives way. */
  pickRest(clientX: number, clientY: number): { point: Vec3; normal: Vec3 } | null {
    return this.body && pickSkin(this.rayAt(clientX, clientY), this.body, true, this.pickable().isKept);
  }

  /** The place of the skin at rest that is nearest to a point. */
  nearest(point: Vec3): { point: Vec3; normal: Vec3 } | null {
    return this.body && nearestOnSkin(this.body, point);
  }

  /** The directions to the right and up in the picture. */
  screenAxes(): { right: Vec3; up: Vec3 } {
    const { right, up } = this.rig.axes();
    return { right: right.toArray() as Vec3, up: up.toArray() as Vec3 };
  }

  metresPerPixel(): number {
    return this.rig.metresPerPixel(this.size.y);
  }

  /** The press point of the scene. */
  get home(): { point: Vec3; normal: Vec3 } | null {
    const home = this.state?.home;
    return home ? { point: home.point as Vec3, normal: home.normal as Vec3 } : null;
  }

  /** Keeps an element of the page at a place of the body while the picture turns. Returns what ends it. */
  pin(element: HTMLElement, place: () => { point: Vec3; normal: Vec3 } | null): () => void {
    const end = this.pins.add(element, place);
    this.pins.update(this.size);
    return end;
  }

  /** Pictures no longer leave the engine more time when it is late. */
  neverYield(): void {
    this.quality.neverYield();
  }

  set claims(claims: Claims | null) {
    this.gestures.claims = claims;
  }

  dispose(): void {
    this.stop.abort();
    this.loop.stop();
    window.clearTimeout(this.meshTimer);
    window.clearTimeout(this.lensTimer);
    this.resizer.disconnect();
    this.gestures.dispose();
    this.quality.dispose();
    this.surfaces?.dispose();
    for (const material of this.materials.values()) material.dispose();
    this.cutaway.dispose();
    this.lumps.dispose();
    this.lens.dispose();
    this.marks.dispose();
    this.tool.dispose();
    this.stage.dispose();
    this.volume.dispose();
    this.shared.palpationMap.value?.dispose();
    for (const map of Object.values(this.maps)) map.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.body = null;
    this.root.remove();
  }

  private nameParts(): void {
    const { canvas, plane } = this.options.words;
    this.canvas.setAttribute('aria-label', canvas);
    this.cutaway.grip.element.setAttribute('aria-label', plane);
  }

  private paintBackground(): void {
    const [middle, corner] = this.theme.background;
    this.root.dataset.theme = this.options.theme;
    this.root.style.background = `radial-gradient(circle farthest-corner at 50% 43%, ${middle}, ${corner})`;
  }

  // Meshes, sizes, sides.

  /** Whether a mesh is of another body, and not of the same one meshed otherwise. */
  private isOther(mesh: MeshSnapshot): boolean {
    const old = this.body!;
    const box = old.box.clone().makeEmpty().setFromArray(mesh.positions);
    return box.min.distanceTo(old.box.min) + box.max.distanceTo(old.box.max) > SAME_BODY * old.radius;
  }

  private takeMesh(mesh: MeshSnapshot): void {
    this.waitingMesh = null;
    window.clearTimeout(this.meshTimer);
    const isOther = !this.body || this.isOther(mesh);
    this.surfaces?.dispose();
    this.body = new Body(mesh, this.body);
    this.surfaces = new Surfaces(this.body, this.shared, this.stage, this.cutaway.planes, this.materials);
    this.stage.scene.add(this.surfaces.group);
    this.stage.setBody(this.body);
    this.frame = null;
    this.isCutStale = true;
    if (isOther) {
      this.tool.group.visible = false;
      this.rig.fit(this.body.box, this.homeSide(), false);
      if (this.expected && performance.now() < this.expected.until) this.camera = this.expected.pose;
      this.expected = null;
    }
    this.loop.invalidate('style');
  }

  /** The side from which home is seen. */
  private homeSide(): Vector3 {
    const side = SIDES.home.clone();
    const normal = this.state ? new Vector3().fromArray(this.state.home.normal) : null;
    if (normal && normal.lengthSq() > 0.5 && side.dot(normal) < 0.25) side.addScaledVector(normal, 0.6 - side.dot(normal)).normalize();
    return side;
  }

  private look(side: Vector3): void {
    if (this.body) this.rig.fit(this.body.box, side, true);
  }

  private resize(): void {
    const { clientWidth: w, clientHeight: h } = this.root;
    if (w === 0 || h === 0) return;
    this.size.set(w, h);
    this.rig.resize(w / h);
    if (this.body && this.isFirst) this.rig.fit(this.body.box, this.homeSide(), false);
    this.loop.invalidate('camera');
  }

  private rayAt(clientX: number, clientY: number) {
    const rect = this.canvas.getBoundingClientRect();
    this.raycaster.setFromCamera(
      new Vector2((2 * (clientX - rect.left)) / rect.width - 1, 1 - (2 * (clientY - rect.top)) / rect.height),
      this.rig.camera,
    );
    return this.raycaster.ray;
  }

  // Drawing.

  private done(): void {
    if (this.rig.isTurning) this.loop.invalidate('camera');
    if (this.isFirst && this.body) {
      this.isFirst = false;
      this.onFirstBody();
    }
  }

  private draw({ ratio, shadows, grain }: Detail): void {
    const { renderer, body, surfaces, stage, options } = this;
    if (body && surfaces) this.bringUpToDate(body, surfaces);
    this.loop.taken();
    const casts = options.shadows && shadows;
    if (stage.key.castShadow !== casts) {
      stage.key.castShadow = casts;
      renderer.shadowMap.needsUpdate = true;
    }
    stage.hasGround = options.shadows;
    this.shared.grain.value = grain ? 1 : 0;
    if (renderer.getPixelRatio() !== ratio) renderer.setPixelRatio(ratio);
    const size = renderer.getSize(new Vector2());
    if (!size.equals(this.size)) renderer.setSize(this.size.x, this.size.y, false);
    const pixel = this.metresPerPixel();
    this.tool.options(options.tool, options.force);
    const arrow = this.tool.scale(pixel, this.rig.axes().right);
    this.marks.scale(pixel, this.size);
    this.cutaway.size = this.size;
    renderer.render(stage.scene, this.rig.camera);
    if (this.probe.isOn && body && surfaces) {
      const values = Colouring.isMap(options.colourBy) ? (surfaces.value.array as Float32Array) : null;
      this.onProbe(this.probe.read(body, this.frame, values, (p) => this.onScreen(p)));
    }
    const tagAt = arrow && this.onScreen(arrow.at);
    // The lens says the same.
    this.forceTag.update(tagAt && !this.lens.covers(tagAt) ? tagAt : null, arrow?.force ?? 0);
    this.scaleBar.update(pixel);
    this.gizmo.update(this.rig.axes());
    this.cutaway.placeGrip(this.size, options.cutaway.position);
    this.pins.update(this.size);
  }

  /** A point in the picture, px from its upper left corner. */
  private onScreen(point: Vector3): { x: number; y: number } {
    const at = point.clone().project(this.rig.camera);
    return { x: (0.5 + 0.5 * at.x) * this.size.x, y: (0.5 - 0.5 * at.y) * this.size.y };
  }

  /** Takes over the changes since the last picture. */
  private bringUpToDate(body: Body, surfaces: Surfaces): void {
    const { options } = this;
    const { changed } = this.loop;
    const isMoved = changed.frame || changed.style;
    if (changed.frame && this.frame) body.deform(this.frame);
    if (isMoved) this.colour(body, surfaces);
    if (changed.style) this.style(body, surfaces);
    else if (changed.frame) surfaces.update();
    const { axis } = options.cutaway;
    if (isMoved || (changed.camera && (axis === 'view' || axis === 'tool'))) {
      this.slice(body, surfaces);
      this.stage.paintGround(body, this.cutaway.plane);
      this.explain(body);
    }
    if (isMoved || changed.camera) this.magnify(body, surfaces);
    if (isMoved) {
      this.lumps.update(body);
      this.marks.update(body);
      if (this.frame) this.tool.place(this.frame);
    }
    if (isMoved || changed.shadow) this.renderer.shadowMap.needsUpdate = true;
  }

  private colour(body: Body, surfaces: Surfaces): void {
    const { options, colouring, shared } = this;
    const by = options.colourBy;
    if (Colouring.isMap(by)) {
      const values = surfaces.value.array as Float32Array;
      colouring.nodes(body, by, this.frame, values);
      surfaces.value.needsUpdate = true;
      colouring.updateRange(body, by, options.range, values, performance.now() / 1000);
      shared.map.value = this.maps[by];
      shared.range.value.set(...colouring.range);
      shared.isLog.value = colouring.isLog ? 1 : 0;
    }
  }

  /** Says what the colours of the picture are. */
  private explain(body: Body): void {
    const { options, colouring, state, cutaway } = this;
    const isSeenThrough = this.looks(body).some((l) => !l.visible || l.opacity < 1);
    const isOpen = options.cutaway.on || isSeenThrough;
    const inside: Category[] = [];
    if (isOpen && options.bones) {
      const hasBones = body.boneTriangles.length > 0;
      inside.push({ name: hasBones ? 'bone' : 'base', colour: BONE });
      // Bones that stand alone leave a core between them.
      if (hasBones && options.cutaway.on && cutaway.section.hasCore) inside.push({ name: 'core', colour: CORE });
    }
    const hasLump = knownLumps(state).length > 0 && (isSeenThrough || (cutaway.area?.lumps ?? 0) > 0);
    if (options.lumps && hasLump) inside.push({ name: 'lump', colour: LUMP });
    const legend = colouring.legend(options.colourBy, state?.layers ?? [], isOpen, inside, state?.method === 'reference');
    const key = JSON.stringify(legend);
    if (key === this.legendKey) return;
    this.legendKey = key;
    this.onLegend(legend);
  }

  private looks(body: Body): NamedLook[] {
    return layerLooks(body.layerStart.length, this.state, this.options);
  }

  private style(body: Body, surfaces: Surfaces): void {
    const { options, state, theme, cutaway } = this;
    const by = options.colourBy;
    const looks = this.looks(body);
    const isMapped = Colouring.isMap(by);
    const [outline, wire] = isMapped && mapOf(by).lines === 'white' ? ['#ffffff', '#ffffff'] : [theme.outline, theme.wire];
    surfaces.style({
      layers: looks,
      isMapped,
      isTissue: by === 'tissue',
      bones: options.bones,
      core: CORE,
      bone: BONE,
      wire: { on: options.wireframe, colour: wire, opacity: theme.wireOpacity },
    });
    const lumps = options.lumps ? knownLumps(state) : [];
    const { section } = cutaway;
    section.material.layers(looks.map((l) => l.colour), looks.map(sectionOpacity), looks.map((l) => l.name));
    section.material.uniforms.isMapped.value = isMapped ? 1 : 0;
    section.material.uniforms.isPlain.value = by === 'layer' ? 1 : 0;
    section.colours(body.boneTriangles.length > 0 ? CORE : BONE, BONE, outline, wire, theme.wireOpacity, options.wireframe);
    section.material.lumps(lumps, LUMP);
    cutaway.frameColour = theme.plane;
    const isSeenThrough = looks.some((l) => !l.visible || l.opacity < 1);
    this.lumps.set(isSeenThrough ? lumps : [], body, LUMP, Boolean(state?.game?.result));
    this.marks.set(state?.game ?? null, body, options.coverage);
    this.feel(body);
    if (!state) return;
    this.tool.set(state.tool.shape ?? null, state.max_force, body.radius);
    this.lens.set(state.tool.shape ?? null);
  }

  /** Shows what was felt, and its legend. */
  private feel(body: Body): void {
    const { map, volume, options: { palpation: kind, colourBy } } = this;
    // A map of another quantity covers the skin.
    const isOn = kind !== 'off' && !Colouring.isMap(colourBy);
    volume.set(map, isOn ? kind : 'off', body);
    const legend: MapLegend | null = kind === 'off' || map === null || map.stiffness.length === 0 || !isOn ? null : {
      kind, range: volume.range, stops: PALPATION_STOPS, n: map.stiffness.length, nForgotten: map.n_forgotten,
      finding: map.has_finding === 1 ? map.finding_share : null,
    };
    const key = JSON.stringify(legend);
    if (key === this.mapLegendKey) return;
    this.mapLegendKey = key;
    this.onMapLegend(legend);
  }

  /** The values by which sections are coloured. */
  private sectionValues(body: Body, surfaces: Surfaces): SectionValues {
    const by = this.options.colourBy;
    const nodes = Colouring.isMap(by) && by !== 'stiffness' ? (surfaces.value.array as Float32Array) : null;
    return { nodes, prisms: by === 'stiffness' ? body.stiffness : null };
  }

  private slice(body: Body, surfaces: Surfaces): void {
    this.isCutStale = false;
    const { options, frame, state } = this;
    const tool = frame && { tip: new Vector3().fromArray(frame.tool), axis: new Vector3(0, 0, 1).applyQuaternion(new Quaternion().fromArray(frame.orientation)) };
    this.cutaway.slice(body, {
      cutaway: options.cutaway,
      values: this.sectionValues(body, surfaces),
      layers: this.looks(body).map((l) => l.visible),
      bones: options.bones,
      lumps: knownLumps(state),
      tool,
    });
  }

  /** Draws the lens while the tool touches. */
  private magnify(body: Body, surfaces: Surfaces): void {
    const { frame, lens, options, theme } = this;
    window.clearTimeout(this.lensTimer);
    const isOpen = options.lens && frame !== null && lens.isDue(frame, performance.now());
    if (isOpen) {
      const by = options.colourBy;
      this.onLens(lens.draw(body, frame, {
        values: this.sectionValues(body, surfaces),
        bones: options.bones,
        colourOf: Colouring.isMap(by) ? this.colouring.colours(mapOf(by).stops) : null,
        layers: this.looks(body),
        lumps: options.lumps ? knownLumps(this.state) : [],
        colours: { background: theme.lens, core: CORE, bone: BONE, lump: LUMP, outline: theme.outline },
      }, this.rig.axes(), this.size));
      // It closes by itself after the last contact.
      if (frame.n_active === 0) this.lensTimer = window.setTimeout(() => this.loop.invalidate('style'), LensView.stays + 50);
    } else if (this.isLensOpen) {
      lens.close();
      this.onLens(null);
    }
    this.isLensOpen = isOpen;
  }
}
