//! What a parameter is.

use super::{ParamError, Value};
use std::fmt;

/// What a parameter's value is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A real number.
    Real,
    /// A whole number.
    Whole,
    /// An angle in degrees.
    Angle,
    /// `on` or `off`; 1 and 0 are the same.
    Switch,
    /// One of these words. Where [`ParamInfo::min`] is a number, the words have numbers too, which count from
    /// there.
    Choice(&'static [&'static str]),
    /// A colour: one number, or three as `r/g/b`.
    Rgb,
    /// A direction or a place: three numbers as `x/y/z`.
    Vector,
    /// The path of a file.
    File,
    /// A name.
    Name,
}

/// What stands where the user says nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Preset {
    /// Nothing: the user has to say something.
    Required,
    /// Nothing, and that means something of its own.
    Absent,
    /// [`Value::Auto`].
    Auto,
    /// A number, in all channels of a colour.
    Number(f64),
    /// On or off.
    Switch(bool),
    /// A word.
    Word(&'static str),
}

/// Name, kind, unit, range and default of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParamInfo {
    /// The name that a user writes before `=`.
    pub name: &'static str,
    /// What its value is.
    pub kind: Kind,
    /// Unit, or "" for a pure number.
    pub unit: &'static str,
    /// Smallest number.
    pub min: f64,
    /// Largest number.
    pub max: f64,
    /// Value where the user says nothing.
    pub default: Preset,
    /// Is `auto` a value, and which number means the same?
    pub auto: Option<f64>,
    /// Does the value stand alone, without `name=`?
    pub positional: bool,
    /// One line of meaning.
    pub doc: &'static str,
}

impl ParamInfo {
    const fn new(
        name: &'static str,
        kind: Kind,
        [min, max]: [f64; 2],
        default: Preset,
        doc: &'static str,
    ) -> Self {
        Self { name, kind, unit: "", min, max, default, auto: None, positional: false, doc }
    }

    /// A real number in a range, pure until [`ParamInfo::unit`] says otherwise.
    pub const fn real(name: &'static str, range: [f64; 2], default: f64, doc: &'static str) -> Self {
        Self::new(name, Kind::Real, range, Preset::Number(default), doc)
    }

    /// A whole number in a range.
    pub const fn whole(name: &'static str, range: [f64; 2], default: f64, doc: &'static str) -> Self {
        Self::new(name, Kind::Whole, range, Preset::Number(default), doc)
    }

    /// An angle in degrees.
    pub const fn angle(name: &'static str, range: [f64; 2], default: f64, doc: &'static str) -> Self {
        Self::new(name, Kind::Angle, range, Preset::Number(default), doc).unit("degrees")
    }

    /// On or off.
    pub const fn switch(name: &'static str, on: bool, doc: &'static str) -> Self {
        Self::new(name, Kind::Switch, [0.0, 1.0], Preset::Switch(on), doc)
    }

    /// One of these words; the first where the user says nothing.
    pub const fn choice(name: &'static str, words: &'static [&'static str], doc: &'static str) -> Self {
        Self::new(name, Kind::Choice(words), [f64::NAN; 2], Preset::Word(words[0]), doc)
    }

    /// A colour in a range.
    pub const fn rgb(name: &'static str, range: [f64; 2], default: f64, doc: &'static str) -> Self {
        Self::new(name, Kind::Rgb, range, Preset::Number(default), doc)
    }

    /// Three numbers.
    pub const fn vector(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, Kind::Vector, [f64::NEG_INFINITY, f64::INFINITY], Preset::Required, doc)
    }

