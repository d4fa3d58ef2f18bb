// Saves the view as a picture file.

import { bodyView, mapLegend } from './body';
import { mapWords } from './mapwords';

/** With the legend of the palpation map while the map is shown. `name` begins the file's name. */
export async function saveImage(name = 'palpa'): Promise<void> {
  const image = await bodyView.value?.image(mapLegend.value && mapWords(mapLegend.value));
  if (image === undefined) return;
  const link = document.createElement('a');
  link.href = URL.createObjectURL(image);
  link.download = `${name}-${new Date().toISOString().slice(0, 19).replaceAll(':', '')}.png`;
  link.click();
  // By then the browser has read it.
  window.setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
