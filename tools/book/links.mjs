// Checks links without a network: `node tools/book/links.mjs BOOK` looks through every Markdown file of the repository
// and every page of the built book in the folder BOOK. A link or image whose file is missing, an anchor that its page does
// not have, a page of docs/ that docs/SUMMARY.md leaves out, and a path docs/….md in a comment that does not exist are
// printed with their place, and the exit code is 1. Links to other sites are not followed.

import { existsSync, readFileSync, readdirSync, statSync } from "node:fs";
import { dirname, extname, join, normalize, relative } from "node:path";

const SKIPPED = new Set([".git", "node_modules", "target", "dist", "out", "artifacts", "corpus"]);
const faults = [];
let count = 0;

const repository = files(".");
const pages = repository.filter((file) => extname(file) === ".md");
for (const page of pages) {
  const markdown = readFileSync(page, "utf8");
  for (const { target, line } of markdownLinks(markdown)) check(page, line, target);
}

const listed = new Set(
  markdownLinks(readFileSync("docs/SUMMARY.md", "utf8")).map(({ target }) => normalize(join("docs", target))),
);
for (const page of pages) {
  if (page.startsWith("docs/") && page !== "docs/SUMMARY.md" && !listed.has(page))
    faults.push(`docs/SUMMARY.md: does not list "${page}"`);
}

for (const file of repository.filter((file) => /\.(rs|ts|tsx|mjs|py|toml)$/.test(file) || file === "Makefile")) {
  eachLine(readFileSync(file, "utf8"), (text, line) => {
    for (const [path] of text.matchAll(/\bdocs\/[\w/]+\.md\b/g)) {
      count += 1;
      if (!existsSync(path)) faults.push(`${file}:${line}: there is no file "${path}"`);
    }
  });
}

const book = process.argv[2];
for (const page of files(book).filter((file) => extname(file) === ".html")) {
  // mdBook's page for addresses that do not exist is written for the root of a site.
  if (relative(book, page) === "404.html") continue;
  eachLine(readFileSync(page, "utf8"), (text, line) => {
    for (const [, target] of text.matchAll(/<(?:a|img|link|script)\b[^>]*?\s(?:href|src)="([^"]*)"/g))
      check(page, line, target.replaceAll("&amp;", "&"));
  });
}

for (const fault of faults) console.error(fault);
console.log(`links: ${count} checked, ${faults.length} broken`);
process.exit(faults.length > 0 ? 1 : 0);

function check(page, line, target) {
  if (/^[a-z][a-z0-9+.-]*:|^\/\//i.test(target)) return;
  count += 1;
  const [path, anchor] = target.split("#", 2);
  let file = path === "" ? page : normalize(join(dirname(page), decodeURIComponent(path)));
  if (!existsSync(file)) {
    faults.push(`${page}:${line}: there is no file "${target}"`);
    return;
  }
  if (statSync(file).isDirectory() && extname(page) === ".html") file = join(file, "index.html");
  if (anchor && !anchors(file).has(decodeURIComponent(anchor)))
    faults.push(`${page}:${line}: there is no heading "#${anchor}" in ${file}`);
}

/** The anchors of a page: those that GitHub makes of headings, or the ids of a page of the book. */
function anchors(file) {
  anchors.known ??= new Map();
  if (!anchors.known.has(file)) anchors.known.set(file, new Set(readAnchors(file)));
  return anchors.known.get(file);
}

function* readAnchors(file) {
  const text = existsSync(file) && statSync(file).isFile() ? readFileSync(file, "utf8") : "";
  if (extname(file) === ".html") {
    for (const [, id] of text.matchAll(/\s(?:id|name)="([^"]*)"/g)) yield id;
    return;
  }
  const seen = new Map();
  for (const [, heading] of withoutCode(text, false).matchAll(/^#{1,6} +(.+?)(?: +#+)? *$/gm)) {
    const slug = heading
      .replace(/!?\[([^\]]*)\]\([^)]*\)/g, "$1")
      .toLowerCase()
      .replace(/[^\p{L}\p{M}\p{N}\p{Pc}\- ]/gu, "")
      .replaceAll(" ", "-");
    const times = seen.get(slug) ?? 0;
    seen.set(slug, times + 1);
    yield times === 0 ? slug : `${slug}-${times}`;
  }
}

function markdownLinks(markdown) {
  const found = [];
  eachLine(withoutCode(markdown, true), (text, line) => {
    for (const [, target] of text.matchAll(/\]\(<?([^()\s>]+)>?(?: "[^"]*")?\)/g)) found.push({ target, line });
    for (const [, target] of text.matchAll(/^ {0,3}\[[^\]]+\]: *(\S+)/g)) found.push({ target, line });
    for (const [, target] of text.matchAll(/<(?:a|img)\b[^>]*?\s(?:href|src)="([^"]*)"/g)) found.push({ target, line });
  });
  return found;
}

/** Fenced blocks, and spans too if asked, made empty; lines keep their numbers. */
function withoutCode(markdown, spans) {
  const blank = (code) => code.replace(/[^\n]+/g, "");
  const text = markdown.replace(/^ *(```|~~~)[^]*?^ *\1[^\n]*$/gm, blank);
  return spans ? text.replace(/(`+)[^`][^]*?\1(?!`)/g, (span) => "`".concat(blank(span))) : text;
}

function eachLine(text, use) {
  text.split("\n").forEach((line, index) => use(line, index + 1));
}

function files(folder) {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = join(folder, entry.name);
    if (entry.isDirectory()) return SKIPPED.has(entry.name) ? [] : files(path);
    return [path];
  });
}
