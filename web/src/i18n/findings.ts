// Words of the findings in a surface. The engine sends a kind and a count. A kind that an older page does not know is shown in the
// engine's own English; e2e/words.test.mjs finds kinds that have no words here.

import type { FindingInfo } from '../generated/api';
import type { Language } from '.';

/** What was found, and what to do. `n` is the number with “at least” where counting stopped. */
type Entry = [found: (n: string, isOne: boolean) => string, advice: string];

const s = (isOne: boolean): string => (isOne ? '' : 's');
const REPAIRED = 'Palpa mends this when the body grows.';

const en = {
  empty: [() => 'There are no triangles.', 'Export the mesh itself, not its points.'],
  'out-of-range': [(n, one) => `${n} triangle${s(one)} with vertices that do not exist.`, 'Export the surface again.'],
  'not-finite': [(n, one) => `${n} vert${one ? 'ex' : 'ices'} with coordinates that are no numbers, infinite or far too large.`, 'Correct or delete these vertices in the program that made the mesh.'],
  degenerate: [(n, one) => `${n} triangle${s(one)} without area.`, REPAIRED],
  duplicate: [(n, one) => `${n} triangle${s(one)} that exist${one ? 's' : ''} twice.`, REPAIRED],
  unjoined: [() => 'Most triangles have no neighbour: this is a heap of triangles, not a surface.', 'Merge vertices at the same place in a mesh program, or remesh.'],
  'nearly-coincident': [(n, one) => `${n} vert${one ? 'ex lies' : 'ices lie'} almost at the same place as another.`, REPAIRED],
  'non-manifold-edge': [(n, one) => `${n} edge${s(one)} with three or more triangles.`, 'Delete the triangles inside, or remesh the surface (Blender: Select Non Manifold; MeshLab: Repair Non Manifold Edges).'],
  'non-manifold-vertex': [(n, one) => `${n} vert${one ? 'ex' : 'ices'} where parts touch in a single point.`, 'Split or join the parts there.'],
  winding: [(n, one) => `${n} triangle${s(one)} wound against the neighbours.`, REPAIRED],
  inverted: [(n, one) => `${n} part${s(one)} turned inside out.`, REPAIRED],
  'one-sided': [(n, one) => `${n} part${s(one)} with only one side, like a Möbius strip.`, 'Cut or remesh the part.'],
  hole: [(n, one) => `${n} hole${s(one)}.`, 'Fill holes in a mesh program (Blender: Fill; MeshLab: Close Holes). Palpa does not guess what was there.'],
  't-junction': [(n, one) => `${n} vert${one ? 'ex' : 'ices'} on an edge without being one of its ends.`, 'Split these edges at the vertices, or remesh.'],
  'self-intersection': [(n, one) => `The surface passes through itself (${n} triangle${s(one)}).`, 'Move or remesh the surface there. Layers may not grow near these places.'],
  'unused-vertex': [(n, one) => `${n} vert${one ? 'ex belongs' : 'ices belong'} to no triangle.`, REPAIRED],
  'open-boundary': [(n, one) => `${n} open rim${s(one)}, as of a cut limb or a sheet.`, 'This is fine: rims become cut faces of the body.'],
  'several-parts': [(n) => `${n} parts that are not connected.`, 'If some are bones, export them to files of their own and add them as bones.'],
  sliver: [(n, one) => `${n} very thin triangle${s(one)}.`, 'The body still grows, but the force is less accurate there. Remeshing helps.'],
  scale: [() => 'No body part has this size.', 'Choose another unit above.'],
  'far-from-origin': [() => 'It lies far from the origin of its coordinates.', 'Nothing is lost, unless the file is saved again in single precision (STL, GLB).'],
  'unclear-side': [(n, one) => `${n} open part${s(one)} of which the outside is not clear.`, 'Check in the picture that the violet side is inside.'],
} satisfies Record<string, Entry>;

type FindingKind = keyof typeof en;

