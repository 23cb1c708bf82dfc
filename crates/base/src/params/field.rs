//! A technique's parameters as the fields of a struct.

use super::{Kind, ParamError, ParamInfo, ParamValues, Value};

/// A technique's parameters; [`crate::params!`] makes them from the fields of a struct.
pub trait Params: Sized + Clone + Send + Sync + 'static {
    /// Every parameter.
    const INFO: &'static [ParamInfo];
    /// Made from values, which are checked.
    fn from_values(values: &ParamValues) -> Result<Self, ParamError>;
    /// Back to values, for provenance and for files.
    fn to_values(&self) -> ParamValues;
}

impl Params for () {
    const INFO: &'static [ParamInfo] = &[];

    fn from_values(values: &ParamValues) -> Result<Self, ParamError> {
        values.check(Self::INFO)
    }

    fn to_values(&self) -> ParamValues {
        ParamValues::default()
    }
}

/// What a field of a struct of parameters may be.
pub trait Field: Sized {
    /// From a checked value; `None` where it is of another kind.
    fn from_value(value: &Value, info: &ParamInfo) -> Option<Self>;
    /// The value.
    fn to_value(&self, info: &ParamInfo) -> Value;

    /// The value of `info`, or its default.
    fn read(values: &ParamValues, info: &ParamInfo) -> Result<Self, ParamError> {
        let value = values.required(info)?;
        Self::from_value(&value, info).ok_or_else(|| info.refused(&value.to_string()))
    }
}

impl Field for f64 {
    fn from_value(value: &Value, _: &ParamInfo) -> Option<Self> {
        if let Value::Number(x) = value { Some(*x) } else { None }
    }

    fn to_value(&self, _: &ParamInfo) -> Value {
        Value::Number(*self)
    }
}

/// A whole number, or the place of a word in its choice.
impl Field for usize {
    fn from_value(value: &Value, info: &ParamInfo) -> Option<Self> {
        match (value, info.kind) {
            (Value::Number(x), _) => Some(*x as Self),
            (Value::Word(word), Kind::Choice(words)) => words.iter().position(|w| *w == word.as_str()),
            _ => None,
        }
    }

    fn to_value(&self, info: &ParamInfo) -> Value {
        match info.kind {
            Kind::Choice(words) => words[*self].into(),
            _ => Value::Number(*self as f64),
        }
    }
}

impl Field for bool {
    fn from_value(value: &Value, _: &ParamInfo) -> Option<Self> {
        if let Value::Switch(on) = value { Some(*on) } else { None }
    }

    fn to_value(&self, _: &ParamInfo) -> Value {
        Value::Switch(*self)
    }
}

/// `None` is [`Value::Auto`].
impl<F: Field> Field for Option<F> {
    fn from_value(value: &Value, info: &ParamInfo) -> Option<Self> {
        if *value == Value::Auto { Some(None) } else { F::from_value(value, info).map(Some) }
    }

    fn to_value(&self, info: &ParamInfo) -> Value {
        self.as_ref().map_or(Value::Auto, |x| x.to_value(info))
    }
}

/// A struct of parameters: each field with its description, and [`Params`] for it.
///
/// ```
/// use steradian_base::{ParamInfo, ParamValues, Params, params};
///
/// params! {
///     /// Of a map.
///     #[derive(Debug, Clone, PartialEq)]
///     pub struct Size {
///         /// Intervals per edge; by the tolerance where `None`.
///         pub size: Option<usize> = ParamInfo::whole("size", [1.0, 512.0], 64.0, "intervals per edge").auto(0.0),
///     }
/// }
///
/// let words = |word| Size::from_values(&ParamValues::from_iter([("size", word)]));
/// assert_eq!((words("auto"), words("32")), (Ok(Size { size: None }), Ok(Size { size: Some(32) })));
/// assert_eq!(words("0").unwrap().to_values().body(Size::INFO), "size=auto");
/// ```
#[macro_export]
macro_rules! params {
    ($(#[$meta:meta])* $vis:vis struct $name:ident {
        $($(#[$doc:meta])* $field_vis:vis $field:ident: $kind:ty = $info:expr,)*
    }) => {
        $(#[$meta])*
        $vis struct $name {
            $($(#[$doc])* $field_vis $field: $kind,)*
        }

        impl $name {
            /// Those of `values` that belong here.
            $vis fn read(values: &$crate::ParamValues) -> ::std::result::Result<Self, $crate::ParamError> {
                Ok(Self { $($field: $crate::Field::read(values, &const { $info })?,)* })
            }
        }

        impl $crate::Params for $name {
            const INFO: &'static [$crate::ParamInfo] = &[$($info),*];

            fn from_values(values: &$crate::ParamValues) -> ::std::result::Result<Self, $crate::ParamError> {
                values.check(Self::INFO)?;
                Self::read(values)
            }

            fn to_values(&self) -> $crate::ParamValues {
                let infos = &mut Self::INFO.iter();
                let mut values = $crate::ParamValues::default();
                $(if let Some(info) = infos.next() {
                    values.0.insert(info.name.into(), $crate::Field::to_value(&self.$field, info));
                })*
                values
            }
        }
    };
}
