//! Values by name.

use super::{Kind, ParamError, ParamInfo, Value};
use crate::nearest;
use std::collections::BTreeMap;
use std::path::Path;

/// Values by name as a user gave them; names that are absent take their defaults.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ParamValues(pub BTreeMap<String, Value>);

/// A spec `name:body` as its two parts; the body is empty where there is no colon.
pub fn split_spec(spec: &str) -> (&str, &str) {
    let (name, body) = spec.split_once(':').unwrap_or((spec, ""));
    (name.trim(), body)
}

impl<N: Into<String>, V: Into<Value>> FromIterator<(N, V)> for ParamValues {
    fn from_iter<I: IntoIterator<Item = (N, V)>>(values: I) -> Self {
        Self(values.into_iter().map(|(n, v)| (n.into(), v.into())).collect())
    }
}

impl ParamValues {
    /// The values of a spec's body: `key=value` and values that stand alone, separated by commas. `_` and `-`
    /// in keys are the same.
    pub fn parse(body: &str, infos: &[ParamInfo]) -> Result<Self, ParamError> {
        let mut values = Self::default();
        for item in body.split(',').map(str::trim).filter(|i| !i.is_empty()) {
            let (info, text) = match item.split_once('=') {
                Some((key, text)) => (find(infos, key.trim())?, text),
                None => (values.alone(item, infos)?, item),
            };
            let value = info.parse(text)?;
            if values.0.insert(info.name.into(), value).is_some() {
                return Err(ParamError::Twice(info.name));
            }
        }
        Ok(values)
    }

    /// The parameter that a value without a key belongs to.
    fn alone<'a>(&self, item: &str, infos: &'a [ParamInfo]) -> Result<&'a ParamInfo, ParamError> {
        let mut places = infos.iter().filter(|i| i.positional && !self.0.contains_key(i.name));
        places.next().ok_or_else(|| ParamError::Syntax {
            item: item.into(),
            available: infos.iter().map(ParamInfo::usage).collect(),
        })
    }

    /// The body of a spec that has these values, in the order of the description; values that are absent are
    /// left out.
    pub fn body(&self, infos: &[ParamInfo]) -> String {
        self.printed(infos, Value::to_string)
    }

    /// [`ParamValues::body`] with the names of files without their folders.
    pub fn body_without_folders(&self, infos: &[ParamInfo]) -> String {
        self.printed(infos, |v| match v {
            Value::File(path) => Path::file_name(path).unwrap_or_default().to_string_lossy().into_owned(),
            v => v.to_string(),
        })
    }

    fn printed(&self, infos: &[ParamInfo], text: impl Fn(&Value) -> String) -> String {
        let one = |i: &ParamInfo| {
            let text = text(self.0.get(i.name)?);
            Some(if i.positional { text } else { format!("{}={text}", i.name) })
        };
        infos.iter().filter_map(one).collect::<Vec<_>>().join(",")
    }

    /// Checks every given value against `infos`.
    pub fn check(&self, infos: &[ParamInfo]) -> Result<(), ParamError> {
        self.0.iter().try_for_each(|(name, value)| find(infos, name)?.check(value).map(|_| ()))
    }

    /// Is a value given?
    pub fn has(&self, info: &ParamInfo) -> bool {
        self.0.contains_key(info.name)
    }

    /// The value of `info`, or its default; `None` where it has none.
    pub fn get(&self, info: &ParamInfo) -> Result<Option<Value>, ParamError> {
        match self.0.get(info.name) {
            Some(value) => info.check(value).map(Some),
            None => Ok(info.default_value()),
        }
    }

    /// The value of `info`, or its default, or an error where it has none.
    pub fn required(&self, info: &ParamInfo) -> Result<Value, ParamError> {
        self.get(info)?.ok_or(ParamError::Missing { name: info.name, doc: info.doc })
    }

    /// A number that is given or has a default.
    pub fn number(&self, info: &ParamInfo) -> Result<f64, ParamError> {
        match self.required(info)? {
            Value::Number(x) => Ok(x),
            other => Err(info.refused(&other.to_string())),
        }
    }

    /// Three numbers that are given or have a default: a colour or a vector.
    pub fn triple(&self, info: &ParamInfo) -> Result<[f64; 3], ParamError> {
        match self.required(info)? {
            Value::Rgb(v) => Ok(v),
            other => Err(info.refused(&other.to_string())),
        }
    }

    /// On or off.
    pub fn is_on(&self, info: &ParamInfo) -> Result<bool, ParamError> {
        Ok(self.required(info)? == Value::Switch(true))
    }

    /// The word of a choice that is given or has a default.
    pub fn word(&self, info: &ParamInfo) -> Result<&'static str, ParamError> {
        let value = self.required(info)?;
        match (&value, info.kind) {
            (Value::Word(word), Kind::Choice(words)) => {
                words.iter().find(|w| **w == word.as_str()).copied().ok_or_else(|| info.refused(word))
            }
            _ => Err(info.refused(&value.to_string())),
        }
    }
}

