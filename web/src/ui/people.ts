// What people can tell apart, for comparison with what a body offers.

/**
 * The smallest change of a force or a stiffness that people notice, as a share of it: lowest and highest of the Weber
 * fractions of five people with an index finger on a haptic device, at forces of 5 and 8 N and a stiffness of 290 N/m.
 * Gurari, Okamura and Kuchenbecker 2017, PLoS ONE 12: e0178605. For smaller forces people need more.
 */
export const NOTICED_SHARE = { least: 0.042, most: 0.101 } as const;

/** How many people would notice a change of this share. */
export function noticedBy(share: number): 'few' | 'some' | 'most' {
  if (share < NOTICED_SHARE.least) return 'few';
  return share < NOTICED_SHARE.most ? 'some' : 'most';
}
