// Words for messages that the engine sends as a kind with numbers.

type Kinded = { kind: string };

/** Those of a union that have this kind. */
export type Of<Union extends Kinded, Kind> = Extract<Union, { kind: Kind }>;

/** The words for each kind of a union; a kind without an entry does not compile. */
export type Words<Union extends Kinded> = { [Kind in Union['kind']]: (of: Of<Union, Kind>) => string };

/** The words for one message. */
export function said<Union extends Kinded>(words: Words<Union>, of: Union): string {
  return (words[of.kind as Union['kind']] as (of: Union) => string)(of);
}
