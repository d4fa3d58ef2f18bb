// Words of the engine's notes. The engine sends kind and numbers; each kind has an entry for each
// language here, so that a new kind does not compile without its words.

import type { Format, ImprintError, Note, Outcome, Place, ReadNote, Tool } from '../generated/notes';
import { inMillimetres } from '../ui/quantity';
import { en as enNames } from './en';
import { ja as jaNames } from './ja';
import { said, type Of, type Words } from './kinds';
import type { Dictionary, Language } from '.';

const percent = (share: number) => `${Math.round(100 * share)} %`;
const exact = (share: number) => `${Number((100 * share).toPrecision(3))} %`;
const place = (at: readonly number[]) => `(${at.map((x) => (x * 1e3).toFixed(1)).join(', ')}) mm`;
const mm = inMillimetres;
/** A layer by the name of its tissue. */
const tissue = (name: string, names: Dictionary): string => (names as Record<string, string>)[`tissue.${name}`] ?? name;

/** The repairs that were made, with their counts. */
function repairs(note: Of<Note, 'repaired'>, names: readonly string[]): string {
  const counts = [note.n_welded, note.n_degenerate, note.n_duplicate, note.n_unused, note.n_flipped];
  return counts.flatMap((n, i) => (n > 0 ? [`${names[i]} ${n}`] : [])).join(', ');
}

const FORMATS: Record<Format, string> = { obj: 'OBJ', stl: 'STL', ply: 'PLY', off: 'OFF', gltf: 'glTF' };
const PLACES = {
  en: { line: 'line', byte: 'byte', record: 'record', file: 'the file' },
  ja: { line: '行', byte: 'バイト', record: 'レコード', file: 'ファイル' },
};

/** A place in a file. */
function inFile(at: Place, names: (typeof PLACES)['en']): string {
  if (at === 'file') return names.file;
  if ('line' in at) return `${names.line} ${at.line}`;
  return 'byte' in at ? `${names.byte} ${at.byte}` : `${names.record} ${at.record}`;
}

/** Name of a tool, and its radius if it has one. */
function toolWords(tool: Tool, names: Dictionary, sized: (name: string, radius: string) => string): string {
  const shape = 'shape' in tool ? tool.shape : tool;
  const name = names[`tool_shape.${shape.kind}`];
  return 'radius' in shape ? sized(name, mm(shape.radius)) : name;
}

const enReads: Words<ReadNote> = {
  'extension-mismatch': ({ extension, format }) => `named .${extension}, but its content is ${FORMATS[format]}; read as ${FORMATS[format]}`,
  utf16: () => 'the text is UTF-16; save it as UTF-8 for other programs',
  'short-faces': ({ count, first }) => `${count} face(s) with fewer than three corners were left out, the first at ${inFile(first, PLACES.en)}`,
  'folded-polygons': ({ count, first }) => `${count} polygon(s) fold over themselves, the first at ${inFile(first, PLACES.en)}; cut them into triangles in a mesh program`,
  'unread-vertices': ({ count, first }) => `${count} vertex line(s) are not numbers, the first at ${inFile(first, PLACES.en)}; no face uses them`,
  'not-faces': ({ count }) => `${count} part(s) of lines or points were left out`,
  'trailing-bytes': ({ bytes }) => `${bytes} byte(s) after the last record were not read`,
};

const enImprints: Words<ImprintError> = {
  'no-circle': ({ radius }) => `a circle of radius ${mm(radius)} is not possible about the tool's axis`,
  'over-rim': () => 'it crosses the rim of the skin; move it inward or make it smaller',
  'too-coarse': ({ radius }) => `the triangles are too large for a circle of radius ${mm(radius, 2)}; refine the skin there to a third of it`,
};

const enOutcomes: Words<Outcome> = {
  converged: () => '',
  iteration_limit: ({ at }) => ` No equilibrium was found; the largest imbalance is near ${place(at)}.`,
  inverted: ({ at }) => ` The tissue would turn inside out near ${place(at)}.`,
  singular: () => ' The tissue has lost its stiffness.',
};

const enTool = (tool: Tool) => toolWords(tool, enNames, (name, radius) => `${name} of radius ${radius}`).toLowerCase();

