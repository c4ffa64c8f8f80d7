//! Arguments of tools: from one list the schema that a client sees, and the reading of what it sends, with an answer to mistakes that says what is
//! allowed.

use hyd_source::did_you_mean;
use serde_json::{Map, Value, json};

/// What an argument is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    Text,
    Number,
    /// An integer from 1 on.
    Count,
    /// An integer from 0 on.
    Natural,
    Flag,
    Texts,
    /// Names with values: numbers, truth values, texts, or lists of them.
    Values,
    /// One of these words.
    Word(&'static [&'static str]),
}

/// An argument of a tool.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Argument {
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    pub(crate) is_required: bool,
    /// What it means, with its unit.
    pub(crate) says: &'static str,
}

/// An argument that must be given.
pub(crate) const fn required(name: &'static str, kind: Kind, says: &'static str) -> Argument {
    Argument { name, kind, is_required: true, says }
}

/// An argument that may be left out.
pub(crate) const fn optional(name: &'static str, kind: Kind, says: &'static str) -> Argument {
    Argument { name, kind, is_required: false, says }
}

impl Kind {
    fn schema(self) -> Value {
        match self {
            Kind::Text => json!({"type": "string"}),
            Kind::Number => json!({"type": "number"}),
            Kind::Count => json!({"type": "integer", "minimum": 1}),
            Kind::Natural => json!({"type": "integer", "minimum": 0}),
            Kind::Flag => json!({"type": "boolean"}),
            Kind::Texts => json!({"type": "array", "items": {"type": "string"}}),
            Kind::Values => {
                json!({"type": "object", "additionalProperties": {"type": ["number", "boolean", "string", "array"]}})
            }
            Kind::Word(words) => json!({"type": "string", "enum": words}),
        }
    }

    /// What is expected, where a value is something else.
    fn wrong(self, value: &Value) -> Option<String> {
        let fits = match self {
            Kind::Text => value.is_string(),
            Kind::Number => value.as_f64().is_some_and(f64::is_finite),
            Kind::Count => value.as_u64().is_some_and(|count| count > 0),
            Kind::Natural => value.is_u64(),
            Kind::Flag => value.is_boolean(),
            Kind::Texts => value.as_array().is_some_and(|items| items.iter().all(Value::is_string)),
            Kind::Values => value.as_object().is_some_and(|fields| fields.values().all(|own| written(own).is_some())),
            Kind::Word(words) => value.as_str().is_some_and(|word| words.contains(&word)),
        };
        if fits {
            return None;
        }
        Some(match self {
            Kind::Text => "must be a string".into(),
            Kind::Number => "must be a number".into(),
            Kind::Count => "must be an integer from 1 on".into(),
            Kind::Natural => "must be an integer from 0 on".into(),
            Kind::Flag => "must be true or false".into(),
            Kind::Texts => "must be a list of strings".into(),
            Kind::Values => {
                "must be an object of names with values: numbers, true or false, strings, or lists of them".into()
            }
            Kind::Word(words) => {
                let hint = value.as_str().and_then(|word| did_you_mean(word, words.iter().copied()));
                let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
                format!("must be one of {}{hint}", words.join(", "))
            }
        })
    }
}

/// A value as `--set` takes it.
fn written(value: &Value) -> Option<String> {
    match value {
        Value::Number(number) => Some(number.to_string()),
        Value::Bool(flag) => Some(flag.to_string()),
        Value::String(text) => Some(text.trim().to_string()),
        Value::Array(items) if !items.is_empty() => {
            let items = items.iter().map(written).collect::<Option<Vec<String>>>()?;
            Some(format!("{{{}}}", items.join(", ")))
        }
        _ => None,
    }
}

/// The schema of a tool with these arguments.
pub(crate) fn schema(arguments: &[Argument]) -> Value {
    let mut properties = Map::new();
    for argument in arguments {
        let mut own = argument.kind.schema();
        own["description"] = argument.says.into();
        properties.insert(argument.name.into(), own);
    }
    let needed: Vec<&str> = arguments.iter().filter(|own| own.is_required).map(|own| own.name).collect();
    json!({"type": "object", "properties": properties, "required": needed, "additionalProperties": false})
}

/// Arguments that fit their list.
#[derive(Clone, Debug, Default)]
pub(crate) struct Given(Map<String, Value>);

/// Reads what a client sends.  `Err`: all that is wrong with it.
pub(crate) fn read(tool: &str, arguments: &[Argument], sent: Option<&Value>) -> Result<Given, String> {
    let sent = match sent {
        None | Some(Value::Null) => Map::new(),
        Some(Value::Object(fields)) => fields.clone(),
        Some(_) => return Err("`arguments` must be an object".to_string()),
    };
    let names = || arguments.iter().map(|own| own.name);
    let all = names().collect::<Vec<_>>().join(", ");
    let mut wrong = Vec::new();
    let mut given = Map::new();
    for (name, value) in sent {
        match arguments.iter().find(|own| own.name == name) {
            None => {
                let hint = did_you_mean(&name, names()).map_or_else(String::new, |hint| format!(" {hint}"));
                wrong.push(format!("`{tool}` has no argument `{name}`;{hint} its arguments are {all}"));
            }
            // Clients that fill in every argument send null for those that are not meant.
            Some(own) if value.is_null() && !own.is_required => {}
            Some(own) => match own.kind.wrong(&value) {
                Some(expected) => wrong.push(format!("`{name}` {expected}")),
                None => {
                    given.insert(name, value);
                }
            },
        }
    }
    let missing = arguments.iter().filter(|own| own.is_required && !given.contains_key(own.name));
    let missing: Vec<String> = missing
        .filter(|own| !wrong.iter().any(|sentence| sentence.starts_with(&format!("`{}` ", own.name))))
        .map(|own| format!("`{tool}` needs `{}`: {}", own.name, own.says))
        .collect();
    wrong.extend(missing);
    if wrong.is_empty() { Ok(Given(given)) } else { Err(wrong.join("\n")) }
}

