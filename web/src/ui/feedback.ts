// The force as sound and vibration, for users without a haptic device. Both are off until
// they are switched on.

import { effect } from '@preact/signals';
import { onFrame, state } from '../store';
import { magnitude } from './history';
import { hasSound, hasVibration } from './settings';
import { beginTone, type Tone } from './tone';

const LOWEST_PITCH = 110;
/** Range of the pitch: small loudspeakers play it well. */
const OCTAVES = 2.5;
const LOUDEST = 0.18;
const DEAD_BAND = 0.02;
/** Length of one vibration, ms; the next one starts a little before its end. */
const PIECE = 120;

export function canVibrate(): boolean {
  return 'vibrate' in navigator || pads().length > 0;
}

function pads(): Gamepad[] {
  return (navigator.getGamepads?.() ?? []).filter((pad): pad is Gamepad => pad?.vibrationActuator != null);
}

/** Strength of sound and vibration, 0 to 1; its square root makes small forces
 * easy to tell apart. */
function strength(force: number): number {
  if (force < DEAD_BAND) return 0;
  return Math.min(1, Math.sqrt(force / Math.min(state.value?.max_force ?? 8, 8)));
}

export function beginFeedback(): void {
  let tone: Tone | null = null;
  let lastPiece = 0;
  let heardAt = 0;

  effect(() => {
    if (hasSound.value) {
      tone ??= beginTone('triangle');
      return;
    }
    void tone?.context.close();
    tone = null;
  });
  onFrame((frame) => {
    heardAt = performance.now();
    const felt = strength(magnitude(frame.force));
    if (tone !== null) {
      const now = tone.context.currentTime;
      tone.oscillator.frequency.setTargetAtTime(LOWEST_PITCH * 2 ** (OCTAVES * felt), now, 0.03);
      tone.gain.gain.setTargetAtTime(LOUDEST * felt, now, 0.03);
    }
    if (hasVibration.value && felt > 0 && heardAt - lastPiece > PIECE * 0.8) {
      lastPiece = heardAt;
      for (const pad of pads()) {
        void pad.vibrationActuator.playEffect('dual-rumble', {
          duration: PIECE, strongMagnitude: felt * 0.6, weakMagnitude: felt,
        });
      }
      // A phone's motor is on or off: weak forces are short pulses.
      navigator.vibrate?.(Math.max(8, Math.round(PIECE * felt)));
    }
  });
  // Without frames the force is unknown, so there is silence.
  window.setInterval(() => {
    if (tone !== null && performance.now() - heardAt > 500) tone.gain.gain.setTargetAtTime(0, tone.context.currentTime, 0.05);
  }, 250);
}
