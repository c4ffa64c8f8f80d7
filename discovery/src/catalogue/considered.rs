//! What may be missing: all effects of the libraries at all places of the base model, but those that the study leaves out.

use std::sync::Arc;

use hyd_compiler::inquiry::AnnotatedClass;

use crate::catalogue::natural::natural;
use crate::catalogue::places::{beside_declared, found, of_laws, unpaired};
use crate::catalogue::same_ids::tell_apart;
use crate::catalogue::{Candidate, Effect, Site, candidates, effects, not_laws, same_places};
use crate::fault::Fault;
use crate::setup::Setup;
use crate::study::Study;
use crate::variant::Workshop;

impl Candidate {
    /// The effects that `classes` declare, at the places where they fit; `warn` is told what is not as one may expect.
    ///
    /// # Errors
    /// A declaration that cannot be read; the messages of the compiler.
    pub fn all(
        setup: &Setup,
        workshop: &Workshop<'_>,
        classes: &[AnnotatedClass],
        warn: &mut dyn FnMut(&str),
    ) -> Result<Vec<Self>, Fault> {
        let mut effects = effects(classes)?;
        considered(&setup.study, &mut effects).iter().for_each(|sentence| warn(sentence));
        let mut places = workshop.places()?;
        if places.is_empty() {
            // A model that says nothing of places has them all the same.
            let asks = |id: &str| effects.iter().any(|effect| effect.at.iter().flatten().any(|own| **own == *id));
            let sentences;
            (places, sentences) = found(setup, workshop, &asks)?;
            sentences.iter().for_each(|sentence| warn(sentence));
            without_balance(setup, workshop, &places).iter().for_each(|sentence| warn(sentence));
            unpaired(setup, &effects).iter().for_each(|sentence| warn(sentence));
        }
        places.extend(beside_declared(&places));
        places.extend(of_laws(&effects, setup, workshop)?);
        same_places(&places).iter().for_each(|sentence| warn(sentence));
        let measured = |name: &str| setup.data.channel(name).is_some();
        let base_model = setup.bench.base_model.as_deref();
        let mut all = candidates(&effects, &places, base_model, &measured);
        not_laws(&effects, &places, &all).iter().for_each(|sentence| warn(sentence));
        tell_apart(&mut all).iter().for_each(|sentence| warn(sentence));
        let (all, left_out) = natural(setup, workshop, all)?;
        left_out.iter().for_each(|sentence| warn(sentence));
        if all.is_empty() {
            let count = match effects.len() {
                0 => "there are no effects, so that".to_string(),
                count => format!("0 of {count} effects fit a place of this model:"),
            };
            warn(&format!("{count} only terms at its equations are tried"));
        }
        Ok(all)
    }
}

/// A sentence on a model in whose equations no balance is found, so that no effect of the machine has a place.
fn without_balance(setup: &Setup, workshop: &Workshop<'_>, places: &[Site]) -> Option<String> {
    if workshop.opaque.is_some() || places.iter().any(|site| !site.door.ends().is_empty()) {
        return None;
    }
    Some(format!(
        "no balance of forces, voltages, currents, heat or flow was found in the equations of `{}`, so that no effect of the machine has a place in it: a \
         balance is an equation with one derivative. Effects of your own can name an equation as their place (`law = true`, \
         docs/guides/write_an_effect.md)",
        setup.bench.base_model.as_deref().unwrap_or(&workshop.class)
    ))
}

/// Takes out the effects that a study leaves out, by the full names of their classes or packages; with sentences on names that leave
/// out nothing.
fn considered(study: &Study, effects: &mut Vec<Arc<Effect>>) -> Vec<String> {
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
