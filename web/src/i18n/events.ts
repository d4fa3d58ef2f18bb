// Words of the engine's events, notices and problems. The engine sends kinds and numbers; each kind has an entry for each
// language here, and names inside them have theirs in en.ts and ja.ts, so that a new kind does not compile without its words.

import type { EventKind, GrantedInfo, NoticeKind, PriorityInfo, Problem } from '../generated/api';
import { withPrefix } from '../ui/quantity';
import { en as enNames } from './en';
import { ja as jaNames } from './ja';
import { said, type Of, type Words } from './kinds';
import type { Dictionary, Language } from '.';

interface Vocabulary {
  events: Words<EventKind>;
  notices: Words<NoticeKind>;
  problems: Words<Problem>;
  priorities: Words<PriorityInfo>;
  outcome: (refused: string | null | undefined) => string;
  granted: (thread: string, priority: string, outcome: string, core: string) => string;
  core: (core: number, outcome: string) => string;
}

const list = (names: Dictionary, of: Of<EventKind, 'law_faults'>, comma: string): string =>
  of.faults.map((fault) => names[`law_fault.${fault}`]).join(comma);

const en: Vocabulary = {
  events: {
    loop_started: () => 'The servo loop started.',
    loop_stopped: ({ ticks }) => `The servo loop stopped after ${ticks} ticks.`,
    device_lost: ({ device, why }) => `Device ${device} was lost (${enNames[`trouble.${why}`]}). Its force goes to zero.`,
    device_back: ({ device, ticks }) => `Device ${device} is back after ${ticks} ticks.`,
    write_failed: ({ device, why }) => `Device ${device} did not accept its force (${enNames[`trouble.${why}`]}).`,
    deadline_missed: ({ skipped, longest }) => `${skipped} ticks were skipped. The longest gap is ${withPrefix(longest, 's')}.`,
    law_faults: (of) => (of.faults.length === 0 ? 'No fault any more. The force comes back.' : `The force goes to zero: ${list(enNames, of, ', ')}.`),
    tissue_started: () => 'The tissue started.',
    tissue_stopped: ({ steps }) => `The tissue stopped after ${steps} steps.`,
    step_status: ({ step, status }) => `Tissue step ${step}: ${enNames[`step_result.${status}`]}.`,
    tissue_panicked: ({ step }) => `The tissue thread panicked in step ${step} and has ended. The force goes to zero.`,
    time_lost: ({ seconds }) => `The tissue lost ${withPrefix(seconds, 's')}, because its time step is limited.`,
    job_panicked: () => 'A background job panicked. The tissue keeps its zone and mesh for some steps, and then requests another job.',
    injected: ({ fault }) => `Fault on purpose: ${enNames[`injected.${fault}`]}.`,
    records_lost: ({ records, n }) => `A buffer was full: ${n} ${enNames[`records.${records}`]} were not recorded.`,
    file_failed: ({ reason }) => `The recording cannot be written and ends here (${reason}).`,
  },
  notices: {
    problem: ({ problem }) => problemWords(problem, 'en'),
    motion_ended: () => 'The motion ended, because the scene was changed.',
    recording_full: () => 'The recording ended: one hour is the limit.',
    thread_lost: ({ thread }) => `The thread ${thread} ended by a fault. The force went to zero, and the engine restarts.`,
    too_many_requests: () => 'This page sent too many requests. Some were left out.',
    engine: ({ event }) => eventWords(event, 'en'),
  },
  problems: {
    refused: ({ text }) => text,
    no_thread: ({ reason }) => `The system gave no thread to build the body (${reason}).`,
  },
  priorities: {
    real_time: ({ priority }) => `real-time priority ${priority}`,
    normal: () => 'ordinary priority',
    nice: ({ niceness }) => `niceness ${niceness}`,
    idle: () => 'idle-time priority',
  },
  outcome: (refused) => (refused == null ? 'granted' : `refused (${refused})`),
  granted: (thread, priority, outcome, core) => `${thread}: ${priority} ${outcome}${core}`,
  core: (core, outcome) => `, core ${core} ${outcome}`,
};