    /// The path of a file.
    pub const fn file(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, Kind::File, [f64::NAN; 2], Preset::Absent, doc)
    }

    /// A name.
    pub const fn name(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, Kind::Name, [f64::NAN; 2], Preset::Absent, doc)
    }

    /// With a unit.
    #[must_use]
    pub const fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// `auto` where the user says nothing; the number `same` means it too.
    #[must_use]
    pub const fn auto(self, same: f64) -> Self {
        Self { auto: Some(same), default: Preset::Auto, ..self }
    }

    /// The user has to say something.
    #[must_use]
    pub const fn required(self) -> Self {
        Self { default: Preset::Required, ..self }
    }

    /// No value where the user says nothing.
    #[must_use]
    pub const fn optional(self) -> Self {
        Self { default: Preset::Absent, ..self }
    }

    /// Another word of the choice where the user says nothing.
    #[must_use]
    pub const fn preset(self, word: &'static str) -> Self {
        Self { default: Preset::Word(word), ..self }
    }

    /// The words of a choice have numbers that count from `first`.
    #[must_use]
    pub const fn numbered(self, first: f64) -> Self {
        Self { min: first, ..self }
    }

    /// The value stands alone, without `name=`.
    #[must_use]
    pub const fn positional(self) -> Self {
        Self { positional: true, ..self }
    }

    /// What stands where the user says nothing.
    pub fn default_value(&self) -> Option<Value> {
        Some(match self.default {
            Preset::Required | Preset::Absent => return None,
            Preset::Auto => Value::Auto,
            Preset::Number(x) if self.kind == Kind::Rgb => Value::Rgb([x; 3]),
            Preset::Number(x) => Value::Number(x),
            Preset::Switch(on) => Value::Switch(on),
            Preset::Word(word) => word.into(),
        })
    }

    /// The value that `text` is.
    pub fn parse(&self, text: &str) -> Result<Value, ParamError> {
        let text = text.trim();
        if self.auto.is_some() && text == "auto" {
            return Ok(Value::Auto);
        }
        let found = match self.kind {
            Kind::Real | Kind::Whole | Kind::Angle => number(text).and_then(|x| self.of_number(x)),
            Kind::Switch => match text {
                "on" | "true" => Some(Value::Switch(true)),
                "off" | "false" => Some(Value::Switch(false)),
                _ => number(text).and_then(|x| self.of_number(x)),
            },
            Kind::Choice(words) => {
                let same = |w: &&&str| **w == text || w.replace('-', "_") == text;
                let word = words.iter().find(same).map(|w| (*w).into());
                word.or_else(|| number(text).and_then(|x| self.of_number(x)))
            }
            Kind::Rgb => triple(text).filter(|v| v.iter().all(|x| self.contains(*x))).map(Value::Rgb),
            Kind::Vector => {
                triple(text).filter(|v| text.contains('/') && v.iter().all(|x| x.is_finite())).map(Value::Rgb)
            }
            Kind::File => Some(Value::File(text.into())),
            Kind::Name => Some(text.into()),
        };
        found.ok_or_else(|| self.refused(text))
    }

    /// `value` as this parameter has it: numbers that stand for words and text that nobody has read are what
    /// they mean.
    pub fn check(&self, value: &Value) -> Result<Value, ParamError> {
        let checked = match value {
            Value::Auto => self.auto.map(|_| Value::Auto),
            Value::Number(x) if self.kind == Kind::Rgb => {
                Some(Value::Rgb([*x; 3])).filter(|_| self.contains(*x))
            }
            Value::Number(x) => self.of_number(*x),
            Value::Switch(on) => Some(Value::Switch(*on)).filter(|_| self.kind == Kind::Switch),
            Value::Word(text) => return self.parse(text),
            Value::Rgb(v) => {
                let fits =
                    matches!(self.kind, Kind::Rgb | Kind::Vector) && v.iter().all(|x| self.contains(*x));
                fits.then(|| value.clone())
            }
            Value::File(_) => Some(value.clone()).filter(|_| self.kind == Kind::File),
        };
        checked.ok_or_else(|| self.refused(&value.to_string()))
    }

    /// The value that a number stands for.
    fn of_number(&self, x: f64) -> Option<Value> {
        if self.auto == Some(x) {
            return Some(Value::Auto);
        }
        match self.kind {
            Kind::Real | Kind::Angle => Some(x.into()).filter(|_| self.contains(x)),
            Kind::Whole => Some(x.into()).filter(|_| self.contains(x) && x.fract() == 0.0),
            Kind::Switch => {
                [false, true].into_iter().find(|on| f64::from(u8::from(*on)) == x).map(Value::Switch)
            }
            Kind::Choice(words) => {
                let at = (0..words.len()).find(|k| self.min + *k as f64 == x)?;
                Some(words[at].into())
            }
            _ => None,
        }
    }

    fn contains(&self, x: f64) -> bool {
        x.is_finite() && (self.min..=self.max).contains(&x)
    }

    /// The error of a value that is none.
    pub fn refused(&self, value: &str) -> ParamError {
        ParamError::Value { name: self.name, value: value.into(), expected: self.expected() }
    }

    /// What is accepted, for messages.
    pub fn expected(&self) -> String {
        let accepted = match self.kind {
            Kind::Real | Kind::Angle => format!("a {}", self.range("number")),
            Kind::Whole => format!("a {}", self.range("whole number")),
            Kind::Switch => "on or off".into(),
            Kind::Choice(words) => format!("one of: {}", words.join(", ")),
            Kind::Rgb => format!("a {}, or three of them as r/g/b", self.range("number")),
            Kind::Vector => "three numbers as x/y/z".into(),
            Kind::File => "a file".into(),
            Kind::Name => "a name".into(),
        };
        if self.auto.is_some() { format!("{accepted}, or auto") } else { accepted }
    }

    fn range(&self, what: &str) -> String {
        match (self.min.is_finite(), self.max.is_finite()) {
            (false, _) => format!("finite {what}"),
            (true, false) => format!("finite {what} of at least {}", self.min),
            (true, true) => format!("{what} in {} … {}", self.min, self.max),
        }
    }

    /// Its name; in capitals where its value stands alone.
    pub fn label(&self) -> String {
        if self.positional { self.name.to_uppercase() } else { self.name.into() }
    }

    /// How it is written.
    pub fn usage(&self) -> String {
        if self.positional { self.label() } else { format!("{}=", self.name) }
    }
}

/// Meaning, range and default in one line.
impl fmt::Display for ParamInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.doc)?;
        let [min, max] = [self.min, self.max];
        let bounds = match (min.is_finite(), max.is_finite()) {
            (true, true) => format!("{min} … {max}"),
            (true, false) => format!("at least {min}"),
            _ => String::new(),
        };
        match self.kind {
            Kind::Rgb if max.is_finite() => write!(f, ", scalar or r/g/b in {bounds}")?,
            Kind::Rgb => write!(f, ", scalar or r/g/b, {bounds}")?,
            Kind::Real | Kind::Whole if !bounds.is_empty() => write!(f, ", {bounds}")?,
            Kind::Angle => write!(f, ", degrees, {bounds}")?,
            Kind::Choice(words) => write!(f, ": {}", words.join(", "))?,
            _ => {}
        }
        match self.default_value() {
            Some(v) => write!(f, ", default {v}"),
            None => Ok(()),
        }
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok()
}

/// One number three times, or three.
fn triple(text: &str) -> Option<[f64; 3]> {
    let values: Vec<f64> = text.split('/').map(|t| number(t.trim())).collect::<Option<_>>()?;
    match values[..] {
        [x] => Some([x; 3]),
        [x, y, z] => Some([x, y, z]),
        _ => None,
    }
}
