//! An enum over types that answer the same questions, such as [`Law`](crate::Law).

/// Writes an enum with a variant for each of the types, named like the type; `From` each type; and
/// a macro `each!(value, inner => expression)`, the expression with `inner` bound to whichever type
/// the value holds. The `($)` lets it write that macro.
///
/// An enum, and no pointer to a trait: the values are `Copy`, and their methods are inlined.
macro_rules! one_of {
    (
        ($dollar:tt) $each:ident!
        $(#[$about:meta])*
        pub enum $Enum:ident { $($(#[$what:meta])* $Type:ident,)* }
    ) => {
        $(#[$about])*
        pub enum $Enum { $($(#[$what])* $Type($Type),)* }

        $(impl From<$Type> for $Enum {
            fn from(inner: $Type) -> Self {
                Self::$Type(inner)
            }
        })*

        macro_rules! $each {
            ($dollar value:expr, $dollar inner:ident => $dollar expression:expr) => {
                match $dollar value { $($Enum::$Type($dollar inner) => $dollar expression,)* }
            };
        }
    };
}
