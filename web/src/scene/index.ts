// The view of a body in three dimensions.

export { BodyView } from './view';
export { DEFAULT_OPTIONS, NoWebGL2 } from './options';
export type { ColourBy, Legend, Picked, SectionArea, Vec3, ViewOptions } from './options';
export { BONE, LUMP, layerColours } from './palette';
