// mdBook's preprocessor for docs/: `$…$` and `$$…$$` become MathML, which every current browser draws without a script,
// and links to files outside docs/ (source code, the README) become plain text, because the book does not contain them.
// mdBook sends [context, book] as JSON on standard input and takes the book back on standard output.

import { posix } from "node:path";
import { text } from "node:stream/consumers";
import temml from "temml";

// `preprocess.mjs supports RENDERER` asks whether to run; MathML is HTML.
if (process.argv[2] === "supports") process.exit(process.argv[3] === "html" ? 0 : 1);

// A fenced block or a code span, which stay as they are, or a formula, or a link.
const PARTS = new RegExp(
  [
    /^ *(?<fence>```|~~~)[^]*?^ *\k<fence>[^\n]*$/,
    /(?<ticks>`+)[^`][^]*?\k<ticks>(?!`)/,
    /\$\$(?<display>[^]+?)\$\$/,
    /\$(?<inline>[^$\n]+)\$/,
    /(?<!!)\[(?<label>(?:[^[\]`]|`[^`]*`)*)\]\((?<target>[^()\s]+)\)/,
  ]
    .map((part) => part.source)
    .join("|"),
  "gm",
);

const [, book] = JSON.parse(await text(process.stdin));
const visit = (items) => {
  for (const item of items) {
    const chapter = item.Chapter;
    if (!chapter) continue;
    chapter.content = convert(chapter.content, chapter.path);
    visit(chapter.sub_items);
  }
};
visit(book.items);
process.stdout.write(JSON.stringify(book));

function convert(content, path) {
  return content.replace(PARTS, (whole, ...rest) => {
    const { display, inline, label, target } = rest.at(-1);
    if (display) return math(display, true, path);
    if (inline) return math(inline, false, path);
    if (target && leavesTheBook(target, path)) return label;
    return whole;
  });
}

function math(formula, displayMode, path) {
  try {
    const mathml = temml.renderToString(formula, { displayMode, throwOnError: true });
    // Characters that Markdown would take for its own.
    return mathml
      .replace(/\s*\n\s*/g, " ")
      .replace(/>[^<]+</g, (text) => text.replace(/[*_|[\]~`\\]/g, (c) => `&#${c.charCodeAt(0)};`));
  } catch (error) {
    console.error(`${path}: formula "${formula.trim()}": ${error.message}`);
    process.exit(1);
  }
}

function leavesTheBook(target, path) {
  if (/^[a-z]+:|^#/i.test(target)) return false;
  return posix.join(posix.dirname(path), target).startsWith("../");
}