const en: Words<Note> = {
  file_read: ({ file, note }) => `${file}: ${said(enReads, note)}.`,
  unusual_size: ({ file, size }) => `${file} measures ${size.toFixed(4)} m from corner to corner. No body part has that size: check “unit” in the scene.`,
  repaired: (note) => `${note.file} was repaired: ${repairs(note, ['vertices welded:', 'triangles without area dropped:', 'double triangles dropped:', 'unused vertices dropped:', 'triangles turned outward:'])}`,
  skin_coarsened: ({ n_given, n_vertices, deviation }) => `The skin was coarsened from ${n_given} to ${n_vertices} vertices where it is finer than needed. It is at most ${mm(deviation, 2)} from the given skin. Set [mesh] coarsen = false to keep all vertices.`,
  base_overlaps: ({ n_pairs }) => `The base of the body passes through itself (${n_pairs} pairs of triangles). Look at the cutaway before you trust forces near there.`,
  layers_thinned: ({ share, median, least, at }) => `Layers are thinner than asked under ${percent(share)} of the skin's area, because there is too little room for them: usually ${percent(median)} of the asked thickness, at worst ${percent(least)}, under the skin at ${place(at)}. Forces are those of the thinner layers. Give the layers less thickness, or check the unit of the surfaces and the place of the bones.`,
  layers_moved: ({ share, layer, asked, thickness, at }) => `Layers are more than 1 % thicker or thinner than asked under ${(100 * share).toFixed(2)} % of the skin's area, to keep the mesh valid. Worst under the skin at ${place(at)}: layer “${tissue(layer, enNames)}” is ${mm(thickness, 2)} instead of ${mm(asked, 2)} thick.`,
  cutout_near: ({ radius, enough }) => `The cut-out has a radius of ${mm(radius, 0)}. With less than ${mm(enough, 0)}, its free rim may change the force.`,
  oblique_press: ({ angle }) => `The press direction is ${Math.round((angle * 180) / Math.PI)}° from the skin's normal: the tool drags more than it presses.`,
  press_on_cut_face: () => 'The place that is pressed lies on a cut face. The force there is that of a free edge.',
  place_off_skin: ({ at, distance }) => `The point of the scene is ${mm(distance)} from the skin. The tool presses the nearest point of the skin, ${place(at)}.`,
  node_beside: ({ distance }) => `The tool holds a single vertex. The nearest one is ${mm(distance, 2)} beside the place of the scene.`,
  tool_over_rim: ({ share }) => `${percent(Math.max(share, 0.01))} of the tool's footprint is beyond the rim of the skin, where no tissue resists. Press farther inside, or keep more of the body.`,
  skin_too_coarse: ({ n_triangles, max_vertices }) => `${n_triangles} skin triangles are larger than wanted, because the limit of ${max_vertices} vertices was reached.`,
  levels_too_high: ({ max_levels }) => `Levels are higher than wanted, because there are ${max_levels} already.`,
  lump_not_refined: ({ lump }) => `The mesh is not refined round the lump “${lump}”, because its size is not known. Set [mesh] near_lumps.`,
  lump_partly_outside: ({ lump, share, at }) => `${percent(share)} of the lump “${lump}” at ${place(at)} lies in the tissue. The rest does not count.`,
  disc_not_imprinted: ({ why }) => `The edge of the disc could not be cut into the mesh: ${said(enImprints, why)}.`,
  disc_patch: ({ n_vertices, radius, effective_radius }) => `${n_vertices} skin vertices lie under the disc of radius ${mm(radius)}; they hold a patch of radius ${mm(effective_radius)}.`,
  cut_face_not_flat: ({ at }) => `The cut face at ${place(at)} is not flat, so it cannot be a plane of symmetry. It was left free.`,
  speeds_alike: () => 'No tissue relaxes and nothing has mass here: every speed gives the same force.',
  single_triangles: ({ n, n_all }) => `${n} of ${n_all} skin triangles have no partner. The prisms under them are too stiff where tissue keeps its volume.`,
  coarse_under_tool: ({ edge, radius }) => `Skin edges near the tool are ${mm(edge)} long, more than a third of its radius of ${mm(radius)}: the force depends on the mesh. Refine it with [mesh] near_tool.`,
  coarse_at_edge: ({ edge, edge_radius }) => `Skin edges near the tool are ${mm(edge)} long, more than a third of the radius of its edge, ${mm(edge_radius)}: the force depends on the steps. Make the edge rounder or the mesh finer.`,
  accuracy_too_fine: ({ accuracy, asked, made }) => `In real time, edges and levels near the tool are ${percent(made)} smaller for an accuracy of ${exact(accuracy)} than by default, not ${percent(asked)}: finer ones make steps late, which costs more force than they gain. Expect more error than asked for.`,
  tension_lost: ({ layer }) => `The cut faces are free and let go of most of the tension of “${tissue(layer, enNames)}”. Set cut_faces = "fixed" or "symmetric" to keep it.`,
  few_under_disc: ({ n_vertices, radius, edge }) => `Only ${n_vertices} skin vertices lie under the tool of radius ${mm(radius)}, with edges of ${mm(edge)} there: the force depends on the mesh.`,
  tension_left_out: () => 'Bars have no tension at rest; “prestress” was left out.',
  first_speed_only: () => 'Forces of bars do not depend on time: only the first of “speeds” was run.',
  bar_aspects: ({ layers, least, most }) => `Height of levels over length of skin edges: ${layers.map(({ name, aspect }) => `${tissue(name, enNames)} ${aspect.toFixed(2)}`).join(', ')}. Outside ${least} to ${most} bars are too stiff across or too soft in shear.`,
  motion_off_skin: ({ far, length }) => `${mm(far, 0)} along its motion the tool is off the skin, where nothing is felt. Shorten the motion (now ${mm(length, 0)}).`,
  tool_replaced: ({ tool, by }) => `A hand presses by contact: the scene's ${enTool(tool)} was replaced by a ${enTool(by)}.`,
  coarser_for_touch: ({ edge }) => `Skin edges under the tool are ${mm(edge)} long, so that the body can follow a hand. [mesh] near_tool makes them finer.`,
  step_failed: ({ depth, outcome }) => `The step to ${mm(depth, 2)} failed.${said(enOutcomes, outcome)} Press less deep, or refine the mesh there.`,
  turned_prisms: ({ n, depth, at }) => `${n} prisms have a corner turned inside out at ${mm(depth, 2)}, the worst near ${place(at)}. The force may be off.`,
  few_touching: ({ n_vertices, radius, edge }) => `At most ${n_vertices} skin vertices touch the tool, over a circle of radius ${mm(radius)} with edges of ${mm(edge)}: the force depends on the mesh.`,
};