fn find<'a>(infos: &'a [ParamInfo], name: &str) -> Result<&'a ParamInfo, ParamError> {
    let same = |i: &&ParamInfo| {
        !i.positional && (i.name == name || i.name.replace('-', "_") == name.replace('-', "_"))
    };
    infos.iter().find(same).ok_or_else(|| {
        let available: Vec<_> = infos.iter().filter(|i| !i.positional).map(|i| i.name).collect();
        ParamError::Unknown { name: name.into(), nearest: nearest(name, &available), available }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const INFOS: [ParamInfo; 8] = [
        ParamInfo::name("name", "a set").positional(),
        ParamInfo::whole("bands", [1.0, 16.0], 5.0, "how many"),
        ParamInfo::whole("size", [1.0, 64.0], 1.0, "texels").auto(0.0),
        ParamInfo::switch("fit-lid", false, "closes"),
        ParamInfo::choice("g", &["v-cavity", "smith"], "masking").numbered(1.0),
        ParamInfo::rgb("f0", [0.0, 1.0], 1.0, "reflectance"),
        ParamInfo::file("angles", "directions"),
        ParamInfo::real("n", [0.0, 1e8], 1.0, "exponent").required(),
    ];
    const BANDS: ParamInfo = INFOS[1];
    const SIZE: ParamInfo = INFOS[2];
    const LID: ParamInfo = INFOS[3];
    const G: ParamInfo = INFOS[4];
    const F0: ParamInfo = INFOS[5];
    const N: ParamInfo = INFOS[7];

    fn parsed(body: &str) -> Result<ParamValues, String> {
        ParamValues::parse(body, &INFOS).map_err(|e| e.to_string())
    }

    #[test]
    fn words_and_the_numbers_that_mean_the_same() {
        for body in [
            "bands=3,size=auto,fit-lid=on,g=smith",
            "bands=3,size=0,fit_lid=1,g=2",
            "bands=3,fit-lid=true,g=smith",
        ] {
            let v = parsed(body).unwrap();
            assert_eq!((v.number(&BANDS), v.required(&SIZE)), (Ok(3.0), Ok(Value::Auto)));
            assert_eq!((v.is_on(&LID), v.word(&G), v.triple(&F0)), (Ok(true), Ok("smith"), Ok([1.0; 3])));
        }
        let given: ParamValues = [("size", 0.0), ("fit-lid", 1.0), ("g", 1.0)].into_iter().collect();
        assert_eq!(given.check(&INFOS), Ok(()));
        assert_eq!((given.required(&SIZE), given.word(&G)), (Ok(Value::Auto), Ok("v-cavity")));
        let text: ParamValues = [("size", "auto"), ("f0", "1/0.5/0")].into_iter().collect();
        assert_eq!((text.required(&SIZE), text.triple(&F0)), (Ok(Value::Auto), Ok([1.0, 0.5, 0.0])));
    }

    #[test]
    fn what_is_printed_is_what_is_read() {
        let body = "gold,bands=3,size=auto,fit-lid=on,g=smith,f0=0.5/0.25/1,angles=a/0.5,n=2.5";
        let v = parsed(body).unwrap();
        assert_eq!((v.body(&INFOS), parsed(&v.body(&INFOS))), (body.to_string(), Ok(v.clone())));
        assert_eq!(v.body_without_folders(&INFOS), body.replace("a/0.5", "0.5"));
    }

    #[test]
    fn messages_name_key_value_range_and_what_is_known() {
        let keys = "bands, size, fit-lid, g, f0, angles, n";
        for (body, want) in [
            ("band=1", format!("no parameter 'band' (did you mean 'bands'?); there are: {keys}")),
            ("bands=17", "bands = '17' is not a whole number in 1 … 16".into()),
            ("bands=2.5", "bands = '2.5' is not a whole number in 1 … 16".into()),
            ("size=-1", "size = '-1' is not a whole number in 1 … 64, or auto".into()),
            ("bands=nan", "bands = 'nan' is not a whole number in 1 … 16".into()),
            ("bands=auto", "bands = 'auto' is not a whole number in 1 … 16".into()),
            ("fit-lid=2", "fit-lid = '2' is not on or off".into()),
            ("g=0", "g = '0' is not one of: v-cavity, smith".into()),
            ("f0=1/2", "f0 = '1/2' is not a number in 0 … 1, or three of them as r/g/b".into()),
            ("n=1,n=2", "'n' is given twice; give it once".into()),
        ] {
            assert_eq!(parsed(body).unwrap_err(), want);
        }
        assert!(
            parsed("a,b").unwrap_err().starts_with("'b' is not key=value; it takes: NAME, bands=, size=")
        );
        assert_eq!(parsed("").unwrap().number(&N).unwrap_err().to_string(), "needs 'n=': exponent");
        assert_eq!(
            parsed("N=1").unwrap_err(),
            format!("no parameter 'N' (did you mean 'n'?); there are: {keys}")
        );
    }

    #[test]
    fn descriptions_in_one_line() {
        let line = |i: &ParamInfo| i.to_string();
        assert_eq!(line(&N), "exponent, 0 … 100000000");
        assert_eq!(line(&F0), "reflectance, scalar or r/g/b in 0 … 1, default 1");
        assert_eq!(line(&G), "masking: v-cavity, smith, default v-cavity");
        assert_eq!(line(&SIZE), "texels, 1 … 64, default auto");
    }
}
