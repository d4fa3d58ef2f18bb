// What the page knows of the machine that it runs on.

/** Whether the processor draws WebGL; null without WebGL 2. */
export const isSoftwareWebGL: boolean | null = find();

function find(): boolean | null {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) return null;
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  const name = info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : '';
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

/** Plain canvases are drawn by the processor itself where it would otherwise play a graphics card: that takes
 * several times as long, for curves as for pictures. */
export function drawPlainly(): void {
  if (isSoftwareWebGL !== true) return;
  const usual = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, kind: string, options?: object) {
    return usual.call(this, kind, kind === '2d' ? { willReadFrequently: true, ...options } : options);
  } as typeof usual;
}

/** Times between two drawings of a curve and between two changes of the numbers, ms: more often looks no smoother,
 * and the engine needs the processor too. */
export const CURVE_PERIOD = isSoftwareWebGL === true ? 250 : 100;
export const NUMBER_PERIOD = isSoftwareWebGL === true ? 200 : 80;