const jaReads: Words<ReadNote> = {
  'extension-mismatch': ({ extension, format }) => `拡張子は .${extension} ですが、内容は ${FORMATS[format]} です。${FORMATS[format]} として読み込みました`,
  utf16: () => 'テキストが UTF-16 です。ほかのプログラムで使うには UTF-8 で保存してください',
  'short-faces': ({ count, first }) => `頂点が 3 個未満の面 ${count} 個を除きました（最初：${inFile(first, PLACES.ja)}）`,
  'folded-polygons': ({ count, first }) => `折り重なった多角形が ${count} 個あります（最初：${inFile(first, PLACES.ja)}）。メッシュ編集ソフトで三角形に分割してください`,
  'unread-vertices': ({ count, first }) => `数でない頂点の行が ${count} 行あります（最初：${inFile(first, PLACES.ja)}）。どの面にも使われていません`,
  'not-faces': ({ count }) => `線や点の要素 ${count} 個を除きました`,
  'trailing-bytes': ({ bytes }) => `最後のレコードの後の ${bytes} バイトは読み込みませんでした`,
};

const jaImprints: Words<ImprintError> = {
  'no-circle': ({ radius }) => `圧子の軸のまわりに半径 ${mm(radius)} の円を置けません`,
  'over-rim': () => '円が皮膚の縁にかかっています。内側へ移すか、小さくしてください',
  'too-coarse': ({ radius }) => `半径 ${mm(radius, 2)} の円に対して三角形が大きすぎます。その付近の皮膚を半径の 3 分の 1 まで細かくしてください`,
};

