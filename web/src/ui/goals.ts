// Goals of a press: a band in which the force shall stay, a limit at which it would hurt, and their sounds.

import { effect, signal } from '@preact/signals';
import { onFrame } from '../store';
import { magnitude } from './history';
import { bandHigh, bandLow, goalsSound, hasBand, hasPainLimit, painLimit } from './settings';
import { beginTone, type Tone } from './tone';

export type Reached = 'none' | 'below' | 'in' | 'above' | 'pain';

/** Where the force is. */
export const reached = signal<Reached>('none');
/** For how long it has been in the band, in whole tenths of a second. */
export const inBandTenths = signal(0);

/** Forces below this are no contact, N. */
const CONTACT = 0.02;
/** A force that left the band or passed the limit has to come back by this share to count: it trembles. */
const RETURN = 0.02;

/** The pitches of the sounds, Hz, and their loudness. */
const TONES: Partial<Record<Reached, { type: OscillatorType; pitch: number; loudness: number }>> = {
  in: { type: 'sine', pitch: 660, loudness: 0.06 },
  pain: { type: 'square', pitch: 196, loudness: 0.1 },
};

/** Where a force (N) is, after it was at `before`. */
export function reachedBy(force: number, before: Reached): Reached {
  const slack = (state: Reached) => (before === state ? 1 - RETURN : 1);
  if (force < CONTACT) return 'none';
  if (hasPainLimit.peek() && force >= painLimit.peek() * slack('pain')) return 'pain';
  if (!hasBand.peek()) return 'none';
  if (force < bandLow.peek() * slack('in')) return 'below';
  return force > bandHigh.peek() / slack('in') ? 'above' : 'in';
}

/** Follows the force. */
export function beginGoals(): void {
  let began = 0;
  let sound: Tone | null = null;
  let heardAt = 0;
  onFrame((frame) => {
    if (!hasBand.peek() && !hasPainLimit.peek()) {
      reached.value = 'none';
      return;
    }
    heardAt = performance.now();
    const now = reachedBy(magnitude(frame.force), reached.peek());
    if (now !== reached.peek()) began = frame.time;
    reached.value = now;
    inBandTenths.value = now === 'in' ? Math.max(0, Math.floor(10 * (frame.time - began))) : 0;
  });
  effect(() => {
    const tone = goalsSound.value ? TONES[reached.value] : undefined;
    if (tone === undefined) {
      sound?.gain.gain.setTargetAtTime(0, sound.context.currentTime, 0.03);
      return;
    }
    sound ??= beginTone(tone.type);
    void sound.context.resume();
    sound.oscillator.type = tone.type;
    sound.oscillator.frequency.value = tone.pitch;
    sound.gain.gain.setTargetAtTime(tone.loudness, sound.context.currentTime, 0.02);
    // Without frames the force is unknown, so there is silence.
    const watch = window.setInterval(() => {
      if (performance.now() - heardAt > 700) reached.value = 'none';
    }, 300);
    return () => window.clearInterval(watch);
  });
}
