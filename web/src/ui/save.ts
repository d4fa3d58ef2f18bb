// Saves the view as a picture file.

import { bodyView } from './body';

export async function saveImage(): Promise<void> {
  const image = await bodyView.value?.image();
  if (image === undefined) return;
  const link = document.createElement('a');
  link.href = URL.createObjectURL(image);
  link.download = `palpa-${new Date().toISOString().slice(0, 19).replaceAll(':', '')}.png`;
  link.click();
  // By then the browser has read it.
  window.setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