const jaOutcomes: Words<Outcome> = {
  converged: () => '',
  iteration_limit: ({ at }) => `釣り合いが見つかりません（最大の不釣り合いは ${place(at)} の付近）。`,
  inverted: ({ at }) => `${place(at)} の付近で組織が裏返ります。`,
  singular: () => '組織の剛性が失われました。',
};

const jaTool = (tool: Tool) => toolWords(tool, jaNames, (name, radius) => `${name}、半径 ${radius}`);

const ja: Words<Note> = {
  file_read: ({ file, note }) => `${file}：${said(jaReads, note)}。`,
  unusual_size: ({ file, size }) => `${file} の大きさは ${size.toFixed(4)} m です。この大きさの体の部位はありません。シーンの unit を確認してください。`,
  repaired: (note) => `${note.file} を修復しました：${repairs(note, ['結合した頂点', '面積のない三角形の削除', '重複した三角形の削除', '未使用の頂点の削除', '外向きに直した三角形'])}`,
  skin_coarsened: ({ n_given, n_vertices, deviation }) => `必要以上に細かい皮膚のメッシュを ${n_given} 頂点から ${n_vertices} 頂点に粗くしました。元の皮膚との距離は最大 ${mm(deviation, 2)} です。すべての頂点を残すには [mesh] coarsen = false を指定してください。`,
  base_overlaps: ({ n_pairs }) => `体の底面が自分自身と交差しています（三角形 ${n_pairs} 組）。その付近の力を使う前に断面を確認してください。`,
  layers_thinned: ({ share, median, least, at }) => `すべての層が入る余裕がないため、皮膚面積の ${percent(share)} で層が指定より薄くなっています。厚さは多くの場所で指定の ${percent(median)}、最も薄い ${place(at)} の皮膚の下では ${percent(least)} です。力は、薄くなった層での値です。層の厚さの指定を小さくするか、面の単位と骨の位置を確認してください。`,
  layers_moved: ({ share, layer, asked, thickness, at }) => `メッシュを有効に保つため、皮膚面積の ${(100 * share).toFixed(2)} % で層の厚さが指定から 1 % を超えてずれています。最大のずれは ${place(at)} の皮膚の下で、層「${tissue(layer, jaNames)}」の厚さは ${mm(asked, 2)} ではなく ${mm(thickness, 2)} です。`,
  cutout_near: ({ radius, enough }) => `切り出しの半径は ${mm(radius, 0)} です。${mm(enough, 0)} 未満では縁の影響を感じることがあります。`,
  oblique_press: ({ angle }) => `押す方向が皮膚の法線から ${Math.round((angle * 180) / Math.PI)}° ずれています。押すよりも引きずる動きになります。`,
  press_on_cut_face: () => '押す位置が切断面の上にあります。そこでの力は自由端の力です。',
  place_off_skin: ({ at, distance }) => `シーンで指定した点は皮膚から ${mm(distance)} 離れています。最も近い皮膚上の点 ${place(at)} を押します。`,
  node_beside: ({ distance }) => `この圧子は頂点を 1 つだけ保持します。最も近い頂点は指定の位置から ${mm(distance, 2)} 離れています。`,
  tool_over_rim: ({ share }) => `圧子の接触範囲の ${percent(Math.max(share, 0.01))} が皮膚の縁の外にあり、そこには押し返す組織がありません。内側を押すか、体をより広く残してください。`,
  skin_too_coarse: ({ n_triangles, max_vertices }) => `頂点数の上限 ${max_vertices} に達したため、皮膚の三角形 ${n_triangles} 個が希望より大きくなっています。`,
  levels_too_high: ({ max_levels }) => `層の分割がすでに ${max_levels} 段あるため、希望より粗くなっています。`,
  lump_not_refined: ({ lump }) => `しこり「${lump}」の大きさが分からないため、周囲のメッシュを細かくできません。[mesh] near_lumps を設定してください。`,
  lump_partly_outside: ({ lump, share, at }) => `${place(at)} のしこり「${lump}」のうち組織の中にあるのは ${percent(share)} です。残りは計算に含まれません。`,
  disc_not_imprinted: ({ why }) => `円板の縁をメッシュに刻めませんでした：${said(jaImprints, why)}。`,
  disc_patch: ({ n_vertices, radius, effective_radius }) => `半径 ${mm(radius)} の円板の下に皮膚の頂点が ${n_vertices} 個あり、半径 ${mm(effective_radius)} の範囲を保持します。`,
  cut_face_not_flat: ({ at }) => `${place(at)} の切断面は平らでないため、対称面にできません。自由端としました。`,
  speeds_alike: () => '緩和する組織も質量もないため、どの速度でも力は同じです。',
  single_triangles: ({ n, n_all }) => `皮膚の三角形 ${n_all} 個のうち ${n} 個に組になる相手がありません。体積を保つ組織では、その下が硬くなりすぎます。`,
  coarse_under_tool: ({ edge, radius }) => `圧子付近の皮膚の辺の長さは ${mm(edge)} で、圧子の半径 ${mm(radius)} の 3 分の 1 を超えています。力がメッシュに依存します。[mesh] near_tool で細かくしてください。`,
  coarse_at_edge: ({ edge, edge_radius }) => `圧子付近の皮膚の辺の長さは ${mm(edge)} で、圧子の縁の半径 ${mm(edge_radius)} の 3 分の 1 を超えています。力がステップに依存します。縁を丸くするか、メッシュを細かくしてください。`,
  accuracy_too_fine: ({ accuracy, asked, made }) => `リアルタイムでは、精度 ${exact(accuracy)} の指定に対して、圧子付近の辺と段の大きさを既定より ${percent(asked)} ではなく ${percent(made)} だけ小さくしました。それ以上細かくすると計算が手の動きに遅れ、かえって力の誤差が増えるためです。誤差は指定より大きくなります。`,
  tension_lost: ({ layer }) => `切断面が自由なため、「${tissue(layer, jaNames)}」の張力の大部分が失われます。保つには cut_faces を "fixed" か "symmetric" にしてください。`,
  few_under_disc: ({ n_vertices, radius, edge }) => `半径 ${mm(radius)} の圧子の下にある皮膚の頂点は ${n_vertices} 個だけです（辺の長さ ${mm(edge)}）。力がメッシュに依存します。`,
  tension_left_out: () => '棒には初期張力がないため、prestress は使われません。',
  first_speed_only: () => '棒には時間の効果がないため、speeds の最初の値だけを使いました。',
  bar_aspects: ({ layers, least, most }) => `層の高さと皮膚の辺の長さの比：${layers.map(({ name, aspect }) => `${tissue(name, jaNames)} ${aspect.toFixed(2)}`).join('、')}。${least}〜${most} の範囲外では、棒の硬さが正しくありません。`,
  motion_off_skin: ({ far, length }) => `動作の ${mm(far, 0)} の位置で圧子が皮膚から外れ、力を感じません。動作の長さ（現在 ${mm(length, 0)}）を短くしてください。`,
  tool_replaced: ({ tool, by }) => `手は接触で押します。シーンの圧子（${jaTool(tool)}）を別の圧子（${jaTool(by)}）に置き換えました。`,
  coarser_for_touch: ({ edge }) => `手の動きに追従できるよう、圧子の下の皮膚の辺の長さを ${mm(edge)} にしました。[mesh] near_tool で細かくできます。`,
  step_failed: ({ depth, outcome }) => `${mm(depth, 2)} までのステップに失敗しました。${said(jaOutcomes, outcome)}浅く押すか、その付近のメッシュを細かくしてください。`,
  turned_prisms: ({ n, depth, at }) => `深さ ${mm(depth, 2)} で ${n} 個の要素が裏返っています（最悪の位置 ${place(at)}）。力が正しくない可能性があります。`,
  few_touching: ({ n_vertices, radius, edge }) => `圧子に触れる皮膚の頂点は最大 ${n_vertices} 個です（半径 ${mm(radius)}、辺の長さ ${mm(edge)}）。力がメッシュに依存します。`,
};

const WORDS: Record<Language, Words<Note>> = { en, ja };

/** A note of the engine in a language; its English words where the page knows no such kind. */
export function noteWords(note: { kind: string; values: Record<string, unknown>; text: string }, language: Language): string {
  const words = WORDS[language] as Record<string, ((note: never) => string) | undefined>;
  return words[note.kind]?.({ kind: note.kind, ...note.values } as never) ?? note.text;
}