const J = 'モデルの生成時に自動で修復します。';
const ja: Record<FindingKind, Entry> = {
  empty: [() => '三角形がありません。', '点だけでなくメッシュを書き出してください。'],
  'out-of-range': [(n) => `存在しない頂点を使う三角形が ${n} 個あります。`, '面を書き出し直してください。'],
  'not-finite': [(n) => `座標が数でない、無限大、または大きすぎる頂点が ${n} 個あります。`, 'メッシュを作ったソフトで、これらの頂点を修正または削除してください。'],
  degenerate: [(n) => `面積のない三角形が ${n} 個あります。`, J],
  duplicate: [(n) => `重複した三角形が ${n} 個あります。`, J],
  unjoined: [() => 'ほとんどの三角形がつながっていません。面ではなく、ばらばらの三角形です。', 'メッシュ編集ソフトで同じ位置の頂点を結合するか、リメッシュしてください。'],
  'nearly-coincident': [(n) => `ほぼ同じ位置にある頂点が ${n} 個あります。`, J],
  'non-manifold-edge': [(n) => `3 個以上の三角形が共有する辺が ${n} 本あります。`, '内側の三角形を削除するか、リメッシュしてください（Blender：非多様体を選択、MeshLab：Repair Non Manifold Edges）。'],
  'non-manifold-vertex': [(n) => `1 点だけで接する部分が ${n} か所あります。`, 'その点で切り離すか、つなげてください。'],
  winding: [(n) => `隣と逆向きの三角形が ${n} 個あります。`, J],
  inverted: [(n) => `裏返しの部分が ${n} 個あります。`, J],
  'one-sided': [(n) => `メビウスの帯のように片面しかない部分が ${n} 個あります。`, 'その部分を切るか、リメッシュしてください。'],
  hole: [(n) => `穴が ${n} 個あります。`, 'メッシュ編集ソフトでふさいでください（Blender：フィル、MeshLab：Close Holes）。Palpa は推測で穴を埋めません。'],
  't-junction': [(n) => `辺の途中にある頂点が ${n} 個あります。`, 'その辺を頂点で分割するか、リメッシュしてください。'],
  'self-intersection': [(n) => `面が自分自身と交差しています（三角形 ${n} 個）。`, 'その付近を動かすか、リメッシュしてください。近くでは層を作れないことがあります。'],
  'unused-vertex': [(n) => `どの三角形にも使われない頂点が ${n} 個あります。`, J],
  'open-boundary': [(n) => `開いた縁が ${n} 本あります（切断した肢やシートなど）。`, '問題ありません。縁は切断面になります。'],
  'several-parts': [(n) => `つながっていない部分が ${n} 個あります。`, '骨が含まれる場合は、別のファイルに書き出して骨として追加してください。'],
  sliver: [(n) => `非常に細い三角形が ${n} 個あります。`, 'モデルは作れますが、その付近の力の精度が下がります。リメッシュをお勧めします。'],
  scale: [() => 'この大きさの体の部位はありません。', '上で別の単位を選んでください。'],
  'far-from-origin': [() => '座標の原点から遠く離れています。', '読み込みでは精度を失いませんが、単精度の形式（STL、GLB）で保存し直すと丸められます。'],
  'unclear-side': [(n) => `どちらが外側か分からない開いた部分が ${n} 個あります。`, '画面で紫の面が内側になっているか確認してください。'],
};

const WORDS: Record<Language, Partial<Record<string, Entry>>> = { en, ja };
const AT_LEAST: Record<Language, (n: number) => string> = { en: (n) => `at least ${n}`, ja: (n) => `${n} 以上の` };

/** What was found, and what to do about it. */
export function findingWords(finding: FindingInfo, language: Language): { found: string; advice: string } {
  const entry = WORDS[language][finding.kind];
  if (entry === undefined) return { found: finding.text, advice: finding.advice };
  const n = finding.is_at_least ? AT_LEAST[language](finding.count) : String(finding.count);
  return { found: entry[0](n, finding.count === 1), advice: entry[1] };
}
