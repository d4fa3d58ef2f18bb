//! The layout of a record in a log: fixed size, packed, little-endian, in the order of its fields.
//!
//! It is the layout of ROS 1 messages, which MCAP knows by name. The schema in the file is the list
//! of fields, so other tools (Foxglove, the `mcap` packages) can read and plot the channels without
//! Palpa.

/// A number in a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A real number.
    F64(f64),
    /// A count or an identifier.
    U64(u64),
    /// A truth value.
    Bool(bool),
}

/// A type that a record can hold.
pub trait Field: Sized {
    /// Name of the type in a schema.
    const TYPE: &'static str;
    /// Number of numbers in a value.
    const WIDTH: usize;
    /// Appends the value to `out`.
    fn put(&self, out: &mut Vec<u8>);
    /// Takes a value from the front of `bytes`; `None` if they end too early.
    fn get(bytes: &mut &[u8]) -> Option<Self>;
    /// The numbers of the value, in order.
    fn values(&self, out: &mut Vec<Value>);
}

macro_rules! number {
    ($type:ty, $name:literal, $value:expr) => {
        impl Field for $type {
            const TYPE: &'static str = $name;
            const WIDTH: usize = 1;
            fn put(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }
            fn get(bytes: &mut &[u8]) -> Option<Self> {
                let (head, rest) = bytes.split_first_chunk()?;
                *bytes = rest;
                Some(Self::from_le_bytes(*head))
            }
            fn values(&self, out: &mut Vec<Value>) {
                let value: fn($type) -> Value = $value;
                out.push(value(*self));
            }
        }
    };
}
number!(f64, "float64", Value::F64);
number!(u64, "uint64", Value::U64);
number!(u32, "uint32", |v| Value::U64(v.into()));
number!(u8, "uint8", |v| Value::U64(v.into()));

impl Field for bool {
    const TYPE: &'static str = "bool";
    const WIDTH: usize = 1;
    fn put(&self, out: &mut Vec<u8>) {
        out.push(u8::from(*self));
    }
    fn get(bytes: &mut &[u8]) -> Option<Self> {
        u8::get(bytes).map(|b| b != 0)
    }
    fn values(&self, out: &mut Vec<Value>) {
        out.push(Value::Bool(*self));
    }
}

/// Arrays hold real numbers only: positions, quaternions and the like.
impl<const N: usize> Field for [f64; N] {
    const TYPE: &'static str = "float64";
    const WIDTH: usize = N;
    fn put(&self, out: &mut Vec<u8>) {
        for v in self {
            v.put(out);
        }
    }
    fn get(bytes: &mut &[u8]) -> Option<Self> {
        let mut all = [0.0; N];
        for v in &mut all {
            *v = f64::get(bytes)?;
        }
        Some(all)
    }
    fn values(&self, out: &mut Vec<Value>) {
        out.extend(self.map(Value::F64));
    }
}

/// A row of a log's table.
pub trait Record: Sized + Default + Copy + Send + 'static {
    /// Name of the record and of its schema.
    const NAME: &'static str;
    /// The fields: name, type, and count of numbers.
    const FIELDS: &'static [(&'static str, &'static str, usize)];
    /// Appends the value to `out`.
    fn encode(&self, out: &mut Vec<u8>);
    /// Reads a record from `bytes`; `None` if they end too early.
    fn decode(bytes: &[u8]) -> Option<Self>;
    /// The numbers of the record, field by field.
    fn values(&self, out: &mut Vec<Value>);

    /// The schema, as text.
    fn schema() -> String {
        (Self::FIELDS.iter())
            .map(|(name, of, width)| match width {
                1 => format!(
                    "{of} {name}
"
                ),
                _ => format!(
                    "{of}[{width}] {name}
"
                ),
            })
            .collect()
    }

    /// Names of the columns of a table: the fields' own, numbered from 0 where a field is an array.
    fn columns() -> Vec<String> {
        let mut names = Vec::new();
        for (name, _, width) in Self::FIELDS {
            match width {
                1 => names.push((*name).to_owned()),
                3 => names.extend(["x", "y", "z"].map(|axis| format!("{name}_{axis}"))),
                _ => names.extend((0..*width).map(|k| format!("{name}_{k}"))),
            }
        }
        names
    }
}

/// Defines a documented struct and its [`Record`] implementation.
macro_rules! record {
    ($(#[$doc:meta])* $name:ident as $label:literal { $($(#[$field_doc:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        pub struct $name { $($(#[$field_doc])* pub $field: $type,)* }

        impl $crate::layout::Record for $name {
            const NAME: &'static str = $label;
            const FIELDS: &'static [(&'static str, &'static str, usize)] = &[$((
                stringify!($field),
                <$type as $crate::layout::Field>::TYPE,
                <$type as $crate::layout::Field>::WIDTH,
            ),)*];
            fn encode(&self, out: &mut Vec<u8>) {
                $($crate::layout::Field::put(&self.$field, out);)*
            }
            fn decode(mut bytes: &[u8]) -> Option<Self> {
                let bytes = &mut bytes;
                Some(Self { $($field: $crate::layout::Field::get(bytes)?,)* })
            }
            fn values(&self, out: &mut Vec<$crate::layout::Value>) {
                $($crate::layout::Field::values(&self.$field, out);)*
            }
        }
    };
}
