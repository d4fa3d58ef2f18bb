// The view of a body: what the page gives is kept, and drawn when something has changed.

import { PCFShadowMap, Plane, Raycaster, Vector2, Vector3, WebGLRenderer, type Texture } from 'three';
import type { LumpInfo, State } from '../generated/api';
import type { FrameSnapshot, MeshSnapshot } from '../generated/wire';
import { Body } from './body';
import { Colouring, mapFor } from './colouring';
import { clippingPlane, cutOf, type Cut } from './cutaway';
import { Gestures, type Claims } from './gestures';
import { Lines } from './lines';
import { LumpsView, lumpArea } from './lumps';
import { MarksView } from './marks';
import type { SharedUniforms } from './materials';
import { DEFAULT_OPTIONS, NoWebGL2, type Legend, type Picked, type SectionArea, type Vec3, type ViewOptions } from './options';
import { Gizmo, PlaneGrip, ScaleBar } from './overlay';
import { BONE, CORE, LUMP, layerColours, mapTexture, type Theme } from './palette';
import { nearestOnSkin, pickBone, pickSection, pickSkin } from './picking';
import { Quality, isSoftwareWebGL } from './quality';
import { CameraRig, SIDES } from './rig';
import { SectionView } from './sectionview';
import { Stage } from './stage';
import { Surfaces, type LayerLook, type Materials } from './surfaces';
import { ToolView } from './tool';

/** A new mesh waits so long for its first frame: shown without it, a pressed body would jump to rest and back. */
const MESH_WAIT = 400;
/** Opacity of all layers while the truth of a game is shown. */
const TRUTH_OPACITY = 0.38;

/** Changes too small to be seen: m, N. */
const UNSEEN_LENGTH = 5e-6;
const UNSEEN_FORCE = 0.004;

/** Whether two frames of a mesh look alike. */
function isSame(a: FrameSnapshot, b: FrameSnapshot): boolean {
  if (a.field !== b.field || a.displacements.length !== b.displacements.length || a.is_replay !== b.is_replay) return false;
  for (let c = 0; c < 3; c++) {
    if (Math.abs(a.tool[c] - b.tool[c]) > UNSEEN_LENGTH || Math.abs(a.force[c] - b.force[c]) > UNSEEN_FORCE) return false;
  }
  const dot = a.orientation[0] * b.orientation[0] + a.orientation[1] * b.orientation[1] + a.orientation[2] * b.orientation[2] + a.orientation[3] * b.orientation[3];
  if (Math.abs(dot) < 1 - 1e-7) return false;
  for (let i = 0; i < a.displacements.length; i++) {
    if (Math.abs(a.displacements[i] * a.displacement_unit - b.displacements[i] * b.displacement_unit) > UNSEEN_LENGTH) return false;
  }
  return true;
}

export class BodyView {
  onLegend: (legend: Legend | null) => void = () => {};
  onSection: (area: SectionArea | null) => void = () => {};
  onCutaway: (position: number) => void = () => {};
  onFirstBody: () => void = () => {};
  readonly canvas = document.createElement('canvas');

  private readonly root = document.createElement('div');
  private readonly renderer: WebGLRenderer;
  private readonly stage = new Stage();
  private readonly rig = new CameraRig(() => this.invalidate('camera'));
  private readonly gestures: Gestures;
  private readonly quality: Quality;
  private readonly scaleBar = new ScaleBar();
  private readonly gizmo: Gizmo;
  private readonly grip: PlaneGrip;
  private readonly tool = new ToolView();
  private readonly marks = new MarksView();
  private readonly colouring = new Colouring();
  private readonly maps: Record<string, Texture>;
  private readonly shared: SharedUniforms = { map: { value: null }, range: { value: new Vector2(0, 1) }, isLog: { value: 0 } };
  private readonly clip = new Plane();
  /** Given to all materials that are cut; empty when nothing is. */
  private readonly planes: Plane[] = [];
  private readonly materials: Materials = new Map();
  private readonly planeFrame = new Lines(1.2);
  private readonly sectionView = new SectionView(this.shared);
  private readonly lumps: LumpsView;
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
  private frame: FrameSnapshot | null = null;
  private cut: Cut | null = null;
  private isFirst = true;
  private isAsked = false;
  private size = new Vector2(1, 1);
  private legendKey = '';
  private areaKey = '';
  /** What has changed since the last picture. */
  private readonly changed = { frame: true, style: true, camera: true, shadow: true };
  private isRefining = false;

