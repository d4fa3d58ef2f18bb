// Fields, switches and buttons that all panels share.

export { Button, Controlled, Download, Section } from './frame';
export { Segmented, Select, Toggle } from './choices';
export { Slider, type Range } from './sliders';
export { PointFields, QuantityField } from './quantities';
export { aloud } from './commit';