impl Given {
    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        self.0.get(name)?.as_str()
    }

    /// An argument that the list requires; empty if the list does not.
    pub(crate) fn needed(&self, name: &str) -> &str {
        self.text(name).unwrap_or_default()
    }

    pub(crate) fn number(&self, name: &str) -> Option<f64> {
        self.0.get(name)?.as_f64()
    }

    pub(crate) fn natural(&self, name: &str) -> Option<u64> {
        self.0.get(name)?.as_u64()
    }

    /// An integer as a size.
    pub(crate) fn count(&self, name: &str) -> Option<usize> {
        self.natural(name).map(|count| usize::try_from(count).unwrap_or(usize::MAX))
    }

    pub(crate) fn flag(&self, name: &str) -> bool {
        self.0.get(name).and_then(Value::as_bool).unwrap_or_default()
    }

    pub(crate) fn texts(&self, name: &str) -> Vec<String> {
        let items = self.0.get(name).and_then(Value::as_array).into_iter().flatten();
        items.filter_map(|item| item.as_str().map(str::to_string)).collect()
    }

    /// Names with their values as text.
    pub(crate) fn values(&self, name: &str) -> Vec<(String, String)> {
        let fields = self.0.get(name).and_then(Value::as_object).into_iter().flatten();
        fields.filter_map(|(name, value)| Some((name.trim().to_string(), written(value)?))).collect()
    }

    /// Names with what they run through as text: a list of values is written with commas.
    pub(crate) fn lists(&self, name: &str) -> Vec<(String, String)> {
        let fields = self.0.get(name).and_then(Value::as_object).into_iter().flatten();
        let text = |value: &Value| match value {
            Value::Array(items) => items.iter().map(written).collect::<Option<Vec<_>>>().map(|items| items.join(",")),
            other => written(other),
        };
        fields.filter_map(|(name, value)| Some((name.trim().to_string(), text(value)?))).collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const LIST: [Argument; 4] = [
        required("file", Kind::Text, "the model's file"),
        optional("stop", Kind::Number, "stop time in s"),
        optional("parameters", Kind::Values, "values"),
        optional("stage", Kind::Word(&["flat", "sorted"]), "which"),
    ];

    fn said(sent: &Value) -> String {
        read("run", &LIST, Some(sent)).unwrap_err()
    }

    #[test]
    fn mistakes_can_be_repaired() {
        assert_eq!(said(&json!({})), "`run` needs `file`: the model's file");
        assert_eq!(
            said(&json!({"file": "a", "stpo": 1})),
            "`run` has no argument `stpo`; did you mean `stop`? its arguments are file, stop, parameters, stage"
        );
        assert_eq!(said(&json!({"file": 1})), "`file` must be a string");
        assert_eq!(said(&json!({"file": "a", "stop": "1"})), "`stop` must be a number");
        assert_eq!(
            said(&json!({"file": "a", "stage": "sortd"})),
            "`stage` must be one of flat, sorted; did you mean `sorted`?"
        );
        assert!(
            said(&json!({"file": "a", "parameters": {"m": {}}})).starts_with("`parameters` must be an object of names")
        );
        assert_eq!(said(&json!([])), "`arguments` must be an object");
    }

    #[test]
    fn values_are_written_as_the_command_takes_them() {
        let sent = json!({"file": "a", "parameters": {"m": 2.5, "on": true, "kind": "Kind.b", "v": [[1, 2], [3, 4]]}, "stop": null});
        let given = read("run", &LIST, Some(&sent)).unwrap();
        let values = given.values("parameters");
        let pairs: Vec<(&str, &str)> = values.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        assert_eq!(pairs, [("kind", "Kind.b"), ("m", "2.5"), ("on", "true"), ("v", "{{1, 2}, {3, 4}}")]);
        assert_eq!(given.number("stop"), None);
        let sent = json!({"file": "a", "parameters": {"m": [5e6, 7e6], "k": "1:3:3"}});
        let lists = read("run", &LIST, Some(&sent)).unwrap().lists("parameters");
        assert_eq!(
            lists,
            [("k".to_string(), "1:3:3".to_string()), ("m".to_string(), "5000000.0,7000000.0".to_string())]
        );
    }

    #[test]
    fn the_schema_says_the_same() {
        let schema = schema(&LIST);
        assert_eq!(schema["required"], json!(["file"]));
        assert_eq!(schema["properties"]["stage"]["enum"], json!(["flat", "sorted"]));
        assert_eq!(schema["properties"]["stop"]["description"], "stop time in s");
    }
}