  constructor(container: HTMLElement, options: ViewOptions) {
    this.options = { ...DEFAULT_OPTIONS, ...options };
    const { canvas, root } = this;
    canvas.id = 'body-canvas';
    canvas.tabIndex = 0;
    canvas.setAttribute('role', 'application');
    canvas.setAttribute('aria-label', 'Body: press with mouse, finger or keys');
    const isSoftware = isSoftwareWebGL();
    const gl = isSoftware === null ? null : canvas.getContext('webgl2', { antialias: !isSoftware, alpha: true, powerPreference: 'high-performance' });
    if (!gl) throw new NoWebGL2();
    this.renderer = new WebGLRenderer({ canvas, context: gl, alpha: true });
    this.renderer.setClearAlpha(0);
    this.renderer.localClippingEnabled = true;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.renderer.shadowMap.autoUpdate = false;
    this.quality = new Quality(gl, Boolean(isSoftware), () => {
      this.isRefining = true;
      this.invalidate('shadow');
    });
    this.maps = Object.fromEntries((['ylgnbu', 'cividis', 'vik'] as const).map((name) => [name, mapTexture(name)]));
    this.shared.map.value = this.maps.viridis;
    this.lumps = new LumpsView(this.shared, this.stage, this.planes);

    root.className = 'scene-root';
    this.gizmo = new Gizmo((axis, sign) => this.look(new Vector3().setComponent(axis, sign).add(new Vector3(0, -0.001, 0)).normalize()));
    this.grip = new PlaneGrip((position) => {
      this.setOptions({ cutaway: { ...this.options.cutaway, position } });
      this.onCutaway(position);
    });
    root.append(canvas, this.scaleBar.element, this.gizmo.element, this.grip.element);
    container.append(root);
    this.gestures = new Gestures(canvas, this.rig);
    this.planeFrame.renderOrder = 9;
    this.stage.scene.add(this.sectionView.group, this.tool.group, this.marks.group, this.lumps.group, this.planeFrame);
    this.sectionView.group.visible = this.planeFrame.visible = false;
    this.theme = this.stage.theme(this.options.theme);
    this.paintBackground();

    const { signal } = this.stop;
    canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      this.quality.forget();
    }, { signal });
    canvas.addEventListener('webglcontextrestored', () => {
      this.quality.forget();
      this.invalidate('style');
    }, { signal });
    document.addEventListener('visibilitychange', () => this.invalidate('camera'), { signal });
    this.resizer = new ResizeObserver(() => this.resize());
    this.resizer.observe(root);
    this.resize();
  }

  // What the page gives.

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
    // Most frames of a body that nobody presses say the same again; a picture that stands still is drawn in full and left alone.
    if (this.frame && isSame(this.frame, frame)) return;
    this.frame = frame;
    this.invalidate('frame');
  }

  setState(state: State): void {
    const before = this.state;
    this.state = state;
    if (before && before.revision === state.revision) return;
    this.invalidate('style');
  }

  setOptions(options: Partial<ViewOptions>): void {
    const before = this.options;
    this.options = { ...before, ...options };
    this.rig.reducedMotion = this.options.reducedMotion;
    if (before.theme !== this.options.theme) {
      this.theme = this.stage.theme(this.options.theme);
      this.paintBackground();
    }
    this.invalidate('style');
  }

  viewFrom(side: 'home' | 'top' | 'front' | 'side'): void {
    this.look(side === 'home' ? this.homeSide() : SIDES[side]);
  }

  /** PNG of what is seen, with the scale bar. */
  async image(): Promise<Blob> {
    this.draw({ ratio: Math.max(window.devicePixelRatio || 1, 1), shadows: true });
    const out = document.createElement('canvas');
    out.width = this.canvas.width;
    out.height = this.canvas.height;
    const g = out.getContext('2d')!;
    const [middle, corner] = this.theme.background;
    const fill = g.createRadialGradient(out.width / 2, 0.43 * out.height, 0, out.width / 2, out.height / 2, 0.75 * Math.max(out.width, out.height));
    fill.addColorStop(0, middle);
    fill.addColorStop(1, corner);
    g.fillStyle = fill;
    g.fillRect(0, 0, out.width, out.height);
    g.drawImage(this.canvas, 0, 0);
    const ratio = out.width / this.size.x;
    const ink = this.options.theme === 'dark' ? '#d5dde3' : '#33404a';
    g.scale(ratio, ratio);
    g.strokeStyle = g.fillStyle = ink;
    g.lineWidth = 1.5;
    const y = this.size.y - 20, x = 20;
    g.beginPath();
    g.moveTo(x, y - 6);
    g.lineTo(x, y);
    g.lineTo(x + this.scaleBar.length, y);
    g.lineTo(x + this.scaleBar.length, y - 6);
    g.stroke();
    g.font = '500 12px system-ui, sans-serif';
    g.fillText(this.scaleBar.label, x, y - 11);
    this.invalidate('camera');
    return new Promise((resolve, reject) => out.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('the picture could not be made'))), 'image/png'));
  }

  pick(clientX: number, clientY: number): Picked | null {
    const { body } = this;
    if (!body) return null;
    const ray = this.rayAt(clientX, clientY);
    const isKept = this.isKept();
    const hits = [
      { part: 'skin' as const, hit: pickSkin(ray, body, false, isKept) },
      { part: 'section' as const, hit: this.cut ? pickSection(ray, this.sectionView.section, this.cut.plane) : null },
      { part: 'bone' as const, hit: this.options.bones ? pickBone(ray, body, isKept) : null },
    ];
    let best: Picked | null = null;
    let nearest = Infinity;
    for (const { part, hit } of hits) {
      if (!hit || hit.distance >= nearest) continue;
      nearest = hit.distance;
      best = { point: hit.point, normal: hit.normal, part };
    }
    return best;
  }

  /** The skin at rest under a place of the picture: stays where it is while the skin gives way. */
  pickRest(clientX: number, clientY: number): { point: Vec3; normal: Vec3 } | null {
    return this.body && pickSkin(this.rayAt(clientX, clientY), this.body, true, this.isKept());
  }

  /** The place of the skin at rest nearest to a point. */
  nearest(point: Vec3): { point: Vec3; normal: Vec3 } | null {
    return this.body && nearestOnSkin(this.body, point);
  }

  /** To the right and up in the picture. */
  screenAxes(): { right: Vec3; up: Vec3 } {
    const { right, up } = this.rig.axes();
    return { right: right.toArray() as Vec3, up: up.toArray() as Vec3 };
  }

  metresPerPixel(): number {
    return this.rig.metresPerPixel(this.size.y);
  }

  /** The place that the scene presses. */
  get home(): { point: Vec3; normal: Vec3 } | null {
    const home = this.state?.home;
    return home ? { point: home.point as Vec3, normal: home.normal as Vec3 } : null;
  }

  set claims(claims: Claims | null) {
    this.gestures.claims = claims;
  }

  /** What the GPU holds, for tests of leaks. */
  get memory(): { geometries: number; textures: number } {
    return { ...this.renderer.info.memory };
  }

  dispose(): void {
    this.stop.abort();
    window.clearTimeout(this.meshTimer);
    this.resizer.disconnect();
    this.gestures.dispose();
    this.quality.dispose();
    this.surfaces?.dispose();
    for (const material of this.materials.values()) material.dispose();
    this.sectionView.dispose();
    this.planeFrame.dispose();
    this.lumps.dispose();
    this.marks.dispose();
    this.tool.dispose();
    this.stage.dispose();
    for (const map of Object.values(this.maps)) map.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.body = null;
    this.root.remove();
  }

  private paintBackground(): void {
    const [middle, corner] = this.theme.background;
    this.root.dataset.theme = this.options.theme;
    this.root.style.background = `radial-gradient(circle farthest-corner at 50% 43%, ${middle}, ${corner})`;
  }

  // Meshes and sizes.

  /** Whether a mesh is of another body, to be looked at anew, and not the same one meshed otherwise. */
  private isOther(mesh: MeshSnapshot): boolean {
    const old = this.body!;
    const box = old.box.clone().makeEmpty().setFromArray(mesh.positions);
    return box.min.distanceTo(old.box.min) + box.max.distanceTo(old.box.max) > 0.06 * old.radius;
  }

  private takeMesh(mesh: MeshSnapshot): void {
    this.waitingMesh = null;
    window.clearTimeout(this.meshTimer);
    const isOther = !this.body || this.isOther(mesh);
    this.surfaces?.dispose();
    this.body = new Body(mesh);
    this.surfaces = new Surfaces(this.body, this.shared, this.stage, this.planes, this.materials);
    this.stage.scene.add(this.surfaces.group);
    this.stage.setBody(this.body);
    this.frame = null;
    if (isOther) {
      this.tool.group.visible = false;
      this.rig.fit(this.body.box, this.homeSide(), false);
    }
    this.invalidate('style');
  }

  /** From where home is seen. */
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
    this.invalidate('camera');
  }

  private rayAt(clientX: number, clientY: number) {
    const rect = this.canvas.getBoundingClientRect();
    this.raycaster.setFromCamera(
      new Vector2((2 * (clientX - rect.left)) / rect.width - 1, 1 - (2 * (clientY - rect.top)) / rect.height),
      this.rig.camera,
    );
    return this.raycaster.ray;
  }

  private isKept(): (p: Vector3) => boolean {
    const cut = this.cut;
    if (!cut) return () => true;
    const [x, y, z] = cut.plane.normal;
    return (p) => x * p.x + y * p.y + z * p.z >= cut.plane.offset;
  }

  // Drawing.

  private invalidate(what: keyof BodyView['changed']): void {
    if (!this.changed) return; // The rig reports while the view is still being made.
    this.changed[what] = true;
    if (what !== 'shadow') {
      this.isRefining = false;
      this.quality?.wait();
    }
    if (this.isAsked || this.stop.signal.aborted) return;
    this.isAsked = true;
    requestAnimationFrame((now) => this.tick(now));
  }

  private tick(now: number): void {
    this.isAsked = false;
    if (this.stop.signal.aborted || document.hidden) return;
    if (!this.quality.isReady(now)) {
      this.isAsked = true;
      requestAnimationFrame((next) => this.tick(next));
      return;
    }
    this.rig.step(now);
    this.draw(this.quality.begin(this.isRefining));
    this.quality.end(now);
    this.isRefining = false;
    if (this.rig.isTurning) this.invalidate('camera');
    if (this.isFirst && this.body) {
      this.isFirst = false;
      this.onFirstBody();
    }
  }

  private draw(how: { ratio: number; shadows: boolean }): void {
    const { changed, renderer, body, surfaces, options } = this;
    if (body && surfaces) {
      const isMoved = changed.frame || changed.style;
      if (changed.frame && this.frame) body.deform(this.frame);
      if (isMoved) this.colour(body, surfaces);
      if (changed.style) this.style(surfaces);
      else if (changed.frame) surfaces.update();
      if (isMoved || (changed.camera && options.cutaway.axis === 'view')) this.slice(body);
      if (isMoved) {
        this.lumps.update(body);
        this.marks.update(body);
        if (this.frame) this.tool.place(this.frame);
      }
      if (isMoved || changed.shadow) renderer.shadowMap.needsUpdate = true;
    }
    changed.frame = changed.style = changed.camera = changed.shadow = false;

    const casts = options.shadows && how.shadows;
    if (this.stage.key.castShadow !== casts) {
      this.stage.key.castShadow = casts;
      renderer.shadowMap.needsUpdate = true;
    }
    this.stage.hasGround = options.shadows;
    if (renderer.getPixelRatio() !== how.ratio) renderer.setPixelRatio(how.ratio);
    const size = renderer.getSize(new Vector2());
    if (!size.equals(this.size)) renderer.setSize(this.size.x, this.size.y, false);
    const pixel = this.metresPerPixel();
    this.tool.options(options.tool, options.force);
    this.tool.scale(pixel);
    this.marks.scale(pixel);
    this.sectionView.size = this.size;
    this.planeFrame.material.uniforms.size.value.copy(this.size);
    renderer.render(this.stage.scene, this.rig.camera);
    this.scaleBar.update(pixel);
    this.gizmo.update(this.rig.axes());
    this.placeGrip();
  }

  private colour(body: Body, surfaces: Surfaces): void {
    const { options, colouring, shared, state } = this;
    const by = options.colourBy;
    if (Colouring.isMap(by)) {
      const values = surfaces.value.array as Float32Array;
      colouring.nodes(body, by, this.frame, values);
      surfaces.value.needsUpdate = true;
      colouring.updateRange(body, by, options.range, values, performance.now() / 1000);
      shared.map.value = this.maps[mapFor(by)];
      shared.range.value.set(...colouring.range);
      shared.isLog.value = colouring.isLog ? 1 : 0;
    }
    const legend = colouring.legend(by, state?.layers ?? [], options.cutaway.on, state?.method === 'reference');
    const key = JSON.stringify(legend);
    if (key !== this.legendKey) {
      this.legendKey = key;
      this.onLegend(legend);
    }
  }

  /** How each layer is shown; all shine through while the truth of a game is told. */
  private layerLooks(body: Body): (LayerLook & { name: string })[] {
    const names = body.layerStart.map((_, i) => this.state?.layers[i]?.name ?? `layer ${i + 1}`);
    const colours = layerColours(names.map((name) => ({ name })));
    const most = this.state?.game?.result ? TRUTH_OPACITY : 1;
    return names.map((name, i) => {
      const { visible = true, opacity = 1 } = this.options.layers[i] ?? {};
      return { name, colour: colours[i], visible: visible && opacity > 0, opacity: Math.min(opacity, most) };
    });
  }

  /** Those that may be known: of a game, once its truth is told. */
  private lumpInfos(): LumpInfo[] {
    const result = this.state?.game?.result;
    return result ? result.lumps.map((l) => l.lump) : (this.state?.lumps ?? []);
  }

  private style(surfaces: Surfaces): void {
    const { options, state, theme, sectionView } = this;
    const looks = this.layerLooks(this.body!);
    const isMapped = Colouring.isMap(options.colourBy);
    // Lines have to be seen on the map's colours: those of most begin dark, that of pressure is light in the middle.
    const isDark = isMapped && mapFor(options.colourBy) !== 'vik';
    const [outline, wire] = isDark ? ['#ffffff', '#ffffff'] : [theme.outline, theme.wire];
    surfaces.style({
      layers: looks,
      isMapped,
      isTissue: options.colourBy === 'tissue',
      bones: options.bones,
      core: CORE,
      bone: BONE,
      wire: { on: options.wireframe, colour: wire, opacity: theme.wireOpacity },
    });
    sectionView.material.layers(looks.map((l) => l.colour), looks.map((l) => (l.opacity < 1 ? Math.min(1, l.opacity + 0.25) : 1)), looks.map((l) => l.name));
    sectionView.material.uniforms.isMapped.value = isMapped ? 1 : 0;
    sectionView.material.uniforms.isPlain.value = options.colourBy === 'layer' ? 1 : 0;
    sectionView.colours(this.body!.boneTriangles.length > 0 ? CORE : BONE, BONE, outline, wire, theme.wireOpacity, options.wireframe);
    this.planeFrame.style(theme.plane, 0.55);
    const lumps = this.lumpInfos();
    sectionView.material.lumps(options.lumps ? lumps : [], LUMP);
    const isSeenThrough = looks.some((l) => !l.visible || l.opacity < 1);
    this.lumps.set(options.lumps && isSeenThrough ? lumps : [], this.body!, LUMP, Boolean(state?.game?.result));
    this.marks.set(state?.game ?? null, this.body!, options.coverage);
    if (state) this.tool.set(state.tool.shape, state.max_force, this.body!.radius);
  }

  private slice(body: Body): void {
    const { options, sectionView, planes } = this;
    const { cutaway, colourBy } = options;
    sectionView.group.visible = this.planeFrame.visible = cutaway.on;
    if (!cutaway.on) {
      this.cut = null;
      if (planes.length > 0) planes.length = 0;
      if (this.areaKey !== '') this.onSection(null);
      this.areaKey = '';
      return;
    }
    this.cut = cutOf(cutaway, body.box, this.rig.axes().forward);
    clippingPlane(this.cut.plane, this.clip);
    if (planes.length === 0) planes.push(this.clip);
    const values = this.surfaces!.value.array as Float32Array;
    const isMapped = Colouring.isMap(colourBy);
    const shown = this.layerLooks(body).map((l) => l.visible);
    const { section } = sectionView;
    section.cut(
      body, this.cut.plane,
      { nodes: isMapped && colourBy !== 'stiffness' ? values : null, prisms: colourBy === 'stiffness' ? body.stiffness : null },
      shown,
    );
    sectionView.update(body, this.cut.plane, options.bones);
    const { corners } = this.cut;
    this.planeFrame.show(Float32Array.from(corners.flatMap((c, i) => [...c.toArray(), ...corners[(i + 1) % 4].toArray()])), 24);
    const area = { total: section.area.reduce((a, b) => a + b, 0), layers: section.area.slice(), lumps: lumpArea(section, this.lumpInfos()) };
    const key = JSON.stringify(area);
    if (key !== this.areaKey) {
      this.areaKey = key;
      this.onSection(area);
    }
  }

  /** At the middle of the frame's side that is uppermost to the right. */
  private placeGrip(): void {
    const { cut, grip, size } = this;
    const element = grip.element;
    if (element.hidden !== !cut) element.hidden = !cut;
    if (!cut) return;
    const toScreen = (p: Vector3) => {
      const q = p.clone().project(this.rig.camera);
      return { x: (0.5 + 0.5 * q.x) * size.x, y: (0.5 - 0.5 * q.y) * size.y };
    };
    const places = cut.middles.map((p) => ({ p, at: toScreen(p) }));
    const best = places.reduce((a, b) => (b.at.x * 0.8 - b.at.y > a.at.x * 0.8 - a.at.y ? b : a));
    const ahead = toScreen(best.p.clone().addScaledVector(cut.way, 0.05));
    const x = Math.min(Math.max(best.at.x, 24), size.x - 24), y = Math.min(Math.max(best.at.y, 24), size.y - 24);
    grip.update(x, y, (ahead.x - best.at.x) / 0.05, (ahead.y - best.at.y) / 0.05, this.options.cutaway.position);
  }
}
