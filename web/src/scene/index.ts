// The view of a body in three dimensions.

export { BodyView } from './view';
export { DEFAULT_OPTIONS, NoWebGL2 } from './options';
export type { LensPicture } from './lens';
export type { PictureLegend } from './picture';
export type { Probed } from './probe';
export type { MapKind } from './palpation';
export type { Legend, MapLegend, Picked, SectionArea, Vec3, ViewOptions } from './options';
export type { NoSkin } from './picking';
export type { CameraPose } from './rig';
export { COLOURINGS, quantityOf, type ColourBy } from './quantities';
