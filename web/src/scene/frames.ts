// Whether two frames look alike: a body at rest sends the same picture again and again.

import type { FrameSnapshot } from '../generated/wire';

/** Changes too small to be seen, m and N. */
const UNSEEN_LENGTH = 5e-6;
const UNSEEN_FORCE = 0.004;
/** 1 − |p · q| of unit quaternions that differ too little to be seen. */
const UNSEEN_TURN = 1e-7;

/** For two frames of one mesh. */
export function looksSame(a: FrameSnapshot, b: FrameSnapshot): boolean {
  if (a.field !== b.field || a.displacements.length !== b.displacements.length || a.is_replay !== b.is_replay) return false;
  for (let c = 0; c < 3; c++) {
    if (Math.abs(a.tool[c] - b.tool[c]) > UNSEEN_LENGTH || Math.abs(a.force[c] - b.force[c]) > UNSEEN_FORCE) return false;
  }
  const [p, q] = [a.orientation, b.orientation];
  const dot = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3];
  if (Math.abs(dot) < 1 - UNSEEN_TURN) return false;
  for (let i = 0; i < a.displacements.length; i++) {
    if (Math.abs(a.displacements[i] * a.displacement_unit - b.displacements[i] * b.displacement_unit) > UNSEEN_LENGTH) return false;
  }
  return true;
}
