// Materials of tissue: surfaces in soft light, and the section.
//
// Written by hand, not taken from three's physical materials, because software
// WebGL must stay usable.

export { SectionMaterial } from './section';
export { SurfaceMaterial, type SurfaceLook } from './surface';
export type { SharedUniforms } from './shared';
