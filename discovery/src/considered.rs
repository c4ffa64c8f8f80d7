//! The effects that a study leaves out.

use std::sync::Arc;

use crate::catalogue::Effect;
use crate::study::Study;

/// Takes out the effects that a study leaves out, by the full names of their classes or packages; with sentences on names that leave
/// out nothing.
pub fn considered(study: &Study, effects: &mut Vec<Arc<Effect>>) -> Vec<String> {
    let is_meant = |effect: &Effect, name: &str| {
        effect.class.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    let mut sentences = Vec::new();
    for (k, name) in study.without.iter().enumerate() {
        if !effects.iter().any(|effect| is_meant(effect, name)) {
            let last = |class: &str| class.rsplit('.').next().map(str::to_lowercase);
            let close = effects.iter().find(|effect| &*effect.id == name || last(&effect.class) == last(name));
            let hint = close.map_or_else(String::new, |effect| format!("; did you mean `{}`?", effect.class));
            let place = study.place(&["without", &k.to_string()]);
            sentences
                .push(format!("{place}`without` names `{name}`, which is not an effect or a package of effects{hint}"));
        }
    }
    effects.retain(|effect| !study.without.iter().any(|name| is_meant(effect, name)));
    sentences
}