const ja: Vocabulary = {
  events: {
    loop_started: () => 'サーボループを開始しました。',
    loop_stopped: ({ ticks }) => `サーボループは ${ticks} 周期で終了しました。`,
    device_lost: ({ device, why }) => `デバイス ${device} を読み取れません（${jaNames[`trouble.${why}`]}）。その力を 0 にします。`,
    device_back: ({ device, ticks }) => `デバイス ${device} は ${ticks} 周期後に復帰しました。`,
    write_failed: ({ device, why }) => `デバイス ${device} が力を受け付けませんでした（${jaNames[`trouble.${why}`]}）。`,
    deadline_missed: ({ skipped, longest }) => `${skipped} 周期が欠落しました。最長の間隔は ${withPrefix(longest, 's')} です。`,
    law_faults: (of) => (of.faults.length === 0 ? '異常は解消しました。力を元に戻します。' : `力を 0 にします：${list(jaNames, of, '、')}。`),
    tissue_started: () => '組織の計算を開始しました。',
    tissue_stopped: ({ steps }) => `組織の計算は ${steps} ステップで終了しました。`,
    step_status: ({ step, status }) => `組織のステップ ${step}：${jaNames[`step_result.${status}`]}。`,
    tissue_panicked: ({ step }) => `組織スレッドがステップ ${step} で異常終了しました。力を 0 にします。`,
    time_lost: ({ seconds }) => `時間刻みの上限のため、組織の時間が ${withPrefix(seconds, 's')} 失われました。`,
    job_panicked: () => 'バックグラウンド処理が異常終了しました。組織は現在の領域とメッシュのまま計算を続け、数ステップ後に処理を再び要求します。',
    injected: ({ fault }) => `意図的な異常：${jaNames[`injected.${fault}`]}。`,
    records_lost: ({ records, n }) => `バッファーがいっぱいのため、${jaNames[`records.${records}`]} ${n} 件が記録されませんでした。`,
    file_failed: ({ reason }) => `記録ファイルに書き込めないため、記録を終了しました（${reason}）。`,
  },
  notices: {
    problem: ({ problem }) => problemWords(problem, 'ja'),
    motion_ended: () => 'シーンが変更されたため、動作を終了しました。',
    recording_full: () => '上限の 1 時間に達したため、記録を終了しました。',
    thread_lost: ({ thread }) => `スレッド ${thread} が異常終了しました。力を 0 にし、エンジンを再起動します。`,
    too_many_requests: () => 'このページからの要求が多すぎるため、一部を省きました。',
    engine: ({ event }) => eventWords(event, 'ja'),
  },
  problems: {
    refused: ({ text }) => text,
    no_thread: ({ reason }) => `体を生成するスレッドを作れませんでした（${reason}）。`,
  },
  priorities: {
    real_time: ({ priority }) => `リアルタイム優先度 ${priority}`,
    normal: () => '通常の優先度',
    nice: ({ niceness }) => `ナイス値 ${niceness}`,
    idle: () => 'アイドル時の優先度',
  },
  outcome: (refused) => (refused == null ? '許可' : `拒否（${refused}）`),
  granted: (thread, priority, outcome, core) => `${thread}：${priority}、${outcome}${core}`,
  core: (core, outcome) => `。コア ${core}、${outcome}`,
};

const WORDS: Record<Language, Vocabulary> = { en, ja };

/** An event of the engine in a language. */
export function eventWords(event: EventKind, language: Language): string {
  return said(WORDS[language].events, event);
}

/** A notice in a language. */
export function noticeWords(notice: NoticeKind, language: Language): string {
  return said(WORDS[language].notices, notice);
}

/** A problem in a language. The texts of refused scenes are in English: they name keys and values of the scene file. */
export function problemWords(problem: Problem, language: Language): string {
  return said(WORDS[language].problems, problem);
}

/** The scheduling that a thread got, in a language. Reasons are the words of the operating system. */
export function grantedWords(of: GrantedInfo, language: Language): string {
  const words = WORDS[language];
  const core = of.core == null ? '' : words.core(of.core, words.outcome(of.core_refused));
  return words.granted(of.thread, said(words.priorities, of.priority), words.outcome(of.priority_refused), core);
}
