// Words in the user's language.

import { effect, signal } from '@preact/signals';
import { en } from './en';
import { ja } from './ja';

export type Key = keyof typeof en;
export type Dictionary = Record<Key, string>;
export type Language = 'en' | 'ja';

const DICTIONARIES: Record<Language, Dictionary> = { en, ja };
const NAME = 'palpa.language';

function initialLanguage(): Language {
  try {
    const kept = localStorage.getItem(NAME);
    if (kept === 'en' || kept === 'ja') return kept;
  } catch {
    // The browser's language it is.
  }
  return navigator.language.startsWith('ja') ? 'ja' : 'en';
}

export const language = signal<Language>(initialLanguage());

effect(() => {
  document.documentElement.lang = language.value;
  try {
    localStorage.setItem(NAME, language.value);
  } catch {
    // It lasts as long as the page.
  }
});

/** The words of a key, with `{name}` replaced by values. */
export function t(key: Key, values?: Record<string, string | number>): string {
  const words = DICTIONARIES[language.value][key];
  return values === undefined ? words : words.replace(/\{(\w+)\}/g, (all, name: string) => String(values[name] ?? all));
}

/** The words of a key that is made of what the engine says; its own word when there are none. */
export function named(prefix: string, word: string, otherwise = word): string {
  const key = `${prefix}.${word}`;
  return key in en ? t(key as Key) : otherwise;
}
