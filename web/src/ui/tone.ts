// A tone whose pitch and loudness follow something. It begins silent.

export interface Tone {
  context: AudioContext;
  oscillator: OscillatorNode;
  gain: GainNode;
}

export function beginTone(type: OscillatorType): Tone {
  const context = new AudioContext();
  const oscillator = context.createOscillator();
  oscillator.type = type;
  const gain = context.createGain();
  gain.gain.value = 0;
  oscillator.connect(gain).connect(context.destination);
  oscillator.start();
  // Browsers keep a page silent until the user has touched it.
  const wake = (): void => void context.resume();
  window.addEventListener('pointerdown', wake, { once: true });
  window.addEventListener('keydown', wake, { once: true });
  return { context, oscillator, gain };
}
